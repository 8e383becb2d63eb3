//! The reasons why a device cannot be opened.

use super::wearer::BodyError;
use crate::link::Error;
#[cfg(feature = "rtt")]
use hal_sim::chip::rtt::LogError;
#[cfg(feature = "chip")]
use hal_sim::chip::{board::BoardError, image::ImageError};
#[cfg(feature = "chip")]
use hal_sim::images::BuildError;
#[cfg(feature = "qemu")]
use hal_sim::qemu::StartError;
#[cfg(feature = "chip")]
use std::io;

/// Reason why a device could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The serial or TCP port could not be opened.
    #[error(transparent)]
    Port(#[from] Error),
    /// QEMU did not start, or its image could not be built (E510).
    #[cfg(feature = "qemu")]
    #[error("E510 QEMU is not available: {0}")]
    Qemu(StartError),
    /// The chip simulator did not start, or its image could not be built or flashed.
    #[cfg(feature = "chip")]
    #[error(transparent)]
    Chip(#[from] ChipError),
    /// The session describes a simulated wearer with impossible parameters.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// `--device auto` found no board (E810).
    #[error(
        "E810 no board that runs Flexor is on a USB port; plug one in, give its port, or see flexor \
         devices"
    )]
    NoBoard,
    /// `--device auto` found several boards (E811).
    #[error("E811 several boards are connected: {0}; give the port of one as --device")]
    SeveralBoards(String),
    /// The name is that of a simulator of this program. A simulator needs a session and cannot be
    /// opened as a port (E517).
    #[error(
        "E517 {0}: a simulator needs a session; give one if the command takes one, or give the port \
         of a board"
    )]
    NoPort(String),
    /// The program was built without the feature that opens this device (E578).
    #[error(
        "E578 this program cannot open {device}: it was built without the feature `{feature}`; use \
         a build with this feature, or choose another device"
    )]
    LeftOut {
        /// Name of the device, as messages show it.
        device: String,
        /// Cargo feature of this package without which the program cannot open the device.
        feature: &'static str,
    },
}

// There is no `#[from]`: the message contains this error in full, so the error must not be listed
// again as its cause.
#[cfg(feature = "qemu")]
impl From<StartError> for OpenError {
    fn from(error: StartError) -> Self {
        Self::Qemu(error)
    }
}

/// Reason why the chip simulator could not be used.
#[cfg(feature = "chip")]
#[derive(Debug, thiserror::Error)]
pub enum ChipError {
    /// The image could not be built (E543).
    #[error("E543 no firmware image: {0}")]
    Build(BuildError),
    /// The image could not be read or flashed.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The board did not start, or it stopped while it ran.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The log that the image writes could not be decoded.
    #[cfg(feature = "rtt")]
    #[error(transparent)]
    Log(#[from] LogError),
    /// The log file, or the TCP port for gdb, could not be opened (E547).
    #[error("E547 the log or the gdb port is not available: {0}")]
    Outside(io::Error),
}

// There is no `#[from]`: the message contains this error in full, so the error must not be listed
// again as its cause.
#[cfg(feature = "chip")]
impl From<BuildError> for ChipError {
    fn from(error: BuildError) -> Self {
        Self::Build(error)
    }
}
