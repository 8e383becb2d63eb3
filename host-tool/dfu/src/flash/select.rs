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
    fn has_serial(&self, wanted: &str) -> bool {
        let serial = self.serial.as_deref();
        serial.is_some_and(|serial| serial.eq_ignore_ascii_case(wanted))
    }

    /// Returns serial number and place as messages name them.
    #[must_use]
    pub fn label(&self) -> String {
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
    let matches = |device: &&DeviceSummary| serial.is_none_or(|wanted| device.has_serial(wanted));
    let mut found = devices.iter().filter(matches);
    match (found.next(), found.next(), serial) {
        (Some(device), None, _) => Ok(device),
        (Some(_), Some(_), _) => Err(FlashError::SeveralDevices {
            devices: labels(devices),
        }),
        (None, _, Some(serial)) if !devices.is_empty() => Err(FlashError::UnknownSerial {
            serial: printable(serial),
            devices: labels(devices),
        }),
        (None, ..) => Err(FlashError::NoDevice),
    }
}

fn labels<'a>(devices: impl IntoIterator<Item = &'a DeviceSummary>) -> String {
    let labels: Vec<_> = devices.into_iter().map(DeviceSummary::label).collect();
    labels.join("; ")
}

/// Boot loader that a board is expected to start, and the boot loaders that are none of its.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Expected {
    before: Vec<DeviceSummary>,
    /// Serial numbers of which the boot loader has one.
    serials: Vec<String>,
    /// Whether the user named the serial number.
    is_named: bool,
}

impl Expected {
    /// Prepares to recognise the boot loader of the chip with `unique_id` (RM0090 section 39.1,
    /// words from the lowest address) among others. `before` lists the boot loaders that are
    /// connected while the board still runs its firmware. `serial` replaces the serial number that
    /// the boot loader probably has.
    ///
    /// # Errors
    /// [`FlashError::AlreadyConnected`] if a boot loader is connected and no serial number is given,
    /// or one that has this serial number.
    pub fn new(
        unique_id: [u32; 3],
        before: Vec<DeviceSummary>,
        serial: Option<&str>,
    ) -> Result<Self, FlashError> {
        let derived = boot_loader_serials(unique_id);
        let is_there = |serial| before.iter().any(|device| device.has_serial(serial));
        let is_ambiguous = serial.map_or(!before.is_empty(), is_there);
        if is_ambiguous {
            let [expected, _] = derived;
            return Err(FlashError::AlreadyConnected {
                devices: labels(&before),
                expected,
            });
        }
        let named = serial.map(|serial| vec![serial.to_owned()]);
        Ok(Self {
            before,
            is_named: named.is_some(),
            serials: named.unwrap_or_else(|| derived.to_vec()),
        })
    }

    /// Takes the boot loader that appeared among `now`. One whose serial number the operating system
    /// could not read is taken if it is the only new one.
    ///
    /// # Errors
    /// [`FlashError::NoDevice`] if none is new, [`FlashError::UnknownSerial`] if the new ones have
    /// other serial numbers, [`FlashError::SeveralDevices`].
    pub fn select<'a>(&self, now: &'a [DeviceSummary]) -> Result<&'a DeviceSummary, FlashError> {
        let was_there = |device: &DeviceSummary| {
            let serial = device.serial.as_deref();
            let before = &self.before;
            before.contains(device)
                || serial.is_some_and(|serial| before.iter().any(|old| old.has_serial(serial)))
        };
        let new: Vec<_> = now.iter().filter(|device| !was_there(device)).collect();
        let is_expected =
            |device: &&DeviceSummary| self.serials.iter().any(|serial| device.has_serial(serial));
        let expected: Vec<_> = new.iter().copied().filter(is_expected).collect();
        let devices = || labels(new.iter().copied());
        match (expected.as_slice(), new.as_slice()) {
            (&[device], _) => Ok(device),
            ([], []) => Err(FlashError::NoDevice),
            ([], &[device]) if device.serial.is_none() && !self.is_named => Ok(device),
            ([], new) if self.is_named || new.iter().all(|device| device.serial.is_some()) => {
                Err(FlashError::UnknownSerial {
                    serial: printable(&self.serials.join(" or ")),
                    devices: devices(),
                })
            }
            _ => Err(FlashError::SeveralDevices { devices: devices() }),
        }
    }
}

/// Serial numbers that ST's boot loaders derive from a chip's unique ID: 8 hexadecimal digits of the
/// sum of its first and third word, 4 of the upper half of its second word. People read the first
/// form on F4 chips, the second one, with 10 added to the lowest byte of the sum, on an F412 and an
/// F76x (community.st.com). ST documents neither.
fn boot_loader_serials([first, second, third]: [u32; 3]) -> [String; 2] {
    let sum = first.wrapping_add(third);
    let [low, rest @ ..] = sum.to_le_bytes();
    let [a, b, c] = rest;
    let newer = u32::from_le_bytes([low.wrapping_add(10), a, b, c]);
    [sum, newer].map(|sum| format!("{sum:08X}{:04X}", second >> 16))
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
