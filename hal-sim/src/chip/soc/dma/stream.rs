//! One DMA stream: its settings, its position, and its one-word buffer.

use super::NEVER;
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};
use crate::chip::soc::matrix::Slave;

/// Bits of SxCR (RM0090 10.5.5) and SxFCR, and the flags of a stream at the positions that they
/// have for stream 0.
pub(crate) mod bit {
    pub const EN: u32 = 1; // CR: enable
    pub const INTERRUPTS: u32 = 0b1_1110; // CR: interrupt enables
    pub const MEMORY_TO_PERIPHERAL: u32 = 1 << 6; // CR: memory to peripheral
    pub const PFCTRL: u32 = 1 << 5; // CR: the peripheral is the flow controller
    pub const CIRC: u32 = 1 << 8; // CR: circular
    pub const PINC: u32 = 1 << 9; // CR: the peripheral's address increments
    pub const MINC: u32 = 1 << 10; // CR: the memory's address increments
    pub const PINCOS: u32 = 1 << 15; // CR: the increment is a word, regardless of PSIZE
    pub const DBM: u32 = 1 << 18; // CR: double buffer
    pub const CT: u32 = 1 << 19; // CR: the second buffer is in use
    pub const FEIE: u32 = 1 << 7; // FCR: FIFO error interrupt
    pub const FEIF: u32 = 1; // FIFO error
    pub const HTIF: u32 = 1 << 4; // Half transfer
    pub const TCIF: u32 = 1 << 5; // Transfer complete
}

/// Value that CR must have outside the bits of `FREE`: words on both sides, memory increment, and
/// no other bit.
const WORDS: u32 = 0b10 << 13 | 0b10 << 11 | 1 << 10;
/// Bits of CR that a program may choose: channel, priority, circular mode, direction, interrupt
/// enables and EN.
const FREE: u32 =
    0x7 << 25 | 0b11 << 16 | bit::CIRC | bit::MEMORY_TO_PERIPHERAL | bit::INTERRUPTS | bit::EN;

/// Bits of CR that are both set in double buffer mode while the second buffer is in use.
const BOTH: u32 = bit::DBM | bit::CT;
/// Addresses of the registers of ports A to I.
const PORTS: std::ops::Range<u32> = 0x4002_0000..0x4002_2400;

/// Register or memory that the peripheral port reads or writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// No target: the stream has not been enabled yet.
    None,
    /// BSRR of a port; 0 is A.
    Bsrr(usize),
    /// Another register of a port: number of the port (0 is A) and offset of the register.
    Port(usize, u32),
    /// A word, half-word or byte of SRAM, by its address.
    Word(u32),
    /// No modelled target: written items are lost, read items are zero.
    Nowhere,
}

/// Registers and position of a stream.
#[derive(Clone, PartialEq, Debug)]
pub struct Stream {
    pub(super) cr: u32,
    pub(super) ndtr: u16,
    pub(super) par: u32,
    pub(super) m0ar: u32,
    pub(super) fcr: u32,
    /// Value of NDTR when the stream was enabled.
    pub(crate) length: u16,
    /// Number of items moved over the memory port, modulo `length`.
    index: u16,
    /// Address of the memory port's next item.
    pointer: u32,
    /// Address of the peripheral port's next item.
    far: u32,
    /// Register or memory that the peripheral port reads or writes.
    pub(crate) target: Target,
    /// Bus slave, SRAM1 or SRAM2, that the memory port accesses.
    pub(crate) memory: Slave,
    /// Whether EN was written 0; a transfer in progress continues.
    pub stopping: bool,
    /// Word that one port has read and the other port has not written yet.
    pub word: Option<u32>,
    /// Cycle at which `word` was last filled or emptied.
    pub turned: Cycle,
    /// Cycle of the latest request, from which the peripheral port may serve the stream.
    pub asked: Cycle,
    /// Cycle from which the memory port may serve the stream; `NEVER` if it has nothing to move.
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

