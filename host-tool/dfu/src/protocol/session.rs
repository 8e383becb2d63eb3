//! DfuSe operations: read, write and erase at an address, and leave.

use super::error::{Action, Operation, ProtocolError};
use super::{Clock, DeviceStatus, Request, State, Status, Transport, TransportError};
use std::ops::Range;

/// Longest time in milliseconds for a transfer that starts no flash operation. The ROM answers
/// such a transfer within milliseconds.
pub const TRANSFER_LIMIT_MS: u32 = 5000;
/// Shortest pause in milliseconds between two status requests, which bounds the number of
/// transfers when the device reports no pause or one that is too short.
pub const MIN_POLL_MS: u32 = 5;
/// Longest time in milliseconds for writing one block: 2048 bytes at 100 µs per byte (DS8626, x8
/// parallelism, maximum) take 205 ms; ten times that.
const WRITE_LIMIT_MS: u32 = 2000;
/// Attempts to reach dfuIDLE by clearing and aborting.
const IDLE_ATTEMPTS: u32 = 6;
/// Longest time in milliseconds for an operation that another program started: erasing a sector
/// of 128 KiB takes at most 4 s (DS8626), twice that and 1 s.
const BUSY_LIMIT_MS: u32 = 9000;
/// Refused status requests tolerated while busy; STM32L4 boot loaders refuse early polls
/// (dfu-util's `dfuse.c` documents the behaviour).
const MAX_BUSY_STALLS: u32 = 3;
/// Block number of the first data block; 0 carries commands and 1 is reserved (AN3156).
const FIRST_BLOCK: u16 = 2;

/// Connection to a DfuSe boot loader.
///
/// Only addresses inside the granted range can be erased or written. The commands mass erase and
/// read unprotect do not exist here.
#[derive(Debug)]
pub struct Session<T, C> {
    transport: T,
    clock: C,
    transfer_size: u16,
    writable: Range<u32>,
    transfers: u64,
}

impl<T: Transport, C: Clock> Session<T, C> {
    /// Creates a session. `transfer_size` in bytes is from the device's functional descriptor;
    /// `writable` holds the addresses that may be erased and written.
    #[must_use]
    pub const fn new(transport: T, clock: C, transfer_size: u16, writable: Range<u32>) -> Self {
        Self {
            transport,
            clock,
            transfer_size,
            writable,
            transfers: 0,
        }
    }

    /// Largest block in bytes.
    #[must_use]
    pub const fn transfer_size(&self) -> u16 {
        self.transfer_size
    }

    /// Number of control transfers so far.
    #[must_use]
    pub const fn transfers(&self) -> u64 {
        self.transfers
    }

    /// Ends the session and returns the transport.
    pub fn into_transport(self) -> T {
        self.transport
    }

    /// State of the device, read without side effects.
    ///
    /// # Errors
    /// See [`ProtocolError`].
    pub fn state(&mut self) -> Result<State, ProtocolError> {
        let operation = operation(Action::Connect, 0);
        self.transfers += 1;
        let bytes = self
            .transport
            .control_in(Request::GetState, 0, 1, TRANSFER_LIMIT_MS)
            .map_err(|cause| ProtocolError::Transfer { operation, cause })?;
        match bytes.as_slice() {
            &[state] => Ok(State(state)),
            other => Err(ProtocolError::Length {
                operation,
                expected: 1,
                received: other.len(),
            }),
        }
    }

    /// Brings the device to dfuIDLE: drops a command that another program left behind, clears an
    /// error, aborts an unfinished transfer, waits for a running operation. The ROM of the
    /// STM32F405 starts in dfuERROR with errFIRMWARE.
    ///
    /// # Errors
    /// [`ProtocolError::UnexpectedState`] or [`ProtocolError::Timeout`] if the device does not get
    /// there.
    pub fn make_idle(&mut self) -> Result<(), ProtocolError> {
        let operation = operation(Action::Connect, 0);
        // A status request would run the command, which can be a mass erase. A boot loader that
        // refuses DFU_GETSTATE is left to the status requests.
        if matches!(self.state(), Ok(State::DOWNLOAD_SYNC)) {
            self.send(operation, Request::Abort, 0, &[])?;
        }
        self.idle(operation)
    }

