//! Devices by name: simulators in this process, boards behind ports.

use super::images;
use super::wearer::{BodyError, body_of, fit, outputs};
use crate::link::{Error, Port, SerialPort, SimulatedPort, TcpPort};
use crate::record::DeviceKind;
use crate::session::Session;
use firmware::lockstep::Sensors;
use firmware::units::Micros;
use hal_sim::chip::board::{Around, Board, BoardError};
use hal_sim::chip::cpu::run::Observer;
use hal_sim::chip::gdb::{Debugger, Outlives, Points};
use hal_sim::chip::image::ImageError;
use hal_sim::chip::rtt::{Log, LogError, Logged};
use hal_sim::chip::{self, soc::Pace};
use hal_sim::images::{BuildError, Image};
use hal_sim::lockstep::Device;
use hal_sim::native::native_seeded;
use hal_sim::qemu::{Qemu, StartError};
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use std::convert::Infallible;
use std::fmt;
use std::fs::File;
use std::io;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
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

/// Why a device could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The port.
    #[error(transparent)]
    Port(#[from] Error),
    /// QEMU or its image.
    #[error("E510 {0}")]
    Qemu(StartError),
    /// The chip simulator or its image.
    #[error(transparent)]
    Chip(#[from] ChipError),
    /// The simulated wearer.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// It is no device by itself.
    #[error("E517 {0} does nothing without a session")]
    NoPort(String),
}

/// Errors that a message has in full, so that they are no cause beside it.
macro_rules! told {
    ($($whole:ident::$variant:ident($error:ty);)*) => {
        $(impl From<$error> for $whole {
            fn from(error: $error) -> Self {
                Self::$variant(error)
            }
        })*
    };
}

told! {
    OpenError::Qemu(StartError);
    ChipError::Build(BuildError);
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
            Self::Chip => Box::new(on_chip(session, seed, &ChipOptions::default())?),
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
        Ok(match self {
            Self::Tcp(address) => Box::new(TcpPort::connect(address)?),
            Self::Serial(path) => Box::new(SerialPort::open(path)?),
            Self::Native | Self::Chip | Self::Qemu => {
                return Err(OpenError::NoPort(self.to_string()));
            }
        })
    }
}

/// A simulated world around `device`, which boots at `boot`, with the
/// session's wearer and angle sensor.
///
/// # Errors
/// The session names a wearer that cannot be.
pub fn simulated(
    session: &Session,
    seed: u64,
    device: Box<dyn Device>,
    boot: Micros,
) -> Result<SimulatedPort, OpenError> {
    let body = body_of(session, seed)?;
    let mut world = World::new(device, body, boot, Faults::default(), seed);
    fit(&mut world, session);
    Ok(SimulatedPort::new(world))
}

/// Why there is no chip simulator.
#[derive(Debug, thiserror::Error)]
pub enum ChipError {
    /// The image was not built.
    #[error("E543 {0}")]
    Build(BuildError),
    /// The image cannot be flashed.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The board does not run.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The image's log cannot be had.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The log's file, or gdb's port.
    #[error("E547 {0}")]
    Outside(io::Error),
}

/// The image to flash: the file at `path`, or the board's own, from beside this
/// program or built in its checkout if it is not newer than its sources.
///
/// # Errors
/// It does not build, or cannot be flashed.
pub fn chip_image(path: Option<&Path>) -> Result<chip::image::Image, ChipError> {
    Ok(match path {
        Some(path) => chip::image::Image::open(path)?,
        None => chip::image::Image::open(&images::find(Image::Stimulator)?)?,
    })
}

/// A board of the chip simulator with the session's output stages and `image`
/// in its flash, watched by `observer`; nothing has run yet.
///
/// # Errors
/// What stops the core from starting.
pub fn power_on<O: Observer>(
    session: &Session,
    image: &chip::image::Image,
    observer: O,
) -> Result<Board<O>, ChipError> {
    let (outputs, pace) = (outputs(session), Pace::Lazy);
    Ok(Board::power_on(image.clone(), outputs, pace, observer)?)
}

/// How a session is to be run on the chip simulator.
#[derive(Debug, Default)]
pub struct ChipOptions {
    /// ELF to flash, for the board's own.
    pub image: Option<PathBuf>,
    /// Port on this machine at which gdb is waited for, the core halted.
    pub gdb: Option<u16>,
    /// What becomes of the board when its debugger has gone.
    pub outlives: Outlives,
    /// File for the image's log; `-` is standard error.
    pub log: Option<PathBuf>,
}

/// The world of [`simulated`] around a board on the chip simulator, its port
/// open.
///
/// # Errors
/// As there, and what stops the board from booting.
pub fn on_chip(
    session: &Session,
    seed: u64,
    options: &ChipOptions,
) -> Result<SimulatedPort, OpenError> {
    let image = chip_image(options.image.as_deref())?;
    let log = options.log.as_deref().map(|path| open_log(path, &image));
    let log = log.transpose()?;
    let (sensors, outside) = (Sensors::default(), ChipError::Outside);
    let (device, boot) = if let Some(port) = options.gdb {
        let board = power_on(session, &image, Points::default())?;
        let listener = TcpListener::bind(("127.0.0.1", port)).map_err(outside)?;
        let at = listener.local_addr().map_err(outside)?;
        eprintln!("the core is halted at reset; gdb: target remote {at}");
        let mut debugger = Debugger::new(listener, board, options.outlives);
        debugger.boot(&sensors).map_err(ChipError::Board)?;
        let boot = debugger.board().now_us();
        (with_log(debugger, log), boot)
    } else {
        let mut board = power_on(session, &image, ())?;
        board.boot(&sensors).map_err(ChipError::Board)?;
        let boot = board.now_us();
        (with_log(board, log), boot)
    };
    let mut port = simulated(session, seed, device, Micros::new(boot as u32))?; // far from wrapping
    port.image = Some(image.path().to_owned());
    Ok(port)
}

fn open_log(path: &Path, image: &chip::image::Image) -> Result<Log, ChipError> {
    let out: Box<dyn io::Write + Send> = if path == Path::new("-") {
        Box::new(io::stderr())
    } else {
        let file = File::create(path).map_err(|why| {
            let told = format!("cannot write {}: {why}", path.display());
            ChipError::Outside(io::Error::new(why.kind(), told))
        })?;
        Box::new(io::BufWriter::new(file))
    };
    Ok(Log::new(image, out)?)
}

fn with_log<D: Device + AsMut<Around> + 'static>(device: D, log: Option<Log>) -> Box<dyn Device> {
    match log {
        Some(log) => Box::new(Logged::new(device, log)),
        None => Box::new(device),
    }
}
