//! Cuts and faults that can be set on a simulated device.

use crate::protocol::Status;

/// Point of the transfer at which the connection and the supply are cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CutPoint {
    /// Before the device sees the transfer.
    Before,
    /// While the operation that the transfer starts is running: flash keeps a random unfinished
    /// state. Equal to `After` for a transfer that starts no flash operation.
    During,
    /// While the operation that the transfer starts is running, if it programs flash byte by byte:
    /// the bytes before number `byte` are programmed, and of that byte all bits but those that are
    /// set in `left`. Equal to `After` for another operation.
    AtByte {
        /// Number of the byte in the block, from 0.
        byte: u16,
        /// Bits that are not programmed yet.
        left: u8,
    },
    /// After the transfer, without an answer.
    After,
}

/// Cut of connection and supply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cut {
    /// Number of the transfer, from 0.
    pub transfer: u64,
    /// Point of the transfer.
    pub point: CutPoint,
    /// Seed of the unfinished flash contents.
    pub seed: u64,
}

/// Misbehaviour of a simulated device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Refuse every request.
    Stall,
    /// Never answer.
    Silence,
    /// Send one byte less than asked for.
    ShortAnswer,
    /// Send one byte more than asked for.
    LongAnswer,
    /// Report this status in every answer to DFU_GETSTATUS.
    Report(Status),
    /// Report this state number in every answer to DFU_GETSTATUS.
    ReportState(u8),
    /// Report dfuDNBUSY with this poll time in milliseconds for ever.
    Busy(u32),
    /// Invert one bit of every uploaded block.
    FlipBit,
    /// Accept writes without programming.
    IgnoreWrites,
    /// Accept erasing without erasing.
    IgnoreErase,
    /// Switch to the option bytes: flash addresses are invalid.
    OtherSetting,
    /// Vanish from the bus, as if unplugged.
    Disconnect,
}

/// Poll times that the device reports while it is busy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PollReport {
    /// The true remaining time.
    #[default]
    Exact,
    /// Always this time in milliseconds, as STM32F405 boot loaders do for mass erase (100 ms;
    /// dfu-util's `dfuse.c`).
    Fixed(u32),
}
