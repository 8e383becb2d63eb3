//! State machine of the simulated boot loader.

use super::{Cut, CutPoint, Fault, Memory, PollReport, SimulatedClock, Stop};
use crate::chip::{Chip, STM32F405, word};
use crate::protocol::{Clock, DeviceStatus, Request, State, Status, Transport, TransportError};
use hal_sim::random::Sequence;

/// Largest transfer of the ROM in bytes.
const TRANSFER_SIZE: u16 = 2048;
/// Commands in the order in which the ROM lists them (AN3156).
const COMMANDS: [u8; 4] = [0x00, 0x21, 0x41, 0x92];

/// Way in which the chip left the boot loader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitKind {
    /// Jumped to the reset vector at this address plus 4.
    Jumped(u32),
    /// Reset, because the word at the address pointer was no stack pointer.
    Reset,
}

/// Download that the next DFU_GETSTATUS starts.
#[derive(Debug, Clone)]
enum Pending {
    SetPointer(u32),
    Erase(u32),
    MassErase,
    ReadUnprotect,
    Write { address: u32, data: Vec<u8> },
    Leave,
    Unknown,
}

/// Simulated STM32F405 in its boot loader. The flash and all settings are public so that tests
/// can prepare and inspect them.
#[derive(Debug, Clone)]
pub struct Simulated {
    /// Contents of flash.
    pub memory: Memory,
    /// Whether read protection is on.
    pub read_protected: bool,
    /// Cut of connection and supply.
    pub cut: Option<Cut>,
    /// Misbehaviour from this transfer on, counted from 0.
    pub fault: Option<(u64, Fault)>,
    /// Time in milliseconds after which each request is answered.
    pub latency_ms: u32,
    /// Poll times while busy.
    pub poll: PollReport,
    /// Whether block addresses count in lengths of the request, as AN3156 says, instead of in the
    /// transfer size, as ST's USB device library does.
    pub blocks_by_length: bool,
    /// Number of transfers since creation.
    pub transfers: u64,
    /// Start addresses of erased sectors, in order.
    pub erased: Vec<u32>,
    /// Start addresses and lengths of writes, in order.
    pub written: Vec<(u32, usize)>,
    /// Numbers of the transfers that started the writes in `written`, in the same order.
    pub writing: Vec<u64>,
    /// Whether mass erase or read unprotect was requested.
    pub forbidden: bool,
    /// Way in which the chip left the boot loader.
    pub left: Option<ExitKind>,
    chip: Chip,
    clock: SimulatedClock,
    powered: bool,
    state: State,
    status: Status,
    pointer: u32,
    pending: Option<Pending>,
    busy_until_ms: u64,
}

impl Simulated {
    /// Creates an STM32F405 with erased flash that has just started its boot loader.
    #[must_use]
    pub fn new(clock: SimulatedClock) -> Self {
        Self {
            memory: Memory::new(STM32F405),
            read_protected: false,
            cut: None,
            fault: None,
            latency_ms: 0,
            poll: PollReport::Exact,
            blocks_by_length: false,
            transfers: 0,
            erased: Vec::new(),
            written: Vec::new(),
            writing: Vec::new(),
            forbidden: false,
            left: None,
            chip: STM32F405,
            clock,
            powered: true,
            state: State::ERROR,
            status: Status::FIRMWARE,
            pointer: STM32F405.origin,
            pending: None,
            busy_until_ms: 0,
        }
    }

    /// Starts the boot loader again with the same flash and without cut, fault and records.
    #[must_use]
    pub fn replugged(self) -> Self {
        Self {
            memory: self.memory,
            read_protected: self.read_protected,
            ..Self::new(self.clock)
        }
    }

    /// Transfer size for the session in bytes.
    #[must_use]
    pub const fn transfer_size(&self) -> u16 {
        TRANSFER_SIZE
    }

    fn active(&self) -> Option<Fault> {
        let (from, fault) = self.fault?;
        (self.transfers > from).then_some(fault)
    }

    /// Counts the transfer, lets its time pass and applies cuts and faults that come before it.
    fn begin(&mut self, timeout_ms: u32) -> Result<Option<CutPoint>, TransportError> {
        if !self.powered {
            return Err(TransportError::Disconnected);
        }
        self.clock.sleep_ms(self.latency_ms.min(timeout_ms));
        let number = self.transfers;
        self.transfers += 1;
        match self.active() {
            Some(Fault::Stall) => return Err(TransportError::Stall),
            Some(Fault::Silence) => {
                self.clock.sleep_ms(timeout_ms);
                return Err(TransportError::Timeout);
            }
            Some(Fault::Disconnect) => {
                self.powered = false;
                return Err(TransportError::Disconnected);
            }
            _ if self.latency_ms > timeout_ms => return Err(TransportError::Timeout),
            _ => {}
        }
        let point = self.cut.filter(|cut| cut.transfer == number);
        if point.is_some_and(|cut| cut.point == CutPoint::Before) {
            self.powered = false;
            return Err(TransportError::Disconnected);
        }
        Ok(point.map(|cut| cut.point))
    }

