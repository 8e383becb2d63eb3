//! Firmware files: DfuSe (`.dfu`), Intel HEX (`.hex`) and raw binary (`.bin`).
//!
//! Comes in: bytes of a file or [`Segment`]s. Goes out: the other of the two. Nothing here knows a
//! chip; [`crate::flash::Image`] checks the segments against one.

mod dfuse;
mod hex;

pub use dfuse::{DfuseFile, DfuseIds, dfu_crc, read_dfuse, write_dfuse};
pub use hex::{read_hex, write_hex};

use thiserror::Error;

/// Largest accepted file in bytes, several times the largest image in any format.
pub const MAX_FILE: usize = 16 << 20;

/// Bytes at an address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Address of the first byte.
    pub address: u32,
    /// Contents.
    pub bytes: Vec<u8>,
}

/// File that cannot be read or written.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ContainerError {
    /// The file is too large.
    #[error("the file has {length} bytes; the largest accepted file has {MAX_FILE}")]
    TooLarge {
        /// Length in bytes.
        length: usize,
    },
    /// The file is an ELF executable.
    #[error(
        "the file is an ELF executable; convert it with 'objcopy -O ihex' and pass the .hex file"
    )]
    Elf,
    /// A `.dfu` file is shorter than its fields say.
    #[error("the .dfu file ends inside the {field} at byte {offset}; copy or build it again")]
    Truncated {
        /// Field that is cut off.
        field: &'static str,
        /// Offset of the field in bytes.
        offset: usize,
    },
    /// A field of a `.dfu` file has a wrong value.
    #[error("the .dfu file has an invalid {field} at byte {offset}")]
    Field {
        /// Name of the field.
        field: &'static str,
        /// Offset of the field in bytes.
        offset: usize,
    },
    /// The checksum of a `.dfu` file is wrong.
    #[error(
        "the .dfu file's checksum is 0x{found:08X} instead of 0x{expected:08X}; copy or build it \
         again"
    )]
    Checksum {
        /// Checksum of the contents.
        expected: u32,
        /// Checksum in the file.
        found: u32,
    },
    /// A `.dfu` file is for another USB device.
    #[error(
        "the .dfu file is for the USB device {vendor:04x}:{product:04x}, not for ST's boot loader \
         0483:df11"
    )]
    OtherDevice {
        /// Vendor ID in the suffix.
        vendor: u16,
        /// Product ID in the suffix.
        product: u16,
    },
    /// A line of an Intel HEX file cannot be read.
    #[error("line {line} of the Intel HEX file is invalid: {reason}")]
    HexLine {
        /// Number of the line, from 1.
        line: usize,
        /// Reason why the record is invalid.
        reason: String,
    },
    /// An Intel HEX file has no end record.
    #[error("the Intel HEX file has no end record; copy or build it again")]
    HexEnd,
    /// A segment leaves the 32-bit address space.
    #[error("the bytes from 0x{address:08X} on exceed the 32-bit address space")]
    AddressSpace {
        /// Address of the first byte of the segment.
        address: u32,
    },
}

/// Reads a firmware file in any of the formats, recognised by its first bytes. A file that is
/// neither DfuSe nor Intel HEX nor ELF is a raw binary for address `origin`.
///
/// # Errors
/// See [`ContainerError`].
pub fn read(file: &[u8], origin: u32) -> Result<Vec<Segment>, ContainerError> {
    if file.len() > MAX_FILE {
        return Err(ContainerError::TooLarge { length: file.len() });
    }
    if file.starts_with(b"DfuSe") {
        let file = read_dfuse(file)?;
        file.ids.check_boot_loader()?;
        return Ok(file.segments);
    }
    if file.starts_with(b"\x7FELF") {
        return Err(ContainerError::Elf);
    }
    let text = std::str::from_utf8(file).ok();
    if let Some(text) = text.filter(|text| text.trim_start().starts_with(':')) {
        return read_hex(text);
    }
    Ok(vec![Segment {
        address: origin,
        bytes: file.to_vec(),
    }])
}

/// Checks that every byte of `segment` has a 32-bit address.
fn check_span(segment: &Segment) -> Result<(), ContainerError> {
    let end = u64::from(segment.address) + segment.bytes.len() as u64;
    if end > 1 << 32 {
        return Err(ContainerError::AddressSpace {
            address: segment.address,
        });
    }
    Ok(())
}
