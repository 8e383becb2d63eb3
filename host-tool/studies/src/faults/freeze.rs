//! An owner does no more: it waits in a loop that does nothing from now on.

use super::error::{FaultsError, never_runs};
use super::stem::Chip;
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::cpu::Stop;

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
    pub fn from_kind(kind: &str) -> Result<Self, FaultsError> {
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

/// `wfi` and back to it: where the thread of this image ends.
const STAY: [[u8; 2]; 2] = [0xBF30_u16.to_le_bytes(), 0xE7FD_u16.to_le_bytes()];
/// Until an owner must have run for so long, cycles: 100 ms.
const PATIENCE: u64 = 100_000 * CYCLES_PER_US;
/// The host is asked whether it has something to say this often, cycles: 1 ms.
const HOST: u64 = 1_000 * CYCLES_PER_US;

/// Freezes `owner` when it has done `instructions` since it next ran. Whether it did: on a
/// board that broke before it may never again.
pub(super) fn freeze(
    fork: &mut Chip,
    owner: Owner,
    instructions: u64,
) -> Result<bool, FaultsError> {
    let end = fork.device.cpu.cycle + PATIENCE;
    let mut left = instructions;
    while fork.device.cpu.cycle <= end {
        match run(&mut fork.device, owner, &mut left) {
            Ok(true) => return loop_forever(&mut fork.device).map(|()| true),
            Ok(false) => {}
            Err(Stop::Reset { .. }) => return Ok(false),
            Err(stop) => return Err(never_runs(stop)),
        }
        let now_us = fork.device_us();
        fork.run_to(now_us).map_err(never_runs)?;
    }
    Ok(false)
}

/// Lets time pass, or `owner` have done the instructions that are `left`; says whether it has.
fn run(board: &mut Board<()>, owner: Owner, left: &mut u64) -> Result<bool, Stop> {
    let Board { cpu, around, .. } = board;
    let end = cpu.cycle + HOST;
    while cpu.cycle < end {
        if cpu.registers.exception == owner.exception() && !cpu.is_asleep() {
            if *left == 0 {
                return Ok(true);
            }
            *left -= 1;
        }
        cpu.step(around)?;
    }
    Ok(false)
}

/// From now on it waits and branches back, where the image has these two instructions, or a
/// constant that could be: memory cannot be executed.
fn loop_forever(board: &mut Board<()>) -> Result<(), FaultsError> {
    let (code, _) = board.image().flash.as_chunks();
    let Some(place) = code.windows(2).position(|two| *two == STAY) else {
        return Err(never_runs("the image has no loop that waits"));
    };
    let registers = &mut board.cpu.registers;
    registers.it = 0;
    registers.r[15] = 0x0800_0000 + 2 * place as u32; // flash has 1 MiB
    Ok(())
}