    fn end<R>(
        &mut self,
        cut: Option<CutPoint>,
        answer: Result<R, TransportError>,
    ) -> Result<R, TransportError> {
        if cut.is_some() {
            self.powered = false;
            return Err(TransportError::Disconnected);
        }
        answer
    }

    fn refuse<R>(&mut self, status: Status) -> Result<R, TransportError> {
        self.fail(status);
        Err(TransportError::Stall)
    }

    fn fail(&mut self, status: Status) {
        self.state = State::ERROR;
        self.status = status;
        self.pending = None;
    }

    fn get_status(&mut self, cut: Option<CutPoint>) -> DeviceStatus {
        let mut poll_ms = 0;
        match self.state {
            State::DOWNLOAD_SYNC => {
                poll_ms = self.start(cut);
            }
            State::BUSY if self.clock.now_ms() < self.busy_until_ms => {
                let remaining = self.busy_until_ms - self.clock.now_ms();
                poll_ms = u32::try_from(remaining).unwrap_or(u32::MAX);
            }
            State::BUSY => self.state = State::DOWNLOAD_IDLE,
            State::MANIFEST_SYNC => {
                self.state = State::MANIFEST;
                self.leave();
            }
            _ => {}
        }
        if let (PollReport::Fixed(ms), State::BUSY) = (self.poll, self.state) {
            poll_ms = ms;
        }
        DeviceStatus {
            status: self.status,
            poll_ms,
            state: self.state,
        }
    }

    /// Runs the pending operation. Returns its duration in milliseconds.
    fn start(&mut self, cut: Option<CutPoint>) -> u32 {
        let seed = self.cut.map_or(0, |cut| cut.seed);
        let mut random = (cut == Some(CutPoint::During)).then(|| Sequence::new(seed));
        let Some(pending) = self.pending.take() else {
            self.fail(Status::STALLED);
            return 0;
        };
        if self.read_protected && !matches!(pending, Pending::ReadUnprotect) {
            self.fail(Status::VENDOR);
            return 0;
        }
        let fault = self.active();
        let duration = match pending {
            Pending::SetPointer(address) if self.valid(address) => {
                self.pointer = address;
                Some(0)
            }
            Pending::Erase(address) if self.valid(address) => {
                self.memory.sector(address).map(|sector| {
                    self.erased.push(sector.address);
                    if fault != Some(Fault::IgnoreErase) {
                        self.memory.erase(&sector, random.as_mut());
                    }
                    // Typical time at x32 parallelism (DS8626).
                    match sector.size {
                        0..=0x4000 => 250,
                        0x4001..=0x1_0000 => 550,
                        _ => 1000,
                    }
                })
            }
            Pending::Write { address, data } if self.valid(address) => {
                self.written.push((address, data.len()));
                self.writing.push(self.transfers.saturating_sub(1));
                let stop = match cut {
                    Some(CutPoint::AtByte { byte, left }) => Some(Stop::AtByte {
                        byte: byte.into(),
                        left,
                    }),
                    _ => random.as_mut().map(Stop::Random),
                };
                if fault != Some(Fault::IgnoreWrites) {
                    self.memory.program(address, &data, stop);
                }
                // 16 µs per word (DS8626).
                Some(u32::try_from(data.len() / 250).unwrap_or(u32::MAX))
            }
            Pending::MassErase | Pending::ReadUnprotect => {
                self.forbidden = true;
                self.memory = Memory::new(self.chip);
                self.read_protected = false;
                Some(16_000)
            }
            _ => None,
        };
        let Some(duration) = duration else {
            self.fail(Status::TARGET);
            return 0;
        };
        self.state = State::BUSY;
        self.busy_until_ms = self.clock.now_ms().saturating_add(duration.into());
        duration
    }

    fn valid(&self, address: u32) -> bool {
        self.active() != Some(Fault::OtherSetting) && self.memory.sector(address).is_some()
    }

    /// Jumps or resets as AN2662 describes for "Leave DFU".
    fn leave(&mut self) {
        let first = self.memory.read(self.pointer, 4);
        let pointer = first.and_then(|bytes| word(bytes, 0)).unwrap_or_default();
        self.left = Some(if self.chip.is_stack_pointer(pointer) {
            ExitKind::Jumped(self.pointer)
        } else {
            ExitKind::Reset
        });
        self.powered = false;
    }