    fn idle(&mut self, operation: Operation) -> Result<(), ProtocolError> {
        let mut state = State::IDLE;
        let mut attempts = 0;
        let begin = self.clock.elapsed_ms();
        while attempts < IDLE_ATTEMPTS {
            let left = self.left_ms(begin, BUSY_LIMIT_MS);
            let status = self.status(operation, left.max(TRANSFER_LIMIT_MS))?;
            state = status.state;
            match state {
                State::IDLE => return Ok(()),
                State::ERROR => {
                    attempts += 1;
                    self.send(operation, Request::ClearStatus, 0, &[])?;
                }
                State::DOWNLOAD_IDLE | State::UPLOAD_IDLE => {
                    attempts += 1;
                    self.send(operation, Request::Abort, 0, &[])?;
                }
                State::DOWNLOAD_SYNC | State::BUSY => {
                    self.pause(operation, begin, BUSY_LIMIT_MS, status.poll_ms)?;
                }
                _ => break,
            }
        }
        Err(ProtocolError::UnexpectedState { operation, state })
    }

    /// Command bytes that the boot loader supports (AN3156 "Get command").
    ///
    /// # Errors
    /// See [`ProtocolError`].
    pub fn commands(&mut self) -> Result<Vec<u8>, ProtocolError> {
        let operation = operation(Action::ReadCommands, 0);
        self.idle(operation)?;
        let commands = self.upload(operation, 0, self.transfer_size)?;
        self.idle(operation)?;
        Ok(commands)
    }

    /// Reads `length` bytes from `address`, with one setting of the address pointer for the full
    /// blocks and another one for the rest: AN3156 multiplies the block number by the length of
    /// each request, other boot loaders by the transfer size.
    ///
    /// # Errors
    /// See [`ProtocolError`]; read protection is [`Status::VENDOR`].
    pub fn read(&mut self, address: u32, length: u32) -> Result<Vec<u8>, ProtocolError> {
        let size = u32::from(self.transfer_size.max(1));
        let whole = length - length % size;
        let mut bytes = Vec::with_capacity(length as usize);
        if whole > 0 {
            self.read_blocks(address, self.transfer_size, whole / size, &mut bytes)?;
        }
        if length > whole {
            let rest = u16::try_from(length - whole).unwrap_or(self.transfer_size);
            self.read_blocks(address.saturating_add(whole), rest, 1, &mut bytes)?;
        }
        Ok(bytes)
    }

    fn read_blocks(
        &mut self,
        start: u32,
        size: u16,
        count: u32,
        bytes: &mut Vec<u8>,
    ) -> Result<(), ProtocolError> {
        self.set_pointer(start)?;
        self.idle(operation(Action::Read, start))?;
        let mut address = start;
        for index in 0..count {
            let operation = operation(Action::Read, address);
            let block = u16::try_from(index).unwrap_or(u16::MAX);
            let data = self.upload(operation, FIRST_BLOCK.saturating_add(block), size)?;
            if data.len() != usize::from(size) {
                // The status says why, where the device does not refuse the request itself.
                self.check(operation)?;
                return Err(ProtocolError::Length {
                    operation,
                    expected: size.into(),
                    received: data.len(),
                });
            }
            bytes.extend_from_slice(&data);
            address = address.saturating_add(size.into());
        }
        self.idle(operation(Action::Read, start))
    }

    /// Writes one block of at most [`Session::transfer_size`] bytes, always as block 2 after
    /// setting the address pointer.
    ///
    /// # Errors
    /// [`ProtocolError::Outside`] without a transfer if the block leaves the granted range.
    pub fn write(&mut self, address: u32, data: &[u8]) -> Result<(), ProtocolError> {
        let operation = operation(Action::Write, address);
        let length = u32::try_from(data.len()).unwrap_or(u32::MAX);
        self.grant(operation, length)?;
        if data.is_empty() || data.len() > usize::from(self.transfer_size) {
            return Err(ProtocolError::Length {
                operation,
                expected: self.transfer_size.into(),
                received: data.len(),
            });
        }
        self.set_pointer(address)?;
        self.download(operation, FIRST_BLOCK, data, WRITE_LIMIT_MS)
    }

