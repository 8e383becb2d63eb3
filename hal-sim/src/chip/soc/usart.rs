//! Models a USART: asynchronous, 8 data bits, 1 stop bit, no parity, no DMA (RM0090 chapter 30).
//!
//! In: bytes of the other side, one frame after another at this side's rate. Out: bytes with the
//! cycle of their end, an interrupt line.

use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled, refuse_if};
use std::collections::VecDeque;

mod sr {
    pub const ORE: u32 = 1 << 3;
    pub const IDLE: u32 = 1 << 4;
    pub const RXNE: u32 = 1 << 5;
    pub const TC: u32 = 1 << 6;
    pub const TXE: u32 = 1 << 7;
    pub const RESET: u32 = TC | TXE;
}

mod cr1 {
    pub const RE: u32 = 1 << 2;
    pub const TE: u32 = 1 << 3;
    pub const IDLEIE: u32 = 1 << 4;
    pub const RXNEIE: u32 = 1 << 5;
    pub const TCIE: u32 = 1 << 6;
    pub const TXEIE: u32 = 1 << 7;
    pub const PEIE: u32 = 1 << 8;
    pub const UE: u32 = 1 << 13;
    pub const OVER8: u32 = 1 << 15;
    pub const KNOWN: u32 = RE | TE | IDLEIE | RXNEIE | TCIE | TXEIE | PEIE | UE | OVER8;
}

/// Start bit, 8 data bits and stop bit.
const FRAME_BITS: u64 = 10;

/// A USART, and the bytes that the other side of its line has sent to it.
#[derive(Clone, PartialEq, Debug)]
pub struct Usart {
    bus_divider: u32,
    sr: u32,
    /// Flags that were set when SR was last read: reading DR clears them.
    seen: u32,
    brr: u32,
    cr1: u32,
    cr3: u32,
    received: u8,
    buffer: Option<u8>,
    sending: Option<(Cycle, u8)>,
    sent: Vec<(Cycle, u8)>,
    incoming: VecDeque<u8>,
    /// End of the frame being received.
    receiving: Option<Cycle>,
    /// Cycle at which the line will have been idle for one frame.
    idle: Option<Cycle>,
}

impl Default for Usart {
    /// Returns the reset state, with a bus as fast as the core.
    fn default() -> Self {
        Self {
            bus_divider: 1,
            sr: sr::RESET,
            seen: 0,
            brr: 0,
            cr1: 0,
            cr3: 0,
            received: 0,
            buffer: None,
            sending: None,
            sent: Vec::new(),
            incoming: VecDeque::new(),
            receiving: None,
            idle: None,
        }
    }
}

impl Usart {
    /// Resets the registers. Bytes that the other side has not sent yet stay.
    pub fn reset(&mut self) {
        *self = Self {
            bus_divider: self.bus_divider,
            sent: std::mem::take(&mut self.sent),
            incoming: std::mem::take(&mut self.incoming),
            ..Self::default()
        };
    }

    /// Sets the core cycles per APB cycle, from the next frame on.
    pub fn set_bus_divider(&mut self, divider: u32) {
        self.bus_divider = divider;
    }

    /// Receives `byte` from the other side, which sends it at `at`, or after the bytes before it. A
    /// receiver that is off loses the byte.
    pub fn receive(&mut self, byte: u8, at: Cycle) {
        if self.is_on(cr1::RE) {
            self.incoming.push_back(byte);
            if self.receiving.is_none() {
                self.receiving = Some(at.saturating_add(self.frame()));
                self.idle = None;
            }
        }
    }

