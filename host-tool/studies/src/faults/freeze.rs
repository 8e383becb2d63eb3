//! Makes an interrupt handler or the thread hang in an endless loop.

use super::error::{FaultsError, never_runs};
use super::stem::Chip;
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::cpu::Stop;

/// Owner of an execution context of the device, with the names of tests/tests/chip_faults.rs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Owner {
    /// The refill.
    Pulser,
    /// The control tick.
    Controller,
    /// The USB interrupt, which transfers bytes.
    Usb,
    /// The thread.
    Session,
}

impl Owner {
    /// Returns the owner that the first word of a fault kind names.
    pub fn from_kind(kind: &str) -> Result<Self, FaultsError> {
        Ok(match kind.split(' ').next() {
            Some("pulser") => Self::Pulser,
            Some("controller") => Self::Controller,
            Some("USB") => Self::Usb,
            Some("session") => Self::Session,
            _ => {
                let why = format!("there is no code to freeze for `{kind}`");
                return Err(FaultsError::Declaration(why));
            }
        })
    }

    /// Returns its exception number: 16 plus the interrupt's number of TIM2, TIM7 or OTG_FS (RM0090
    /// table 62), or 0 for the thread.
    const fn exception(self) -> u16 {
        match self {
            Self::Pulser => 44,
            Self::Controller => 71,
            Self::Usb => 83,
            Self::Session => 0,
        }
    }
}

/// The instructions `wfi` and a branch back to it, with which the thread of this image ends.
const STAY: [[u8; 2]; 2] = [0xBF30_u16.to_le_bytes(), 0xE7FD_u16.to_le_bytes()];
/// Longest time until an owner must have run, cycles: 100 ms.
const PATIENCE: u64 = 100_000 * CYCLES_PER_US;
/// Interval at which the host may send, cycles: 1 ms.
const HOST: u64 = 1_000 * CYCLES_PER_US;

/// Makes `owner` hang after `instructions` instructions of its next run. Returns `false` if it
/// never runs again, which is possible on a board with an earlier fault.
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

/// Runs for a while, or until `owner` has executed the `left` instructions; returns whether it has.
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

/// Moves the program counter to a waiting loop in the image. Code or a constant with these two
/// instructions serves, since memory outside flash is not executable.
fn loop_forever(board: &mut Board<()>) -> Result<(), FaultsError> {
    let (code, _) = board.image().flash.as_chunks();
    let Some(place) = code.windows(2).position(|two| *two == STAY) else {
        return Err(never_runs("the image has no waiting loop"));
    };
    let registers = &mut board.cpu.registers;
    registers.it = 0;
    registers.r[15] = 0x0800_0000 + 2 * place as u32; // fits: flash has 1 MiB
    Ok(())
}
