//! One stream: its settings, its place, and its one-word buffer.

use super::NEVER;
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse};
use crate::chip::soc::matrix::Slave;

/// Bits of SxCR (RM0090 10.5.5) and flags of a stream, at stream 0's place.
pub(crate) mod bit {
    pub const EN: u32 = 1; // CR: enable
    pub const INTERRUPTS: u32 = 0b1_1110; // CR: interrupt enables
    pub const MEMORY_TO_PERIPHERAL: u32 = 1 << 6; // CR: memory to peripheral
    pub const CIRC: u32 = 1 << 8; // CR: circular
    pub const FEIF: u32 = 1; // FIFO error
    pub const HTIF: u32 = 1 << 4; // Half transfer
    pub const TCIF: u32 = 1 << 5; // Transfer complete
}

/// CR but CHSEL, PL, CIRC, DIR 0: words both sides, memory increments, and
/// nothing else set.
const WORDS: u32 = 0b10 << 13 | 0b10 << 11 | 1 << 10;
const FREE: u32 = 0x7 << 25 | 0b11 << 16 | bit::CIRC | bit::MEMORY_TO_PERIPHERAL | bit::EN;

/// The far end of the peripheral port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// No stream is enabled.
    None,
    /// BSRR of a port; 0 is A.
    Bsrr(usize),
    /// A word of SRAM.
    Word(u32),
    /// Items are lost, or zero.
    Nowhere,
}

/// State of a stream.
#[derive(Clone, PartialEq, Debug)]
pub struct Stream {
    pub(super) cr: u32,
    pub(super) ndtr: u16,
    pub(super) par: u32,
    pub(super) m0ar: u32,
    pub(super) fcr: u32,
    /// NDTR when it was enabled.
    pub(crate) length: u16,
    /// Items that went over the memory port, modulo `length`.
    index: u16,
    /// The far end of the peripheral port.
    pub(crate) target: Target,
    /// The slave that the memory port uses.
    pub(crate) memory: Slave,
    /// EN was written 0; the transfer under way goes on.
    pub stopping: bool,
    /// The word between the ports.
    pub word: Option<u32>,
    /// When it came or went.
    pub turned: Cycle,
    /// Since when the peripheral port should serve it.
    pub asked: Cycle,
    /// Since when the memory port should serve it.
    pub due: Cycle,
}

impl Stream {
    pub(super) const fn new() -> Self {
        Self {
            cr: 0,
            ndtr: 0,
            par: 0,
            m0ar: 0,
            fcr: 1, // threshold one half (RM0090 10.5.10)
            length: 0,
            index: 0,
            target: Target::None,
            memory: Slave::Sram1,
            stopping: false,
            word: None,
            turned: 0,
            asked: NEVER,
            due: NEVER,
        }
    }

    /// EN reads 1.
    #[inline]
    pub const fn is_enabled(&self) -> bool {
        self.cr & bit::EN != 0
    }

    /// CIRC.
    #[inline]
    pub const fn is_circular(&self) -> bool {
        self.cr & bit::CIRC != 0
    }

    /// Direction: memory to peripheral.
    #[inline]
    pub const fn plays(&self) -> bool {
        self.cr & bit::MEMORY_TO_PERIPHERAL != 0
    }

    /// PL, 3 is very high.
    pub const fn priority(&self) -> u32 {
        self.cr >> 16 & 0b11
    }

    /// CHSEL.
    pub const fn channel(&self) -> u32 {
        self.cr >> 25 & 0b111
    }

    /// The slave that the peripheral port uses.
    #[inline]
    pub const fn far_slave(&self) -> Slave {
        match self.target {
            Target::Word(address) => sram(address),
            _ => Slave::Ahb1,
        }
    }

    /// Address of the memory port's next item.
    #[inline]
    pub const fn address(&self) -> u32 {
        (self.m0ar & !0b11).wrapping_add(4 * self.index as u32)
    }

    /// The peripheral port can move the next item at `at`: its word is there
    /// (playing) or the last one gone.
    #[inline]
    pub const fn is_ready_at(&self, at: Cycle) -> bool {
        self.plays() == self.word.is_some() && self.turned <= at
    }

