//! Defines the host's requests and their order: enumeration (USB 2.0 section 9.1.2), then the
//! serial port (CDC PSTN 1.2 section 6.3).

use super::descriptor::{Device, kind, text};
use super::{Failure, line};
use crate::chip::Cycle;

/// Language id of US English.
const LANGUAGE: u16 = 0x0409;
/// Address that the host assigns to the device with SET_ADDRESS.
pub const ADDRESS: u8 = 5;
/// Recovery time after SET_ADDRESS (USB 2.0 9.2.6.3).
pub const ADDRESS_RECOVERY_MS: u64 = 2;
/// Line coding 115,200 baud, 1 stop bit, no parity, 8 bits: the request of a terminal program,
/// although there is no UART.
const LINE_CODING: [u8; 7] = [0x00, 0xC2, 0x01, 0x00, 0, 0, 8];

/// A request on endpoint 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// GET_DESCRIPTOR: the first 8 bytes of the device descriptor.
    MaxPacket,
    /// SET_ADDRESS with [`ADDRESS`].
    Address,
    /// GET_DESCRIPTOR: the whole device descriptor.
    Device,
    /// GET_DESCRIPTOR: the first 9 bytes of the configuration.
    ConfigurationHeader,
    /// GET_DESCRIPTOR: the whole configuration.
    Configuration,
    /// GET_DESCRIPTOR: a string; 0 is the manufacturer, 1 the product and 2 the serial number.
    String(usize),
    /// SET_CONFIGURATION, which makes the data endpoints usable.
    Configure,
    /// SET_LINE_CODING: baud rate and format of a serial line.
    LineCoding,
    /// SET_CONTROL_LINE_STATE with DTR and RTS on: a program opens the port.
    Open,
    /// SET_CONTROL_LINE_STATE with DTR and RTS off: a program closes the port.
    Close,
    /// Request of another program: the bytes of its SETUP.
    Foreign([u8; 8]),
}

impl Request {
    /// Returns the name of the request for the text of a [`Failure`].
    pub fn name(self) -> &'static str {
        match self {
            Self::MaxPacket => "GET_DESCRIPTOR device, 8 bytes",
            Self::Address => "SET_ADDRESS",
            Self::Device => "GET_DESCRIPTOR device",
            Self::ConfigurationHeader => "GET_DESCRIPTOR configuration, 9 bytes",
            Self::Configuration => "GET_DESCRIPTOR configuration",
            Self::String(_) => "GET_DESCRIPTOR string",
            Self::Configure => "SET_CONFIGURATION",
            Self::LineCoding => "SET_LINE_CODING",
            Self::Open => "SET_CONTROL_LINE_STATE open",
            Self::Close => "SET_CONTROL_LINE_STATE close",
            Self::Foreign(_) => "another program's request",
        }
    }

    /// Returns whether the device may answer STALL: strings are optional (USB 2.0 9.6.7), and a
    /// device need not know the requests of other programs.
    pub fn may_stall(self) -> bool {
        matches!(self, Self::String(_) | Self::Foreign(_))
    }

    /// Returns the eight bytes of the SETUP packet (USB 2.0 table 9-2). `total` is the length of
    /// the whole configuration, wTotalLength.
    pub fn setup(self, device: &Device, total: u16) -> [u8; 8] {
        let interface = u16::from(device.control_interface);
        let (request_type, code, value, index, length) = match self {
            Self::MaxPacket => (0x80, 6, descriptor(kind::DEVICE, 0), 0, 8),
            Self::Address => (0x00, 5, u16::from(ADDRESS), 0, 0),
            Self::Device => (0x80, 6, descriptor(kind::DEVICE, 0), 0, 18),
            Self::ConfigurationHeader => (0x80, 6, descriptor(kind::CONFIGURATION, 0), 0, 9),
            Self::Configuration => (0x80, 6, descriptor(kind::CONFIGURATION, 0), 0, total),
            Self::String(n) => {
                let index = device.strings.get(n).copied().unwrap_or(0);
                (0x80, 6, descriptor(kind::STRING, index), LANGUAGE, 255)
            }
            Self::Configure => (0x00, 9, u16::from(device.configuration), 0, 0),
            Self::LineCoding => (0x21, 0x20, 0, interface, 7),
            Self::Open => (0x21, 0x22, 0b11, interface, 0),
            Self::Close => (0x21, 0x22, 0b00, interface, 0),
            Self::Foreign(setup) => return setup,
        };
        let [v, i, l] = [value, index, length].map(u16::to_le_bytes);
        [request_type, code, v[0], v[1], i[0], i[1], l[0], l[1]]
    }

    /// Returns the data that the request sends to the device; empty if there are none.
    pub fn data(self) -> &'static [u8] {
        match self {
            Self::LineCoding => &LINE_CODING,
            _ => &[],
        }
    }

    /// Returns the request that follows once this one is served; `None` after the last.
    pub fn next(self, device: &Device) -> Option<Self> {
        let string = |from: usize| {
            let index = device.strings.iter().skip(from).position(|n| *n != 0);
            index.map_or(Self::Configure, |n| Self::String(from + n))
        };
        Some(match self {
            Self::MaxPacket => Self::Address,
            Self::Address => Self::Device,
            Self::Device => Self::ConfigurationHeader,
            Self::ConfigurationHeader => Self::Configuration,
            Self::Configuration => string(0),
            Self::String(n) => string(n + 1),
            Self::Configure => Self::LineCoding,
            Self::LineCoding => Self::Open,
            Self::Open | Self::Close | Self::Foreign(_) => return None,
        })
    }

    /// Stores the device's answer in `device`; returns wTotalLength if the answer contains it.
    pub fn accept(self, bytes: &[u8], device: &mut Device) -> Result<Option<u16>, Failure> {
        match self {
            Self::MaxPacket => match bytes {
                &[18, kind::DEVICE, .., size @ (8 | 16 | 32 | 64)] if bytes.len() == 8 => {
                    device.max_packet = size;
                }
                _ => return Err(Failure::Descriptor("device descriptor, 8 bytes")),
            },
            Self::Device => device.parse_device(bytes)?,
            Self::ConfigurationHeader => match bytes {
                &[9, kind::CONFIGURATION, low, high, ..] if bytes.len() == 9 => {
                    return Ok(Some(u16::from_le_bytes([low, high])));
                }
                _ => return Err(Failure::Descriptor("configuration descriptor, 9 bytes")),
            },
            Self::Configuration => device.parse_configuration(bytes)?,
            Self::String(0) => device.manufacturer = Some(text(bytes)?),
            Self::String(1) => device.name = Some(text(bytes)?),
            Self::String(_) => device.serial = Some(text(bytes)?),
            _ => {}
        }
        Ok(None)
    }
}

