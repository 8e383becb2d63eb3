//! Everything that is said on the link. Variant order is the wire format:
//! append, never insert; the schema hash changes with any edit.

use super::{Refusal, Telemetry};
use crate::control::{EndpointSpec, ForceSpec, JointSpec};
use crate::haptics::{ModulationSpec, WallSpec};
use crate::limb::{AXES, LineSpec};
use crate::muscle::{MuscleSpec, Rung};
use crate::pulse::{CHANNELS, GroupSpec, MAX_GROUPS, TrainSpec};
use crate::range::Range;
use crate::safety::{
    ChannelSpec, FaultRecord, Left, ListedPulse, MAX_LISTED, StageKind, StageSupply, Stages, State,
    StopCause, WearerSpec,
};
use crate::units::{Amplitude, Micros};
use heapless::Vec;
use postcard_schema::{Schema, key::hash::fnv1a64::hash_ty_path};
use serde::{Deserialize, Serialize};

impl Request {
    /// Of a mask of amplitudes: a mask of nothing asks for nothing, and would only
    /// say that the host is there, in any state.
    pub const MASK: Range = Range::new("mask", 1, (1 << CHANNELS) - 1);
    /// Of a setpoint's widths; what a channel's train may have is asked where it is armed.
    pub const WIDTHS: Range = Range {
        field: "widths",
        ..TrainSpec::WIDTH_US
    };
    /// Of a measurement's joint.
    pub const JOINT: Range = Range::new("joint", 0, AXES as i32 - 1);
    /// Of telemetry's period.
    pub const PERIOD_MS: Range = Range::new("period_ms", 0, 1_000);
    /// Of an angle's rate: rates beyond are no finger's.
    pub const CENTIDEG_PER_S: Range = Range::new("centideg_per_s", -2_000_000, 2_000_000);
    /// Of a force's rate: rates beyond are no muscle's.
    pub const MILLINEWTON_PER_S: Range = Range::new("millinewton_per_s", -32_767_000, 32_767_000);
}

/// A request on its way to the device.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ToDevice {
    /// The session that `Hello` granted; anything for `Hello` itself.
    pub session: u16,
    /// Counts up by one per frame and wraps; every answer names it, and a gap
    /// counts as lost frames.
    pub seq: u16,
    /// What is asked.
    pub request: Request,
}

