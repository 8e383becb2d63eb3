//! Procedure that writes a firmware image and keeps the chip safe when it is cut.
//!
//! Order: clear the Thumb bit of the old reset vector, then overwrite the old vectors with zeros;
//! erase sector 0, then the other sectors; write and verify the other sectors; write and verify
//! sector 0 without its first eight bytes; write and verify the reset vector, then the stack pointer
//! with [`HOLD_BIT`] set; clear this bit.
//!
//! Flash bits fall from 1 to 0 one by one while a word is programmed, in an order that the ROM does
//! not promise. Therefore one bit alone ends the old firmware, and one bit alone completes the new
//! one: at every cut the flash holds the old firmware or the new one to the last bit, or vectors that
//! start nothing. A new run succeeds after any cut.

mod error;
mod image;
mod select;

pub use error::{ChipState, FlashError, FlashFailure};
pub use image::{Image, ImageError, MIN_LENGTH};
pub use select::{
    AlternateSetting, DeviceSummary, Expected, check_descriptor, select_device, select_setting,
};

use crate::chip::{Sector, word};
use crate::protocol::{Clock, Session, Transport};

/// Bytes that are read with one setting of the address pointer.
const READ_LENGTH: u32 = 0x4000;
/// Codes of the commands that the procedure needs (AN3156): set address pointer and erase.
const NEEDED_COMMANDS: [u8; 2] = [0x21, 0x41];
/// Length of the initial stack pointer and the reset vector.
const COMMIT_LENGTH: usize = 8;
/// Bit that the new stack pointer keeps until everything else is verified. No address in RAM has it,
/// also not by the test of ST's examples, `pointer & 0x2FFE0000 == 0x20000000`. A stack there lies
/// in a reserved region (RM0090 section 2.3), so that the first push locks the CPU up.
pub const HOLD_BIT: u32 = 1 << 27;
/// Bit of the reset vector without which the CPU faults at the first instruction (ARMv7-M B1.5.5).
const THUMB_BIT: u32 = 1;

/// Step of the procedure for progress displays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Erasing; amounts count bytes of sectors.
    Erase,
    /// Writing; amounts count bytes of the image.
    Write,
    /// Reading back; amounts count bytes of the image.
    Verify,
}

/// Progress of one stage. A stage can be reported again after another one; `done` never falls
/// within a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Current stage.
    pub stage: Stage,
    /// Finished amount of the stage in bytes.
    pub done: u32,
    /// Size of the stage in bytes.
    pub total: u32,
}

/// End of a successful run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Finish {
    /// Stay in the boot loader. The user presses reset.
    #[default]
    Stay,
    /// Leave with the address pointer on erased flash. ST documents for the STM32F105's DFU boot
    /// loader (AN2662) that it then resets the chip; not tried on an STM32F405. If the ROM jumps
    /// there instead, the CPU locks up and the user presses reset, as with [`Finish::Stay`].
    Reset,
    /// Leave with the address pointer on the firmware. The ROM jumps to the firmware without a
    /// reset: clocks, USB interrupts and the memory mapping at address 0 keep the boot loader's
    /// settings.
    Jump,
}

/// State after a successful run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The chip is in the boot loader.
    InBootLoader,
    /// The boot loader accepted the request that resets the chip.
    ResetRequested,
    /// The boot loader accepted the request that jumps to the firmware.
    Jumped,
}

impl Ending {
    /// Returns the next step for the user.
    #[must_use]
    pub const fn instruction(self) -> &'static str {
        match self {
            Self::InBootLoader => "Release BOOT0 and press reset to start the firmware.",
            Self::ResetRequested => {
                "The boot loader was asked to reset the chip. If the board does not start within \
                 5 s, release BOOT0 and press reset."
            }
            Self::Jumped => {
                "The firmware was started without a reset. Press reset before you use the board."
            }
        }
    }
}

/// Result of a successful run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// Erased and written sectors.
    pub sectors: Vec<Sector>,
    /// Length of the image in bytes.
    pub bytes: u32,
    /// Number of control transfers.
    pub transfers: u64,
    /// State of the chip.
    pub ending: Ending,
}

/// Writes `image` and verifies it.
///
/// # Errors
/// [`FlashFailure`] says what failed and what the chip holds then.
pub fn flash<T: Transport, C: Clock>(
    session: &mut Session<T, C>,
    image: &Image,
    finish: Finish,
    progress: &mut dyn FnMut(Progress),
) -> Result<Report, FlashFailure> {
    flash_until(session, image, finish, progress, &|| false)
}