    /// Returns the bytes sent since the last call, with the end of their stop bit.
    pub fn sent(&mut self) -> impl Iterator<Item = (Cycle, u8)> + '_ {
        self.sent.drain(..)
    }

    /// Returns the level of the interrupt line (table 148).
    pub fn interrupt(&self) -> bool {
        let on = |enable: u32, flags: u32| self.cr1 & enable != 0 && self.sr & flags != 0;
        on(cr1::TXEIE, sr::TXE)
            || on(cr1::TCIE, sr::TC)
            || on(cr1::RXNEIE, sr::RXNE | sr::ORE)
            || on(cr1::IDLEIE, sr::IDLE)
    }

    const fn is_on(&self, direction: u32) -> bool {
        let bits = cr1::UE | direction;
        self.cr1 & bits == bits && self.brr != 0
    }

    /// Returns the core cycles of a frame: USARTDIV in 1/16 (1/8 with OVER8) is the bus cycles of a
    /// bit (section 30.3.4).
    fn frame(&self) -> u64 {
        let bit = if self.cr1 & cr1::OVER8 == 0 {
            self.brr
        } else {
            self.brr >> 4 << 3 | self.brr & 7
        };
        FRAME_BITS * u64::from(bit) * u64::from(self.bus_divider)
    }

    fn write_data(&mut self, value: u32, at: Cycle) -> Modelled {
        refuse_if(
            !self.is_on(cr1::TE),
            "USART_DR: written while TE or UE is off",
        )?;
        let byte = (value & 0xFF) as u8;
        self.sr &= !sr::TC;
        if self.sending.is_none() {
            self.sending = Some((at.saturating_add(self.frame()), byte));
        } else if self.buffer.is_none() {
            self.buffer = Some(byte);
            self.sr &= !sr::TXE;
        } else {
            return Err(Unmodelled("USART_DR: written while TXE is clear"));
        }
        Ok(())
    }

    fn read_data(&mut self) -> u32 {
        self.sr &= !(sr::RXNE | self.seen);
        self.seen = 0;
        u32::from(self.received)
    }

    fn end_of_sent(&mut self, end: Cycle, byte: u8) {
        self.sent.push((end, byte));
        self.sending = self
            .buffer
            .take()
            .map(|next| (end.saturating_add(self.frame()), next));
        self.sr |= sr::TXE;
        if self.sending.is_none() {
            self.sr |= sr::TC;
        }
    }

    fn end_of_received(&mut self, end: Cycle) {
        if let Some(byte) = self.incoming.pop_front() {
            if self.sr & sr::RXNE == 0 {
                self.received = byte;
                self.sr |= sr::RXNE;
            } else {
                self.sr |= sr::ORE; // the new byte is lost
            }
        }
        let next = end.saturating_add(self.frame());
        self.receiving = (!self.incoming.is_empty()).then_some(next);
        self.idle = self.incoming.is_empty().then_some(next);
    }

    fn write_cr1(&mut self, value: u32) -> Modelled {
        refuse_if(
            value & !cr1::KNOWN != 0,
            "USART_CR1: parity, 9 data bits, wake-up or break",
        )?;
        self.cr1 = value;
        if value & cr1::UE == 0 || value & cr1::RE == 0 {
            self.receiving = None;
            self.idle = None;
            self.incoming.clear();
        }
        Ok(())
    }
}