    /// Returns whether EN is set.
    #[inline]
    pub const fn is_enabled(&self) -> bool {
        self.cr & bit::EN != 0
    }

    /// Returns whether CIRC is set: the stream restarts after its last item.
    #[inline]
    pub const fn is_circular(&self) -> bool {
        self.cr & bit::CIRC != 0
    }

    /// Returns whether the direction is memory to peripheral.
    #[inline]
    pub const fn is_memory_to_peripheral(&self) -> bool {
        self.cr & bit::MEMORY_TO_PERIPHERAL != 0
    }

    /// Returns the priority level PL; 3 is very high.
    pub const fn priority(&self) -> u32 {
        self.cr >> 16 & 0b11
    }

    /// Returns the channel CHSEL that requests the stream, 0–7.
    pub const fn channel(&self) -> u32 {
        self.cr >> 25 & 0b111
    }

    /// Returns the bus slave that the peripheral port accesses: SRAM1 or SRAM2 for a word in
    /// memory, otherwise AHB1.
    #[inline]
    pub const fn far_slave(&self) -> Slave {
        match self.target {
            Target::Word(address) => sram(address),
            _ => Slave::Ahb1,
        }
    }

    /// Returns the address of the memory port's next item.
    #[inline]
    pub const fn address(&self) -> u32 {
        self.pointer & !(self.bytes() - 1)
    }

    /// Returns the size of one item, bytes. In direct mode both ports use the size of the
    /// peripheral port (RM0090 10.5.5, MSIZE).
    #[inline]
    const fn bytes(&self) -> u32 {
        1 << (self.cr >> 11 & 0b11)
    }

    /// Returns the size of one item, the same on both ports.
    #[inline]
    pub const fn size(&self) -> Size {
        match self.bytes() {
            1 => Size::Byte,
            2 => Size::Half,
            _ => Size::Word,
        }
    }

    /// Returns NDTR, the number of items left.
    #[inline]
    pub const fn count_left(&self) -> u16 {
        self.ndtr
    }

    /// Returns whether DIR selects memory to memory: the stream then needs no requests, stops after
    /// its last item, and uses the FIFO in hardware (RM0090 10.3.6, 10.5.10).
    #[inline]
    pub const fn is_memory_to_memory(&self) -> bool {
        self.cr >> 7 & 1 != 0
    }

    /// Returns whether the stream moves words with the settings of the images, so that many items
    /// can be moved at once.
    #[inline]
    pub const fn is_plain(&self) -> bool {
        self.cr & !FREE == WORDS
    }

    /// Returns the start of the items in memory (RM0090 10.3.9): M1AR, the address of the second
    /// buffer, is always 0 here.
    const fn base(&self) -> u32 {
        match self.cr & BOTH {
            BOTH => 0,
            _ => self.m0ar,
        }
    }

    /// Returns whether the peripheral port can move an item at `at`. From memory to the peripheral,
    /// that needs a word between the ports; in the other direction there must be none.
    #[inline]
    pub const fn is_ready_at(&self, at: Cycle) -> bool {
        self.is_memory_to_peripheral() == self.word.is_some() && self.turned <= at
    }

    /// Advances the memory port by one item. After the last item the port restarts at the
    /// beginning, in double buffer mode that of the other buffer (RM0090 10.3.9).
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

    /// Advances the address of the peripheral port by one item, if PINC selects that.
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

    /// Returns whether the memory port has moved the last item of a stream that is not circular.
    /// The answer is valid only after an item has been moved.
    pub const fn has_fetched_all(&self) -> bool {
        !self.is_circular() && self.index == 0
    }

    /// Returns the number of items that the stream can move before it restarts or a flag is set.
    pub fn uneventful_items(&self) -> u16 {
        let half = self.length / 2;
        let flag = if self.ndtr > half { half } else { 0 };
        let items = (self.ndtr - flag).saturating_sub(1);
        items.min(self.length.saturating_sub(self.index))
    }

