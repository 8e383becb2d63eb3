//! Implements semihosting (Arm IHI 0030), requests of a program to the host by BKPT 0xAB, as far as
//! the bench image and test programs use it. Files are kept in memory.

use super::bus::AccessError;
use super::{Access, Bus, Cpu, Fault, Size, Stop, TrapResult};
use std::collections::BTreeMap;

/// Immediate of BKPT that requests semihosting.
const BREAKPOINT: u8 = 0xAB;

/// Numbers of the semihosting operations, which a program passes in R0.
mod operation {
    pub const OPEN: u32 = 0x01;
    pub const CLOSE: u32 = 0x02;
    pub const WRITEC: u32 = 0x03;
    pub const WRITE0: u32 = 0x04;
    pub const WRITE: u32 = 0x05;
    pub const ERRNO: u32 = 0x13;
    pub const EXIT: u32 = 0x18;
    pub const EXIT_EXTENDED: u32 = 0x20;
}

/// Reason of an exit without failure (ADP_Stopped_ApplicationExit).
const APPLICATION_EXIT: u32 = 0x2_0026;
/// Value in R0 after an OPEN or CLOSE that failed.
const REFUSED: u32 = u32::MAX;
/// File name with which OPEN opens the console.
const CONSOLE: &[u8] = b":tt";
/// Longest name of a file, bytes.
const LONGEST_NAME: u32 = 256;

/// Output that a program writes through semihosting: console and files.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Semihosting {
    /// All bytes written to the console, in order.
    pub console: Vec<u8>,
    /// Contents of the files written, by name.
    pub files: BTreeMap<String, Vec<u8>>,
    /// Console or file behind handle n + 1; `None` once closed.
    open: Vec<Option<Handle>>,
}

#[derive(Clone, PartialEq, Debug)]
enum Handle {
    Console,
    File(String),
}

impl Semihosting {
    /// Opens a file and returns its handle, or [`REFUSED`]. Modes 4–7 truncate, 8–11 append;
    /// reading (0–3) is refused except for the console.
    fn open(&mut self, name: &[u8], mode: u32) -> u32 {
        let handle = if name == CONSOLE {
            Handle::Console
        } else {
            let name = String::from_utf8_lossy(name).into_owned();
            match mode {
                4..=7 => drop(self.files.insert(name.clone(), Vec::new())),
                8..=11 => drop(self.files.entry(name.clone()).or_default()),
                _ => return REFUSED,
            }
            Handle::File(name)
        };
        self.open.push(Some(handle));
        self.open.len() as u32
    }

    fn handle(&mut self, number: u32) -> Option<&mut Option<Handle>> {
        self.open.get_mut((number as usize).checked_sub(1)?)
    }

    fn close(&mut self, number: u32) -> u32 {
        match self.handle(number) {
            Some(handle) if handle.is_some() => {
                *handle = None;
                0
            }
            _ => REFUSED,
        }
    }

    /// Writes to a handle; returns the number of bytes not written.
    fn write(&mut self, number: u32, bytes: &[u8]) -> u32 {
        let sink = match self.handle(number).and_then(|handle| handle.clone()) {
            Some(Handle::Console) => &mut self.console,
            Some(Handle::File(name)) => self.files.entry(name).or_default(),
            None => return bytes.len() as u32,
        };
        sink.extend_from_slice(bytes);
        0
    }
}

impl Cpu {
    /// Executes BKPT `immediate`, which takes no time. If it is 0xAB and semihosting is on, carries
    /// out the request. Otherwise the core stops if a debugger is attached, and takes
    /// [`Fault::Breakpoint`] if not.
    ///
    /// # Errors
    /// Returns a trap if the program ended, or made a request that is not modelled.
    pub(super) fn breakpoint(&mut self, bus: &mut impl Bus, immediate: u8) -> TrapResult {
        let host = match immediate {
            BREAKPOINT => self.system.semihosting.take(),
            _ => None,
        };
        let Some(mut host) = host else {
            let pc = self.registers.r[15];
            return Err(match self.system.has_debugger() {
                true => Stop::BreakpointInstruction { pc }.into(),
                false => Fault::Breakpoint.into(),
            });
        };
        let answer = self.call_host(bus, &mut host);
        self.system.semihosting = Some(host);
        if let Some(answer) = answer? {
            self.registers.r[0] = answer;
        }
        Ok(())
    }

