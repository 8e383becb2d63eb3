//! Devices by name: simulators in this process, boards behind ports.

#[cfg(feature = "chip")]
use super::chip::{ChipOptions, on_chip};
#[cfg(feature = "qemu")]
use super::images;
use super::open_error::OpenError;
use super::simulated::simulated;
use crate::link::Port;
#[cfg(feature = "realtime")]
use crate::link::TcpPort;
#[cfg(feature = "serial")]
use crate::link::{Error, SerialPort};
use crate::record::DeviceKind;
use crate::session::Session;
#[cfg(feature = "serial")]
use crate::suggestion::nearest;
use firmware::units::Micros;
#[cfg(feature = "qemu")]
use hal_sim::images::Image;
use hal_sim::native::native_seeded;
#[cfg(feature = "qemu")]
use hal_sim::qemu::{Qemu, StartError};
use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;

/// A device as `--device` names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceName {
    /// The native simulator.
    Native,
    /// The flashed image on the chip simulator.
    Chip,
    /// The device code under QEMU.
    Qemu,
    /// Whatever answers behind a socket.
    Tcp(String),
    /// Whatever answers on a serial port.
    Serial(String),
}

impl FromStr for DeviceName {
    type Err = Infallible;

    fn from_str(name: &str) -> Result<Self, Infallible> {
        Ok(match name {
            "native" => Self::Native,
            "chip" => Self::Chip,
            "qemu" => Self::Qemu,
            _ => match name.strip_prefix("tcp:") {
                Some(address) => Self::Tcp(address.to_owned()),
                None => Self::Serial(name.to_owned()),
            },
        })
    }
}

impl DeviceName {
    /// As [`FromStr`] reads it, and a command takes it.
    #[must_use]
    pub fn typed(&self) -> String {
        match self {
            Self::Native => "native".to_owned(),
            Self::Chip => "chip".to_owned(),
            Self::Qemu => "qemu".to_owned(),
            Self::Tcp(_) | Self::Serial(_) => self.to_string(),
        }
    }

    /// Whether it is behind a port: what it is, and its seed, are its own.
    #[must_use]
    pub const fn is_port(&self) -> bool {
        matches!(self, Self::Tcp(_) | Self::Serial(_))
    }

    /// The device of this program that a record is of.
    #[must_use]
    pub const fn of(kind: DeviceKind) -> Option<Self> {
        match kind {
            DeviceKind::Native => Some(Self::Native),
            DeviceKind::Chip => Some(Self::Chip),
            DeviceKind::Qemu => Some(Self::Qemu),
            DeviceKind::Board => None,
        }
    }
}

impl fmt::Display for DeviceName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Native => f.write_str("native simulator"),
            Self::Chip => f.write_str("chip simulator"),
            Self::Qemu => f.write_str("QEMU"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Serial(path) => f.write_str(path),
        }
    }
}

impl DeviceName {
    /// Opens the device for `session`; `seed` decides a simulated wearer's noise
    /// and where a simulator's session numbers begin.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn open(&self, session: &Session, seed: u64) -> Result<Box<dyn Port>, OpenError> {
        Ok(match self {
            Self::Native => {
                let device = Box::new(native_seeded(Micros::new(0), seed));
                Box::new(simulated(session, seed, device, Micros::new(0))?)
            }
            #[cfg(feature = "chip")]
            Self::Chip => Box::new(on_chip(session, seed, &ChipOptions::default())?),
            #[cfg(not(feature = "chip"))]
            Self::Chip => return Err(self.left_out("chip")),
            #[cfg(not(feature = "qemu"))]
            Self::Qemu => return Err(self.left_out("qemu")),
            #[cfg(feature = "qemu")]
            Self::Qemu => {
                let image = images::find(Image::Qemu).map_err(StartError::NotBuilt)?;
                let mut device = Box::new(Qemu::start(&image)?);
                device.boot_seeded(seed).map_err(StartError::from)?;
                let mut port = simulated(session, seed, device, Micros::new(0))?;
                port.image = Some(image);
                Box::new(port)
            }
            Self::Tcp(_) | Self::Serial(_) => self.connect()?,
        })
    }

    /// Connects to what is behind a port, and to nothing else.
    ///
    /// # Errors
    /// The port; it is a simulator of this program.
    pub fn connect(&self) -> Result<Box<dyn Port>, OpenError> {
        match self {
            #[cfg(feature = "realtime")]
            Self::Tcp(address) => Ok(Box::new(TcpPort::connect(address)?)),
            #[cfg(not(feature = "realtime"))]
            Self::Tcp(_) => Err(self.left_out("realtime")),
            #[cfg(feature = "serial")]
            Self::Serial(path) => match SerialPort::open(path) {
                Ok(port) => Ok(Box::new(port)),
                Err(error) => Err(misspelt(path, error).into()),
            },
            #[cfg(not(feature = "serial"))]
            Self::Serial(_) => Err(self.left_out("serial")),
            Self::Native | Self::Chip | Self::Qemu => Err(OpenError::NoPort(self.to_string())),
        }
    }

    #[cfg(not(all(feature = "chip", feature = "qemu", feature = "serial")))]
    fn left_out(&self, feature: &'static str) -> OpenError {
        let device = self.to_string();
        OpenError::LeftOut { device, feature }
    }
}

/// The error of a serial port that cannot be opened, with the simulator whose name was probably
/// meant by `path`.
#[cfg(feature = "serial")]
fn misspelt(path: &str, error: Error) -> Error {
    let advice = match nearest(path, ["native", "chip", "qemu"]) {
        Some("native") => "did you mean `native`, the simulator?",
        Some("chip") => "did you mean `chip`, the chip simulator?",
        Some("qemu") => "did you mean `qemu`?",
        _ => return error,
    };
    match error {
        Error::Open { port, reason, .. } => Error::Open {
            port,
            reason,
            advice,
        },
        other => other,
    }
}
