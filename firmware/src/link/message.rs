//! Messages of the link in both directions. The order of variants is the wire format: append
//! variants and never insert them. Every change alters the schema hash.

pub use super::option_bytes::OptionBytes;
use super::{Refusal, Telemetry};
use crate::board::wiring::BOARD_NAME;
use crate::control::{EndpointSpec, ForceSpec, JointSpec};
use crate::haptics::{ModulationSpec, WallSpec};
use crate::limb::{AXES, LineSpec};
use crate::muscle::{MuscleLevel, MuscleSpec};
use crate::pulse::{CHANNELS, GroupSpec, MAX_GROUPS, TrainSpec};
use crate::range::Range;
use crate::safety::{
    ChannelSpec, FaultRecord, ListedPulse, MAX_LISTED, RemainingAllowance, StageKind, StageSupply,
    Stages, State, StopCause, WearerSpec,
};
use crate::units::{Amplitude, Micros};
use heapless::{String, Vec};
use postcard_schema::{Schema, key::hash::fnv1a64::hash_ty_path};
use serde::{Deserialize, Serialize};

impl Request {
    /// Range of the mask of a request for amplitudes. An empty mask is refused: the request would
    /// set nothing, and in any state only show that the host is alive.
    pub const MASK: Range = Range::new("mask", 1, (1 << CHANNELS) - 1);
    /// Range of the widths of a setpoint, µs. The narrower range of the channel's own train is
    /// checked with the armed setup.
    pub const WIDTHS: Range = Range {
        field: "widths",
        ..TrainSpec::WIDTH_US
    };
    /// Range of the joint number of a measurement.
    pub const JOINT: Range = Range::new("joint", 0, AXES as i32 - 1);
    /// Range of the telemetry period, ms.
    pub const PERIOD_MS: Range = Range::new("period_ms", 0, 1_000);
    /// Range of the rate of an angle, 0.01 °/s; no finger moves faster.
    pub const CENTIDEG_PER_S: Range = Range::new("centideg_per_s", -2_000_000, 2_000_000);
    /// Range of the rate of a force, mN/s; no muscle changes faster.
    pub const MILLINEWTON_PER_S: Range = Range::new("millinewton_per_s", -32_767_000, 32_767_000);
}

/// A message from the host to the device.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ToDevice {
    /// Number of the session that `Hello` granted; ignored in `Hello` itself.
    pub session: u16,
    /// Sequence number, which increases by one per frame and wraps. Every answer contains it, and
    /// gaps count as lost frames.
    pub seq: u16,
    /// Request that the device is to carry out.
    pub request: Request,
}

