//! Answer to DFU_GETSTATUS (DFU 1.1 section 6.1.2).

use std::fmt;

/// Result of the last operation as the device reports it (bStatus).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Status(pub u8);

impl Status {
    /// No error.
    pub const OK: Self = Self(0x00);
    /// The address is not valid for this device.
    pub const TARGET: Self = Self(0x01);
    /// Flash could not be programmed.
    pub const PROGRAM: Self = Self(0x06);
    /// The received address is out of range.
    pub const ADDRESS: Self = Self(0x08);
    /// No valid firmware: the ROM reports this after a start in boot loader mode.
    pub const FIRMWARE: Self = Self(0x0A);
    /// Vendor-specific: read protection is on (AN3156).
    pub const VENDOR: Self = Self(0x0B);
    /// A request was refused.
    pub const STALLED: Self = Self(0x0F);

    /// Name in the DFU specification.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self.0 {
            0x00 => "OK",
            0x01 => "errTARGET",
            0x02 => "errFILE",
            0x03 => "errWRITE",
            0x04 => "errERASE",
            0x05 => "errCHECK_ERASED",
            0x06 => "errPROG",
            0x07 => "errVERIFY",
            0x08 => "errADDRESS",
            0x09 => "errNOTDONE",
            0x0A => "errFIRMWARE",
            0x0B => "errVENDOR",
            0x0C => "errUSBR",
            0x0D => "errPOR",
            0x0E => "errUNKNOWN",
            0x0F => "errSTALLEDPKT",
            _ => "unknown status",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (0x{:02X})", self.name(), self.0)
    }
}

/// State of the device's DFU state machine (bState).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct State(pub u8);

impl State {
    /// Ready for a download or an upload.
    pub const IDLE: Self = Self(2);
    /// Data received; the next DFU_GETSTATUS starts the operation.
    pub const DOWNLOAD_SYNC: Self = Self(3);
    /// The operation runs.
    pub const BUSY: Self = Self(4);
    /// Between two downloads.
    pub const DOWNLOAD_IDLE: Self = Self(5);
    /// The zero-length download was received.
    pub const MANIFEST_SYNC: Self = Self(6);
    /// The device leaves the boot loader.
    pub const MANIFEST: Self = Self(7);
    /// Between two uploads.
    pub const UPLOAD_IDLE: Self = Self(9);
    /// An error waits for DFU_CLRSTATUS.
    pub const ERROR: Self = Self(10);

    /// Name in the DFU specification.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self.0 {
            0 => "appIDLE",
            1 => "appDETACH",
            2 => "dfuIDLE",
            3 => "dfuDNLOAD-SYNC",
            4 => "dfuDNBUSY",
            5 => "dfuDNLOAD-IDLE",
            6 => "dfuMANIFEST-SYNC",
            7 => "dfuMANIFEST",
            8 => "dfuMANIFEST-WAIT-RESET",
            9 => "dfuUPLOAD-IDLE",
            10 => "dfuERROR",
            _ => "unknown state",
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.name(), self.0)
    }
}

/// Decoded answer to DFU_GETSTATUS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceStatus {
    /// Result of the last operation.
    pub status: Status,
    /// Time in milliseconds that the device asks for before the next request (bwPollTimeout),
    /// 0 to 16,777,215. The STM32F405 reports too short times for erasing.
    pub poll_ms: u32,
    /// State after this request.
    pub state: State,
}

impl DeviceStatus {
    /// Number of bytes in the answer.
    pub const LENGTH: u16 = 6;

    /// Decodes the answer; `None` unless it has exactly six bytes.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let &[status, low, middle, high, state, _string] = bytes else {
            return None;
        };
        Some(Self {
            status: Status(status),
            poll_ms: u32::from_le_bytes([low, middle, high, 0]),
            state: State(state),
        })
    }

    /// Encodes the answer, with string index 0 and `poll_ms` cut to 24 bits.
    #[must_use]
    pub fn to_bytes(self) -> [u8; 6] {
        let [low, middle, high, _] = self.poll_ms.min(0x00FF_FFFF).to_le_bytes();
        [self.status.0, low, middle, high, self.state.0, 0]
    }
}
