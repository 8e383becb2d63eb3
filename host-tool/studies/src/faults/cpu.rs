//! Fault campaign: the processor core freezes, jumps to a wrong address, receives no interrupts, or
//! loses register contents.

use super::Draws;
use super::case::{Case, CaseResult};
use super::declaration::{Declaration, Register};
use super::error::{FaultsError, never_runs};
use super::freeze::{Owner, freeze};
use super::kinds::Kinds;
use super::registers::bit_of;
use super::stem::{Chip, ForkSource};
use hal_sim::chip::board::Board;
use hal_sim::chip::cpu::bus::Unmodelled;
use hal_sim::chip::cpu::{Open, Stop};
use hal_sim::chip::image::Image;
use hal_sim::random::Random;

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0xC9_0C;
/// Upper bound of the random number of instructions that an interrupt handler executes before it
/// hangs.
const INSTRUCTIONS: u64 = 300;
/// Main flash, as start address and length in bytes (RM0090 section 2.3). Like the following areas,
/// it is a possible target of a wrong branch.
const FLASH: (u64, u64) = (0x0800_0000, 0x10_0000);
/// Main SRAM, as start address and length in bytes.
const SRAM: (u64, u64) = (0x2000_0000, 0x2_0000);
/// Core-coupled memory, as start address and length in bytes.
const CCM: (u64, u64) = (0x1000_0000, 0x1_0000);
/// Peripheral registers, as start address and length in bytes.
const PERIPHERALS: (u64, u64) = (0x4000_0000, 0x8_0000);
/// The whole address space, as start address and length in bytes.
const ALL: (u64, u64) = (0, 1 << 32);
/// Bit positions of the flags N, Z, C, V and Q and of the four bits of GE in the status register.
const FLAGS: [u32; 9] = [31, 30, 29, 28, 27, 19, 18, 17, 16];
/// Upper bound of the random number of bytes by which a fault lowers the stack pointer.
const DEEPEST: u64 = 0x1_0000;

/// Campaign in which the processor core fails: the undisturbed run from which cases start, and the
/// kinds of fault.
pub(super) struct Core {
    stem: ForkSource,
    kinds: Kinds,
    registers: Vec<Register>,
    image_bytes: u64,
}

impl Core {
    pub fn new(seed: u64, declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        Ok(Self {
            stem: ForkSource::record(declaration, image)?,
            kinds: Kinds::new(declaration, image, seed, STREAM),
            registers: declaration.of.registers.clone(),
            image_bytes: image.flash.len() as u64,
        })
    }

    /// Injects a fault of this kind. Returns its random details, and an error of the core if the
    /// fault stops it at once.
    fn inject_fault(
        &self,
        kind: &str,
        fork: &mut Chip,
        random: &mut Random,
    ) -> Result<(String, Result<(), Stop>), FaultsError> {
        let board = &mut fork.device;
        let text = match kind {
            "wild PC" => return Ok(self.jump_to_wild_address(board, random)),
            "wild SP" => {
                let (begin, bytes) = [SRAM, CCM, ALL][random.below(3) as usize];
                let sp = (begin + random.below(bytes)) as u32 & !3;
                board.cpu.registers.r[13] = sp;
                format!("{sp:#010x}")
            }
            "PRIMASK" | "FAULTMASK" | "BASEPRI" | "CONTROL" => special(kind, board, random),
            "core register" => register(board, random),
            "flags" => {
                let bit = FLAGS[random.below(FLAGS.len() as u64) as usize];
                board.cpu.registers.apsr ^= 1 << bit;
                format!("bit {bit}")
            }
            "IT" => {
                let bit = random.below(8);
                board.cpu.registers.it ^= 1 << bit;
                format!("bit {bit}")
            }
            "private register" => return self.private(board, random),
            "stack at its guard" => move_stack_to_guard(board)?,
            "stack lowered" => {
                let bytes = random.below(DEEPEST) as u32 & !7;
                let sp = &mut board.cpu.registers.r[13];
                *sp = sp.wrapping_sub(bytes);
                format!("by {bytes} bytes")
            }
            _ => {
                let instructions = random.below(INSTRUCTIONS);
                let frozen = freeze(fork, Owner::from_kind(kind)?, instructions);
                if !frozen? {
                    return Err(never_runs("the code to freeze does not run"));
                }
                format!("after {instructions} instructions")
            }
        };
        Ok((text, Ok(())))
    }