/// Requests that a host can send. The device answers each with one acknowledgement or one refusal.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Request {
    /// Opens a session. The answer is [`Response::Hello`].
    Hello {
        /// Schema hash of the host, [`SCHEMA`].
        schema: u64,
    },
    /// Shows that the host is alive, which ends the host silence.
    KeepAlive,
    /// Requests [`Response::Status`].
    Status,
    /// Empties the draft setup.
    Clear,
    /// Sets the wearer's limits in the draft.
    Wearer(WearerSpec),
    /// Sets a channel in the draft.
    Channel {
        /// Number of the channel, from 0.
        channel: u8,
        /// Train, stage and limits of the channel.
        spec: ChannelSpec,
    },
    /// Sets the channel groups in the draft.
    Groups(Vec<GroupSpec, MAX_GROUPS>),
    /// Selects the channel that drives the sync output, in the draft.
    Sync {
        /// Number of the channel, from 0; `None` for no sync.
        channel: Option<u8>,
    },
    /// Sets the muscle of a channel in the draft. The device then predicts the muscle's force.
    Muscle {
        /// Number of the channel, from 0.
        channel: u8,
        /// Force model, recruitment and fatigue of the muscle.
        spec: MuscleSpec,
    },
    /// Sets the controlled joint in the draft.
    Joint(JointSpec),
    /// Checks the whole draft, then the electrodes, then arms the device.
    Arm {
        /// Checksum [`SetupSum::total`](super::SetupSum::total) of the setup requests that the
        /// device accepted from the host. The request is refused if the draft's checksum differs.
        setup: u32,
    },
    /// Starts the trains of the armed setup.
    Start,
    /// Ends stimulation: lets the amplitudes fall over the wearer's fall time. Disarms if no
    /// stimulation runs.
    Stop,
    /// Acknowledges the latched fault. After a last grounding the device is idle.
    Acknowledge,
    /// Setpoint of amplitudes and pulse widths of several channels. All or none are accepted.
    Amplitudes {
        /// Device time from which the amplitudes are valid, at most 1 s ahead; `None` means on
        /// arrival.
        at: Option<Micros>,
        /// Bit i selects channel i.
        mask: u16,
        /// Amplitudes, one per bit set, lowest channel first.
        values: Vec<Amplitude, CHANNELS>,
        /// Widths of a phase, µs, in the same order, each applied with its amplitude; empty for the
        /// trains' own widths.
        widths: Vec<u16, CHANNELS>,
    },
    /// Setpoint of the joint's reference angle.
    Angle {
        /// Device time from which the angle is valid; `None` means on arrival.
        at: Option<Micros>,
        /// Reference angle, 0.01°.
        centideg: i16,
        /// Rate of the angle, 0.01 °/s; `None` lets the device estimate it.
        centideg_per_s: Option<i32>,
    },
    /// An angle measured by the host.
    Measurement {
        /// Number of the axis of an arm, 0–8, or of the modulated joint, 0–3; 0 for a joint or a
        /// wall.
        joint: u8,
        /// Measured angle, 0.01°.
        centideg: i16,
        /// Device time of the measurement.
        at: Micros,
    },
    /// Requests telemetry every `period_ms`; 0 ends it.
    Subscribe {
        /// Time between two samples, 1–1000 ms, or 0.
        period_ms: u16,
    },
    /// Sets the virtual wall in the draft.
    Wall(WallSpec),
    /// Puts a channel of the draft under force control. The channel needs a muscle.
    ForceControl {
        /// Number of the channel, from 0.
        channel: u8,
        /// Range of pulse periods, and behaviour between setpoints.
        spec: ForceSpec,
    },
    /// Setpoint of the reference force of a channel under force control.
    Force {
        /// Number of the channel, from 0.
        channel: u8,
        /// Device time from which the force is valid; `None` means on arrival.
        at: Option<Micros>,
        /// Mean force over a pulse period, mN.
        millinewton: u32,
        /// Rate of the force, mN/s; `None` lets the device estimate it.
        millinewton_per_s: Option<i32>,
    },
    /// Changes the model level of a muscle of the armed setup, without a step in its force.
    MuscleLevel {
        /// Number of the channel, from 0.
        channel: u8,
        /// Model level from then on.
        level: MuscleLevel,
    },
    /// Simulates an edge at the trigger input of a simulated board. The program that serves a
    /// simulator accepts and answers this request; every device refuses it.
    SimulateTrigger,
    /// Stores the board's output stages, when the board is put into service. Only in state Idle.
    /// The device acknowledges the request first; then the board disconnects its outputs, writes,
    /// and restarts. The next [`Response::Hello`] contains the table that the board found.
    StoreStages {
        /// Output stage of each channel; `None` if the channel has none.
        stages: [Option<StageKind>; CHANNELS],
        /// Supply of the output stages.
        supply: StageSupply,
    },
    /// Setpoint of a list of pulses that a channel plays once, in place of its train's own pulses,
    /// from its next burst on.
    Pulses {
        /// Number of the channel, from 0.
        channel: u8,
        /// Pulses in the order in which they play.
        pulses: Vec<ListedPulse, MAX_LISTED>,
    },
    /// Sets the wearer's arm in the draft, whose hand is to exert forces.
    Limb(EndpointSpec),
    /// Sets the line of action of a channel's muscle in the draft; the arm then drives that
    /// channel.
    Line(LineSpec),
    /// Setpoint of the reference force at the hand of the arm.
    Wrench {
        /// Device time from which the force is valid; `None` means on arrival.
        at: Option<Micros>,
        /// Components backward, to the right and upward, in the thorax frame, mN; ±1 000 000.
        force_mn: [i32; 3],
    },
    /// Sets a joint in the draft whose stimulation follows its angle while an object is held.
    Modulation(ModulationSpec),
    /// Setpoint that reports whether an object is held. Without a held object, no modulated joint
    /// is stimulated.
    ObjectHeld {
        /// State of the object: `true` from when it is grabbed, `false` from when it is released.
        held: bool,
    },
    /// Restarts a breadboard in the boot loader of its chip, which writes another image by USB
    /// DFU. Only in state Idle, with arm key and hand-held stop open. The device acknowledges the
    /// request first.
    EnterBootLoader,
}

