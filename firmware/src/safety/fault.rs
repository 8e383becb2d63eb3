//! Numbered faults. A fault truncates pulses, disconnects the outputs and latches until it is
//! acknowledged. *Limiting* is not a fault and is reported separately.

use super::BrokenRule;
use crate::pulse::{CHANNELS, RenderError};
use crate::units::Micros;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The reason why the outputs were disconnected. Its number never changes in the protocol.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub enum Fault {
    /// 1: a refill came too late for its window.
    MissedDeadline,
    /// 2: the tape's DMA streams disagree about the slot being played.
    TapeSlip,
    /// 3: the stack guard was touched.
    StackGuard,
    /// 4: a joint sensor's reading is outside its range.
    SensorRange,
    /// 5: a joint sensor has not delivered a new reading for too long.
    SensorStale,
    /// 6: an over-current comparator or the current sense tripped.
    OverCurrent,
    /// 7: an electrode came off.
    ElectrodeOff,
    /// 8: the supply voltage fell below its threshold.
    BrownOut,
    /// 9: the crystal oscillator failed.
    ClockFailure,
    /// 10: a part of the device stopped checking in, and the watchdog reset the device.
    Watchdog,
    /// 11: the program panicked.
    Panic,
    /// 12: a joint's control loop keeps oscillating although its feedback gain is at its minimum.
    LimitCycle,
    /// 13: a window would have broken a rule of the outputs, and was not played.
    Outputs,
    /// 14: memory that decides the outputs changed by itself (bit flip).
    Memory,
    /// 15: device time disagrees with the core's cycle counter, the cycle counter with its
    /// crystal, or device time with the host's frames.
    TimeBase,
    /// 16: a register that decides edges does not hold the value that was written.
    Registers,
    /// 17: one phase of a channel's pulses carries no current, while the other does.
    PhaseLost,
    /// 18: the current sense was triggered and gave no reading.
    ReadingMissing,
    /// 19: a channel's load is far above the load at arming, or comes and goes.
    LoadUnstable,
    /// 20: the program wrote to code or constants, executed data, or accessed memory that is not
    /// its own.
    Access,
    /// 21: flash does not hold the image that was written; found at boot.
    Flash,
    /// 22: RAM does not keep the values that are written; found at boot, or in the table of a muscle
    /// while stimulating.
    Ram,
    /// 23: the watchdog's oscillator runs outside 17 to 47 kHz; found at boot.
    Oscillator,
    /// 24: a breadboard's image runs on a board that it is not made for: its strap is open, or
    /// something drives its over-current line; found at boot.
    Board,
}

impl Fault {
    /// Returns the fault's number, 1 to 24, which never changes.
    #[must_use]
    pub const fn number(self) -> u16 {
        self as u16 + 1
    }

    /// Returns the fault's bit in [`FaultRecord::later_faults`].
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self as u32 // the last has number 24
    }

    /// Returns the fault with this number, as stored in backup registers; `None` for an unknown
    /// number.
    #[must_use]
    pub const fn from_number(number: u16) -> Option<Self> {
        Some(match number {
            1 => Self::MissedDeadline,
            2 => Self::TapeSlip,
            3 => Self::StackGuard,
            4 => Self::SensorRange,
            5 => Self::SensorStale,
            6 => Self::OverCurrent,
            7 => Self::ElectrodeOff,
            8 => Self::BrownOut,
            9 => Self::ClockFailure,
            10 => Self::Watchdog,
            11 => Self::Panic,
            12 => Self::LimitCycle,
            13 => Self::Outputs,
            14 => Self::Memory,
            15 => Self::TimeBase,
            16 => Self::Registers,
            17 => Self::PhaseLost,
            18 => Self::ReadingMissing,
            19 => Self::LoadUnstable,
            20 => Self::Access,
            21 => Self::Flash,
            22 => Self::Ram,
            23 => Self::Oscillator,
            24 => Self::Board,
            _ => return None,
        })
    }
}

impl From<RenderError> for Fault {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Late | RenderError::Full => Self::MissedDeadline,
            RenderError::Memory => Self::Memory,
        }
    }
}

impl From<BrokenRule> for Fault {
    fn from(broken: BrokenRule) -> Self {
        match broken {
            BrokenRule::Memory => Self::Memory,
            _ => Self::Outputs,
        }
    }
}

/// A fault as it is stored and reported.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub struct FaultRecord {
    /// The first fault that latched.
    pub fault: Fault,
    /// Device time at which it latched.
    pub at: Micros,
    /// Charge left on each channel by the truncated pulse, in DAC-code·µs, anodic positive.
    pub residual: [i32; CHANNELS],
    /// Faults that came while this one was latched, bit n for fault n + 1. The first fault is the
    /// one that is kept.
    pub later_faults: u32,
    /// Whether power was lost since, so that `at` belongs to an earlier time base.
    pub power_lost: bool,
    /// Whether the fault was found at boot: no acknowledgement clears it, only a boot that does
    /// not find it.
    pub found_at_boot: bool,
    /// Where or how the fault was found, by a number whose meaning depends on the fault
    /// (docs/evidence/faults.md): an address, a frequency, flags. 0 if there is nothing to add.
    pub detail: u32,
}

impl FaultRecord {
    /// Returns the record of `fault` at `at`, without residual charge and without later faults.
    #[must_use]
    pub const fn new(fault: Fault, at: Micros) -> Self {
        Self {
            fault,
            at,
            residual: [0; CHANNELS],
            later_faults: 0,
            power_lost: false,
            found_at_boot: false,
            detail: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_round_trip() {
        for number in 1..=24 {
            assert_eq!(Fault::from_number(number).unwrap().number(), number);
        }
        assert_eq!(Fault::from_number(0), None);
        assert_eq!(Fault::from_number(25), None);
    }
}
