//! Boards of the chip simulator on which sessions run.

#[cfg(feature = "gdb")]
mod debug;
mod failed_boot;
mod log;

use super::board::Board;
use super::images;
use super::open_error::{ChipError, OpenError};
use super::simulated::simulated_port;
use super::wearer::output_stages;
use crate::link::SimulatedPort;
use crate::session::Session;
use firmware::lockstep::Sensors;
use firmware::units::Micros;
use hal_sim::chip::board::{Board as SimulatedBoard, Hardware, SharedPinLog};
use hal_sim::chip::cpu::run::Observer;
#[cfg(feature = "gdb")]
use hal_sim::chip::gdb::AfterDebugger;
use hal_sim::chip::{self, soc::Pace};
use hal_sim::lockstep::Device;
use log::LogFile;
use std::path::{Path, PathBuf};

/// Opens the image to flash on the reference board, like [`board_image`].
///
/// # Errors
/// The errors of [`board_image`].
pub fn chip_image(path: Option<&Path>) -> Result<chip::image::Image, ChipError> {
    board_image(path, Board::Reference)
}

/// Opens the image to flash: the file at `path`, or without a path the image of `board` of this
/// program. The latter is the file beside this program, or a file that is built in its checkout if
/// that file is missing or older than its sources.
///
/// # Errors
/// The image does not build, or the file cannot be flashed.
pub fn board_image(path: Option<&Path>, board: Board) -> Result<chip::image::Image, ChipError> {
    Ok(match path {
        Some(path) => chip::image::Image::open(path)?,
        None => chip::image::Image::open(&images::find(board.image())?)?,
    })
}

/// Powers on the reference board of the chip simulator. It has the output stages of `session`, and
/// `image` in its flash. `observer` is informed of what the core executes. No instruction has been executed
/// yet when this function returns.
///
/// # Errors
/// The core could not be started.
pub fn power_on<O: Observer>(
    session: &Session,
    image: &chip::image::Image,
    observer: O,
) -> Result<SimulatedBoard<O>, ChipError> {
    power_on_as(Board::Reference, session, image, observer)
}

/// Powers on any board, with the stages of `session` if it has stages.
fn power_on_as<O: Observer>(
    board: Board,
    session: &Session,
    image: &chip::image::Image,
    observer: O,
) -> Result<SimulatedBoard<O>, ChipError> {
    let (outputs, pace) = (output_stages(session), Pace::Lazy);
    let hardware = Hardware::new(board.wiring());
    let image = image.clone();
    let board = SimulatedBoard::power_on_as(&hardware, image, outputs, pace, observer)?;
    Ok(board)
}

/// Options for running a session on the chip simulator.
#[derive(Debug, Default)]
pub struct ChipOptions {
    /// Board that is simulated, and whose image of this program is flashed.
    pub board: Board,
    /// Log of the chip's pins, which the caller reads after the run.
    pub pins: Option<SharedPinLog>,
    /// ELF file to flash instead of the board's image of this program.
    pub image: Option<PathBuf>,
    /// TCP port on this computer at which the simulator waits for gdb with the core halted. A value
    /// of 0 takes any free port, and `None` runs without a debugger.
    #[cfg(feature = "gdb")]
    pub gdb: Option<u16>,
    /// Whether the board continues to run after its debugger has disconnected, or ends.
    #[cfg(feature = "gdb")]
    pub outlives: AfterDebugger,
    /// File to which the log of the image is written; `-` is standard error. `None` discards the
    /// log.
    #[cfg(feature = "rtt")]
    pub log: Option<PathBuf>,
}

/// Boots a board on the chip simulator and opens its port in a simulated world with the session's
/// wearer, as [`simulated_port`] does.
///
/// # Errors
/// The errors of [`simulated_port`], and any reason why the board does not boot.
pub fn open_chip_port(
    session: &Session,
    seed: u64,
    options: &ChipOptions,
) -> Result<SimulatedPort, OpenError> {
    let image = board_image(options.image.as_deref(), options.board)?;
    let log = LogFile::open(options, &image)?;
    let (device, boot_us) = match () {
        #[cfg(feature = "gdb")]
        () if options.gdb.is_some() => debug::boot_under_gdb(session, &image, options, log)?,
        () => boot_board(options, session, &image, log)?,
    };
    let mut port = simulated_port(session, seed, device, Micros::new(boot_us as u32))?; // far from wrapping
    port.image = Some(image.path().to_owned());
    Ok(port)
}

/// Boots a board without a debugger. Returns the board, and the device time at the end of its boot,
/// µs.
fn boot_board(
    options: &ChipOptions,
    session: &Session,
    image: &chip::image::Image,
    log: LogFile,
) -> Result<(Box<dyn Device>, u64), ChipError> {
    let mut board = power_on_as(options.board, session, image, ())?;
    if let Some(pins) = &options.pins {
        board.around.log_pins(pins.clone());
    }
    if let Err(error) = board.boot(&Sensors::default()) {
        return Err(failed_boot::explain(error, &mut board.around, image, log));
    }
    let boot_us = board.now_us();
    Ok((log.attach(board), boot_us))
}