/// Messages from the device to the host.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, Schema)]
#[expect(
    clippy::large_enum_variant,
    reason = "one at a time, on its way to the wire: nothing keeps many"
)]
pub enum Response<'a> {
    /// Confirms that a session is open.
    Hello(HelloInfo),
    /// Acknowledges a request that was carried out.
    Ack {
        /// Sequence number of the request.
        seq: u16,
        /// Device time at which the request was carried out.
        at: Micros,
    },
    /// Reports that a request or a frame was refused; nothing changed.
    Refused {
        /// Sequence number of the request, if it could be read.
        seq: Option<u16>,
        /// Number, field and allowed range of the refusal.
        #[serde(borrow)]
        refusal: Refusal<'a>,
    },
    /// Answers [`Request::Status`].
    Status {
        /// Sequence number of the request.
        seq: u16,
        /// State, fault and counters of the device.
        status: Status,
    },
    /// Reports an event that no request asked for.
    Event {
        /// Device time of the event.
        at: Micros,
        /// Kind and details of the event.
        event: Event,
    },
    /// A telemetry sample to which the host has subscribed.
    Telemetry(Telemetry),
}

/// Kind of a device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Kind {
    /// Board, to which wearers may be connected.
    Board,
    /// Device code compiled for the computer: the native backend.
    Native,
    /// Device code in QEMU.
    Qemu,
    /// Board with a simulated output stage, for light-emitting diodes and a logic analyser. Nothing
    /// may be connected to a wearer.
    Breadboard,
}

/// Cause of the device's last reset.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum ResetCause {
    /// Power came up.
    PowerOn,
    /// The reset pin was active.
    Pin,
    /// The supply voltage fell below the brown-out level.
    BrownOut,
    /// The independent watchdog expired.
    Watchdog,
    /// The software requested the reset, after a panic or from a debugger.
    Software,
}

/// Information about a device at the start of a session.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct HelloInfo {
    /// Sequence number of the `Hello` request.
    pub seq: u16,
    /// Number of the session, which every request must contain.
    pub session: u16,
    /// Schema hash of the device, [`SCHEMA`].
    pub schema: u64,
    /// Firmware version: major, minor, patch.
    pub version: [u8; 3],
    /// Board or simulator.
    pub kind: Kind,
    /// 96-bit unique number of the chip; zero in simulators.
    pub unique_id: [u32; 3],
    /// Device time of the answer.
    pub at: Micros,
    /// State at this time.
    pub state: State,
    /// Cause of the last reset.
    pub reset: ResetCause,
    /// Last fault, kept through resets.
    pub last_fault: Option<FaultRecord>,
    /// Time for which an output is disconnected between driving one polarity and the other, µs.
    pub dead_time_us: u16,
    /// Output stages of the device.
    pub stages: Stages,
    /// Option bytes of the chip; `None` in simulators without a chip.
    pub option_bytes: Option<OptionBytes>,
    /// Name of the board whose pins the image drives; empty in simulators without a chip.
    pub board: String<BOARD_NAME>,
    /// Frequency of the crystal as measured at boot against the chip's internal oscillator, which
    /// is itself within 4 %, Hz; 0 if it was not measured.
    pub crystal_hz: u32,
}

