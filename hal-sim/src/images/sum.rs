//! The sum over an image, which the linker leaves room for behind all that is loaded
//! (`.image_sum`, memory.x) and the device compares at each boot. `cargo program` and the
//! simulators both have it written here, so that the image that is tested is the one that
//! is flashed.

use crate::chip::image::{FLASH, Image, ImageError};
use crc::{CRC_32_MPEG_2, Crc};
use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSection};
use std::fs::OpenOptions;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use thiserror::Error;

/// As the chip's CRC unit computes it from words (RM0090 section 4): most significant bit
/// first, neither reflected nor inverted.
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_MPEG_2);
const SECTION: &str = ".image_sum";

/// Why an image has no sum.
#[derive(Debug, Error)]
pub enum SumError {
    /// It cannot be read, or is no image.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// It cannot be written: the system's words.
    #[error("its sum cannot be written: {0}")]
    Unwritable(#[from] io::Error),
    /// Something is loaded behind the sum, or it is no word.
    #[error("its section {SECTION} is not the last word that is loaded: see memory.x")]
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
    let image = Image::parse(path, &bytes)?;
    let Some((address, from)) = place(&bytes)? else {
        return Ok(());
    };
    let below = address.checked_sub(FLASH.start).map(|n| n as usize);
    let (below, rest) = below
        .and_then(|below| image.flash.split_at_checked(below))
        .ok_or(SumError::NotLast)?;
    if rest.len() != size_of::<u32>() || !below.len().is_multiple_of(size_of::<u32>()) {
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

/// Address of the sum, and where it is in the file.
fn place(bytes: &[u8]) -> Result<Option<(u32, u64)>, SumError> {
    // `Image` has read it.
    let elf = ElfFile32::<Endianness>::parse(bytes).map_err(|_| SumError::NotLast)?;
    let Some(section) = elf.section_by_name(SECTION) else {
        return Ok(None);
    };
    if section.size() == 0 {
        return Ok(None);
    }
    let (from, _) = section.file_range().ok_or(SumError::NotLast)?;
    Ok(Some((section.address() as u32, from))) // ELF32
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