fn descriptor(kind: u8, index: u8) -> u16 {
    u16::from_le_bytes([index, kind])
}

/// Stage of a control transfer (USB 2.0 section 8.5.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The host sends the SETUP packet.
    Setup,
    /// The device sends data to the host.
    DataIn,
    /// The host sends data to the device.
    DataOut,
    /// The device confirms that it has served the request.
    StatusIn,
    /// The host confirms that it has all data.
    StatusOut,
}

/// A control transfer under way.
#[derive(Clone, PartialEq, Debug)]
pub struct Control {
    /// Request that the transfer serves.
    pub request: Request,
    /// Eight bytes of the SETUP packet.
    pub setup: [u8; 8],
    /// Data towards the device, if the request has such data.
    data: Vec<u8>,
    /// Stage of the transfer to which the next transaction belongs.
    pub stage: Stage,
    /// Whether the next data packet is DATA1.
    pub data1: bool,
    /// Data received from the device so far.
    pub received: Vec<u8>,
    /// Number of bytes of `data` that the device has accepted so far.
    pub sent: usize,
    /// Cycle until which the device must have served the request, 5 s after its beginning.
    pub deadline: Cycle,
}

impl Control {
    /// Creates the transfer for `request`, which begins at `at` on a clock of `hz` hertz. `total`
    /// is wTotalLength.
    pub fn new(request: Request, device: &Device, total: u16, at: Cycle, hz: u64) -> Self {
        Self {
            request,
            setup: request.setup(device, total),
            data: request.data().to_vec(),
            stage: Stage::Setup,
            data1: false,
            received: Vec::new(),
            sent: 0,
            deadline: at + 5 * hz,
        }
    }

    /// Replaces the data towards the device; cuts them, or pads them with zeros, to wLength.
    pub fn with_data(mut self, mut data: Vec<u8>) -> Self {
        data.resize(self.length(), 0);
        self.data = data;
        self
    }

    /// Returns the length of the data stage in bytes, wLength of the SETUP packet.
    pub fn length(&self) -> usize {
        usize::from(u16::from_le_bytes([self.setup[6], self.setup[7]]))
    }

    /// Returns the bytes of the next data packet to the device, at most `max_packet`.
    pub fn chunk(&self, max_packet: usize) -> &[u8] {
        let rest = self.data.get(self.sent..).unwrap_or_default();
        rest.get(..max_packet).unwrap_or(rest)
    }

    /// Returns the longest time that the next transaction takes, cycles of a clock of `hz`.
    pub fn budget(&self, max_packet: usize, hz: u64) -> Cycle {
        let bytes = match self.stage {
            Stage::Setup => 8,
            Stage::DataIn | Stage::DataOut => max_packet,
            Stage::StatusIn | Stage::StatusOut => 0,
        };
        line::budget(bytes, hz)
    }

    /// Moves to the data stage or, without data, to the status stage, after the device accepted
    /// SETUP.
    pub fn setup_done(&mut self) {
        self.data1 = true;
        self.stage = match (self.length(), self.setup[0] & 0x80 != 0) {
            (0, _) => Stage::StatusIn,
            (_, true) => Stage::DataIn,
            (_, false) => Stage::DataOut,
        };
    }

    /// Notes that the device accepted a data packet of `bytes` bytes; returns whether the transfer
    /// is done.
    pub fn out_done(&mut self, bytes: usize) -> bool {
        if self.stage == Stage::StatusOut {
            return true;
        }
        self.sent += bytes;
        self.data1 = !self.data1;
        if self.sent >= self.data.len() {
            self.stage = Stage::StatusIn;
            self.data1 = true;
        }
        false
    }

    /// Takes a data packet from the device; returns whether the transfer is done.
    pub fn in_done(&mut self, bytes: &[u8], max_packet: usize) -> Result<bool, Failure> {
        if self.stage == Stage::StatusIn {
            return match bytes {
                [] => Ok(true),
                _ => Err(Failure::Babble(self.request.name())),
            };
        }
        self.received.extend_from_slice(bytes);
        self.data1 = !self.data1;
        if self.received.len() > self.length() || bytes.len() > max_packet {
            return Err(Failure::Babble(self.request.name()));
        }
        if bytes.len() < max_packet || self.received.len() == self.length() {
            self.stage = Stage::StatusOut;
            self.data1 = true;
        }
        Ok(false)
    }
}