    /// Erases the sector at `address`. `limit_ms` is the longest time until it is erased.
    ///
    /// # Errors
    /// [`ProtocolError::Outside`] without a transfer if `address` is not granted.
    pub fn erase(&mut self, address: u32, limit_ms: u32) -> Result<(), ProtocolError> {
        let operation = operation(Action::Erase, address);
        self.grant(operation, 1)?;
        self.download(operation, 0, &command(0x41, address), limit_ms)
    }

    /// Leaves the boot loader. A ROM that finds a stack pointer at `address` jumps to the reset
    /// vector behind it, without a reset; otherwise it resets the chip (AN2662, "Leave DFU").
    /// The device disconnects either way, so that a lost connection is no error.
    ///
    /// # Errors
    /// See [`ProtocolError`].
    pub fn leave(&mut self, address: u32) -> Result<(), ProtocolError> {
        let operation = operation(Action::Leave, address);
        self.idle(operation)?;
        self.set_pointer(address)?;
        self.send(operation, Request::Download, FIRST_BLOCK, &[])?;
        match self.status(operation, TRANSFER_LIMIT_MS) {
            Err(ProtocolError::Transfer { cause, .. }) if cause != TransportError::Stall => Ok(()),
            Err(error) => Err(error),
            Ok(DeviceStatus {
                status: Status::OK,
                state: State::MANIFEST | State::BUSY,
                ..
            }) => Ok(()),
            Ok(DeviceStatus { status, state, .. }) if status != Status::OK => {
                Err(ProtocolError::Reported {
                    operation,
                    status,
                    state,
                })
            }
            Ok(DeviceStatus { state, .. }) => {
                Err(ProtocolError::UnexpectedState { operation, state })
            }
        }
    }

    fn set_pointer(&mut self, address: u32) -> Result<(), ProtocolError> {
        let operation = operation(Action::SetAddress, address);
        self.download(operation, 0, &command(0x21, address), TRANSFER_LIMIT_MS)
    }

    /// Refuses a change of `length` bytes that leaves the granted range.
    fn grant(&self, operation: Operation, length: u32) -> Result<(), ProtocolError> {
        let Range { start, end } = self.writable;
        let inside = operation.address >= start
            && operation
                .address
                .checked_add(length)
                .is_some_and(|last| last <= end);
        if inside {
            return Ok(());
        }
        Err(ProtocolError::Outside {
            operation,
            start,
            last: end.saturating_sub(1),
        })
    }

    /// Sends a download and polls until the device is in dfuDNLOAD-IDLE.
    fn download(
        &mut self,
        operation: Operation,
        block: u16,
        data: &[u8],
        limit_ms: u32,
    ) -> Result<(), ProtocolError> {
        // A download is allowed in dfuIDLE and dfuDNLOAD-IDLE; every operation here ends in one
        // of them.
        if let Err(error) = self.send(operation, Request::Download, block, data) {
            return Err(self.reason(error));
        }
        let begin = self.clock.elapsed_ms();
        let mut last_poll = None;
        let mut stalls = 0;
        loop {
            let left = self.left_ms(begin, limit_ms);
            let status = match self.status(operation, left.max(TRANSFER_LIMIT_MS)) {
                Ok(status) => status,
                Err(ProtocolError::Transfer {
                    cause: TransportError::Stall,
                    ..
                }) if last_poll.is_some() && stalls < MAX_BUSY_STALLS => {
                    stalls += 1;
                    DeviceStatus {
                        status: Status::OK,
                        poll_ms: last_poll.unwrap_or(MIN_POLL_MS),
                        state: State::BUSY,
                    }
                }
                Err(error) => return Err(error),
            };
            if status.status != Status::OK || status.state == State::ERROR {
                return Err(self.reported(operation, status));
            }
            match status.state {
                State::DOWNLOAD_IDLE => return Ok(()),
                State::BUSY | State::DOWNLOAD_SYNC => {}
                state => return Err(ProtocolError::UnexpectedState { operation, state }),
            }
            last_poll = Some(status.poll_ms);
            self.pause(operation, begin, limit_ms, status.poll_ms)?;
        }
    }