    fn block_address(&self, block: u16, length: u16) -> u32 {
        let unit = if self.blocks_by_length {
            length
        } else {
            TRANSFER_SIZE
        };
        let offset = u32::from(block.saturating_sub(2)) * u32::from(unit);
        self.pointer.saturating_add(offset)
    }

    fn upload(&mut self, block: u16, length: u16) -> Result<Vec<u8>, TransportError> {
        if !matches!(self.state, State::IDLE | State::UPLOAD_IDLE) {
            return self.refuse(Status::STALLED);
        }
        let data = match block {
            0 => COMMANDS.to_vec(),
            1 => return self.refuse(Status::STALLED),
            _ if self.read_protected => return self.refuse(Status::VENDOR),
            _ => {
                let length = length.min(TRANSFER_SIZE);
                let address = self.block_address(block, length);
                match self.memory.read(address, length.into()) {
                    Some(bytes) if self.valid(address) => bytes.to_vec(),
                    _ => return self.refuse(Status::TARGET),
                }
            }
        };
        self.state = State::UPLOAD_IDLE;
        Ok(data)
    }

    fn download(&mut self, block: u16, data: &[u8]) -> Result<(), TransportError> {
        if !matches!(self.state, State::IDLE | State::DOWNLOAD_IDLE) {
            return self.refuse(Status::STALLED);
        }
        let length = u16::try_from(data.len()).unwrap_or(u16::MAX);
        let pending = match (block, data) {
            (_, []) => Pending::Leave,
            (0, &[0x21, a, b, c, d]) => Pending::SetPointer(u32::from_le_bytes([a, b, c, d])),
            (0, &[0x41, a, b, c, d]) => Pending::Erase(u32::from_le_bytes([a, b, c, d])),
            (0, [0x41]) => Pending::MassErase,
            (0, [0x92]) => Pending::ReadUnprotect,
            (0, _) => Pending::Unknown,
            (1, _) => return self.refuse(Status::STALLED),
            _ if data.len() > usize::from(TRANSFER_SIZE) => return self.refuse(Status::STALLED),
            _ => Pending::Write {
                address: self.block_address(block, length),
                data: data.to_vec(),
            },
        };
        self.state = match pending {
            Pending::Leave => State::MANIFEST_SYNC,
            _ => State::DOWNLOAD_SYNC,
        };
        self.pending = Some(pending);
        Ok(())
    }

    /// Changes an answer as the active fault says.
    fn distort(&self, request: Request, mut bytes: Vec<u8>) -> Vec<u8> {
        let status = request == Request::GetStatus;
        match self.active() {
            Some(Fault::ShortAnswer) => {
                bytes.pop();
            }
            Some(Fault::LongAnswer) => bytes.push(0),
            Some(Fault::Report(reported)) if status => {
                if let Some(byte) = bytes.first_mut() {
                    *byte = reported.0;
                }
            }
            Some(Fault::ReportState(state)) if status => {
                if let Some(byte) = bytes.get_mut(4) {
                    *byte = state;
                }
            }
            Some(Fault::Busy(poll_ms)) if status => {
                let busy = DeviceStatus {
                    status: Status::OK,
                    poll_ms,
                    state: State::BUSY,
                };
                bytes = busy.to_bytes().to_vec();
            }
            Some(Fault::FlipBit) if request == Request::Upload => {
                if let Some(byte) = bytes.last_mut() {
                    *byte ^= 0x10;
                }
            }
            _ => {}
        }
        bytes
    }
}

impl Transport for Simulated {
    fn control_in(
        &mut self,
        request: Request,
        value: u16,
        length: u16,
        timeout_ms: u32,
    ) -> Result<Vec<u8>, TransportError> {
        let cut = self.begin(timeout_ms)?;
        let answer = match request {
            Request::GetStatus => Ok(self.get_status(cut).to_bytes().to_vec()),
            Request::GetState => Ok(vec![self.state.0]),
            Request::Upload => self.upload(value, length),
            _ => self.refuse(Status::STALLED),
        };
        let answer = answer.map(|bytes| self.distort(request, bytes));
        self.end(cut, answer)
    }

    fn control_out(
        &mut self,
        request: Request,
        value: u16,
        data: &[u8],
        timeout_ms: u32,
    ) -> Result<(), TransportError> {
        let cut = self.begin(timeout_ms)?;
        let answer = match (request, self.state) {
            (Request::Download, _) => self.download(value, data),
            (Request::ClearStatus, State::ERROR)
            | (
                Request::Abort,
                State::IDLE | State::DOWNLOAD_SYNC | State::DOWNLOAD_IDLE | State::UPLOAD_IDLE,
            ) => {
                self.pending = None;
                self.state = State::IDLE;
                self.status = Status::OK;
                Ok(())
            }
            _ => self.refuse(Status::STALLED),
        };
        self.end(cut, answer)
    }
}
