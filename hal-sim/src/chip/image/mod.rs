//! Reads and checks the image that would be flashed, an ELF file.
//!
//! In: the file's bytes. Out: the contents of flash after programming, the address where the core
//! starts, names of functions and of variables. Running the image is in `cpu` and `soc`, decoding
//! its logs in `rtt`. A file that could not be flashed and started is refused with the reason;
//! nothing is guessed.

mod symbols;
#[cfg(test)]
pub(super) mod tests;

pub use symbols::{Symbol, Symbols};

use crate::input;
use object::elf::{EF_ARM_EABI_VER5, ELFCLASS32, ELFDATA2LSB, EM_ARM, FileHeader32, PT_LOAD};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSection};
use std::ops::Range;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Address range of the main flash, 1 MiB (RM0090, table 5).
pub const FLASH: Range<u32> = 0x0800_0000..0x0810_0000;

/// Memories in which the initial stack pointer may lie: CCM, and SRAM1 with SRAM2 (RM0090, section
/// 2.3.1). A stack pointer lies one past the first word of the stack.
const STACKS: [Range<u32>; 2] = [0x1000_0000..0x1001_0000, 0x2000_0000..0x2002_0000];

/// Number of words of the vector table that hold exceptions of the core (Arm ARM, table B1-4).
const CORE_VECTORS: u32 = 16;

/// Reason why an image is refused. Each message has a number and names the file.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The operating system could not read the file.
    #[error("E530 the image {0} cannot be read: {1}; check the path and the permissions")]
    Unreadable(PathBuf, std::io::Error),
    /// The file is not an ELF file, or is damaged.
    #[error("E531 {0} is not a readable ELF file: {1}")]
    NotElf(PathBuf, String),
    /// The ELF file is for another processor or ABI.
    #[error("E532 {0} is not for a Cortex-M: {1} (needed: 32-bit little-endian ARM, Thumb)")]
    WrongArchitecture(PathBuf, String),
    /// The flash has no valid vector table, from which the core starts.
    #[error("E533 {0} has no vector table at {start:#010x}: {1}; link the image for this address", start = FLASH.start)]
    NoVectorTable(PathBuf, String),
    /// Some bytes lie outside the flash.
    #[error(
        "E534 {0} does not fit the flash {start:#010x}..{end:#010x} (1 MiB): {1}",
        start = FLASH.start,
        end = FLASH.end
    )]
    OutsideFlash(PathBuf, String),
    /// Logs were requested, but the image has no defmt table.
    #[error(
        "E535 {0} has no defmt table: it was built without defmt, or stripped; its logs cannot be \
         decoded; leave out --log, or build the image with defmt"
    )]
    NoDefmtTable(PathBuf),
}

/// An image that can be flashed and started.
#[derive(Clone, Debug)]
pub struct Image {
    /// Contents of the flash from the start of [`FLASH`] on; erased bytes (0xFF) between segments,
    /// nothing after the last segment.
    pub flash: Vec<u8>,
    /// Number of bytes in flash that segments fill.
    pub size: u32,
    /// Initial stack pointer, word 0 of the vector table.
    pub initial_sp: u32,
    /// Address of the first instruction, without the Thumb bit.
    pub reset: u32,
    /// Names of functions and variables; empty if the file was stripped.
    pub symbols: Symbols,
    path: PathBuf,
    has_defmt: bool,
}

impl Image {
    /// Reads and checks the file at `path`.
    pub fn open(path: &Path) -> Result<Self, ImageError> {
        let bytes = input::read(path, input::LONGEST_DOCUMENT);
        let bytes = bytes.map_err(|why| ImageError::Unreadable(path.to_owned(), why))?;
        Self::parse(path, &bytes)
    }

    /// Reads an image from `bytes`, the contents of an ELF file, and checks it. Errors call the
    /// file `path`.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, ImageError> {
        check_machine(path, bytes)?;
        let not_elf = |why: object::Error| ImageError::NotElf(path.to_owned(), why.to_string());
        let elf = ElfFile32::<Endianness>::parse(bytes).map_err(not_elf)?;
        check_state(path, elf.elf_header())?;
        let (flash, size) = load(path, &elf, bytes)?;
        let (initial_sp, reset) = start(path, &flash)?;
        Ok(Self {
            flash,
            size,
            initial_sp,
            reset,
            symbols: Symbols::read(&elf),
            path: path.to_owned(),
            has_defmt: elf
                .section_by_name(".defmt")
                .is_some_and(|table| table.size() > 0),
        })
    }

    /// Returns the path of the file from which the image was read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Checks that the image has the defmt table that decoding its logs needs.
    ///
    /// # Errors
    /// Returns [`ImageError::NoDefmtTable`] if it has none.
    pub fn require_defmt(&self) -> Result<(), ImageError> {
        if self.has_defmt {
            return Ok(());
        }
        Err(ImageError::NoDefmtTable(self.path.clone()))
    }
}

