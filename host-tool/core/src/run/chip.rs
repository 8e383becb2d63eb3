//! A board of the chip simulator, for a session.

#[cfg(feature = "gdb")]
mod debug;
mod log;

use super::images;
use super::open_error::{ChipError, OpenError};
use super::simulated::simulated;
use super::wearer::outputs;
use crate::link::SimulatedPort;
use crate::session::Session;
use firmware::lockstep::Sensors;
use firmware::units::Micros;
use hal_sim::chip::board::Board;
use hal_sim::chip::cpu::run::Observer;
#[cfg(feature = "gdb")]
use hal_sim::chip::gdb::Outlives;
use hal_sim::chip::{self, soc::Pace};
use hal_sim::images::Image;
use hal_sim::lockstep::Device;
use log::LogFile;
use std::path::{Path, PathBuf};

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
    #[cfg(feature = "gdb")]
    pub gdb: Option<u16>,
    /// What becomes of the board when its debugger has gone.
    #[cfg(feature = "gdb")]
    pub outlives: Outlives,
    /// File for the image's log; `-` is standard error.
    #[cfg(feature = "rtt")]
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
    let log = LogFile::open(options, &image)?;
    let (device, boot_us) = match () {
        #[cfg(feature = "gdb")]
        () if options.gdb.is_some() => debug::booted(session, &image, options, log)?,
        () => booted(session, &image, log)?,
    };
    let mut port = simulated(session, seed, device, Micros::new(boot_us as u32))?; // far from wrapping
    port.image = Some(image.path().to_owned());
    Ok(port)
}

/// A board without a debugger, and when it had booted, µs of device time.
fn booted(
    session: &Session,
    image: &chip::image::Image,
    log: LogFile,
) -> Result<(Box<dyn Device>, u64), ChipError> {
    let mut board = power_on(session, image, ())?;
    board.boot(&Sensors::default())?;
    let boot_us = board.now_us();
    Ok((log.attach(board), boot_us))
}