/// Counts of events since boot.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct Counters {
    /// Number of frames that were decoded.
    pub frames: u32,
    /// Number of frames with a wrong CRC, without COBS, too long or with an unknown message.
    pub bad_frames: u32,
    /// Number of missing sequence numbers of requests: frames that were lost or bad.
    pub lost_frames: u32,
    /// Number of setpoints that were carried out, or accepted to wait for their time.
    pub setpoints: u32,
    /// Number of requests that were refused.
    pub refused: u32,
    /// Number of pulses started since boot.
    pub pulses: u32,
    /// Number of trigger edges that found no prepared train.
    pub idle_triggers: u32,
    /// Number of messages to the host that were dropped because the host did not read, or because
    /// their time was implausible.
    pub dropped: u32,
    /// Number of messages between the device's own parts that were lost because a queue was full; 0
    /// unless a part was late.
    pub lost_posts: u32,
    /// Number of requests with the number of another session or of none.
    pub unknown_sessions: u32,
    /// Number of timed setpoints that arrived too late: their time was before the start of the
    /// window in which the device accepted them.
    pub late_setpoints: u32,
}

/// Answer to a status request.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct Status {
    /// Device time of the answer.
    pub at: Micros,
    /// State at that time.
    pub state: State,
    /// Latched or last fault.
    pub fault: Option<FaultRecord>,
    /// Counts of events since boot.
    pub counters: Counters,
    /// Remaining allowance of the wearer of the armed or last armed setup; `None` before the first
    /// arming.
    pub remaining: Option<RemainingAllowance>,
}

/// Events that the device reports without a request.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Event {
    /// Stimulation ends, and the amplitudes begin to fall.
    Stopping(StopCause),
    /// The outputs are disconnected, and the device is idle.
    Stopped(StopCause),
    /// A fault is latched, and the outputs are disconnected.
    Faulted(FaultRecord),
    /// An acknowledged fault is cleared.
    Recovered,
    /// The electrode check of [`Request::Arm`] measured a channel. The device reports one event per
    /// channel, before the verdict.
    Electrode {
        /// Number of the channel, from 0.
        channel: u8,
        /// Amplitude that was applied, in the unit of its stage.
        applied: Amplitude,
        /// Current that flowed, µA.
        current_ua: u32,
    },
    /// The control loop of the joint oscillated by itself. The gain of its feedback is lowered
    /// until the next [`Request::Arm`].
    LimitCycle {
        /// Width of the oscillation, peak to peak, 0.01°.
        swing_centideg: u16,
        /// Period of the oscillation, ms.
        period_ms: u16,
        /// New gain of the feedback, thousandths of the configured one.
        gain_milli: u16,
    },
    /// The object has been held for the longest time allowed. No modulated joint is stimulated
    /// until the host reports that the object is released, and then held again.
    HoldExpired,
    /// An edge of the trigger input while stimulating, whether or not it starts a train. The
    /// event's time is that of the edge.
    TriggerEdge,
    /// First leading edge of the sync output in a window while stimulating, reported when the
    /// window is rendered, up to 0.5 ms before the edge. The event's time is that of the edge.
    SyncEdge,
}

/// Session number that no session has.
pub const BROADCAST: u16 = 0;

/// Hash of the types of both directions (FNV-1a over their postcard schema).
pub const SCHEMA: u64 = {
    let to = u64::from_le_bytes(hash_ty_path::<ToDevice>("flexor/to-device"));
    let from = u64::from_le_bytes(hash_ty_path::<Response<'static>>("flexor/to-host"));
    to ^ from.rotate_left(1)
};
