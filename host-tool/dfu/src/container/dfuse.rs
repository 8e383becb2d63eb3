//! DfuSe file (ST UM0391): prefix, one image with elements, DFU 1.1 suffix. Little-endian.

use super::{ContainerError, MAX_FILE, Segment, check_span};
use crate::ids::{DFUSE_VERSION, PRODUCT_ID, VENDOR_ID};
use crc::{CRC_32_JAMCRC, Crc};

/// Length of the file prefix in bytes.
const PREFIX: usize = 11;
/// Length of the target prefix in bytes.
const TARGET: usize = 274;
/// Length of the target's name in bytes, zero-padded.
const NAME: usize = 255;
/// Length of the suffix in bytes.
const SUFFIX: usize = 16;

/// Identifier that stands for any.
const ANY: u16 = 0xFFFF;

/// USB identifiers in the suffix. 0xFFFF stands for any.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DfuseIds {
    /// Vendor ID.
    pub vendor: u16,
    /// Product ID.
    pub product: u16,
    /// Device version (bcdDevice).
    pub device: u16,
}

impl Default for DfuseIds {
    /// ST's boot loader in any version.
    fn default() -> Self {
        Self {
            vendor: VENDOR_ID,
            product: PRODUCT_ID,
            device: ANY,
        }
    }
}

impl DfuseIds {
    /// Checks that the identifiers are those of ST's boot loader, or stand for any device.
    ///
    /// # Errors
    /// [`ContainerError::OtherDevice`]
    pub fn check_boot_loader(self) -> Result<(), ContainerError> {
        let Self {
            vendor, product, ..
        } = self;
        if [VENDOR_ID, ANY].contains(&vendor) && [PRODUCT_ID, ANY].contains(&product) {
            return Ok(());
        }
        Err(ContainerError::OtherDevice { vendor, product })
    }
}

/// Contents of a DfuSe file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DfuseFile {
    /// Identifiers in the suffix.
    pub ids: DfuseIds,
    /// Name of the first target; empty if it has none.
    pub name: String,
    /// Elements for alternate setting 0, the internal flash, in the order of the file.
    pub segments: Vec<Segment>,
}

/// Checksum of the DFU suffix: CRC-32, reflected, initial value 0xFFFFFFFF, without final
/// inversion (DFU 1.1 appendix B; catalogued as CRC-32/JAMCRC).
#[must_use]
pub fn dfu_crc(bytes: &[u8]) -> u32 {
    Crc::<u32>::new(&CRC_32_JAMCRC).checksum(bytes)
}

/// Writes a DfuSe file with one target for alternate setting 0. `name` is cut to 254 bytes.
///
/// # Errors
/// [`ContainerError::AddressSpace`], or [`ContainerError::TooLarge`] if the file would exceed
/// [`MAX_FILE`].
pub fn write_dfuse(
    segments: &[Segment],
    name: &str,
    ids: DfuseIds,
) -> Result<Vec<u8>, ContainerError> {
    let elements = segments.iter().map(|s| s.bytes.len().saturating_add(8));
    let size = elements.fold(0, usize::saturating_add);
    let total = size.saturating_add(PREFIX + TARGET + SUFFIX);
    if total > MAX_FILE {
        return Err(ContainerError::TooLarge { length: total });
    }
    // All lengths are below MAX_FILE and fit 32 bits.
    let field = |length: usize| u32::try_from(length).unwrap_or_default().to_le_bytes();
    let mut file = Vec::with_capacity(total);
    file.extend_from_slice(b"DfuSe\x01");
    file.extend_from_slice(&field(total - SUFFIX)); // DFUImageSize is without the suffix
    file.push(1);
    file.extend_from_slice(b"Target\x00");
    file.extend_from_slice(&field(1));
    let mut padded: Vec<u8> = name.bytes().take(NAME - 1).collect();
    padded.resize(NAME, 0);
    file.extend_from_slice(&padded);
    file.extend_from_slice(&field(size));
    file.extend_from_slice(&field(segments.len()));
    for segment in segments {
        check_span(segment)?;
        file.extend_from_slice(&segment.address.to_le_bytes());
        file.extend_from_slice(&field(segment.bytes.len()));
        file.extend_from_slice(&segment.bytes);
    }
    for id in [ids.device, ids.product, ids.vendor, DFUSE_VERSION] {
        file.extend_from_slice(&id.to_le_bytes());
    }
    file.extend_from_slice(b"UFD\x10");
    file.extend_from_slice(&dfu_crc(&file).to_le_bytes());
    Ok(file)
}

