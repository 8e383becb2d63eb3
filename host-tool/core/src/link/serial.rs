//! Connects to a board on a serial port.

use super::Error;
use super::stream::{POLL, SplitStream, Stream};
use firmware::link::{USB_IDS, USB_MANUFACTURER};
use std::io::{self, ErrorKind, Write};

/// Port of a board on a serial port.
pub type SerialPort = Stream<Box<dyn serialport::SerialPort>>;

impl SerialPort {
    /// Opens the serial port at `path`. Over USB, the configured bit rate has no effect.
    ///
    /// # Errors
    /// [`Error::Open`]: the port is absent, busy, or not permitted.
    pub fn open(path: &str) -> Result<Self, Error> {
        let opened = serialport::new(path, 115_200).timeout(POLL).open();
        let stream = opened.map_err(|e| Error::Open {
            port: path.to_owned(),
            reason: e.to_string(),
            advice: match e.kind() {
                // The library reports this kind when another program has locked the port.
                serialport::ErrorKind::NoDevice => {
                    "another program uses this port (a serial monitor, another flexor): close it"
                }
                serialport::ErrorKind::Io(ErrorKind::NotFound) => {
                    "plug the board in and check its port (on Linux /dev/ttyACM0 or similar); \
                     without --device, flexor uses the native simulator"
                }
                serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
                    "on Linux, add yourself to the group `dialout` and log in again"
                }
                _ => "give the port of a board (on Linux /dev/ttyACM0 or similar)",
            },
        })?;
        Ok(Self::begin(stream))
    }
}

impl SplitStream for Box<dyn serialport::SerialPort> {
    fn clone_writer(&self) -> io::Result<Box<dyn Write + Send>> {
        Ok(Box::new(self.try_clone()?))
    }
}

/// A serial port of a board that runs a Flexor image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlexorPort {
    /// Path or name by which the port is opened.
    pub path: String,
    /// Name of the product: kind and board.
    pub product: String,
    /// Serial number, which is the chip's unique number.
    pub serial: Option<String>,
}

/// Lists the ports of boards that run a Flexor image, by name. No port is opened. If the operating
/// system cannot list its ports, there are none.
#[must_use]
pub fn flexor_ports() -> Vec<FlexorPort> {
    let ports = serialport::available_ports().unwrap_or_default();
    let mut found: Vec<FlexorPort> = ports.into_iter().filter_map(flexor_port).collect();
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

fn flexor_port(port: serialport::SerialPortInfo) -> Option<FlexorPort> {
    let serialport::SerialPortType::UsbPort(usb) = port.port_type else {
        return None;
    };
    let is_flexor =
        (usb.vid, usb.pid) == USB_IDS && usb.manufacturer.as_deref() == Some(USB_MANUFACTURER);
    is_flexor.then(|| FlexorPort {
        path: port.port_name,
        product: usb.product.unwrap_or_else(|| USB_MANUFACTURER.to_owned()),
        serial: usb.serial_number,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::{SerialPortInfo, SerialPortType, UsbPortInfo};

    #[test]
    fn only_ports_of_flexors_boards_are_listed() {
        let usb = |pid, manufacturer: Option<&str>| SerialPortInfo {
            port_name: "/dev/ttyACM0".to_owned(),
            port_type: SerialPortType::UsbPort(UsbPortInfo {
                vid: 0x1209,
                pid,
                serial_number: Some("ABC".to_owned()),
                manufacturer: manufacturer.map(str::to_owned),
                product: Some("Flexor breadboard weact-f405".to_owned()),
            }),
        };
        let found = flexor_port(usb(1, Some("Flexor"))).unwrap();
        assert_eq!(found.product, "Flexor breadboard weact-f405");
        assert_eq!(found.serial.as_deref(), Some("ABC"));
        // The ids are those of a test range, which anybody may use.
        assert_eq!(flexor_port(usb(1, Some("Somebody"))), None);
        assert_eq!(flexor_port(usb(2, Some("Flexor"))), None);
        let plain = SerialPortInfo {
            port_name: "/dev/ttyS0".to_owned(),
            port_type: SerialPortType::Unknown,
        };
        assert_eq!(flexor_port(plain), None);
    }
}