    /// Counts `items` items as moved over both ports, at most [`Self::uneventful_items`], without
    /// accessing the memory.
    pub fn skip(&mut self, items: u16) {
        self.ndtr -= items;
        self.index += items;
        self.pointer = self.pointer.wrapping_add(4 * u32::from(items));
        if self.index >= self.length {
            self.index = 0;
            self.pointer = self.m0ar;
        }
    }

    /// Counts one item moved over the peripheral port, and returns the number of items left. If
    /// none is left, a circular stream reloads NDTR (RM0090 10.3.9).
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

    /// Enables the stream and latches its settings, after EN was written 1 in an access that is
    /// complete from `done` on.
    pub(super) fn switch_on(&mut self, done: Cycle) -> Modelled {
        refuse_if(
            self.cr & !FREE != WORDS,
            "a DMA2 stream that does not move words or does not increment its memory address only",
        )?;
        refuse_if(self.fcr & 0b100 != 0, "a DMA2 stream's FIFO")?;
        refuse_if(self.ndtr == 0, "a DMA2 stream enabled with NDTR = 0")?;
        self.target = self.far_end()?;
        self.memory = sram(self.m0ar);
        let last = self.m0ar.wrapping_add(4 * (u32::from(self.ndtr) - 1));
        if !self.m0ar.is_multiple_of(4) || !is_sram(self.m0ar) || !is_sram(last) {
            return Err(Unmodelled("DMA2 memory other than SRAM1 and SRAM2"));
        }
        refuse_if(
            sram(last) != self.memory,
            "a DMA2 buffer that extends from SRAM1 into SRAM2",
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

    /// Returns the flags whose interrupts are enabled: the enable bits of CR lie one bit below
    /// their flags (RM0090 10.5.1, 10.5.5).
    pub(super) const fn flags_enabled(&self) -> u32 {
        let fifo = if self.fcr & bit::FEIE != 0 {
            bit::FEIF
        } else {
            0
        };
        (self.cr & bit::INTERRUPTS) << 1 | fifo
    }

    /// Inverts `bits` of PAR while the stream is enabled, which moves the address of the next item.
    pub(super) fn upset_par(&mut self, bits: u32) {
        let done = self.far.wrapping_sub(self.par);
        self.par ^= bits;
        self.far = self.par.wrapping_add(done);
        self.redirect();
    }

    /// Inverts `bits` of M0AR. This takes effect at once if the stream uses the buffer of M0AR,
    /// otherwise when it next changes to that buffer.
    pub(super) fn upset_m0ar(&mut self, bits: u32) {
        let base = self.base();
        self.m0ar ^= bits;
        let moved = self.base().wrapping_sub(base);
        self.pointer = self.pointer.wrapping_add(moved);
        self.memory = sram(self.pointer);
    }

    /// Inverts `bits` of CR except EN and the interrupt enables while the stream is enabled and
    /// these bits are write-protected. Assumed to take effect from the next item on. In direct mode
    /// the hardware determines MSIZE, MBURST and PBURST (RM0090 10.3.11, 10.5.5). With the
    /// peripheral as flow controller, CIRC is cleared; in double buffer mode it is set. TIM1 never
    /// marks an item as the last.
    ///
    /// # Errors
    /// Fails for codes that the manual reserves.
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
        // A word between the ports continues in the new direction; if there is none, it is fetched.
        if turned && self.is_memory_to_peripheral() != self.word.is_some() {
            self.due = at;
        }
        Ok(())
    }

    /// Updates the target from the address `far`. Items are aligned: the lowest bits of an address
    /// are ignored (RM0090 10.3.10).
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

/// Returns the SRAM that contains `address`. SRAM2 is the last 16 KiB (RM0090 2.3.1).
const fn sram(address: u32) -> Slave {
    if address < 0x2001_C000 {
        Slave::Sram1
    } else {
        Slave::Sram2
    }
}