/// Reads a DfuSe file. Targets for other alternate settings than 0 are skipped.
///
/// # Errors
/// See [`ContainerError`]. No input panics.
pub fn read_dfuse(file: &[u8]) -> Result<DfuseFile, ContainerError> {
    if file.len() > MAX_FILE {
        return Err(ContainerError::TooLarge { length: file.len() });
    }
    let body = file.len().checked_sub(SUFFIX);
    let (body, suffix) =
        body.and_then(|body| file.split_at_checked(body))
            .ok_or(ContainerError::Truncated {
                field: "suffix",
                offset: 0,
            })?;
    let ids = read_suffix(file, body.len(), suffix)?;
    let mut reader = Reader {
        bytes: body,
        offset: 0,
    };
    reader.expect("signature", b"DfuSe\x01")?;
    // UM0391: the length without the suffix. Some programs include the suffix.
    let size = reader.word("file size")? as usize;
    if size != file.len() && size != body.len() {
        return Err(ContainerError::Field {
            field: "file size",
            offset: 6,
        });
    }
    let targets = reader.byte("number of targets")?;
    let mut name = String::new();
    let mut segments = Vec::new();
    for index in 0..targets {
        let target = read_target(&mut reader)?;
        if index == 0 {
            name = target.name;
        }
        if target.setting == 0 {
            segments.extend(target.segments);
        }
    }
    if reader.offset != body.len() {
        return Err(ContainerError::Field {
            field: "trailing data",
            offset: reader.offset,
        });
    }
    Ok(DfuseFile {
        ids,
        name,
        segments,
    })
}

fn read_suffix(file: &[u8], offset: usize, suffix: &[u8]) -> Result<DfuseIds, ContainerError> {
    let mut reader = Reader {
        bytes: suffix,
        offset: 0,
    };
    let device = reader.half("device version")?;
    let product = reader.half("product ID")?;
    let vendor = reader.half("vendor ID")?;
    let version = reader.half("DFU version")?;
    let signature = reader.take("suffix signature", 3)?;
    let length = reader.byte("suffix length")?;
    let found = reader.word("checksum")?;
    let invalid = |field, at: usize| ContainerError::Field {
        field,
        offset: offset + at,
    };
    if signature != b"UFD" {
        return Err(invalid("suffix signature", 8));
    }
    if usize::from(length) != SUFFIX {
        return Err(invalid("suffix length", 11));
    }
    let expected = dfu_crc(file.get(..offset + 12).unwrap_or_default());
    if found != expected {
        return Err(ContainerError::Checksum { expected, found });
    }
    if version != DFUSE_VERSION {
        return Err(invalid("DFU version", 6));
    }
    Ok(DfuseIds {
        vendor,
        product,
        device,
    })
}

struct Target {
    setting: u8,
    name: String,
    segments: Vec<Segment>,
}

fn read_target(reader: &mut Reader<'_>) -> Result<Target, ContainerError> {
    reader.expect("target signature", b"Target")?;
    let setting = reader.byte("alternate setting")?;
    let named = reader.word("name flag")? != 0;
    let name = reader.take("target name", NAME)?;
    let name = name.split(|&byte| byte == 0).next().unwrap_or_default();
    let name = if named {
        String::from_utf8_lossy(name).into_owned()
    } else {
        String::new()
    };
    let size = reader.word("target size")?;
    let count = reader.word("number of elements")?;
    let start = reader.offset;
    let mut segments = Vec::new();
    // Each element takes at least eight bytes, so that a wrong count ends with the file.
    for _ in 0..count {
        let address = reader.word("element address")?;
        let length = reader.word("element size")?;
        let bytes = reader.take("element", length as usize)?.to_vec();
        let segment = Segment { address, bytes };
        check_span(&segment)?;
        segments.push(segment);
    }
    if reader.offset - start != size as usize {
        return Err(ContainerError::Field {
            field: "target size",
            offset: start.saturating_sub(8),
        });
    }
    Ok(Target {
        setting,
        name,
        segments,
    })
}

/// Reads fields from the front of `bytes`.
struct Reader<'a> {
    bytes: &'a [u8],
    offset: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, field: &'static str, length: usize) -> Result<&'a [u8], ContainerError> {
        let end = self.offset.checked_add(length);
        let taken = end.and_then(|end| self.bytes.get(self.offset..end));
        let taken = taken.ok_or(ContainerError::Truncated {
            field,
            offset: self.offset,
        })?;
        self.offset += length;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, field: &'static str) -> Result<[u8; N], ContainerError> {
        let offset = self.offset;
        let bytes = self.take(field, N)?;
        bytes
            .try_into()
            .map_err(|_| ContainerError::Truncated { field, offset })
    }

    fn byte(&mut self, field: &'static str) -> Result<u8, ContainerError> {
        self.array(field).map(u8::from_le_bytes)
    }

    fn half(&mut self, field: &'static str) -> Result<u16, ContainerError> {
        self.array(field).map(u16::from_le_bytes)
    }

    fn word(&mut self, field: &'static str) -> Result<u32, ContainerError> {
        self.array(field).map(u32::from_le_bytes)
    }

    fn expect(&mut self, field: &'static str, value: &[u8]) -> Result<(), ContainerError> {
        let offset = self.offset;
        if self.take(field, value.len())? == value {
            Ok(())
        } else {
            Err(ContainerError::Field { field, offset })
        }
    }
}
