//! The sum over an image, which the linker leaves room for behind all that is loaded
//! (`.image_sum`, memory.x) and the device compares at each boot. `cargo program` and the
//! simulators both have it written here, so that the image that is tested is the one that
//! is flashed.

use crc::{CRC_32_MPEG_2, Crc};
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSection};
use std::fs::OpenOptions;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use thiserror::Error;

/// As the chip's CRC unit computes it from words (RM0090 section 4): most significant bit
/// first, neither reflected nor inverted.
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_MPEG_2);
/// Start and length of the chip's flash (RM0090 table 5).
const FLASH: u32 = 0x0800_0000;
const FLASH_BYTES: u32 = 1 << 20;
const SECTION: &str = ".image_sum";

/// Why an image has no sum.
#[derive(Debug, Error)]
pub enum SumError {
    /// It cannot be read or written: the system's words.
    #[error("its sum cannot be written")]
    Unwritable(#[from] io::Error),
    /// No ELF, or a damaged one.
    #[error("it is not an ELF file that can be read")]
    NotElf(#[from] object::Error),
    /// Something is loaded behind the sum, or it is no word.
    #[error("its section {SECTION} is not the last word that is loaded into flash: see memory.x")]
    NotLast,
}

/// The sum over what flash holds below it.
#[must_use]
pub fn sum(flash: &[u8]) -> u32 {
    let (words, _) = flash.as_chunks();
    let mut digest = CRC.digest();
    for word in words {
        digest.update(&u32::from_le_bytes(*word).to_be_bytes());
    }
    digest.finalize()
}

/// Writes the sum into the file at `path`, if it has room for one. Done again, it changes
/// nothing.
///
/// # Errors
/// [`SumError`].
pub fn write_sum(path: &Path) -> Result<(), SumError> {
    let bytes = std::fs::read(path)?;
    let elf = ElfFile32::<Endianness>::parse(&*bytes)?;
    let Some(section) = elf
        .section_by_name(SECTION)
        .filter(|elf_section| elf_section.size() != 0)
    else {
        return Ok(());
    };
    let flash = loaded(&elf, &bytes)?;
    let below = section.address().checked_sub(FLASH.into());
    let (below, rest) = below
        .and_then(|below| flash.split_at_checked(usize::try_from(below).ok()?))
        .ok_or(SumError::NotLast)?;
    let (from, length) = section.file_range().ok_or(SumError::NotLast)?;
    let is_word = length == 4 && rest.len() == 4 && below.len().is_multiple_of(4);
    if !is_word {
        return Err(SumError::NotLast);
    }
    let sum = sum(below).to_le_bytes();
    if rest != sum {
        let mut file = OpenOptions::new().write(true).open(path)?;
        file.seek(SeekFrom::Start(from))?;
        file.write_all(&sum)?;
    }
    Ok(())
}

/// What flash holds from its start on once `elf` is flashed: erased between segments.
fn loaded(elf: &ElfFile32<'_, Endianness>, bytes: &[u8]) -> Result<Vec<u8>, SumError> {
    let (endian, mut flash) = (elf.endian(), Vec::new());
    for segment in elf.elf_program_headers() {
        if segment.p_type(endian) != PT_LOAD || segment.p_filesz(endian) == 0 {
            continue;
        }
        let data = segment.data(endian, bytes);
        let data = data.map_err(|()| SumError::NotLast)?;
        let from = segment.p_paddr(endian).checked_sub(FLASH);
        let from = from.filter(|from| *from < FLASH_BYTES);
        let from = from.ok_or(SumError::NotLast)? as usize;
        let to = from + data.len();
        if flash.len() < to {
            flash.resize(to, 0xFF);
        }
        if let Some(place) = flash.get_mut(from..to) {
            place.copy_from_slice(data);
        }
    }
    Ok(flash)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RM0090 has no example; the check value is that of CRC-32/MPEG-2, and the unit's own
    /// register over words is `chip::soc::crc`'s test.
    #[test]
    fn a_sum_behind_what_it_sums_leaves_nothing() {
        let flash: Vec<u8> = (0..=251).collect();
        let words: Vec<u8> = b"1234"
            .iter()
            .rev()
            .chain(b"5678".iter().rev())
            .copied()
            .collect();
        let mut digest = CRC.digest();
        digest.update(b"12345678");
        assert_eq!(sum(&words), digest.finalize());
        let mut whole = flash.clone();
        whole.extend(sum(&flash).to_le_bytes());
        assert_eq!(sum(&whole), 0);
        whole[17] ^= 1;
        assert_ne!(sum(&whole), 0);
    }
}
