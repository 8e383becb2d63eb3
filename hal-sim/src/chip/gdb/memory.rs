//! Reads and writes memory as a debugger does: no time passes, and reading has no side effects.

use super::points::Points;
use super::refused::GdbRefusal;
use crate::chip::board::Board;
use crate::chip::cpu::{Bus, Size, is_private};
use crate::chip::soc::flash::{BASE, SECTORS, SIZE};

/// Memory map for clients: gdb sets hardware breakpoints in flash and writes it by sectors, as
/// `load` requires.
pub const MAP: &str = include_str!("memory-map.xml");

/// Base address of RCC, which enables the clocks.
const RCC: u32 = 0x4002_3800;

const NOWHERE: GdbRefusal = GdbRefusal::Address("there is no memory or register at this address");
const FLASH_WRITE: GdbRefusal =
    GdbRefusal::Address("flash is written with `load`, not by storing to it");
const NO_FLASH: GdbRefusal = GdbRefusal::Address("this address is not in the flash");

impl Board<Points> {
    /// Reads `count` bytes from `from` on, or fewer if an address after the first does not answer.
    ///
    /// # Errors
    /// Fails if the first byte cannot be read.
    pub(super) fn peek(&self, from: u32, count: usize) -> Result<Vec<u8>, GdbRefusal> {
        let mut bytes = Vec::with_capacity(count);
        let mut registers = None;
        while bytes.len() < count {
            let Some(at) = from.checked_add(bytes.len() as u32) else {
                break; // end of memory
            };
            match self.peek_memory(at) {
                Some(byte) => bytes.push(byte),
                None => {
                    let copy = registers.get_or_insert_with(|| self.fork());
                    let left = count - bytes.len();
                    match peek_register(copy, at, left) {
                        Some(own) => bytes.extend(own),
                        None => break,
                    }
                }
            }
        }
        match bytes.is_empty() && count > 0 {
            true => Err(NOWHERE),
            false => Ok(bytes),
        }
    }

    /// Returns a copy of the board, from which registers are read: reading may change their state,
    /// but not that of the board.
    fn fork(&self) -> Self {
        let mut copy = self.clone();
        copy.around.soc.rcc.settle();
        copy
    }

    fn peek_memory(&self, at: u32) -> Option<u8> {
        let soc = &self.around.soc;
        match at >> 24 {
            0x00 | 0x08 if at & 0x00FF_FFFF < SIZE as u32 => {
                Some(soc.flash.peek(at, Size::Byte) as u8)
            }
            0x20 => Some(soc.ram.read(at, Size::Byte)? as u8),
            0x10 => Some(soc.ccm.read(at, Size::Byte)? as u8),
            _ => None,
        }
    }

    /// Writes RAM directly, and registers as the core would: in words where the address and the
    /// remaining bytes allow, else in half-words, else in bytes.
    ///
    /// # Errors
    /// Fails if an address cannot be written; the bytes before it are written.
    pub(super) fn poke(&mut self, from: u32, bytes: &[u8]) -> Result<(), GdbRefusal> {
        let mut left = bytes;
        while !left.is_empty() {
            let at = from.checked_add((bytes.len() - left.len()) as u32);
            let at = at.ok_or(NOWHERE)?;
            let size = widest(at, left.len());
            let (own, others) = left.split_at(size.bytes() as usize);
            let mut word = [0; 4];
            word[..own.len()].copy_from_slice(own);
            self.store(at, size, u32::from_le_bytes(word))?;
            left = others;
        }
        Ok(())
    }

    fn store(&mut self, at: u32, size: Size, value: u32) -> Result<(), GdbRefusal> {
        let cycle = self.cpu.cycle;
        let soc = &mut self.around.soc;
        let written = match at >> 24 {
            0x20 => soc.ram.write(at, size, value),
            0x10 => soc.ccm.write(at, size, value),
            0x00 | 0x08 if at & 0x00FF_FFFF < SIZE as u32 => return Err(FLASH_WRITE),
            _ if is_private(at) => self.cpu.system.write(at, size, value, cycle).ok(),
            _ => self.around.write(at, size, value, cycle).map(drop).ok(),
        };
        if at >> 10 == RCC >> 10 {
            self.around.soc.rcc.settle();
        }
        written.ok_or(GdbRefusal::Address(
            "no memory or register accepts a write of this size at this address",
        ))
    }

    /// Erases the sectors that contain the `count` bytes from `from` on.
    ///
    /// # Errors
    /// Fails if the range is not in the flash.
    pub(super) fn erase(&mut self, from: u32, count: u32) -> Result<(), GdbRefusal> {
        let start = from.checked_sub(BASE).ok_or(NO_FLASH)?;
        let end = start.checked_add(count).ok_or(NO_FLASH)?;
        if end > SIZE as u32 {
            return Err(NO_FLASH);
        }
        for sector in SECTORS.windows(2) {
            if sector[0] < end && start < sector[1] {
                let blank = vec![0xFF; (sector[1] - sector[0]) as usize];
                let done = self.around.soc.flash.replace(BASE + sector[0], &blank);
                done.map_err(|_| NO_FLASH)?;
            }
        }
        Ok(())
    }

    /// Programs `bytes` into flash that is erased or already contains them.
    ///
    /// # Errors
    /// Fails if the range is not in the flash, or would need an erase first.
    pub(super) fn program(&mut self, from: u32, bytes: &[u8]) -> Result<(), GdbRefusal> {
        let flash = &mut self.around.soc.flash;
        // Programming only clears bits (RM0090 section 3.6).
        let kept = |(at, &new): (u32, &u8)| flash.peek(at, Size::Byte) as u8 & new == new;
        if from < BASE || bytes.len() > SIZE - ((from - BASE) as usize).min(SIZE) {
            return Err(NO_FLASH);
        }
        if !(from..).zip(bytes).all(kept) {
            return Err(GdbRefusal::Address(
                "the flash at this address is not erased",
            ));
        }
        flash.replace(from, bytes).map_err(|_| NO_FLASH)
    }
}

/// Returns the widest access that `left` bytes at `at` allow.
const fn widest(at: u32, left: usize) -> Size {
    if at.is_multiple_of(4) && left >= 4 {
        Size::Word
    } else if at.is_multiple_of(2) && left >= 2 {
        Size::Half
    } else {
        Size::Byte
    }
}

/// Reads up to `left` bytes of one word from the register at `at`: from the whole word, or, if that
/// has no answer, with the widest access that fits. The FSMC's memory counts as absent: a debugger
/// that reads all of it would wait for a gigabyte of zeros.
fn peek_register(board: &mut Board<Points>, at: u32, left: usize) -> Option<Vec<u8>> {
    if (0x6000_0000..0xA000_0000).contains(&at) {
        return None;
    }
    let aligned_word = load(board, at & !3, Size::Word).map(|word| (word, at & 3, 4));
    let (word, lane, end) = aligned_word.or_else(|| {
        let size = widest(at, left);
        load(board, at, size).map(|word| (word, 0, size.bytes()))
    })?;
    let count = left.min((end - lane) as usize);
    let bytes = word.to_le_bytes();
    Some(bytes[lane as usize..lane as usize + count].to_vec())
}

fn load(board: &mut Board<Points>, at: u32, size: Size) -> Option<u32> {
    let cycle = board.cpu.cycle;
    match is_private(at) {
        true => board.cpu.system.read(at, size, cycle).ok(),
        false => board
            .around
            .read(at, size, cycle)
            .ok()
            .map(|read| read.value),
    }
}
