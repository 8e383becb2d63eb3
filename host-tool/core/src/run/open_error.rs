//! Why a device could not be opened.

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

/// Why a device could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The port.
    #[error(transparent)]
    Port(#[from] Error),
    /// QEMU or its image.
    #[cfg(feature = "qemu")]
    #[error("E510 {0}")]
    Qemu(StartError),
    /// The chip simulator or its image.
    #[cfg(feature = "chip")]
    #[error(transparent)]
    Chip(#[from] ChipError),
    /// The simulated wearer.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// It is no device by itself.
    #[error("E517 {0} does nothing without a session")]
    NoPort(String),
    /// The program was built without what opens it.
    #[error("E578 this program cannot open {device}: it was built without the feature `{feature}`")]
    LeftOut {
        /// The device.
        device: String,
        /// The feature of this package.
        feature: &'static str,
    },
}

// No `#[from]`: the message has this error in full, so that it is no cause beside it.
#[cfg(feature = "qemu")]
impl From<StartError> for OpenError {
    fn from(error: StartError) -> Self {
        Self::Qemu(error)
    }
}

/// Why there is no chip simulator.
#[cfg(feature = "chip")]
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
    #[cfg(feature = "rtt")]
    #[error(transparent)]
    Log(#[from] LogError),
    /// The log's file, or gdb's port.
    #[error("E547 {0}")]
    Outside(io::Error),
}

// No `#[from]`: the message has this error in full, so that it is no cause beside it.
#[cfg(feature = "chip")]
impl From<BuildError> for ChipError {
    fn from(error: BuildError) -> Self {
        Self::Build(error)
    }
}
