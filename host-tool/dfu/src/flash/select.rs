//! Choice of the device and of its alternate setting.

use super::FlashError;
use crate::chip::Chip;
use crate::protocol::{DFUSE_VERSION, FunctionalDescriptor, Layout};

/// Device in DFU mode, as the operating system lists it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceSummary {
    /// Serial number; ST's ROM derives it from the chip's unique ID. `None` if the operating
    /// system could not read it.
    pub serial: Option<String>,
    /// Bus, as the operating system names it.
    pub bus: String,
    /// Address on the bus.
    pub address: u8,
}

impl DeviceSummary {
    fn label(&self) -> String {
        let serial = self.serial.as_deref().map_or("unknown".into(), printable);
        let bus = printable(&self.bus);
        format!("serial {serial} at bus {bus} address {}", self.address)
    }
}

/// Alternate setting of the DFU interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlternateSetting {
    /// Number for SET_INTERFACE.
    pub number: u8,
    /// Name, which describes the memory.
    pub name: String,
}

/// Takes the device with `serial`, or the only device if no serial number is given. The
/// comparison ignores case.
///
/// # Errors
/// [`FlashError::NoDevice`], [`FlashError::UnknownSerial`], [`FlashError::SeveralDevices`].
pub fn select_device<'a>(
    devices: &'a [DeviceSummary],
    serial: Option<&str>,
) -> Result<&'a DeviceSummary, FlashError> {
    let list = || {
        let labels: Vec<_> = devices.iter().map(DeviceSummary::label).collect();
        labels.join("; ")
    };
    let matches = |device: &&DeviceSummary| {
        serial.is_none_or(|wanted| {
            let found = device.serial.as_deref();
            found.is_some_and(|found| found.eq_ignore_ascii_case(wanted))
        })
    };
    let mut found = devices.iter().filter(matches);
    match (found.next(), found.next(), serial) {
        (Some(device), None, _) => Ok(device),
        (Some(_), Some(_), _) => Err(FlashError::SeveralDevices { devices: list() }),
        (None, _, Some(serial)) if !devices.is_empty() => Err(FlashError::UnknownSerial {
            serial: printable(serial),
            devices: list(),
        }),
        (None, ..) => Err(FlashError::NoDevice),
    }
}

/// Takes the alternate setting that describes exactly the flash of `chip`, by its layout and not
/// by its number.
///
/// # Errors
/// [`FlashError::OtherChip`] with the layouts that were found.
pub fn select_setting<'a>(
    chip: &Chip,
    settings: &'a [AlternateSetting],
) -> Result<&'a AlternateSetting, FlashError> {
    let is_flash = |setting: &&AlternateSetting| {
        Layout::parse(&setting.name).is_ok_and(|layout| layout.is_flash_of(chip))
    };
    settings.iter().find(is_flash).ok_or_else(|| {
        let names = settings.iter().take(8);
        let names: Vec<_> = names.map(|setting| printable(&setting.name)).collect();
        FlashError::OtherChip {
            chip: chip.name,
            found: names.join("; "),
        }
    })
}

/// Checks that the device speaks DfuSe in both directions and has a usable transfer size.
/// Returns that size in bytes.
///
/// # Errors
/// [`FlashError::Unsupported`].
pub fn check_descriptor(descriptor: &FunctionalDescriptor) -> Result<u16, FlashError> {
    let reason = if descriptor.version != DFUSE_VERSION {
        format!("DFU version 0x{:04X}", descriptor.version)
    } else if !descriptor.can_download {
        "no downloads".into()
    } else if !descriptor.can_upload {
        "no uploads, which verification needs".into()
    } else if !(64..=4096).contains(&descriptor.transfer_size)
        || !descriptor.transfer_size.is_multiple_of(64)
    {
        let size = descriptor.transfer_size;
        format!("transfers of {size} bytes instead of a multiple of 64 from 64 to 4096")
    } else {
        return Ok(descriptor.transfer_size);
    };
    Err(FlashError::Unsupported { reason })
}

/// Text from a device, limited to 80 printable ASCII characters for messages.
fn printable(text: &str) -> String {
    let keep = |c: char| {
        if c == ' ' || c.is_ascii_graphic() {
            c
        } else {
            '?'
        }
    };
    text.chars().take(80).map(keep).collect()
}
