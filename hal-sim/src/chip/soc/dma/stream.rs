//! One stream: its settings, its place, and its one-word buffer.

use super::NEVER;
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};
use crate::chip::soc::matrix::Slave;

/// Bits of SxCR (RM0090 10.5.5) and flags of a stream, at stream 0's place.
pub(crate) mod bit {
    pub const EN: u32 = 1; // CR: enable
    pub const INTERRUPTS: u32 = 0b1_1110; // CR: interrupt enables
    pub const MEMORY_TO_PERIPHERAL: u32 = 1 << 6; // CR: memory to peripheral
    pub const PFCTRL: u32 = 1 << 5; // CR: the peripheral is the flow controller
    pub const CIRC: u32 = 1 << 8; // CR: circular
    pub const PINC: u32 = 1 << 9; // CR: the peripheral's address increments
    pub const MINC: u32 = 1 << 10; // CR: the memory's address increments
    pub const PINCOS: u32 = 1 << 15; // CR: ... by a word, whatever PSIZE is
    pub const DBM: u32 = 1 << 18; // CR: double buffer
    pub const CT: u32 = 1 << 19; // CR: of which the second is in use
    pub const FEIE: u32 = 1 << 7; // FCR: FIFO error interrupt
    pub const FEIF: u32 = 1; // FIFO error
    pub const HTIF: u32 = 1 << 4; // Half transfer
    pub const TCIF: u32 = 1 << 5; // Transfer complete
}

/// CR but CHSEL, PL, CIRC, DIR 0: words both sides, memory increments, and
/// nothing else set.
const WORDS: u32 = 0b10 << 13 | 0b10 << 11 | 1 << 10;
const FREE: u32 =
    0x7 << 25 | 0b11 << 16 | bit::CIRC | bit::MEMORY_TO_PERIPHERAL | bit::INTERRUPTS | bit::EN;

/// Two buffers, and the second in use.
const BOTH: u32 = bit::DBM | bit::CT;
/// Registers of ports A to I.
const PORTS: std::ops::Range<u32> = 0x4002_0000..0x4002_2400;

