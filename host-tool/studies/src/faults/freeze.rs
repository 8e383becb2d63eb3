//! An owner stays where it is: its code branches to itself from now on.

use super::error::FaultsError;
use super::stem::Chip;
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::cpu::{Bus, Size, Stop};

/// Who owns one of the device's contexts, as tests/tests/chip_faults.rs tells them apart.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Owner {
    /// The refill.
    Pulser,
    /// The control tick.
    Controller,
    /// What moves bytes.
    Usb,
    /// The thread.
    Session,
}

impl Owner {
    /// The one that a kind begins with.
    pub fn of(kind: &str) -> Result<Self, FaultsError> {
        Ok(match kind.split(' ').next() {
            Some("pulser") => Self::Pulser,
            Some("controller") => Self::Controller,
            Some("USB") => Self::Usb,
            Some("session") => Self::Session,
            _ => return Err(FaultsError::Declaration(format!("no owner `{kind}`"))),
        })
    }

    /// Its exception: 16 and the line of TIM2, TIM7, OTG_FS (RM0090 table 62); the thread.
    const fn exception(self) -> u16 {
        match self {
            Self::Pulser => 44,
            Self::Controller => 71,
            Self::Usb => 83,
            Self::Session => 0,
        }
    }
}

/// A word of SRAM2 that nothing uses, and a branch to itself, twice.
const PLACE: (u32, u32) = (0x2001_FFFC, 0xE7FE_E7FE);
/// Until an owner must have run, cycles: 20 ms.
const PATIENCE: u64 = 20_000 * CYCLES_PER_US;

/// Freezes `owner` when it has done `instructions` since it next ran. Whether it did: on a
/// board that broke before it may never again.
pub(super) fn freeze(fork: &mut Chip, owner: Owner, instructions: u64) -> Result<bool, Stop> {
    let Board { cpu, around, .. } = &mut fork.device;
    let end = cpu.cycle + PATIENCE;
    let mut left = instructions;
    loop {
        let is_own = cpu.registers.exception == owner.exception() && !cpu.is_asleep();
        if is_own && left == 0 {
            break;
        }
        left -= u64::from(is_own);
        if cpu.cycle > end {
            return Ok(false);
        }
        match cpu.step(around) {
            Err(Stop::Reset { .. }) => return Ok(false),
            done => done?,
        }
    }
    let (place, code) = PLACE;
    if around.write(place, Size::Word, code, cpu.cycle).is_err() {
        return Ok(false);
    }
    cpu.registers.it = 0;
    cpu.registers.r[15] = place;
    Ok(true)
}