impl Peripheral for Usart {
    fn read(&mut self, offset: u32, at: Cycle) -> Modelled<u32> {
        self.advance(at)?;
        let word = match offset {
            0x00 => {
                self.seen = self.sr & (sr::ORE | sr::IDLE);
                self.sr
            }
            0x04 => self.read_data(),
            0x08 => self.brr,
            0x0C => self.cr1,
            0x10 | 0x18 => 0,
            0x14 => self.cr3,
            _ => return Err(Unmodelled("USART register")),
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        self.advance(at)?;
        match offset {
            // rc_w0: RXNE and TC.
            0x00 => self.sr &= value | !(sr::RXNE | sr::TC),
            0x04 => self.write_data(value, at)?,
            0x08 => self.brr = value & 0xFFFF,
            0x0C => self.write_cr1(value)?,
            // EIE: framing and noise errors do not occur here.
            0x14 if value & !1 == 0 => self.cr3 = value,
            0x10 | 0x18 if value == 0 => {}
            _ => return Err(Unmodelled("USART_CR2, CR3 or GTPR")),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        while let Some((end, byte)) = self.sending.filter(|(end, _)| *end <= to) {
            self.end_of_sent(end, byte);
        }
        while let Some(end) = self.receiving.filter(|end| *end <= to) {
            self.end_of_received(end);
        }
        if self.idle.is_some_and(|at| at <= to) {
            self.idle = None;
            self.sr |= sr::IDLE;
        }
        Ok(())
    }

    fn next_event(&self) -> Cycle {
        let sending = self.sending.map(|(end, _)| end);
        [sending, self.receiving, self.idle]
            .into_iter()
            .flatten()
            .min()
            .unwrap_or(Cycle::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    const SR: u32 = 0;
    const DR: u32 = 4;
    const BRR: u32 = 8;
    const CR1: u32 = 0xC;

    /// Creates a USART at 115,200 baud and 42 MHz: USARTDIV 22.8125, 365 / 16.
    fn usart(interrupts: u32) -> Usart {
        let mut usart = Usart::default();
        usart.set_bus_divider(4);
        usart.set(BRR, 365, 0);
        usart.set(CR1, 0x200C | interrupts, 0);
        usart
    }

    const FRAME: Cycle = 10 * 365 * 4;

    #[test]
    fn bytes_leave_one_frame_after_another() {
        let mut usart = usart(0);
        assert_eq!(usart.get(SR, 0), 0xC0);
        usart.set(DR, 0x41, 100);
        assert_eq!(usart.get(SR, 100), 0x80);
        usart.write(DR, 0x42, 100).unwrap();
        assert_eq!(usart.get(SR, 100), 0);
        assert!(usart.write(DR, 0, 100).is_err());
        assert_eq!(usart.get(SR, 100 + FRAME), 0x80);
        assert_eq!(usart.get(SR, 99 + 2 * FRAME), 0x80);
        assert_eq!(usart.get(SR, 100 + 2 * FRAME), 0xC0);
        let sent: Vec<_> = usart.sent().collect();
        assert_eq!(sent, [(100 + FRAME, 0x41), (100 + 2 * FRAME, 0x42)]);
    }

    #[test]
    fn bytes_arrive_overrun_and_leave_the_line_idle() {
        let mut usart = usart(0);
        for byte in [1, 2, 3] {
            usart.receive(byte, 0);
        }
        assert_eq!(usart.get(SR, FRAME - 1), 0xC0);
        assert_eq!(usart.get(SR, FRAME), 0xE0);
        assert_eq!(usart.get(DR, FRAME), 1);
        assert_eq!(usart.get(SR, 3 * FRAME), 0xE8, "ORE");
        assert_eq!(usart.get(DR, 3 * FRAME), 2, "3 is lost");
        assert_eq!(usart.get(SR, 4 * FRAME), 0xD0, "IDLE");
        usart.get(DR, 4 * FRAME);
        assert_eq!(usart.get(SR, 4 * FRAME), 0xC0);
        assert_eq!(usart.next_event(), Cycle::MAX);
    }

    #[test]
    fn interrupts_have_their_enables() {
        assert!(!usart(0).interrupt());
        assert!(usart(1 << 7).interrupt(), "TXEIE");
        assert!(usart(1 << 6).interrupt(), "TCIE");
        let mut usart = usart(1 << 5);
        assert!(!usart.interrupt());
        usart.receive(9, 0);
        usart.advance(FRAME).unwrap();
        assert!(usart.interrupt(), "RXNEIE");
        usart.get(DR, FRAME);
        assert!(!usart.interrupt());
    }

    #[test]
    fn over8_has_its_own_divider() {
        let mut usart = Usart::default();
        usart.set(BRR, 0x2D5, 0); // 45 5/8
        usart.set(CR1, 0xA008, 0);
        usart.set(DR, 0, 0);
        assert_eq!(usart.next_event(), 10 * 365);
    }

    #[test]
    fn the_rest_is_not_modelled() {
        let mut usart = usart(0);
        for (offset, value) in [(CR1, 1 << 12), (0x10, 1 << 13), (0x14, 1 << 7), (0x20, 0)] {
            assert!(usart.write(offset, value, 0).is_err());
        }
        let mut off = Usart::default();
        assert!(off.write(DR, 0, 0).is_err());
        off.receive(1, 0);
        assert_eq!(off.next_event(), Cycle::MAX);
    }
}
