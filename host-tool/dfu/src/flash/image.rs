//! Firmware image that has been checked against the chip, and the sectors it needs.

use crate::chip::{Chip, Sector, word};
use crate::container::Segment;
use thiserror::Error;

/// Shortest image in bytes: the 16 vectors of the Cortex-M4 itself.
pub const MIN_LENGTH: usize = 64;

/// Firmware image for one chip: contiguous from the start of flash, a multiple of four bytes long
/// and with a plausible vector table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    chip: Chip,
    bytes: Vec<u8>,
}

/// Image that does not fit the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ImageError {
    /// The image has no bytes.
    #[error("the image is empty; build the firmware and pass its .bin, .hex or .dfu file")]
    Empty,
    /// The image is too short to hold the vectors.
    #[error("the image has {length} bytes; the vector table alone has {MIN_LENGTH}")]
    TooShort {
        /// Length in bytes.
        length: usize,
    },
    /// The image starts elsewhere.
    #[error(
        "the image starts at 0x{found:08X}, but the flash of the {chip} starts at \
         0x{expected:08X}; link the firmware for that address"
    )]
    Origin {
        /// Name of the chip.
        chip: &'static str,
        /// First address of the image.
        found: u32,
        /// First address of flash.
        expected: u32,
    },
    /// The image leaves the flash for firmware.
    #[error(
        "the image ends at 0x{last:08X}, {excess} bytes behind the flash for firmware, which \
         ends at 0x{limit:08X}; the sectors behind it hold the board's stage table"
    )]
    TooLarge {
        /// Last address of the image.
        last: u64,
        /// Last address that firmware may use.
        limit: u32,
        /// Number of bytes behind the limit.
        excess: u64,
    },
    /// Two segments of the file set the same address.
    #[error("the file sets the byte at 0x{address:08X} twice; build the firmware again")]
    Overlap {
        /// Address that is set twice.
        address: u32,
    },
    /// The first word does not lie in RAM.
    #[error(
        "the initial stack pointer 0x{pointer:08X} is not in the RAM of the {chip}; the file is \
         no firmware image, or one for another chip"
    )]
    StackPointer {
        /// Name of the chip.
        chip: &'static str,
        /// First word of the image.
        pointer: u32,
    },
    /// The second word is even, or lies outside the image.
    #[error(
        "the reset vector 0x{vector:08X} is not an odd address inside the image; the file is no \
         firmware image, or one for another chip"
    )]
    ResetVector {
        /// Second word of the image.
        vector: u32,
    },
}

impl Image {
    /// Joins `segments` to one image for `chip`. Gaps and the end are filled with 0xFF, the value
    /// of erased flash.
    ///
    /// # Errors
    /// See [`ImageError`].
    pub fn new(chip: &Chip, segments: &[Segment]) -> Result<Self, ImageError> {
        let mut sorted: Vec<_> = segments.iter().filter(|s| !s.bytes.is_empty()).collect();
        sorted.sort_by_key(|segment| segment.address);
        let first = sorted.first().ok_or(ImageError::Empty)?;
        if first.address != chip.origin {
            return Err(ImageError::Origin {
                chip: chip.name,
                found: first.address,
                expected: chip.origin,
            });
        }
        let mut bytes = Vec::new();
        for segment in sorted {
            let end = u64::from(segment.address) + segment.bytes.len() as u64;
            let limit = u64::from(chip.firmware_end);
            if end > limit {
                return Err(ImageError::TooLarge {
                    last: end - 1,
                    limit: chip.firmware_end.saturating_sub(1),
                    excess: end - limit,
                });
            }
            let offset = segment.address.saturating_sub(chip.origin) as usize;
            if offset < bytes.len() {
                return Err(ImageError::Overlap {
                    address: segment.address,
                });
            }
            bytes.resize(offset, 0xFF);
            bytes.extend_from_slice(&segment.bytes);
        }
        Self::check(*chip, bytes)
    }

    fn check(chip: Chip, mut bytes: Vec<u8>) -> Result<Self, ImageError> {
        if bytes.len() < MIN_LENGTH {
            return Err(ImageError::TooShort {
                length: bytes.len(),
            });
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0xFF);
        let image = Self { chip, bytes };
        let pointer = word(&image.bytes, 0).unwrap_or_default();
        if !chip.is_stack_pointer(pointer) {
            return Err(ImageError::StackPointer {
                chip: chip.name,
                pointer,
            });
        }
        if !chip.is_vector_table(&image.bytes, &(chip.origin..image.end())) {
            let vector = word(&image.bytes, 4).unwrap_or_default();
            return Err(ImageError::ResetVector { vector });
        }
        Ok(image)
    }

    /// Chip that the image was checked against.
    #[must_use]
    pub const fn chip(&self) -> &Chip {
        &self.chip
    }

    /// Contents from the start of flash.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Address behind the last byte.
    #[must_use]
    pub fn end(&self) -> u32 {
        let length = u32::try_from(self.bytes.len()).unwrap_or(u32::MAX);
        self.chip.origin.saturating_add(length)
    }

    /// Sectors that the image occupies, in address order. Only these are erased and written.
    #[must_use]
    pub fn sectors(&self) -> Vec<Sector> {
        let end = self.end();
        let used = self.chip.sectors();
        used.take_while(|sector| sector.address < end).collect()
    }

    /// Part of the image in `sector`; empty for a sector that the image does not occupy.
    #[must_use]
    pub fn part(&self, sector: &Sector) -> &[u8] {
        let offset = |address: u32| {
            let offset = address.saturating_sub(self.chip.origin) as usize;
            offset.min(self.bytes.len())
        };
        let part = offset(sector.address)..offset(sector.end());
        self.bytes.get(part).unwrap_or_default()
    }

    /// Address of eight bytes behind the image that stay erased in its last sector; `None` if the
    /// image fills that sector.
    #[must_use]
    pub fn blank_address(&self) -> Option<u32> {
        let last = self.sectors().into_iter().last()?;
        let address = last.end().checked_sub(8)?;
        (address >= self.end()).then_some(address)
    }
}