/// The far end of the peripheral port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// No stream is enabled.
    None,
    /// BSRR of a port; 0 is A.
    Bsrr(usize),
    /// Another register of a port, by its offset.
    Port(usize, u32),
    /// A word of SRAM, or less.
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
    /// Address of the memory port's next item, and of the peripheral port's.
    pointer: u32,
    far: u32,
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
            pointer: 0,
            far: 0,
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
    pub const fn is_memory_to_peripheral(&self) -> bool {
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
        self.pointer & !(self.bytes() - 1)
    }

    /// Of one item: both ports have the same in direct mode, the peripheral's (RM0090 10.5.5,
    /// MSIZE).
    #[inline]
    const fn bytes(&self) -> u32 {
        1 << (self.cr >> 11 & 0b11)
    }

    /// As [`Self::bytes`].
    #[inline]
    pub const fn size(&self) -> Size {
        match self.bytes() {
            1 => Size::Byte,
            2 => Size::Half,
            _ => Size::Word,
        }
    }

    /// NDTR.
    #[inline]
    pub const fn count_left(&self) -> u16 {
        self.ndtr
    }

    /// DIR: it asks itself, and ends with its items; the FIFO is the hardware's then (RM0090
    /// 10.3.6, 10.5.10).
    #[inline]
    pub const fn is_memory_to_memory(&self) -> bool {
        self.cr >> 7 & 1 != 0
    }

    /// Whether it moves words as an image sets it up, so that many can go at once.
    #[inline]
    pub const fn is_plain(&self) -> bool {
        self.cr & !FREE == WORDS
    }

    /// Where the memory's items begin (RM0090 10.3.9): M1AR, of the second of two buffers, is
    /// 0 here.
    const fn base(&self) -> u32 {
        match self.cr & BOTH {
            BOTH => 0,
            _ => self.m0ar,
        }
    }

    /// The peripheral port can move the next item at `at`: its word is there
    /// (playing) or the last one gone.
    #[inline]
    pub const fn is_ready_at(&self, at: Cycle) -> bool {
        self.is_memory_to_peripheral() == self.word.is_some() && self.turned <= at
    }

    /// The memory port moved one item. After the last it begins anew, with two buffers in
    /// the other one (RM0090 10.3.9).
    #[inline]
    pub fn step(&mut self) {
        self.index += 1;
        if self.cr & bit::MINC != 0 {
            self.pointer = self.pointer.wrapping_add(self.bytes());
        }
        if self.index >= self.length {
            self.index = 0;
            if self.cr & bit::DBM != 0 {
                self.cr ^= bit::CT;
            }
            self.pointer = self.base();
            self.memory = sram(self.pointer);
        }
    }

    /// The peripheral port moved one item.
    #[inline]
    fn step_far(&mut self) {
        if self.cr & bit::PINC != 0 {
            let bytes = match self.cr & bit::PINCOS {
                0 => self.bytes(),
                _ => 4,
            };
            self.far = self.far.wrapping_add(bytes);
            self.redirect();
        }
    }

    /// Whether a stream that plays has fetched, not being circular, all.
    pub const fn has_fetched_all(&self) -> bool {
        !self.is_circular() && self.index == 0
    }

    /// Items that it can move before it begins anew or a flag rises.
    pub fn uneventful_items(&self) -> u16 {
        let half = self.length / 2;
        let flag = if self.ndtr > half { half } else { 0 };
        let items = (self.ndtr - flag).saturating_sub(1);
        items.min(self.length.saturating_sub(self.index))
    }

    /// Both ports moved `items`, at most [`Self::uneventful_items`].
    pub fn skip(&mut self, items: u16) {
        self.ndtr -= items;
        self.index += items;
        self.pointer = self.pointer.wrapping_add(4 * u32::from(items));
        if self.index >= self.length {
            self.index = 0;
            self.pointer = self.m0ar;
        }
    }

    /// The peripheral port moved one item: gives what is left of NDTR, which a
    /// circular stream then loads anew (RM0090 10.3.9).
    #[inline]
    pub(super) fn count(&mut self) -> u16 {
        self.ndtr = self.ndtr.saturating_sub(1);
        let left = self.ndtr;
        self.step_far();
        if left == 0 && self.is_circular() {
            self.ndtr = self.length;
            if self.cr & bit::PINC != 0 {
                self.far = self.par;
                self.redirect();
            }
        }
        left
    }

    /// EN was written 1, complete from `done` on: takes the settings over.
    pub(super) fn switch_on(&mut self, done: Cycle) -> Modelled {
        refuse_if(
            self.cr & !FREE != WORDS,
            "a DMA2 stream that does not move words, incrementing its memory only",
        )?;
        refuse_if(self.fcr & 0b100 != 0, "a DMA2 stream's FIFO")?;
        refuse_if(self.ndtr == 0, "a DMA2 stream enabled with nothing to move")?;
        self.target = self.far_end()?;
        self.memory = sram(self.m0ar);
        let last = self.m0ar.wrapping_add(4 * (u32::from(self.ndtr) - 1));
        if !self.m0ar.is_multiple_of(4) || !is_sram(self.m0ar) || !is_sram(last) {
            return Err(Unmodelled("DMA2 memory other than SRAM1 and SRAM2"));
        }
        refuse_if(
            sram(last) != self.memory,
            "a DMA2 buffer across SRAM1 and SRAM2",
        )?;
        self.cr |= bit::EN;
        (self.length, self.index) = (self.ndtr, 0);
        (self.pointer, self.far) = (self.m0ar, self.par);
        (self.word, self.stopping) = (None, false);
        self.asked = NEVER;
        self.due = if self.is_memory_to_peripheral() {
            done
        } else {
            NEVER
        };
        Ok(())
    }

    /// Flags that interrupt: CR's enables lie one bit before theirs (RM0090 10.5.1, 10.5.5).
    pub(super) const fn flags_enabled(&self) -> u32 {
        let fifo = if self.fcr & bit::FEIE != 0 {
            bit::FEIF
        } else {
            0
        };
        (self.cr & bit::INTERRUPTS) << 1 | fifo
    }

    /// Turns `bits` of PAR while it is on: the next item goes or comes from there.
    pub(super) fn upset_par(&mut self, bits: u32) {
        let done = self.far.wrapping_sub(self.par);
        self.par ^= bits;
        self.far = self.par.wrapping_add(done);
        self.redirect();
    }

    /// The same of M0AR, if it is in use; else from when it is on.
    pub(super) fn upset_m0ar(&mut self, bits: u32) {
        let base = self.base();
        self.m0ar ^= bits;
        let moved = self.base().wrapping_sub(base);
        self.pointer = self.pointer.wrapping_add(moved);
        self.memory = sram(self.pointer);
    }

    /// Turns `bits` of CR while it is on, which no write could, but EN and the interrupts;
    /// taken to have effect from the next item on. In direct mode MSIZE, MBURST and PBURST
    /// are the hardware's (RM0090 10.3.11, 10.5.5). A peripheral that is the flow controller
    /// puts CIRC out, two buffers put it on; TIM1 never says that an item is the last.
    ///
    /// # Errors
    /// Codes that the manual reserves.
    pub(super) fn upset_cr(&mut self, bits: u32, at: Cycle) -> Modelled {
        const FORCED: u32 = 0b11 << 13 | 0b1111 << 21;
        let mut cr = self.cr ^ bits & !FORCED;
        refuse_if(cr >> 6 & 0b11 == 3, "a DMA2 stream with DIR 3")?;
        refuse_if(cr >> 11 & 0b11 == 3, "a DMA2 stream with PSIZE 3")?;
        cr = cr & !(0b11 << 13) | (cr >> 11 & 0b11) << 13;
        if cr & bit::PFCTRL != 0 {
            cr &= !bit::CIRC;
        } else if cr & bit::DBM != 0 {
            cr |= bit::CIRC;
        }
        let turned = (cr ^ self.cr) & bit::MEMORY_TO_PERIPHERAL != 0;
        self.cr = cr;
        self.redirect();
        // What is between the ports goes on the new way; nothing is there: it is fetched.
        if turned && self.is_memory_to_peripheral() != self.word.is_some() {
            self.due = at;
        }
        Ok(())
    }

    /// The far end is where `far` is. Items are aligned: the lowest bits of an address do not
    /// count (RM0090 10.3.10).
    fn redirect(&mut self) {
        let far = self.far & !(self.bytes() - 1);
        let port = far.wrapping_sub(PORTS.start);
        self.target = match (self.is_memory_to_peripheral(), is_sram(far)) {
            (true, _) if PORTS.contains(&far) && port & 0x3FF == 0x18 => {
                Target::Bsrr(port as usize / 0x400)
            }
            (true, _) if PORTS.contains(&far) && self.bytes() == 4 => {
                Target::Port(port as usize / 0x400, port & 0x3FF)
            }
            (_, true) => Target::Word(far),
            _ => Target::Nowhere,
        };
    }

    fn far_end(&self) -> Modelled<Target> {
        let port = self.par.wrapping_sub(0x4002_0018);
        if self.is_memory_to_peripheral() && port <= 0x2000 && port.is_multiple_of(0x400) {
            Ok(Target::Bsrr(port as usize / 0x400))
        } else if !self.is_memory_to_peripheral() && is_sram(self.par) && self.par.is_multiple_of(4)
        {
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
