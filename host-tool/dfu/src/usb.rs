//! Boot loaders on the USB ports of the host, through `nusb` (usbfs on Linux, WinUSB on Windows,
//! IOKit on macOS).
//!
//! Not tried on a device: everything that can be tested without one lives in the other modules.

use crate::chip::Chip;
use crate::flash::{AlternateSetting, DeviceSummary, FlashError, check_descriptor, select_setting};
use crate::protocol::{
    FunctionalDescriptor, HostClock, PRODUCT_ID, Request, Session, Transport, TransportError,
    VENDOR_ID,
};
use nusb::descriptors::language_id::US_ENGLISH;
use nusb::transfer::{ControlIn, ControlOut, ControlType, Recipient, TransferError};
use nusb::{Device, DeviceInfo, ErrorKind, Interface, MaybeFuture};
use std::time::Duration;
use thiserror::Error;

/// udev rule that gives the user at the console access to the boot loader.
pub const UDEV_RULE: &str =
    r#"SUBSYSTEM=="usb", ATTRS{idVendor}=="0483", ATTRS{idProduct}=="df11", TAG+="uaccess""#;

/// DFU interface of ST's ROM.
const INTERFACE: u8 = 0;
/// Limit for reading a descriptor.
const DESCRIPTOR_TIMEOUT: Duration = Duration::from_secs(3);
/// Alternate settings whose names are read; ST's ROM has 4. Bounds the time for a device that does not
/// answer.
const MOST_SETTINGS: usize = 16;
/// Descriptor type of the DFU functional descriptor.
const FUNCTIONAL: u8 = 0x21;

/// Failure to find or open a boot loader.
#[derive(Debug, Error)]
pub enum UsbError {
    /// The operating system could not list the devices.
    #[error("the USB devices cannot be listed: {0}; check that USB works on this computer")]
    List(nusb::Error),
    /// The user may not open the device.
    #[error(
        "no permission to open the boot loader: {cause}. On Linux, write the line\n  \
         {UDEV_RULE}\nto /etc/udev/rules.d/60-flexor.rules, run 'udevadm control --reload' as \
         root and plug the board in again"
    )]
    Permission {
        /// Error of the operating system.
        cause: nusb::Error,
    },
    /// Another program or a kernel driver uses the device.
    #[error("the boot loader is used by another program ({cause}); close it and try again")]
    Busy {
        /// Error of the operating system.
        cause: nusb::Error,
    },
    /// The operating system has no suitable driver for the device.
    #[error(
        "the boot loader cannot be opened: {cause}. On Windows it needs the WinUSB driver: \
         install it for 'STM32 BOOTLOADER' with Zadig (https://zadig.akeo.ie)"
    )]
    Driver {
        /// Error of the operating system.
        cause: nusb::Error,
    },
    /// Opening failed otherwise.
    #[error("the boot loader cannot be opened: {cause}; plug the board in again")]
    Open {
        /// Error of the operating system.
        cause: nusb::Error,
    },
    /// No device fits.
    #[error(transparent)]
    Unsuitable(#[from] FlashError),
}

impl UsbError {
    fn open(cause: nusb::Error) -> Self {
        match cause.kind() {
            ErrorKind::PermissionDenied => Self::Permission { cause },
            ErrorKind::Busy => Self::Busy { cause },
            ErrorKind::Unsupported => Self::Driver { cause },
            ErrorKind::NotFound | ErrorKind::Disconnected => FlashError::NoDevice.into(),
            _ => Self::Open { cause },
        }
    }
}

fn boot_loaders() -> Result<Vec<(DeviceSummary, DeviceInfo)>, UsbError> {
    let devices = nusb::list_devices().wait().map_err(UsbError::List)?;
    let ours =
        |device: &DeviceInfo| device.vendor_id() == VENDOR_ID && device.product_id() == PRODUCT_ID;
    let with_summary = |device: DeviceInfo| {
        let summary = DeviceSummary {
            serial: device.serial_number().map(str::to_owned),
            bus: device.bus_id().to_owned(),
            address: device.device_address(),
        };
        (summary, device)
    };
    Ok(devices.filter(ours).map(with_summary).collect())
}

/// A board that runs its own firmware.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// Serial number: the chip's unique number.
    pub serial: Option<String>,
    /// Version of the firmware: major, minor, patch.
    pub version: [u8; 3],
}

/// Lists the connected devices with these vendor and product ids and this manufacturer. No device
/// is opened.
///
/// # Errors
/// [`UsbError::List`].
pub fn list_boards(ids: (u16, u16), manufacturer: &str) -> Result<Vec<Listed>, UsbError> {
    let devices = nusb::list_devices().wait().map_err(UsbError::List)?;
    let ours = |device: &DeviceInfo| {
        (device.vendor_id(), device.product_id()) == ids
            && device.manufacturer_string() == Some(manufacturer)
    };
    let listed = |device: DeviceInfo| {
        let release = device.device_version(); // bcdDevice
        Listed {
            serial: device.serial_number().map(str::to_owned),
            version: [
                (release >> 8) as u8,
                (release >> 4 & 0xF) as u8,
                (release & 0xF) as u8,
            ],
        }
    };
    Ok(devices.filter(ours).map(listed).collect())
}