/// What a host can ask. Each gets one acknowledgement or one refusal.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Request {
    /// Opens a session. Answered by [`Response::Hello`].
    Hello {
        /// The host's [`SCHEMA`].
        schema: u64,
    },
    /// The host is alive. Counts against host silence.
    KeepAlive,
    /// Asks for [`Response::Status`].
    Status,
    /// Empties the draft setup.
    Clear,
    /// Puts the wearer's limits into the draft.
    Wearer(WearerSpec),
    /// Puts a channel into the draft.
    Channel {
        /// From 0.
        channel: u8,
        /// Its configuration.
        spec: ChannelSpec,
    },
    /// Puts the groups into the draft.
    Groups(Vec<GroupSpec, MAX_GROUPS>),
    /// Names the channel that drives sync out, in the draft.
    Sync {
        /// From 0; `None` for no sync.
        channel: Option<u8>,
    },
    /// Gives a channel of the draft a muscle whose force is predicted.
    Muscle {
        /// From 0.
        channel: u8,
        /// The muscle.
        spec: MuscleSpec,
    },
    /// Puts a controlled joint into the draft.
    Joint(JointSpec),
    /// Checks the whole draft, then the electrodes, then arms.
    Arm {
        /// [`SetupSum::total`](super::SetupSum::total) of what the host had accepted:
        /// refused where the draft is another.
        setup: u32,
    },
    /// Starts the armed setup's trains.
    Start,
    /// Ends stimulation by the wearer's fall, or disarms.
    Stop,
    /// Acknowledges a fault.
    Acknowledge,
    /// Direct amplitudes and pulse widths, all or none of them. A setpoint.
    Amplitudes {
        /// Device time from which they hold, at most 1 s ahead; `None` is on arrival.
        at: Option<Micros>,
        /// Bit i is channel i.
        mask: u16,
        /// One per bit set, lowest channel first.
        values: Vec<Amplitude, CHANNELS>,
        /// Widths of a phase in µs in the same order, each taken with its amplitude; empty
        /// for the trains' own.
        widths: Vec<u16, CHANNELS>,
    },
    /// The wanted angle of the joint. A setpoint.
    Angle {
        /// Device time from which it is valid; `None` is on arrival.
        at: Option<Micros>,
        /// 0.01°.
        centideg: i16,
        /// 0.01 °/s; `None` lets the device estimate it.
        centideg_per_s: Option<i32>,
    },
    /// A joint angle measured by the host.
    Measurement {
        /// Which of an arm's nine axes, 0–8; of four modulated joints 0–3; of a joint or a
        /// wall 0.
        joint: u8,
        /// 0.01°.
        centideg: i16,
        /// Device time of the measurement.
        at: Micros,
    },
    /// Telemetry every `period_ms`, 1–1000 ms; 0 ends it.
    Subscribe {
        /// ms.
        period_ms: u16,
    },
    /// Puts a virtual wall into the draft.
    Wall(WallSpec),
    /// Puts a channel of the draft under force control. It needs a muscle.
    ForceControl {
        /// From 0.
        channel: u8,
        /// How.
        spec: ForceSpec,
    },
    /// The wanted force of a channel under force control. A setpoint.
    Force {
        /// From 0.
        channel: u8,
        /// Device time from which it is valid; `None` is on arrival.
        at: Option<Micros>,
        /// mN, on the average of a pulse period.
        millinewton: u32,
        /// mN/s; `None` lets the device estimate it.
        millinewton_per_s: Option<i32>,
    },
    /// Changes the rung of a muscle of the armed setup, without a step in its
    /// force.
    Rung {
        /// From 0.
        channel: u8,
        /// The rung from then on.
        rung: Rung,
    },
    /// An edge at the trigger input of a simulated board. Whoever serves a
    /// simulator takes it and answers; every device refuses it.
    SimulateTrigger,
    /// Stores which output stages the board has, for whoever puts it into service.
    /// Idle only. Acknowledged before it does; then the board isolates, writes, and
    /// restarts: the next [`Response::Hello`] tells the table it found.
    StoreStages {
        /// One per channel; `None` where there is none.
        stages: [Option<StageKind>; CHANNELS],
        /// How they are supplied.
        supply: StageSupply,
    },
    /// A list of pulses that a channel plays once, in place of its train's own, from its
    /// next burst on. A setpoint.
    Pulses {
        /// From 0.
        channel: u8,
        /// One after the other.
        pulses: Vec<ListedPulse, MAX_LISTED>,
    },
    /// Puts a wearer's arm into the draft, whose hand is to exert forces.
    Limb(EndpointSpec),
    /// Puts the line of action of a channel's muscle into the draft; the arm drives that
    /// channel.
    Line(LineSpec),
    /// The wanted force at the hand of the arm. A setpoint.
    Wrench {
        /// Device time from which it is valid; `None` is on arrival.
        at: Option<Micros>,
        /// mN, backward, to the right, upward, seen from the thorax; ±1 000 000.
        force_mn: [i32; 3],
    },
    /// Puts a joint into the draft whose stimulation follows its angle while an object is
    /// held.
    Modulation(ModulationSpec),
    /// Whether an object is held. A setpoint: while it is not, no modulated joint is
    /// stimulated.
    Held {
        /// `true` from when it is grabbed, `false` from when it is let go.
        held: bool,
    },
}

/// What the device says.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, Schema)]
#[expect(
    clippy::large_enum_variant,
    reason = "one at a time, on its way to the wire: nothing keeps many"
)]
pub enum Response<'a> {
    /// A session is open.
    Hello(HelloInfo),
    /// The request with this number was carried out, at this device time.
    Ack {
        /// The request's number.
        seq: u16,
        /// When.
        at: Micros,
    },
    /// A request or a frame was refused; nothing changed.
    Refused {
        /// The request's number, if it could be read.
        seq: Option<u16>,
        /// Why.
        #[serde(borrow)]
        refusal: Refusal<'a>,
    },
    /// Answer to [`Request::Status`].
    Status {
        /// The request's number.
        seq: u16,
        /// The status.
        status: Status,
    },
    /// Something happened without being asked for.
    Event {
        /// When.
        at: Micros,
        /// What.
        event: Event,
    },
    /// A subscribed sample.
    Telemetry(Telemetry),
}

/// What a device is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Kind {
    /// A board: wearers may be connected.
    Board,
    /// The native simulator.
    Native,
    /// The device code in QEMU.
    Qemu,
}

/// Why the device last reset.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum ResetCause {
    /// Power came up.
    PowerOn,
    /// The reset pin.
    Pin,
    /// The supply fell.
    BrownOut,
    /// The independent watchdog bit.
    Watchdog,
    /// Software asked, after a panic or a debugger.
    Software,
}

/// What the chip does by itself before any program runs (RM0090 section 3.7), set once
/// with a probe.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct OptionBytes {
    /// Level below which the chip is in reset, 1–3; 0 is off. Level 3 is some 2.8 V.
    pub brown_out_level: u8,
    /// The watchdog starts with reset, before the firmware does.
    pub hardware_watchdog: bool,
    /// Level of read protection, 0–2; 2 cannot be undone.
    pub read_protection: u8,
}

impl OptionBytes {
    /// As docs/hil.md sets them.
    pub const WANTED: Self = Self {
        brown_out_level: 3,
        hardware_watchdog: false,
        read_protection: 0,
    };

