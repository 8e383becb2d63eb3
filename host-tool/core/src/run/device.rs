//! Opens devices by name: simulators in this process and boards behind ports.

#[cfg(feature = "chip")]
use super::chip::{ChipOptions, open_chip_port};
#[cfg(feature = "qemu")]
use super::images;
use super::open_error::OpenError;
use super::simulated::simulated_port;
use crate::link::Port;
#[cfg(feature = "realtime")]
use crate::link::TcpPort;
#[cfg(feature = "serial")]
use crate::link::{Error, FlexorPort, SerialPort, flexor_ports};
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

/// Device as the option `--device` names it, and thereby the backend that executes the device code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceName {
    /// Native backend: the device code runs in this process.
    Native,
    /// Chip simulator, which executes the flashed image.
    Chip,
    /// QEMU, which executes the device code compiled for it.
    Qemu,
    /// Device at a TCP address, written `tcp:ADDRESS`.
    Tcp(String),
    /// Device on a serial port, given by the port's path or name.
    Serial(String),
    /// The only board on the USB ports of this computer.
    Auto,
}

impl FromStr for DeviceName {
    type Err = Infallible;

    fn from_str(name: &str) -> Result<Self, Infallible> {
        Ok(match name {
            "native" => Self::Native,
            "chip" => Self::Chip,
            "qemu" => Self::Qemu,
            "auto" => Self::Auto,
            _ => match name.strip_prefix("tcp:") {
                Some(address) => Self::Tcp(address.to_owned()),
                None => Self::Serial(name.to_owned()),
            },
        })
    }
}

impl DeviceName {
    /// Returns the name as a command accepts it, which [`FromStr`] reads back to the same value.
    #[must_use]
    pub fn to_argument(&self) -> String {
        match self {
            Self::Native => "native".to_owned(),
            Self::Chip => "chip".to_owned(),
            Self::Qemu => "qemu".to_owned(),
            Self::Auto => "auto".to_owned(),
            Self::Tcp(_) | Self::Serial(_) => self.to_string(),
        }
    }

    /// Returns whether the device is reached through a TCP or serial port. Its kind and its seed
    /// are then not known to this program.
    #[must_use]
    pub const fn is_port(&self) -> bool {
        matches!(self, Self::Tcp(_) | Self::Serial(_) | Self::Auto)
    }

    /// Returns the simulator of this program on which a record of `kind` was made, so that a rerun
    /// can use it; `None` for a board.
    #[must_use]
    pub const fn from_kind(kind: DeviceKind) -> Option<Self> {
        match kind {
            DeviceKind::Native => Some(Self::Native),
            DeviceKind::Chip => Some(Self::Chip),
            DeviceKind::Qemu => Some(Self::Qemu),
            DeviceKind::Board | DeviceKind::Breadboard => None,
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
            Self::Auto => f.write_str("the only board"),
        }
    }
}

impl DeviceName {
    /// Opens the device for `session`. For a simulator, `seed` determines the noise of the
    /// simulated wearer and the number of the first session.
    ///
    /// # Errors
    /// Returns an [`OpenError`] if the device, its image or the simulated wearer cannot be set up.
    pub fn open(&self, session: &Session, seed: u64) -> Result<Box<dyn Port>, OpenError> {
        Ok(match self {
            Self::Native => {
                let device = Box::new(native_seeded(Micros::new(0), seed));
                Box::new(simulated_port(session, seed, device, Micros::new(0))?)
            }
            #[cfg(feature = "chip")]
            Self::Chip => Box::new(open_chip_port(session, seed, &ChipOptions::default())?),
            #[cfg(not(feature = "chip"))]
            Self::Chip => return Err(self.missing_feature("chip")),
            #[cfg(not(feature = "qemu"))]
            Self::Qemu => return Err(self.missing_feature("qemu")),
            #[cfg(feature = "qemu")]
            Self::Qemu => {
                let image = images::find(Image::Qemu).map_err(StartError::NotBuilt)?;
                let mut device = Box::new(Qemu::start(&image)?);
                device.boot_seeded(seed).map_err(StartError::from)?;
                let mut port = simulated_port(session, seed, device, Micros::new(0))?;
                port.image = Some(image);
                Box::new(port)
            }
            Self::Tcp(_) | Self::Serial(_) | Self::Auto => self.connect()?,
        })
    }

    /// Connects to a device behind a TCP or serial port. The name of a simulator of this program is
    /// refused.
    ///
    /// # Errors
    /// The port cannot be opened, the program was built without support for it, or the name is that
    /// of a simulator of this program.
    pub fn connect(&self) -> Result<Box<dyn Port>, OpenError> {
        match self {
            #[cfg(feature = "realtime")]
            Self::Tcp(address) => Ok(Box::new(TcpPort::connect(address)?)),
            #[cfg(not(feature = "realtime"))]
            Self::Tcp(_) => Err(self.missing_feature("realtime")),
            #[cfg(feature = "serial")]
            Self::Serial(path) => match SerialPort::open(path) {
                Ok(port) => Ok(Box::new(port)),
                Err(error) => Err(with_suggestion(path, error).into()),
            },
            #[cfg(feature = "serial")]
            Self::Auto => Self::Serial(only_port(&flexor_ports())?).connect(),
            #[cfg(not(feature = "serial"))]
            Self::Serial(_) | Self::Auto => Err(self.missing_feature("serial")),
            Self::Native | Self::Chip | Self::Qemu => Err(OpenError::NoPort(self.to_string())),
        }
    }

    #[cfg(not(all(feature = "chip", feature = "qemu", feature = "serial")))]
    fn missing_feature(&self, feature: &'static str) -> OpenError {
        let device = self.to_string();
        OpenError::LeftOut { device, feature }
    }
}

/// Returns the path of the only port in `ports`.
///
/// # Errors
/// There is none, or more than one.
#[cfg(feature = "serial")]
fn only_port(ports: &[FlexorPort]) -> Result<String, OpenError> {
    match ports {
        [port] => Ok(port.path.clone()),
        [] => Err(OpenError::NoBoard),
        ports => {
            let list = ports
                .iter()
                .map(|port| format!("{} ({})", port.path, port.product));
            Err(OpenError::SeveralBoards(
                list.collect::<Vec<_>>().join(", "),
            ))
        }
    }
}

/// Returns the error of a serial port that cannot be opened. If `path` resembles the name of a
/// simulator, the error suggests that simulator.
#[cfg(feature = "serial")]
fn with_suggestion(path: &str, error: Error) -> Error {
    let advice = match nearest(path, ["native", "chip", "qemu", "auto"]) {
        Some("native") => "did you mean `native`, the native simulator?",
        Some("chip") => "did you mean `chip`, the chip simulator?",
        Some("qemu") => "did you mean `qemu`, the QEMU simulator?",
        Some("auto") => "did you mean `auto`, the only board on this computer?",
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
