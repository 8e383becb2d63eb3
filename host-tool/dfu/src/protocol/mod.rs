//! DFU 1.1 and DfuSe requests over a control endpoint.
//!
//! Comes in: a [`Transport`] and a [`Clock`]. Goes out: memory contents and device states. No USB
//! library and no clock lives here, and no decision about what to write: see [`crate::flash`].

mod error;
mod layout;
mod session;
mod status;

pub use error::{Action, Operation, ProtocolError};
pub use layout::{Layout, LayoutError, Segment};
pub use session::{MIN_POLL_MS, Session, TRANSFER_LIMIT_MS};
pub use status::{DeviceStatus, State, Status};

pub use crate::ids::{DFUSE_VERSION, PRODUCT_ID, VENDOR_ID};
use std::time::{Duration, Instant};
use thiserror::Error;

/// Class requests of DFU 1.1 (table 3.2) that a boot loader answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Request {
    /// DFU_DNLOAD, out: data for the device, or a DfuSe command in block 0.
    Download = 1,
    /// DFU_UPLOAD, in: data from the device.
    Upload = 2,
    /// DFU_GETSTATUS, in: 6 bytes; starts the operation of the last download.
    GetStatus = 3,
    /// DFU_CLRSTATUS, out: leaves dfuERROR.
    ClearStatus = 4,
    /// DFU_GETSTATE, in: 1 byte, without side effects.
    GetState = 5,
    /// DFU_ABORT, out: returns to dfuIDLE.
    Abort = 6,
}

/// Control transfers to the DFU interface. All requests are class requests to the interface
/// (bmRequestType 0x21 or 0xA1); the implementation supplies the interface number.
pub trait Transport {
    /// Reads up to `length` bytes. `timeout_ms` limits the transfer.
    ///
    /// # Errors
    /// See [`TransportError`].
    fn control_in(
        &mut self,
        request: Request,
        value: u16,
        length: u16,
        timeout_ms: u32,
    ) -> Result<Vec<u8>, TransportError>;

    /// Writes `data`. `timeout_ms` limits the transfer.
    ///
    /// # Errors
    /// See [`TransportError`].
    fn control_out(
        &mut self,
        request: Request,
        value: u16,
        data: &[u8],
        timeout_ms: u32,
    ) -> Result<(), TransportError>;
}

/// Time and waiting, so that simulated sessions take no real time.
pub trait Clock {
    /// Waits for `ms` milliseconds.
    fn sleep_ms(&mut self, ms: u32);

    /// Time since a fixed moment in milliseconds, including the time that transfers take.
    fn elapsed_ms(&self) -> u64;
}

/// Clock of this computer. Its time starts when it is created.
#[derive(Debug, Clone, Copy)]
pub struct HostClock(Instant);

impl Default for HostClock {
    fn default() -> Self {
        Self(Instant::now())
    }
}

impl Clock for HostClock {
    fn sleep_ms(&mut self, ms: u32) {
        std::thread::sleep(Duration::from_millis(ms.into()));
    }

    fn elapsed_ms(&self) -> u64 {
        u64::try_from(self.0.elapsed().as_millis()).unwrap_or(u64::MAX)
    }
}

/// Failure of one control transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum TransportError {
    /// The device refused the request.
    #[error("the device refused the request (STALL)")]
    Stall,
    /// The device did not answer within the timeout.
    #[error("the device did not answer in time")]
    Timeout,
    /// The device is gone.
    #[error("the device is disconnected")]
    Disconnected,
    /// The bus or the host controller failed.
    #[error("the USB bus reported a fault; try another cable or port")]
    Fault,
    /// The operating system failed with this code.
    #[error("the operating system reported USB error {0}")]
    System(u32),
}

/// DFU functional descriptor (DFU 1.1 table 4.2), which ends the configuration descriptor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FunctionalDescriptor {
    /// Whether the device accepts downloads.
    pub can_download: bool,
    /// Whether the device allows uploads, which verification needs.
    pub can_upload: bool,
    /// Largest transfer in bytes; 2048 on the STM32F405.
    pub transfer_size: u16,
    /// DFU version as binary-coded decimal; 0x011A for DfuSe.
    pub version: u16,
}

impl FunctionalDescriptor {
    /// Reads the descriptor from its bytes; `None` if `bytes` is not one.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let (
            &[
                length,
                kind,
                attributes,
                _,
                _,
                size_low,
                size_high,
                low,
                high,
            ],
            _,
        ) = bytes.split_first_chunk::<9>()?;
        (usize::from(length) >= 9 && kind == 0x21).then_some(Self {
            can_download: attributes & 1 != 0,
            can_upload: attributes & 2 != 0,
            transfer_size: u16::from_le_bytes([size_low, size_high]),
            version: u16::from_le_bytes([low, high]),
        })
    }
}