    /// Time in milliseconds that an operation has left which began at `begin`.
    fn left_ms(&self, begin: u64, limit_ms: u32) -> u32 {
        let spent = self.clock.elapsed_ms().saturating_sub(begin);
        limit_ms.saturating_sub(u32::try_from(spent).unwrap_or(u32::MAX))
    }

    /// Waits before the next status request for the time that the device asks for. The time that
    /// its answers take counts: an operation takes at most its limit and one transfer.
    fn pause(
        &mut self,
        operation: Operation,
        begin: u64,
        limit_ms: u32,
        poll_ms: u32,
    ) -> Result<(), ProtocolError> {
        let left = self.left_ms(begin, limit_ms);
        if left == 0 {
            return Err(ProtocolError::Timeout {
                operation,
                limit_ms,
            });
        }
        self.clock.sleep_ms(poll_ms.min(left).max(MIN_POLL_MS));
        Ok(())
    }

    fn upload(
        &mut self,
        operation: Operation,
        block: u16,
        length: u16,
    ) -> Result<Vec<u8>, ProtocolError> {
        self.transfers += 1;
        let data = self
            .transport
            .control_in(Request::Upload, block, length, TRANSFER_LIMIT_MS);
        match data {
            Ok(data) if data.len() <= usize::from(length) => Ok(data),
            Ok(data) => Err(ProtocolError::Length {
                operation,
                expected: length.into(),
                received: data.len(),
            }),
            Err(cause) => Err(self.reason(ProtocolError::Transfer { operation, cause })),
        }
    }

    /// Replaces a refused transfer by the status that explains it, if the device reports one.
    fn reason(&mut self, error: ProtocolError) -> ProtocolError {
        let ProtocolError::Transfer {
            operation,
            cause: TransportError::Stall,
        } = error
        else {
            return error;
        };
        self.check(operation).err().unwrap_or(error)
    }

    /// Fails with the status that the device reports, unless it is OK.
    fn check(&mut self, operation: Operation) -> Result<(), ProtocolError> {
        let status = self.status(operation, TRANSFER_LIMIT_MS)?;
        if status.status == Status::OK {
            return Ok(());
        }
        Err(self.reported(operation, status))
    }

    /// Clears the reported error so that the next operation can start.
    fn reported(&mut self, operation: Operation, status: DeviceStatus) -> ProtocolError {
        // The reported status is the error to return, whether or not clearing succeeds.
        let _ = self.send(operation, Request::ClearStatus, 0, &[]);
        ProtocolError::Reported {
            operation,
            status: status.status,
            state: status.state,
        }
    }

    fn status(
        &mut self,
        operation: Operation,
        timeout_ms: u32,
    ) -> Result<DeviceStatus, ProtocolError> {
        self.transfers += 1;
        let bytes = self
            .transport
            .control_in(Request::GetStatus, 0, DeviceStatus::LENGTH, timeout_ms)
            .map_err(|cause| ProtocolError::Transfer { operation, cause })?;
        DeviceStatus::parse(&bytes).ok_or(ProtocolError::Length {
            operation,
            expected: DeviceStatus::LENGTH.into(),
            received: bytes.len(),
        })
    }

    fn send(
        &mut self,
        operation: Operation,
        request: Request,
        value: u16,
        data: &[u8],
    ) -> Result<(), ProtocolError> {
        self.transfers += 1;
        self.transport
            .control_out(request, value, data, TRANSFER_LIMIT_MS)
            .map_err(|cause| ProtocolError::Transfer { operation, cause })
    }
}

const fn operation(action: Action, address: u32) -> Operation {
    Operation { action, address }
}

/// DfuSe command with an address, little-endian (AN3156).
const fn command(code: u8, address: u32) -> [u8; 5] {
    let [a, b, c, d] = address.to_le_bytes();
    [code, a, b, c, d]
}
