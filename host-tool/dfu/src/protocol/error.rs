//! Failures of the protocol, with the operation and address they belong to.

use super::{State, Status, TransportError};
use std::fmt;
use thiserror::Error;

/// Kind of operation that was under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Action {
    /// Bringing the boot loader to dfuIDLE.
    Connect,
    /// Reading the list of supported commands.
    ReadCommands,
    /// Setting the address pointer.
    SetAddress,
    /// Erasing a sector.
    Erase,
    /// Writing a block.
    Write,
    /// Reading a block.
    Read,
    /// Leaving the boot loader.
    Leave,
}

/// Operation under way when an error occurred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Operation {
    /// Kind of operation.
    pub action: Action,
    /// Flash address; 0 where the action has none.
    pub address: u32,
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self.action {
            Action::Connect => return f.write_str("preparing the boot loader"),
            Action::ReadCommands => return f.write_str("reading the boot loader's commands"),
            Action::SetAddress => "setting the address pointer to",
            Action::Erase => "erasing the sector at",
            Action::Write => "writing the block at",
            Action::Read => "reading the block at",
            Action::Leave => "leaving the boot loader with the address pointer at",
        };
        write!(f, "{text} 0x{:08X}", self.address)
    }
}

/// Failure while speaking to the boot loader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ProtocolError {
    /// A control transfer failed.
    #[error("USB failed while {operation}: {cause}")]
    Transfer {
        /// Operation under way.
        operation: Operation,
        /// Failure of the transfer.
        cause: TransportError,
    },
    /// The device reported an error status.
    #[error("the device reported {status} in state {state} while {operation}")]
    Reported {
        /// Operation under way.
        operation: Operation,
        /// Reported status.
        status: Status,
        /// State before the status was cleared.
        state: State,
    },
    /// The device sent an answer of the wrong length.
    #[error(
        "the device sent {received} bytes instead of {expected} while {operation}; the boot \
         loader is not one of this chip, or the connection is faulty"
    )]
    Length {
        /// Operation under way.
        operation: Operation,
        /// Wanted number of bytes.
        expected: usize,
        /// Received number of bytes.
        received: usize,
    },
    /// The device is in a state that the operation cannot lead to.
    #[error("the device is in the unexpected state {state} while {operation}")]
    UnexpectedState {
        /// Operation under way.
        operation: Operation,
        /// Reported state.
        state: State,
    },
    /// The device stayed busy.
    #[error("the device is still busy after {limit_ms} ms while {operation}")]
    Timeout {
        /// Operation under way.
        operation: Operation,
        /// Time that was granted, in milliseconds.
        limit_ms: u32,
    },
    /// The caller asked for a change outside the addresses that were granted to the session.
    #[error(
        "{operation} was refused before anything was sent: only 0x{start:08X} to \
         0x{last:08X} may change"
    )]
    Outside {
        /// Refused operation.
        operation: Operation,
        /// First address that may change.
        start: u32,
        /// Last address that may change.
        last: u32,
    },
}

impl ProtocolError {
    /// Reported status, if the device reported one.
    #[must_use]
    pub const fn status(&self) -> Option<Status> {
        match self {
            Self::Reported { status, .. } => Some(*status),
            _ => None,
        }
    }

    /// Operation that failed.
    #[must_use]
    pub const fn operation(&self) -> Operation {
        match *self {
            Self::Transfer { operation, .. }
            | Self::Reported { operation, .. }
            | Self::Length { operation, .. }
            | Self::UnexpectedState { operation, .. }
            | Self::Timeout { operation, .. }
            | Self::Outside { operation, .. } => operation,
        }
    }
}
