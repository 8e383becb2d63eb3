//! Makes an interrupt handler or the thread hang in an endless loop.

use super::error::{FaultsError, never_runs};
use super::stem::Chip;
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::cpu::Stop;

/// Execution context of the device that can hang. The variants have the names that
/// tests/tests/chip_faults.rs uses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Owner {
    /// The refill's interrupt handler.
    Pulser,
    /// The control tick's interrupt handler.
    Controller,
    /// The interrupt handler that transfers bytes over USB.
    Usb,
    /// The thread, which runs the session when no interrupt handler runs.
    Session,
}

impl Owner {
    /// Returns the context that the first word of a fault kind names.
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

    /// Returns the exception number of the context: 16 plus the interrupt's number of TIM2, TIM7 or
    /// OTG_FS (RM0090 table 62), or 0 for the thread.
    const fn exception(self) -> u16 {
        match self {
            Self::Pulser => 44,
            Self::Controller => 71,
            Self::Usb => 83,
            Self::Session => 0,
        }
    }
}

/// The instruction `wfi` and a branch back to it: the endless loop in which the thread of the image
/// ends.
const STAY: [[u8; 2]; 2] = [0xBF30_u16.to_le_bytes(), 0xE7FD_u16.to_le_bytes()];
/// Longest time to wait until a context has run, core clock cycles: 100 ms.
const PATIENCE: u64 = 100_000 * CYCLES_PER_US;
/// Interval at which the simulated host may send, core clock cycles: 1 ms.
const HOST: u64 = 1_000 * CYCLES_PER_US;

/// Makes `owner` hang after it has executed `instructions` further instructions. Returns `false` if
/// it does not run that long within 100 ms, which is possible on a board with an earlier fault.
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

/// Runs for one host interval, or until `owner` has executed its remaining `left` instructions.
/// Returns whether it has.
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

/// Moves the program counter to an endless waiting loop in the image. The loop must lie in flash,
/// since no other memory is executable; data with the same bytes will do.
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