/// Checks the ELF identification and header before anything depends on them: class, byte order,
/// machine, ABI, type.
fn check_machine(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let wrong = |why: String| Err(ImageError::WrongArchitecture(path.to_owned(), why));
    let Some((ident, [_, _, machine @ ..])) = bytes.split_first_chunk::<16>() else {
        return not_elf(path, format!("it has only {} bytes", bytes.len()));
    };
    if !ident.starts_with(b"\x7fELF") {
        return not_elf(path, "it does not begin with the ELF magic number".into());
    }
    if ident[4] != ELFCLASS32.0 {
        return wrong("it is a 64-bit file".into());
    }
    if ident[5] != ELFDATA2LSB.0 {
        return wrong("it is big-endian".into());
    }
    match machine.first_chunk().copied().map(u16::from_le_bytes) {
        Some(machine) if machine == EM_ARM.0 => Ok(()),
        Some(other) => wrong(format!("its machine number is {other}, not {}", EM_ARM.0)),
        None => not_elf(path, "its header is incomplete".into()),
    }
}

/// Checks that the ABI is Arm EABI version 5 and that the image starts in Thumb state.
fn check_state(path: &Path, header: &FileHeader32<Endianness>) -> Result<(), ImageError> {
    let (flags, entry) = (
        header.e_flags(Endianness::Little),
        header.e_entry(Endianness::Little),
    );
    let why = if flags.arm_eabi() != EF_ARM_EABI_VER5 {
        format!(
            "its ELF flags {:#010x} are not those of the Arm EABI, version 5",
            flags.0
        )
    } else if entry.is_multiple_of(2) {
        format!("its entry point {entry:#010x} is even, so it is ARM code and not Thumb code")
    } else {
        return Ok(());
    };
    Err(ImageError::WrongArchitecture(path.to_owned(), why))
}

fn not_elf<T>(path: &Path, why: String) -> Result<T, ImageError> {
    Err(ImageError::NotElf(path.to_owned(), why))
}

/// Returns the contents of flash, and the number of bytes in it that the segments fill.
fn load(
    path: &Path,
    elf: &ElfFile32<'_, Endianness>,
    bytes: &[u8],
) -> Result<(Vec<u8>, u32), ImageError> {
    let (mut flash, mut size) = (Vec::new(), 0u32);
    let endian = elf.endian();
    for segment in elf.elf_program_headers() {
        if segment.p_type(endian) != PT_LOAD || segment.p_filesz(endian) == 0 {
            continue;
        }
        let Ok(data) = segment.data(endian, bytes) else {
            return not_elf(path, "a segment lies beyond the end of the file".into());
        };
        let at = segment.p_paddr(endian);
        // The length fits because the bytes are within the file; the end fits in u64.
        let end = u64::from(at) + data.len() as u64;
        if at < FLASH.start || end > u64::from(FLASH.end) {
            return Err(ImageError::OutsideFlash(
                path.to_owned(),
                format!("a segment of {} bytes lies at {at:#010x}", data.len()),
            ));
        }
        let from = (at - FLASH.start) as usize;
        let to = from + data.len();
        if flash.len() < to {
            flash.resize(to, 0xFF);
        }
        flash[from..to].copy_from_slice(data);
        // There are at most 2^16 segments of at most 1 MiB.
        size = size.saturating_add(data.len() as u32);
    }
    if flash.is_empty() {
        return Err(ImageError::OutsideFlash(
            path.to_owned(),
            "it contains no data to load".into(),
        ));
    }
    Ok((flash, size))
}

/// Returns the initial stack pointer and the address of the first instruction (Arm ARM B1.5.5).
fn start(path: &Path, flash: &[u8]) -> Result<(u32, u32), ImageError> {
    let none = |why: String| Err(ImageError::NoVectorTable(path.to_owned(), why));
    let word = |n: usize| -> Option<u32> {
        let bytes = flash.get(4 * n..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes))
    };
    let (Some(sp), Some(reset), Some(_)) = (word(0), word(1), word(CORE_VECTORS as usize - 1))
    else {
        return none(format!(
            "it has only {} bytes, but {} are needed",
            flash.len(),
            4 * CORE_VECTORS
        ));
    };
    let in_ram = STACKS.iter().any(|s| s.start < sp && sp <= s.end);
    if !in_ram || !sp.is_multiple_of(4) {
        return none(format!(
            "its first word {sp:#010x} is not a valid initial stack pointer, because it is not in RAM \
             or not a multiple of 4"
        ));
    }
    if reset.is_multiple_of(2) {
        return none(format!(
            "its reset vector {reset:#010x} is even, so it is not Thumb code"
        ));
    }
    let reset = reset & !1;
    let code = flash.get((reset.wrapping_sub(FLASH.start)) as usize..);
    if code.is_none_or(|code| code.len() < 2) {
        return none(format!(
            "its reset vector {reset:#010x} is not in the image's flash"
        ));
    }
    Ok((sp, reset))
}
