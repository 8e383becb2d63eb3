//! What the guard says and hears: states, inputs, denials, notices.

use super::{Fault, FaultRecord, Reading, SumError};
use crate::units::{Amplitude, Micros};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The device's state, as reported.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub enum State {
    /// Reset, nothing decided yet.
    #[default]
    Boot,
    /// Outputs isolated, supply down. Includes the electrode check.
    Idle,
    /// Ready to start; expires in 10 s.
    Armed,
    /// Trains play.
    Stimulating,
    /// Amplitudes fall; no new start possible.
    Stopping,
    /// Isolated until acknowledged. Includes the grounding that follows.
    Fault,
}

/// Why stimulation or arming ended without a fault.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub enum StopCause {
    /// The host asked.
    Request,
    /// The host was silent too long.
    HostSilent,
    /// The hand-held stop opened.
    HandStop,
    /// Armed for 10 s without a start.
    ArmExpired,
    /// Every finite train has played.
    Finished,
    /// The arm key, closed at arming, opened.
    ArmKey,
    /// The wearer's longest time of stimulation is over.
    TimeOver,
    /// A channel has put out the wearer's largest charge.
    DoseReached,
}

/// The board's inputs at one refill.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Inputs {
    /// Arm input closed.
    pub arm: bool,
    /// Hand-held stop closed.
    pub hand_stop: bool,
    /// An over-current comparator latched.
    pub over_current: bool,
    /// Trigger edge captured since the last refill.
    pub trigger: Option<Micros>,
    /// The trigger input is held: read after the edge was.
    pub held: bool,
    /// Mid-phase current sampled since the last refill.
    pub reading: Option<Reading>,
}

impl Inputs {
    /// Bit of [`Self::closed`]: the hand-held stop.
    pub const STOP: u8 = 1;
    /// Bit of [`Self::closed`]: the arm key.
    pub const KEY: u8 = 2;

    /// What a person holds closed, as bits.
    #[must_use]
    #[inline]
    pub const fn closed(&self) -> u8 {
        (self.hand_stop as u8 * Self::STOP) | (self.arm as u8 * Self::KEY)
    }
}

/// Why a request was denied. Channels count from 0. No more than four words: it is part
/// of each answer to an order, which is copied from room to room.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Denied {
    /// Not possible in this state.
    WrongState(State),
    /// A fault is latched: acknowledge it first.
    FaultLatched(Fault),
    /// Neither arm input nor hand-held stop is closed.
    ArmInputOpen,
    /// The wearer's limits ask for the hand-held stop, which is not closed.
    HandStopOpen,
    /// The electrode check saw no or too little current.
    ElectrodeOff {
        /// First channel that failed.
        channel: u8,
    },
    /// The electrode check saw too much current.
    ElectrodeShort {
        /// The channel.
        channel: u8,
    },
    /// The electrode check saw current in one phase only.
    PhaseLost {
        /// First channel that failed.
        channel: u8,
    },
    /// Through the load that the electrode check measured, the channel's limit is more
    /// than the wearer's limits allow.
    LoadTooLow {
        /// The channel.
        channel: u8,
        /// That load at most, Ω.
        ohm: u32,
    },
    /// The check was ended by a stop, or a stop came before it began.
    Cancelled,
    /// A stop came behind the order before it was carried out.
    Stopped,
    /// There is no room to tell the controller of it.
    Busy,
    /// A setpoint before arming.
    NotArmed,
    /// The channel is not part of the armed setup.
    NoChannel {
        /// The channel.
        channel: u8,
    },
    /// The control law drives this channel.
    Controlled {
        /// The channel.
        channel: u8,
    },
    /// The wearer's longest time of stimulation is over until power comes up anew.
    TimeOver {
        /// That time, s.
        max_s: u32,
    },
    /// The channel has put out the wearer's largest charge until power comes up anew.
    DoseReached {
        /// The channel.
        channel: u8,
        /// That charge, mC.
        max_mc: u32,
    },
    /// Nobody knows what was spent of time and charge before the reset: power must come
    /// up anew.
    AllowanceLost,
    /// A larger rise than the wearer allows from burst to burst or within a second.
    TooLargeStep {
        /// The channel.
        channel: u8,
        /// The largest amplitude that would be taken now.
        highest: Amplitude,
    },
    /// Through the loads measured at arming all channels together would exceed this.
    Together(SumError),
    /// A width that the channel's train may not have.
    Width {
        /// The channel.
        channel: u8,
        /// What it may be, µs: from this
        min_us: u16,
        /// to this.
        max_us: u16,
    },
    /// The same of a pulse of a list.
    ListedWidth {
        /// The channel.
        channel: u8,
        /// What it may be, µs: from this
        min_us: u16,
        /// to this.
        max_us: u16,
    },
    /// At this width the amplitude is above the wearer's charge limit.
    Charge {
        /// The channel.
        channel: u8,
        /// The largest amplitude at this width.
        highest: Amplitude,
    },
    /// A pulse of a list comes too soon after the one before, or too late.
    Listed {
        /// The channel.
        channel: u8,
        /// How long after it may come at the soonest, µs.
        least_us: u32,
    },
    /// The channel's train takes no lists of pulses.
    NoLists {
        /// The channel.
        channel: u8,
    },
    /// A list of pulses is under way.
    ListPlays,
    /// The channel has not risen from zero, which no list does.
    NotRisen {
        /// The channel.
        channel: u8,
    },
    /// A train of a fixed number of pulses would begin below the ordered amplitude, which
    /// is above the channel's `start`.
    AboveStart {
        /// The channel.
        channel: u8,
        /// How many of its pulses would be below.
        pulses: u32,
        /// The channel's `start`.
        start: Amplitude,
    },
    /// A pulse of a list is further above the one before than a burst may rise.
    ListedSlope {
        /// The channel.
        channel: u8,
        /// The largest amplitude of this width there.
        highest: Amplitude,
    },
    /// A timed setpoint is further ahead than [`limits::AHEAD_US`](super::limits::AHEAD_US).
    TooFarAhead,
    /// As many timed setpoints wait as may.
    TooManyWaiting,
    /// A timed setpoint is due less than a window after the latest that waits.
    TimeGoesBack {
        /// How long after the start of the next window it may be due at the soonest, µs.
        least_us: u32,
    },
    /// Above the wearer's limit.
    AboveLimit {
        /// The channel.
        channel: u8,
        /// Its limit.
        limit: Amplitude,
    },
}

/// What a tick of the guard has to say.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Notice {
    /// The electrode check ended; `Ok` means armed.
    Checked(Result<(), Denied>),
    /// Amplitudes begin to fall.
    Stopping(StopCause),
    /// Outputs are isolated and the device is idle. From arming or a stop.
    Idle(StopCause),
    /// A fault latched.
    Faulted(FaultRecord),
    /// The acknowledged fault is cleared.
    Recovered,
    /// The electrode check read a channel.
    Electrode {
        /// From 0.
        channel: u8,
        /// What was applied, in the unit of its stage.
        applied: Amplitude,
        /// The current that flowed, µA.
        current_ua: u32,
    },
}