    /// The memory port moved one item.
    #[inline]
    pub fn step(&mut self) {
        self.index += 1;
        if self.index >= self.length {
            self.index = 0;
        }
    }

    /// Whether a stream that plays has fetched, not being circular, all.
    pub const fn has_fetched_all(&self) -> bool {
        !self.is_circular() && self.index == 0
    }

    /// Items that it can move before it begins anew or a flag rises.
    pub fn uneventful(&self) -> u16 {
        let half = self.length / 2;
        let flag = if self.ndtr > half { half } else { 0 };
        let items = (self.ndtr - flag).saturating_sub(1);
        items.min(self.length.saturating_sub(self.index))
    }

    /// Both ports moved `items`, at most [`Self::uneventful`].
    pub fn skip(&mut self, items: u16) {
        self.ndtr -= items;
        self.index += items;
        if self.index >= self.length {
            self.index = 0;
        }
    }

    /// The peripheral port moved one item: gives what is left of NDTR, which a
    /// circular stream then loads anew (RM0090 10.3.9).
    #[inline]
    pub(super) fn count(&mut self) -> u16 {
        self.ndtr = self.ndtr.saturating_sub(1);
        let left = self.ndtr;
        if left == 0 && self.is_circular() {
            self.ndtr = self.length;
        }
        left
    }

    /// EN was written 1, complete from `done` on: takes the settings over.
    pub(super) fn switch_on(&mut self, done: Cycle) -> Modelled {
        refuse(
            self.cr & !FREE != WORDS,
            "a DMA2 stream that does not move words, incrementing its memory only",
        )?;
        refuse(self.fcr & 0b100 != 0, "a DMA2 stream's FIFO")?;
        refuse(self.ndtr == 0, "a DMA2 stream enabled with nothing to move")?;
        self.target = self.far_end()?;
        self.memory = sram(self.m0ar);
        let last = self.m0ar.wrapping_add(4 * (u32::from(self.ndtr) - 1));
        if !self.m0ar.is_multiple_of(4) || !is_sram(self.m0ar) || !is_sram(last) {
            return Err(Unmodelled("DMA2 memory other than SRAM1 and SRAM2"));
        }
        refuse(
            sram(last) != self.memory,
            "a DMA2 buffer across SRAM1 and SRAM2",
        )?;
        self.cr |= bit::EN;
        (self.length, self.index) = (self.ndtr, 0);
        (self.word, self.stopping) = (None, false);
        self.asked = NEVER;
        self.due = if self.plays() { done } else { NEVER };
        Ok(())
    }

    /// PAR or M0AR changed while it is on. Words are aligned: their lowest two bits do not
    /// count (RM0090 10.3.10).
    pub(super) fn redirect(&mut self) {
        let port = (self.par & !0b11).wrapping_sub(0x4002_0018);
        let is_port = port <= 0x2000 && port.is_multiple_of(0x400);
        self.target = match (self.plays(), is_sram(self.par)) {
            (true, _) if is_port => Target::Bsrr(port as usize / 0x400),
            (false, true) => Target::Word(self.par & !0b11),
            _ => Target::Nowhere,
        };
        self.memory = sram(self.m0ar);
    }

    fn far_end(&self) -> Modelled<Target> {
        let port = self.par.wrapping_sub(0x4002_0018);
        if self.plays() && port <= 0x2000 && port.is_multiple_of(0x400) {
            Ok(Target::Bsrr(port as usize / 0x400))
        } else if !self.plays() && is_sram(self.par) && self.par.is_multiple_of(4) {
            Ok(Target::Word(self.par))
        } else {
            Err(Unmodelled(
                "a DMA2 peripheral other than GPIOx_BSRR (to) and SRAM (from)",
            ))
        }
    }

    pub(super) fn switch_off(&mut self) {
        self.cr &= !bit::EN;
        (self.word, self.stopping) = (None, false);
        (self.asked, self.due) = (NEVER, NEVER);
    }
}

const fn is_sram(address: u32) -> bool {
    address >= 0x2000_0000 && address < 0x2002_0000
}

/// SRAM2 is the last 16 KiB (RM0090 2.3.1).
const fn sram(address: u32) -> Slave {
    if address < 0x2001_C000 {
        Slave::Sram1
    } else {
        Slave::Sram2
    }
}
