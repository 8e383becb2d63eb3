//! Parses the descriptors of the device (USB 2.0 section 9.6, CDC PSTN 1.2).

use super::Failure;

/// Descriptor types (USB 2.0 table 9-5).
pub mod kind {
    pub const DEVICE: u8 = 1;
    pub const CONFIGURATION: u8 = 2;
    pub const STRING: u8 = 3;
    pub const INTERFACE: u8 = 4;
    pub const ENDPOINT: u8 = 5;
}

/// Class of a CDC communications interface, and its ACM subclass.
const COMMUNICATIONS: (u8, u8) = (0x02, 0x02);
/// Class of a CDC data interface.
const DATA: u8 = 0x0A;

/// Description of a USB serial port, as its descriptors give it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Device {
    /// Vendor id of the manufacturer, idVendor.
    pub vendor: u16,
    /// Product id that the manufacturer assigned, idProduct.
    pub product: u16,
    /// Release of the device in binary-coded decimal, bcdDevice.
    pub release: u16,
    /// Largest packet of endpoint 0, bytes.
    pub max_packet: u8,
    /// Name of the manufacturer, the string iManufacturer; `None` if there is none.
    pub manufacturer: Option<String>,
    /// Name of the product, the string iProduct.
    pub name: Option<String>,
    /// Serial number, the string iSerialNumber.
    pub serial: Option<String>,
    /// Value that selects the configuration, bConfigurationValue.
    pub configuration: u8,
    /// Largest current that the device draws from the bus, mA (bMaxPower).
    pub max_power_ma: u16,
    /// Number of the CDC communications interface, to which the host addresses line coding and line
    /// state.
    pub control_interface: u8,
    /// Interrupt IN endpoint, over which the device reports changes of its state.
    pub notify: Endpoint,
    /// Bulk IN endpoint: data towards the host.
    pub data_in: Endpoint,
    /// Bulk OUT endpoint: data towards the device.
    pub data_out: Endpoint,
    /// Indices of the strings for manufacturer, product and serial number; 0 means none.
    pub(super) strings: [u8; 3],
}

/// Contents of an endpoint descriptor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Endpoint {
    /// Endpoint number, without the direction bit.
    pub number: usize,
    /// Largest packet, bytes (wMaxPacketSize).
    pub max_packet: usize,
    /// Polling interval, frames of 1 ms (bInterval).
    pub interval: u8,
}

fn read_u16(bytes: &[u8], at: usize) -> u16 {
    let byte = |n| u16::from(bytes.get(n).copied().unwrap_or(0));
    byte(at) | byte(at + 1) << 8
}

impl Device {
    /// Takes ids, names and the largest packet of endpoint 0 over from `bytes`, the device
    /// descriptor.
    pub(super) fn parse_device(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        let &[18, kind::DEVICE, _, _, _, _, _, max_packet, ..] = bytes else {
            return Err(Failure::Descriptor("device descriptor"));
        };
        let &[manufacturer, product, serial, configurations] =
            bytes.get(14..18).unwrap_or_default()
        else {
            return Err(Failure::Descriptor("the device descriptor is too short"));
        };
        if !matches!(max_packet, 8 | 16 | 32 | 64) || configurations == 0 {
            return Err(Failure::Descriptor("bMaxPacketSize0 or bNumConfigurations"));
        }
        self.vendor = read_u16(bytes, 8);
        self.product = read_u16(bytes, 10);
        self.release = read_u16(bytes, 12);
        self.max_packet = max_packet;
        self.strings = [manufacturer, product, serial];
        Ok(())
    }

    /// Takes interfaces and endpoints over from `bytes`, the whole configuration: its descriptor,
    /// interfaces and endpoints.
    pub(super) fn parse_configuration(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        let &[9, kind::CONFIGURATION, _, _, _, value, _, _, power, ..] = bytes else {
            return Err(Failure::Descriptor("configuration descriptor"));
        };
        if usize::from(read_u16(bytes, 2)) != bytes.len() {
            return Err(Failure::Descriptor("wTotalLength"));
        }
        self.configuration = value;
        self.max_power_ma = u16::from(power) * 2;
        let mut class = 0;
        let mut rest = bytes;
        while let Some(&length) = rest.first() {
            let part = rest.get(..usize::from(length)).unwrap_or_default();
            rest = rest.get(usize::from(length)..).unwrap_or_default();
            match *part {
                [9, kind::INTERFACE, number, _, _, code, subclass, ..] => {
                    class = code;
                    if (code, subclass) == COMMUNICATIONS {
                        self.control_interface = number;
                    }
                }
                [7, kind::ENDPOINT, address, attributes, ..] => {
                    let endpoint = Endpoint {
                        number: usize::from(address & 0xF),
                        max_packet: usize::from(read_u16(part, 4) & 0x7FF),
                        interval: part.get(6).copied().unwrap_or(0),
                    };
                    self.parse_endpoint(class, address, attributes, endpoint)?;
                }
                [length, _, ..] if length >= 2 => {}
                _ => return Err(Failure::Descriptor("an invalid bLength in a configuration")),
            }
        }
        self.complete()
    }

    fn parse_endpoint(
        &mut self,
        class: u8,
        address: u8,
        attributes: u8,
        endpoint: Endpoint,
    ) -> Result<(), Failure> {
        let bulk = matches!(endpoint.max_packet, 8 | 16 | 32 | 64);
        match (class, address & 0x80 != 0, attributes & 0b11) {
            (0x02, true, 0b11) if endpoint.max_packet <= 64 && endpoint.interval > 0 => {
                self.notify = endpoint;
            }
            (DATA, true, 0b10) if bulk => self.data_in = endpoint,
            (DATA, false, 0b10) if bulk => self.data_out = endpoint,
            _ => {
                return Err(Failure::Descriptor(
                    "an endpoint that does not belong to a serial port",
                ));
            }
        }
        Ok(())
    }

    fn complete(&self) -> Result<(), Failure> {
        let endpoints = [self.notify, self.data_in, self.data_out];
        if endpoints.iter().any(|e| e.number == 0) {
            return Err(Failure::Descriptor(
                "an endpoint of the serial port is missing",
            ));
        }
        Ok(())
    }
}

/// Returns the text of a string descriptor.
pub(super) fn text(bytes: &[u8]) -> Result<String, Failure> {
    match bytes {
        [length, kind::STRING, units @ ..] if usize::from(*length) == bytes.len() => {
            let units: Vec<u16> = units
                .chunks_exact(2)
                .map(|unit| read_u16(unit, 0))
                .collect();
            String::from_utf16(&units).map_err(|_| Failure::Descriptor("a string is not UTF-16"))
        }
        _ => Err(Failure::Descriptor("string descriptor")),
    }
}
