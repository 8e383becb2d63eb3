//! One endpoint: its control, interrupt and transfer size registers.

use super::registers::{ctl, epint};
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};

/// Direction of an endpoint's data, named from the host's side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Device to host.
    In,
    /// Host to device.
    Out,
}

/// Registers DIEPCTLn/DOEPCTLn, DIEPINTn/DOEPINTn, DIEPTSIZn/DOEPTSIZn.
#[derive(Clone, PartialEq, Debug)]
pub struct Endpoint {
    number: usize,
    direction: Direction,
    /// Control register without its self-clearing command bits.
    control: u32,
    /// Bits of the interrupt register that stay set until software clears them.
    pub interrupt: u32,
    /// XFRSIZ as programmed, minus the bytes transferred since.
    pub size: u32,
    /// PKTCNT: number of packets left.
    pub packets: u32,
    /// STUPCNT (OUT 0) or the bits above PKTCNT, which are only stored.
    pub upper: u32,
}

impl Endpoint {
    /// Creates an endpoint in its reset state.
    pub fn new(number: usize, direction: Direction) -> Self {
        Self {
            number,
            direction,
            control: if number == 0 { ctl::USBAEP } else { 0 },
            interrupt: 0,
            size: 0,
            packets: 0,
            upper: 0,
        }
    }

    /// Returns the control register, DIEPCTLn or DOEPCTLn.
    pub fn control(&self) -> u32 {
        self.control
    }

    /// Returns whether all of `bits` of the control register are set.
    pub fn has(&self, bits: u32) -> bool {
        self.control & bits == bits
    }

    /// Sets bits of the control register on behalf of the USB core, without executing commands.
    pub fn set(&mut self, bits: u32) {
        self.control |= bits;
    }

    /// Clears bits of the control register on behalf of the USB core.
    pub fn clear(&mut self, bits: u32) {
        self.control &= !bits;
    }

    /// Returns whether the next data packet is DATA1.
    pub fn data1(&self) -> bool {
        self.has(ctl::DPID)
    }

    /// Changes the identifier of the next data packet from DATA0 to DATA1 or back.
    pub fn toggle(&mut self) {
        self.control ^= ctl::DPID;
    }

    /// Returns the maximum packet length, bytes; endpoint 0 encodes it (section 34.16.4).
    pub fn max_packet(&self) -> u32 {
        match self.number {
            0 => 64 >> (self.control & 0b11),
            _ => self.control & ctl::MPSIZ,
        }
    }

    /// Writes the control register, DIEPCTLn or DOEPCTLn: stores the settings and executes the
    /// command bits.
    ///
    /// # Errors
    /// Fails for isochronous endpoints, snooping, and the TX FIFO of another endpoint.
    pub fn write_control(&mut self, value: u32) -> Modelled {
        let plain = self.plain_bits();
        let next = self.control & !plain | value & plain;
        refuse_if(
            next & ctl::EPTYP == ctl::ISOCHRONOUS,
            "OTG_FS isochronous endpoint",
        )?;
        refuse_if(next & ctl::SNPM != 0, "OTG_FS DOEPCTL SNPM")?;
        let fifo = (next & ctl::TXFNUM) >> 22;
        if self.direction == Direction::In && fifo != 0 && fifo != self.number as u32 {
            return Err(Unmodelled("OTG_FS TXFNUM other than the endpoint's own"));
        }
        self.control = next;
        self.command(value);
        Ok(())
    }

    /// Returns a mask of the control register's bits that read back as software wrote them.
    fn plain_bits(&self) -> u32 {
        let fifo = match self.direction {
            Direction::In => ctl::TXFNUM,
            Direction::Out => ctl::SNPM,
        };
        match self.number {
            0 => 0b11 | fifo,
            _ => ctl::MPSIZ | ctl::USBAEP | ctl::EPTYP | ctl::STALL | fifo,
        }
    }

    /// Executes the command bits of `value`, which read as 0.
    fn command(&mut self, value: u32) {
        if self.number == 0 {
            // Set by software, cleared by the next SETUP.
            self.control |= value & ctl::STALL;
        } else if value & ctl::SD1PID != 0 {
            self.set(ctl::DPID);
        } else if value & ctl::SD0PID != 0 {
            self.clear(ctl::DPID);
        }
        if value & ctl::CNAK != 0 {
            self.clear(ctl::NAKSTS);
            self.interrupt &= !epint::INEPNE;
        }
        if value & ctl::SNAK != 0 {
            if self.direction == Direction::In && !self.has(ctl::NAKSTS) {
                self.interrupt |= epint::INEPNE;
            }
            self.set(ctl::NAKSTS);
        }
        if value & ctl::EPENA != 0 {
            self.set(ctl::EPENA);
        }
        // Takes effect at once: no transaction is in progress during a register write.
        if value & ctl::EPDIS != 0 && self.has(ctl::EPENA) {
            self.clear(ctl::EPENA);
            self.interrupt |= epint::EPDISD;
        }
    }

    /// Deactivates the endpoint unless it is endpoint 0, as a bus reset does (section 34.16.4).
    pub fn usb_reset(&mut self) {
        if self.number != 0 {
            self.clear(ctl::USBAEP);
        }
    }

    /// Returns the transfer size register, DIEPTSIZn or DOEPTSIZn: the bytes and packets left.
    pub fn transfer_size(&self) -> u32 {
        self.upper << 29 | self.packets << 19 | self.size
    }

    /// Writes DIEPTSIZn/DOEPTSIZn; endpoint 0 has shorter fields.
    pub fn write_transfer_size(&mut self, value: u32) {
        let (size, packets) = match (self.number, self.direction) {
            (0, Direction::In) => (0x7F, 0b11),
            (0, Direction::Out) => (0x7F, 0b1),
            _ => (0x7_FFFF, 0x3FF),
        };
        self.size = value & size;
        self.packets = value >> 19 & packets;
        self.upper = value >> 29 & 0b11;
    }
}