    fn jump_to_wild_address(
        &self,
        board: &mut Board<()>,
        random: &mut Random,
    ) -> (String, Result<(), Stop>) {
        let image = (FLASH.0, self.image_bytes);
        let areas = [image, FLASH, SRAM, CCM, PERIPHERALS, ALL];
        let (begin, bytes) = areas[random.below(areas.len() as u64) as usize];
        let target = (begin + random.below(bytes)) as u32;
        let done = board.cpu.jump(&mut board.around, target);
        (format!("{target:#010x}"), done)
    }

    fn private(
        &self,
        board: &mut Board<()>,
        random: &mut Random,
    ) -> Result<(String, Result<(), Stop>), FaultsError> {
        let counts = self
            .registers
            .iter()
            .map(|register| register.bits.count_ones());
        let bits = u64::from(counts.sum::<u32>());
        let drawn = random.below(bits.max(1));
        let Some((register, bit)) = bit_of(&self.registers, drawn) else {
            return Err(FaultsError::Declaration(
                "the registers have no bits".into(),
            ));
        };
        let (pc, at) = (board.cpu.registers.r[15], board.cpu.cycle);
        let done = board.cpu.system.upset(register.address, 1 << bit, at);
        let done = done.map_err(|Unmodelled(feature)| Stop::Outside { pc, what: feature });
        Ok((format!("{} bit {bit}", register.name), done))
    }
}

impl Draws for Core {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let mut fork = self.stem.instant(random.unit(), &mut random)?;
        let open = [Open::Undefined, Open::Nothing][random.below(2) as usize];
        fork.device.cpu.open = open;
        let struck = self.inject_fault(kind, &mut fork, &mut random);
        let moment_us = fork.device_us();
        let (detail, done) = struck?;
        let fate = match done {
            Err(Stop::LockUp { .. }) => {
                fork.device.cpu.set_halted(true); // until a reset
                self.stem.play_and_judge(fork, moment_us)
            }
            Err(stop) => CaseResult::stopped(stop),
            Ok(()) => self.stem.play_and_judge(fork, moment_us),
        };
        Ok(Case::new(kind, &detail, (index, moment_us), fate))
    }

    fn notes(&self) -> Vec<String> {
        let kinds = self.kinds.in_words();
        vec![
            format!("Injected at random: {kinds}."),
            "Where the architecture leaves the behaviour open, an instruction is at random \
             undefined or does nothing."
                .to_owned(),
        ]
    }
}

/// Sets the stack pointer to the upper end of the guard region below the stack.
fn move_stack_to_guard(board: &mut Board<()>) -> Result<String, FaultsError> {
    let guard = board.cpu.system.denied_range();
    let end = guard
        .ok_or_else(|| never_runs("no guard of the stack"))?
        .end as u32;
    board.cpu.registers.r[13] = end;
    Ok(format!("{end:#010x}"))
}

/// Sets an interrupt mask (PRIMASK, FAULTMASK or BASEPRI), or flips a bit of CONTROL.
fn special(kind: &str, board: &mut Board<()>, random: &mut Random) -> String {
    let registers = &board.cpu.registers;
    let (mut primask, mut faultmask) = (registers.primask, registers.faultmask);
    let (mut basepri, mut control) = (registers.basepri, u32::from(registers.control));
    let text = match kind {
        "PRIMASK" => {
            primask = true;
            "set".to_owned()
        }
        "FAULTMASK" => {
            faultmask = true;
            "set".to_owned()
        }
        "BASEPRI" => {
            basepri = (1 + random.below(15) as u8) << 4;
            format!("{basepri:#04x}")
        }
        _ => {
            let bit = random.below(3);
            control ^= 1 << bit;
            format!("bit {bit}")
        }
    };
    board
        .cpu
        .upset_special(primask, faultmask, basepri, control);
    text
}

/// Flips one random bit of a core register R0 to R15. The lowest bits of SP and PC do not exist and
/// are not flipped.
fn register(board: &mut Board<()>, random: &mut Random) -> String {
    let (number, bit) = (random.below(16) as usize, random.below(32) as u32);
    let lowest = match number {
        13 => 2,
        15 => 1,
        _ => 0,
    };
    if bit >= lowest {
        board.cpu.registers.r[number] ^= 1 << bit;
    }
    format!("r{number} bit {bit}")
}