/// Lists the connected boot loaders (0483:df11). No device is opened.
///
/// # Errors
/// [`UsbError::List`].
pub fn list() -> Result<Vec<DeviceSummary>, UsbError> {
    let devices = boot_loaders()?.into_iter();
    Ok(devices.map(|(summary, _)| summary).collect())
}

/// Opens the boot loader `chosen` of [`list`], checks that it belongs to `chip` and starts a session
/// that may change only the flash for firmware.
///
/// # Errors
/// See [`UsbError`].
pub fn open(
    chip: &Chip,
    chosen: &DeviceSummary,
) -> Result<Session<UsbTransport, HostClock>, UsbError> {
    let devices = boot_loaders()?;
    let found = devices.iter().find(|(summary, _)| summary == chosen);
    let (_, info) = found.ok_or(FlashError::NoDevice)?;
    let device = info.open().wait().map_err(UsbError::open)?;
    let interface = device
        .detach_and_claim_interface(INTERFACE)
        .wait()
        .map_err(UsbError::open)?;
    let settings = settings(&device, &interface);
    let number = select_setting(chip, &settings)?.number;
    let transfer_size = check_descriptor(&functional_descriptor(&interface)?)?;
    interface
        .set_alt_setting(number)
        .wait()
        .map_err(UsbError::open)?;
    let transport = UsbTransport { interface };
    Ok(Session::new(
        transport,
        HostClock::default(),
        transfer_size,
        chip.firmware(),
    ))
}

/// Alternate settings with the names that the device reports now. A name that cannot be read is
/// empty and fits no chip.
fn settings(device: &Device, interface: &Interface) -> Vec<AlternateSetting> {
    let name = |index| {
        let text = device.get_string_descriptor(index, US_ENGLISH, DESCRIPTOR_TIMEOUT);
        text.wait().unwrap_or_default()
    };
    let descriptors = interface.descriptors();
    descriptors
        .take(MOST_SETTINGS)
        .map(|setting| AlternateSetting {
            number: setting.alternate_setting(),
            name: setting.string_index().map(name).unwrap_or_default(),
        })
        .collect()
}

/// Functional descriptor of the DFU interface; ST's ROM puts it behind the last alternate
/// setting.
fn functional_descriptor(interface: &Interface) -> Result<FunctionalDescriptor, FlashError> {
    interface
        .descriptors()
        .flat_map(|setting| setting.descriptors().collect::<Vec<_>>())
        .filter(|descriptor| descriptor.descriptor_type() == FUNCTIONAL)
        .find_map(|descriptor| FunctionalDescriptor::parse(descriptor.as_bytes()))
        .ok_or_else(|| FlashError::Unsupported {
            reason: "no DFU functional descriptor".into(),
        })
}

/// Control endpoint of an opened boot loader.
pub struct UsbTransport {
    interface: Interface,
}

impl Transport for UsbTransport {
    fn control_in(
        &mut self,
        request: Request,
        value: u16,
        length: u16,
        timeout_ms: u32,
    ) -> Result<Vec<u8>, TransportError> {
        let transfer = ControlIn {
            control_type: ControlType::Class,
            recipient: Recipient::Interface,
            request: request as u8,
            value,
            index: INTERFACE.into(),
            length,
        };
        let result = self.interface.control_in(transfer, timeout(timeout_ms));
        result.wait().map_err(transport_error)
    }

    fn control_out(
        &mut self,
        request: Request,
        value: u16,
        data: &[u8],
        timeout_ms: u32,
    ) -> Result<(), TransportError> {
        let transfer = ControlOut {
            control_type: ControlType::Class,
            recipient: Recipient::Interface,
            request: request as u8,
            value,
            index: INTERFACE.into(),
            data,
        };
        let result = self.interface.control_out(transfer, timeout(timeout_ms));
        result.wait().map_err(transport_error)
    }
}

fn timeout(ms: u32) -> Duration {
    Duration::from_millis(ms.into())
}

fn transport_error(error: TransferError) -> TransportError {
    match error {
        TransferError::Cancelled => TransportError::Timeout,
        TransferError::Stall => TransportError::Stall,
        TransferError::Disconnected => TransportError::Disconnected,
        TransferError::Fault => TransportError::Fault,
        TransferError::InvalidArgument => TransportError::System(0),
        TransferError::Unknown(code) => TransportError::System(code),
    }
}
