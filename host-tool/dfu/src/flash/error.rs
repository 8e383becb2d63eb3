//! Failures of flashing and the state in which they leave the chip.

use super::image::ImageError;
use crate::protocol::{ProtocolError, Status, TransportError};
use std::fmt;
use thiserror::Error;

/// State of the chip's flash when flashing ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChipState {
    /// Nothing was changed.
    Unchanged,
    /// The stack pointer or the reset vector of the old firmware is being overwritten. The rest
    /// of the old firmware is still there.
    Invalidating,
    /// Sector 0 is erased, partly erased or without vectors; no firmware starts.
    Unbootable,
    /// Everything but the first eight bytes is written and verified; those are being written.
    Committing,
    /// The new firmware is complete.
    Complete,
}

impl fmt::Display for ChipState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unchanged => {
                "The firmware on the chip is unchanged. To try again, hold BOOT0, press reset and \
                 run the command again."
            }
            Self::Invalidating => {
                "The old firmware must not be used any more: its first eight bytes may be \
                 damaged. Hold BOOT0, press reset and run the command again."
            }
            Self::Unbootable => {
                "The chip holds no complete firmware and does not start without BOOT0. Hold \
                 BOOT0, press reset and run the command again."
            }
            Self::Committing => {
                "The new firmware is written except perhaps its first eight bytes. Hold BOOT0, \
                 press reset and run the command again."
            }
            Self::Complete => {
                "The new firmware is written and verified. Release BOOT0 and press reset."
            }
        })
    }
}

/// Failure with the state in which it leaves the chip.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{error}. {chip}")]
pub struct FlashFailure {
    /// Cause of the failure. The message contains it, so it is not returned as a source.
    pub error: FlashError,
    /// State of the flash after the failure.
    pub chip: ChipState,
}

/// Reason why flashing failed.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FlashError {
    /// No boot loader is connected.
    #[error(
        "no STM32 boot loader (USB 0483:df11) is connected; hold BOOT0, press reset, release \
         BOOT0 and check the cable"
    )]
    NoDevice,
    /// More than one boot loader is connected.
    #[error("several boot loaders are connected ({devices}); select one by its serial number")]
    SeveralDevices {
        /// Description of the devices.
        devices: String,
    },
    /// A boot loader was connected before the board was asked to restart in its own.
    #[error(
        "a boot loader is connected already ({devices}), and could be taken for the board that \
         restarts; disconnect it, or give the serial number of the board's boot loader, probably \
         {expected}"
    )]
    AlreadyConnected {
        /// Description of the devices.
        devices: String,
        /// Serial number that the boot loader of the restarting board probably has.
        expected: String,
    },
    /// No connected boot loader has the wanted serial number.
    #[error("no boot loader has serial number {serial}; connected: {devices}")]
    UnknownSerial {
        /// Wanted serial number.
        serial: String,
        /// Description of the devices.
        devices: String,
    },
    /// The device is another chip.
    #[error(
        "the boot loader does not describe the flash of an {chip}; it describes: {found}. \
         Connect the right board"
    )]
    OtherChip {
        /// Name of the expected chip.
        chip: &'static str,
        /// Names of the device's memories.
        found: String,
    },
    /// The device's DFU properties do not allow flashing.
    #[error("the boot loader is not supported: {reason}")]
    Unsupported {
        /// Property that does not fit.
        reason: String,
    },
    /// The boot loader lacks a command.
    #[error("the boot loader does not support command 0x{command:02X}; it is not ST's ROM")]
    MissingCommand {
        /// Code of the command.
        command: u8,
    },
    /// The image does not fit.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The chip refuses to be read and written.
    #[error(
        "read protection is on (the boot loader reported {status} while {during}). Removing it \
         erases the whole flash including the stage table, so this command does not do it; use \
         STM32CubeProgrammer if that is what you want"
    )]
    ReadProtected {
        /// Reported status.
        status: Status,
        /// Operation that was refused.
        during: String,
    },
    /// The connection was lost.
    #[error("the board was unplugged or lost power while {during}")]
    Unplugged {
        /// Operation under way.
        during: String,
    },
    /// The chip ignored the erase command.
    #[error(
        "sector 0 is not erased although the boot loader reported success (0x{read:02X} at \
         0x{address:08X}); the sector is probably write-protected: check the option bytes with \
         STM32CubeProgrammer"
    )]
    NotErased {
        /// First address that is not erased.
        address: u32,
        /// Byte that was read.
        read: u8,
    },
    /// Flash differs from the image.
    #[error(
        "verification failed at 0x{address:08X}: read 0x{read:02X} instead of 0x{expected:02X}; \
         the sector may be write-protected, worn out, or the supply too low"
    )]
    Mismatch {
        /// First address that differs.
        address: u32,
        /// Byte of the image.
        expected: u8,
        /// Byte that was read.
        read: u8,
    },
    /// The caller ended the procedure between two operations. The boot loader still runs.
    #[error("writing was interrupted")]
    Interrupted,
    /// Another failure of the protocol.
    #[error(transparent)]
    Protocol(ProtocolError),
}

impl From<ProtocolError> for FlashError {
    fn from(error: ProtocolError) -> Self {
        let during = error.operation().to_string();
        match error {
            ProtocolError::Reported { status, .. } if status == Status::VENDOR => {
                Self::ReadProtected { status, during }
            }
            ProtocolError::Transfer {
                cause: TransportError::Disconnected,
                ..
            } => Self::Unplugged { during },
            error => Self::Protocol(error),
        }
    }
}
