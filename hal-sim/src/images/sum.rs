//! Checksum of an image.
//!
//! The linker reserves a word for it behind everything that is loaded (`.image_sum`, memory.x), and
//! the device verifies it at each boot. `cargo program` and the simulators both write it here, so
//! that the tested image is the flashed one.

use crc::{CRC_32_MPEG_2, Crc};
use firmware::board::image::{COMMIT_AT, MAGIC, OFFSET};
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSection};
use std::fs::OpenOptions;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use thiserror::Error;

/// CRC as the chip's CRC unit computes it from words (RM0090 section 4): most significant bit
/// first, neither reflected nor inverted.
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_MPEG_2);
/// Start address of the chip's flash (RM0090 table 5).
const FLASH: u32 = 0x0800_0000;
/// Size of the chip's flash, bytes (RM0090 table 5).
const FLASH_BYTES: u32 = 1 << 20;
const SECTION: &str = ".image_sum";

/// Reason why a checksum could not be written.
#[derive(Debug, Error)]
pub enum SumError {
    /// The file cannot be read or written; holds the system's error.
    #[error("its checksum cannot be written")]
    Unwritable(#[from] io::Error),
    /// The file is not an ELF file, or is damaged.
    #[error("it is not a readable ELF file")]
    NotElf(#[from] object::Error),
    /// Data is loaded behind the checksum, or its section is not one word.
    #[error("its section {SECTION} must be the last word that is loaded into flash; see memory.x")]
    NotLast,
    /// The image has no record behind its vectors.
    #[error("it has no Flexor image record behind its vectors")]
    NoRecord,
}

/// Computes the checksum of `flash`, the content of flash below the checksum.
#[must_use]
pub fn sum(flash: &[u8]) -> u32 {
    let (words, _) = flash.as_chunks();
    let mut digest = CRC.digest();
    for word in words {
        digest.update(&u32::from_le_bytes(*word).to_be_bytes());
    }
    digest.finalize()
}

/// Writes the checksum into the file at `path`, if the file has a section for it. Repeating the
/// call changes nothing.
///
/// # Errors
/// Returns [`SumError`] if the file cannot be read, parsed or written.
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

/// Writes the first eight bytes of a commit's hash into the image's record
/// ([`firmware::board::image::COMMIT_AT`]), and renews the checksum. Repeating the call changes
/// nothing.
///
/// # Errors
/// Returns [`SumError`] if the file cannot be read, parsed or written, or has no record.
pub fn write_commit(path: &Path, commit: [u8; 8]) -> Result<(), SumError> {
    let bytes = std::fs::read(path)?;
    let elf = ElfFile32::<Endianness>::parse(&*bytes)?;
    let record = u64::from(FLASH) + OFFSET as u64;
    let mut places = elf.elf_program_headers().iter().filter_map(|segment| {
        let endian = elf.endian();
        let start = u64::from(segment.p_paddr(endian));
        let within = record.checked_sub(start)?;
        let is_inside = within < u64::from(segment.p_filesz(endian));
        is_inside.then(|| u64::from(segment.p_offset(endian)) + within)
    });
    let place = places.next().ok_or(SumError::NoRecord)?;
    let found = usize::try_from(place)
        .ok()
        .and_then(|from| bytes.get(from..));
    if !found.is_some_and(|found| found.starts_with(&MAGIC)) {
        return Err(SumError::NoRecord);
    }
    let mut file = OpenOptions::new().write(true).open(path)?;
    file.seek(SeekFrom::Start(place + COMMIT_AT as u64))?;
    file.write_all(&commit)?;
    drop(file);
    write_sum(path)
}

/// Returns the content of flash, from its start, after `elf` is flashed; gaps between segments are
/// erased (0xFF).
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

    /// RM0090 has no example. The expected value is that of CRC-32/MPEG-2; the test of
    /// `chip::soc::crc` covers the unit's register.
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
        let mut image = flash.clone();
        image.extend(sum(&flash).to_le_bytes());
        assert_eq!(sum(&image), 0);
        image[17] ^= 1;
        assert_ne!(sum(&image), 0);
    }
}