    /// Carries out the semihosting request in R0 and R1; returns the new R0, if it changes.
    fn call_host(
        &mut self,
        bus: &mut impl Bus,
        host: &mut Semihosting,
    ) -> Result<Option<u32>, Stop> {
        let [number, block, ..] = self.registers.r;
        Ok(Some(match number {
            operation::OPEN => {
                let [name, mode, length] = self.block(bus, block)?;
                let name = self.guest_bytes(bus, name, length.min(LONGEST_NAME))?;
                host.open(&name, mode)
            }
            operation::CLOSE => {
                let [handle] = self.block(bus, block)?;
                host.close(handle)
            }
            operation::WRITE => {
                let [handle, start, length] = self.block(bus, block)?;
                let bytes = self.guest_bytes(bus, start, length)?;
                host.write(handle, &bytes)
            }
            operation::WRITEC => {
                let byte = self.guest_bytes(bus, block, 1)?;
                host.console.extend(byte);
                return Ok(None);
            }
            operation::WRITE0 => {
                let text = self.guest_text(bus, block)?;
                host.console.extend(text);
                return Ok(None);
            }
            operation::ERRNO => 0,
            operation::EXIT => {
                return Err(Stop::Exit(u32::from(block != APPLICATION_EXIT)));
            }
            operation::EXIT_EXTENDED => {
                let [reason, status] = self.block(bus, block)?;
                let is_exit = reason == APPLICATION_EXIT;
                return Err(Stop::Exit(if is_exit { status } else { 1 }));
            }
            _ => {
                return Err(Stop::Instruction {
                    instruction: 0xBEAB,
                    pc: self.registers.r[15],
                    what: "this semihosting operation is not modelled",
                });
            }
        }))
    }

    fn block<const N: usize>(&self, bus: &mut impl Bus, address: u32) -> Result<[u32; N], Stop> {
        let mut words = [0; N];
        for (word, offset) in words.iter_mut().zip((0..).step_by(4)) {
            *word = self.guest_word(bus, address.wrapping_add(offset), Size::Word)?;
        }
        Ok(words)
    }

    fn guest_bytes(&self, bus: &mut impl Bus, start: u32, length: u32) -> Result<Vec<u8>, Stop> {
        (0..length)
            .map(|offset| self.guest_byte(bus, start.wrapping_add(offset)))
            .collect()
    }

    /// Reads the program's text from `start` up to the first zero.
    fn guest_text(&self, bus: &mut impl Bus, start: u32) -> Result<Vec<u8>, Stop> {
        let mut text = vec![];
        let mut address = start;
        loop {
            match self.guest_byte(bus, address)? {
                0 => return Ok(text),
                byte => text.push(byte),
            }
            address = address.wrapping_add(1);
        }
    }

    fn guest_byte(&self, bus: &mut impl Bus, address: u32) -> Result<u8, Stop> {
        self.guest_word(bus, address, Size::Byte)
            .map(|word| (word & 0xFF) as u8)
    }

    fn guest_word(&self, bus: &mut impl Bus, address: u32, size: Size) -> Result<u32, Stop> {
        let read = bus.read(address, size, self.cycle);
        read.map(|read| read.value).map_err(|denied| Stop::Access {
            access: Access {
                address,
                size,
                written: None,
            },
            pc: self.registers.r[15],
            what: match denied {
                AccessError::Error => "a semihosting argument points to memory that does not exist",
                AccessError::Unmodelled(what) => what.0,
            },
        })
    }
}