    /// As FLASH_OPTCR shows them (RM0090 3.9.7, 3.7.1).
    #[must_use]
    pub const fn from_optcr(optcr: u32) -> Self {
        Self {
            // BOR_LEV: 00 is level 3, 11 is off.
            brown_out_level: !(optcr >> 2) as u8 & 0b11,
            hardware_watchdog: optcr & 1 << 5 == 0, // WDG_SW
            read_protection: match (optcr >> 8) as u8 {
                0xAA => 0,
                0xCC => 2,
                _ => 1,
            },
        }
    }
}

/// What a device tells at the start of a session.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct HelloInfo {
    /// The `Hello`'s number.
    pub seq: u16,
    /// To be named in every request.
    pub session: u16,
    /// The device's [`SCHEMA`].
    pub schema: u64,
    /// Firmware version.
    pub version: [u8; 3],
    /// What it is.
    pub kind: Kind,
    /// 96-bit unique number of the chip; zero in simulators.
    pub unique_id: [u32; 3],
    /// Device time.
    pub at: Micros,
    /// State at this moment.
    pub state: State,
    /// Why it last reset.
    pub reset: ResetCause,
    /// Its last fault, kept through resets.
    pub last_fault: Option<FaultRecord>,
    /// Isolation between opposite drive, µs.
    pub dead_time_us: u16,
    /// Its output stages.
    pub stages: Stages,
    /// The chip's option bytes; none in simulators without a chip.
    pub option_bytes: Option<OptionBytes>,
}

/// What has been counted since boot.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct Counters {
    /// Frames understood.
    pub frames: u32,
    /// Frames with a wrong CRC, no COBS, too long or of no known message.
    pub bad_frames: u32,
    /// Gaps in the request numbers: frames lost or bad.
    pub lost: u32,
    /// Setpoints carried out, or taken to wait for their time.
    pub setpoints: u32,
    /// Requests refused.
    pub refused: u32,
    /// Pulses started since boot.
    pub pulses: u32,
    /// Trigger edges that found no prepared train.
    pub idle_triggers: u32,
    /// Messages to the host dropped because it did not read, or because their time is not
    /// of the present.
    pub dropped: u32,
    /// Messages between the device's own parts lost for want of room; 0 unless
    /// a part was late.
    pub lost_posts: u32,
    /// Requests that named no open session, or another one.
    pub strangers: u32,
    /// Timed amplitudes whose time was before the window that took them up.
    pub late_setpoints: u32,
}

/// The state of the device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct Status {
    /// Device time.
    pub at: Micros,
    /// State at that time.
    pub state: State,
    /// The latched or last fault.
    pub fault: Option<FaultRecord>,
    /// Counters since boot.
    pub counters: Counters,
    /// What is left of what the armed or last armed setup's wearer allows; none before one
    /// was armed.
    pub left: Option<Left>,
}

/// What the device reports of its own accord.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Event {
    /// Amplitudes begin to fall.
    Stopping(StopCause),
    /// Outputs isolated; the device is idle.
    Stopped(StopCause),
    /// A fault latched and the outputs are isolated.
    Faulted(FaultRecord),
    /// An acknowledged fault is cleared.
    Recovered,
    /// The electrode check of [`Request::Arm`] read a channel: what was applied
    /// and what flowed, one event a channel, before the verdict.
    Electrode {
        /// From 0.
        channel: u8,
        /// What was applied, in the unit of its stage.
        applied: Amplitude,
        /// The current that flowed, µA.
        current_ua: u32,
    },
    /// The joint's loop swung by itself: its feedback is lowered until the next
    /// [`Request::Arm`].
    LimitCycle {
        /// Width of the swing, peak to peak, 0.01°.
        swing_centideg: u16,
        /// Its period, ms.
        period_ms: u16,
        /// Gain of the feedback from now on, thousandths of the configured one.
        gain_milli: u16,
    },
    /// The object has been held for as long as it may be: nothing is stimulated until the
    /// host says that it is released, and held anew.
    HoldOver,
    /// An edge of the trigger input while stimulating, whether it starts a train or not; the
    /// event's time is the edge's.
    TriggerEdge,
    /// The first leading edge of the sync output in a window while stimulating, reported
    /// when it is rendered, up to 0.5 ms before; the event's time is the edge's.
    SyncEdge,
}

/// A session number no session has.
pub const BROADCAST: u16 = 0;

/// Hash of the types of both directions (FNV-1a over their postcard schema).
pub const SCHEMA: u64 = {
    let to = u64::from_le_bytes(hash_ty_path::<ToDevice>("flexor/to-device"));
    let from = u64::from_le_bytes(hash_ty_path::<Response<'static>>("flexor/to-host"));
    to ^ from.rotate_left(1)
};