/// Writes `image` as [`flash`] does, and ends between two operations when `is_interrupted` returns
/// true. It is not asked any more when only the first eight bytes are missing.
///
/// # Errors
/// As [`flash`], and [`FlashError::Interrupted`]. The boot loader still runs then, and a new run
/// succeeds.
pub fn flash_until<T: Transport, C: Clock>(
    session: &mut Session<T, C>,
    image: &Image,
    finish: Finish,
    progress: &mut dyn FnMut(Progress),
    is_interrupted: &dyn Fn() -> bool,
) -> Result<Report, FlashFailure> {
    let mut run = Run {
        session,
        image,
        progress,
        is_interrupted,
        chip: ChipState::Unchanged,
        erased: 0,
        written: 0,
        verified: 0,
    };
    match run.procedure(finish) {
        Ok(report) => Ok(report),
        Err(error) => Err(FlashFailure {
            error,
            chip: run.chip,
        }),
    }
}

struct Run<'a, T, C> {
    session: &'a mut Session<T, C>,
    image: &'a Image,
    progress: &'a mut dyn FnMut(Progress),
    is_interrupted: &'a dyn Fn() -> bool,
    chip: ChipState,
    erased: u32,
    written: u32,
    verified: u32,
}

impl<T: Transport, C: Clock> Run<'_, T, C> {
    fn procedure(&mut self, finish: Finish) -> Result<Report, FlashError> {
        let sectors = self.image.sectors();
        let (Some(first), Some(others)) = (sectors.first(), sectors.get(1..)) else {
            return Err(ImageError::Empty.into());
        };
        self.check_interrupted()?;
        let head = self.check_device()?;
        self.check_interrupted()?;
        self.invalidate(head)?;
        self.erase(first, others)?;
        for sector in others {
            self.write(sector.address, self.image.part(sector))?;
        }
        for sector in others {
            self.verify(sector.address, self.image.part(sector))?;
        }
        self.write_first(first)?;
        let ending = self.finish(finish)?;
        Ok(Report {
            sectors,
            bytes: self.length(),
            transfers: self.session.transfers(),
            ending,
        })
    }

    fn check_interrupted(&self) -> Result<(), FlashError> {
        if (self.is_interrupted)() {
            return Err(FlashError::Interrupted);
        }
        Ok(())
    }

    /// Checks that the boot loader can do what is needed. Returns the start of flash.
    fn check_device(&mut self) -> Result<Vec<u8>, FlashError> {
        self.session.make_idle()?;
        let commands = self.session.commands()?;
        for command in NEEDED_COMMANDS {
            if !commands.contains(&command) {
                return Err(FlashError::MissingCommand { command });
            }
        }
        let length = u32::from(self.session.transfer_size());
        Ok(self.session.read(self.image.chip().origin, length)?)
    }

    /// Overwrites the vectors of old firmware, so that a cut while sector 0 is erased cannot
    /// leave old vectors before damaged code. Programming zeros needs no erase. `head` is the start
    /// of flash.
    fn invalidate(&mut self, mut head: Vec<u8>) -> Result<(), FlashError> {
        if head.iter().take(COMMIT_LENGTH).all(|&byte| byte == 0xFF) {
            return Ok(());
        }
        self.chip = ChipState::Invalidating;
        // A stack pointer that is partly zero can still lie in RAM, an even reset vector starts
        // nothing.
        let reset = word(&head, 4).unwrap_or_default();
        for (offset, value) in [(4, reset & !THUMB_BIT), (0, 0), (4, 0)] {
            self.program_vector(&mut head, offset, value)?;
        }
        Ok(())
    }

    /// Programs a word of the first eight bytes and compares the start of flash with `head`, which
    /// gets the word too.
    fn program_vector(
        &mut self,
        head: &mut [u8],
        offset: u32,
        value: u32,
    ) -> Result<(), FlashError> {
        let origin = self.image.chip().origin;
        let bytes = value.to_le_bytes();
        self.session.write(origin.saturating_add(offset), &bytes)?;
        let place = head.iter_mut().skip(offset as usize);
        place.zip(bytes).for_each(|(byte, value)| *byte = value);
        self.compare(origin, head)
    }

    fn erase(&mut self, first: &Sector, others: &[Sector]) -> Result<(), FlashError> {
        let sizes = others.iter().map(|sector| sector.size);
        let total = sizes.fold(first.size, u32::saturating_add);
        self.chip = ChipState::Unbootable;
        self.erase_one(first, total)?;
        let length = u32::from(self.session.transfer_size());
        let head = self.session.read(first.address, length)?;
        if let Some((address, read)) = differing(first.address, &head, |_| 0xFF) {
            return Err(FlashError::NotErased { address, read });
        }
        for sector in others {
            self.check_interrupted()?;
            self.erase_one(sector, total)?;
        }
        Ok(())
    }

    fn erase_one(&mut self, sector: &Sector, total: u32) -> Result<(), FlashError> {
        self.session
            .erase(sector.address, sector.erase_limit_ms())?;
        self.erased = self.erased.saturating_add(sector.size);
        (self.progress)(Progress {
            stage: Stage::Erase,
            done: self.erased,
            total,
        });
        Ok(())
    }

    /// Writes and verifies sector 0: first without its first eight bytes, then the reset vector,
    /// then the stack pointer in two steps.
    fn write_first(&mut self, first: &Sector) -> Result<(), FlashError> {
        let part = self.image.part(first);
        let mut blanked = part.to_vec();
        blanked
            .iter_mut()
            .take(COMMIT_LENGTH)
            .for_each(|b| *b = 0xFF);
        self.write(first.address, &blanked)?;
        self.verify(first.address, &blanked)?;
        let (pointer, reset) = (word(part, 0), word(part, 4));
        let (Some(pointer), Some(reset)) = (pointer, reset) else {
            return Err(ImageError::Empty.into());
        };
        blanked.truncate(self.session.transfer_size().into());
        self.chip = ChipState::Committing;
        for (offset, value) in [(4, reset), (0, pointer | HOLD_BIT), (0, pointer)] {
            self.program_vector(&mut blanked, offset, value)?;
        }
        self.chip = ChipState::Complete;
        Ok(())
    }

    fn finish(&mut self, finish: Finish) -> Result<Ending, FlashError> {
        match (finish, self.image.blank_address()) {
            (Finish::Jump, _) => {
                self.session.leave(self.image.chip().origin)?;
                Ok(Ending::Jumped)
            }
            (Finish::Reset, Some(address)) => {
                self.session.leave(address)?;
                Ok(Ending::ResetRequested)
            }
            _ => {
                self.session.make_idle()?;
                Ok(Ending::InBootLoader)
            }
        }
    }

    /// Writes `bytes` from `address` on, without the blocks that stay erased.
    fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let mut at = address;
        for block in bytes.chunks(usize::from(self.session.transfer_size().max(1))) {
            self.check_interrupted()?;
            if block.iter().any(|&byte| byte != 0xFF) {
                self.session.write(at, block)?;
            }
            let length = u32::try_from(block.len()).unwrap_or_default();
            at = at.saturating_add(length);
            self.written = self.written.saturating_add(length);
            let done = self.written;
            self.report(Stage::Write, done);
        }
        Ok(())
    }

    fn verify(&mut self, address: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let mut at = address;
        for part in bytes.chunks(READ_LENGTH as usize) {
            self.check_interrupted()?;
            self.compare(at, part)?;
            let length = u32::try_from(part.len()).unwrap_or_default();
            at = at.saturating_add(length);
            self.verified = self.verified.saturating_add(length);
            let done = self.verified;
            self.report(Stage::Verify, done);
        }
        Ok(())
    }

    fn compare(&mut self, address: u32, expected: &[u8]) -> Result<(), FlashError> {
        let length = u32::try_from(expected.len()).unwrap_or_default();
        let found = self.session.read(address, length)?;
        let wanted = |index: usize| expected.get(index).copied().unwrap_or(0xFF);
        match differing(address, &found, wanted) {
            None => Ok(()),
            Some((at, read)) => Err(FlashError::Mismatch {
                address: at,
                expected: wanted(at.saturating_sub(address) as usize),
                read,
            }),
        }
    }

    fn report(&mut self, stage: Stage, done: u32) {
        let total = self.length();
        (self.progress)(Progress { stage, done, total });
    }

    fn length(&self) -> u32 {
        u32::try_from(self.image.bytes().len()).unwrap_or(u32::MAX)
    }
}

/// First address from `start` on, and its byte, at which `found` differs from `wanted`.
fn differing(start: u32, found: &[u8], wanted: impl Fn(usize) -> u8) -> Option<(u32, u8)> {
    let (index, &read) = found
        .iter()
        .enumerate()
        .find(|&(index, &byte)| byte != wanted(index))?;
    let offset = u32::try_from(index).unwrap_or(u32::MAX);
    Some((start.saturating_add(offset), read))
}
