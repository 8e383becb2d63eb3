//! States, inputs, refusals and notices of the guard.

use super::{Fault, FaultRecord, Reading, SumError};
use crate::units::{Amplitude, Micros};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The device's state, as reported to hosts.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub enum State {
    /// After a reset, before the first window has been rendered.
    #[default]
    Boot,
    /// Outputs disconnected and output supply off. Includes the electrode check.
    Idle,
    /// Electrodes checked, ready to start. Expires after 10 s.
    Armed,
    /// Trains play with the wanted amplitudes.
    Stimulating,
    /// Amplitudes fall; no new start is possible.
    Stopping,
    /// Outputs disconnected until the fault is acknowledged. Includes the grounding that follows.
    Fault,
}

/// The reason why stimulation or arming ended without a fault.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub enum StopCause {
    /// The host asked for a stop.
    Request,
    /// The host sent nothing for longer than the wearer's limit.
    HostSilent,
    /// The hand-held stop opened.
    HandStop,
    /// No start came within 10 s after arming.
    ArmExpired,
    /// Every train with a fixed number of bursts has played.
    Finished,
    /// The arm key, which was closed at arming, opened.
    ArmKey,
    /// The wearer's longest stimulation time is over.
    TimeOver,
    /// A channel has output the wearer's largest charge.
    DoseReached,
}

/// The board's inputs, sampled at one refill.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Inputs {
    /// Whether the arm key is closed.
    pub arm: bool,
    /// Whether the hand-held stop is closed.
    pub hand_stop: bool,
    /// Whether an over-current comparator has latched.
    pub over_current: bool,
    /// Time of the trigger edge captured since the last refill.
    pub trigger: Option<Micros>,
    /// Whether the trigger input is active, sampled after the edge was captured.
    pub held: bool,
    /// Current sampled in the middle of a phase since the last refill.
    pub reading: Option<Reading>,
}

impl Inputs {
    /// Bit of the hand-held stop in [`Self::closed`].
    pub const STOP: u8 = 1;
    /// Bit of the arm key in [`Self::closed`].
    pub const KEY: u8 = 2;

    /// Returns the inputs that a person holds closed, as bits [`Self::STOP`] and [`Self::KEY`].
    #[must_use]
    #[inline]
    pub const fn closed(&self) -> u8 {
        (self.hand_stop as u8 * Self::STOP) | (self.arm as u8 * Self::KEY)
    }
}

/// The reason why a request was refused. Channels count from 0. The size is limited to four words,
/// because every answer to a request contains a denial and is copied from module to module.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Denial {
    /// The request is not possible in this state.
    WrongState(State),
    /// A fault is latched and must be acknowledged first.
    FaultLatched(Fault),
    /// Neither the arm key nor the hand-held stop is closed.
    ArmInputOpen,
    /// The wearer's limits require the hand-held stop, which is not closed.
    HandStopOpen,
    /// The electrode check measured no current, or too little.
    ElectrodeOff {
        /// First channel that failed, from 0.
        channel: u8,
    },
    /// The electrode check measured too much current.
    ElectrodeShort {
        /// The channel that failed, from 0.
        channel: u8,
    },
    /// The electrode check measured current in only one of the two phases.
    PhaseLost {
        /// First channel that failed, from 0.
        channel: u8,
    },
    /// With the load that the electrode check measured, the channel's limit exceeds the wearer's
    /// limits.
    LoadTooLow {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// Upper bound of the measured load, Ω.
        ohm: u32,
    },
    /// A stop ended the electrode check, or came before it began.
    Cancelled,
    /// A stop came after the request and before the request was carried out.
    Stopped,
    /// The device is busy: a message between its parts found no room, or is missing.
    Busy,
    /// A setpoint came before arming.
    NotArmed,
    /// The channel is not part of the armed setup.
    NoChannel {
        /// The channel asked for, from 0.
        channel: u8,
    },
    /// A controller drives this channel, so a host may not.
    Controlled {
        /// Channel for which the request was refused, from 0.
        channel: u8,
    },
    /// The wearer's longest stimulation time is over until power is removed.
    TimeOver {
        /// The wearer's longest stimulation time, s.
        max_s: u32,
    },
    /// The channel has output the wearer's largest charge; it may output more only after power was
    /// removed.
    DoseReached {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// The wearer's largest charge per channel, mC.
        max_mc: u32,
    },
    /// The time and charge spent before the reset are unknown: power must be removed and restored.
    AllowanceLost,
    /// The amplitude rises by more than the wearer allows from burst to burst or within a second.
    TooLargeStep {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// The largest amplitude that would be accepted now, in the stage's thousandths.
        highest: Amplitude,
    },
    /// With the loads measured at arming, all channels together would exceed this limit of the
    /// common return.
    Together(SumError),
    /// The channel's train does not allow this pulse width.
    Width {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// Smallest allowed width, µs.
        min_us: u16,
        /// Largest allowed width, µs.
        max_us: u16,
    },
    /// The channel's train does not allow the width of a listed pulse.
    ListedWidth {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// Smallest allowed width, µs.
        min_us: u16,
        /// Largest allowed width, µs.
        max_us: u16,
    },
    /// At this width the amplitude is above the wearer's charge limit.
    Charge {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// The largest amplitude at this width, in the stage's thousandths.
        highest: Amplitude,
    },
    /// A listed pulse comes too soon after the previous one, or too late.
    Listed {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// Shortest allowed delay after the previous pulse, µs.
        least_us: u32,
    },
    /// The channel's train takes no lists of pulses.
    NoLists {
        /// Channel for which the request was refused, from 0.
        channel: u8,
    },
    /// Another list of pulses is in progress.
    ListPlays,
    /// The channel has not finished its rise from zero, which lists cannot do.
    NotRisen {
        /// Channel for which the request was refused, from 0.
        channel: u8,
    },
    /// A train of a fixed number of pulses would begin below the requested amplitude, because that
    /// is above the channel's `start`.
    AboveStart {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// Number of pulses that would be below the requested amplitude.
        pulses: u32,
        /// The channel's `start`, in the stage's thousandths.
        start: Amplitude,
    },
    /// A listed pulse rises above the previous one by more than a burst may.
    ListedSlope {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// The largest amplitude of this width at that place in the list, in the stage's
        /// thousandths.
        highest: Amplitude,
    },
    /// A timed setpoint is further ahead than [`limits::AHEAD_US`](super::limits::AHEAD_US).
    TooFarAhead,
    /// The queue of timed setpoints is full.
    TooManyWaiting,
    /// A timed setpoint is due less than a window after the latest one in the queue.
    TimeGoesBack {
        /// Earliest time at which it may be due, after the start of the next window, µs.
        least_us: u32,
    },
    /// The amplitude is above the wearer's limit.
    AboveLimit {
        /// Channel for which the request was refused, from 0.
        channel: u8,
        /// The channel's limit, in the stage's thousandths.
        limit: Amplitude,
    },
}

/// A change that the guard reports.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Notice {
    /// The electrode check ended; `Ok` means that the device is armed.
    Checked(Result<(), Denial>),
    /// Amplitudes begin to fall.
    Stopping(StopCause),
    /// Outputs are disconnected and the device is idle, after arming or stimulation ended.
    Idle(StopCause),
    /// A fault latched.
    Faulted(FaultRecord),
    /// The acknowledged fault is cleared.
    Recovered,
    /// The electrode check measured the current of a channel.
    Electrode {
        /// Channel that was measured, from 0.
        channel: u8,
        /// Applied amplitude, in the stage's thousandths.
        applied: Amplitude,
        /// Measured current, µA.
        current_ua: u32,
    },
}
