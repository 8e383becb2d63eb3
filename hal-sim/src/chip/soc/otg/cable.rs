//! Controller as seen from the cable: packets of a host, VBUS, bus states.

use super::fifo::Status;
use super::registers::{ctl, dctl, dsts, epint, int};
use super::{ENDPOINTS, Otg};
use crate::chip::Cycle;
use crate::chip::board::wiring::Vbus;

/// Answer of the device to a SETUP or OUT transaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handshake {
    /// Accepted.
    Ack,
    /// Busy: the host has to try again.
    Nak,
    /// The endpoint is halted, or the request is refused.
    Stall,
    /// No answer: wrong address, no such endpoint, or not attached.
    Silent,
}

/// Answer of the device to an IN token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// A packet with the data of the endpoint.
    Data(Packet),
    /// No data to send.
    Nak,
    /// The endpoint is halted, or the request is refused.
    Stall,
    /// No answer: wrong address, no such endpoint, or not attached.
    Silent,
}

/// A USB data packet, 0–64 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet {
    bytes: [u8; 64],
    length: u8,
    /// Whether the packet identifier is DATA1, not DATA0.
    pub data1: bool,
}

impl Packet {
    /// Creates a packet from at most the first 64 bytes of `bytes`.
    pub fn new(bytes: &[u8], data1: bool) -> Self {
        let mut packet = Self {
            bytes: [0; 64],
            length: bytes.len().min(64) as u8,
            data1,
        };
        for (to, from) in packet.bytes.iter_mut().zip(bytes) {
            *to = *from;
        }
        packet
    }

    /// Returns the 0 to 64 data bytes, without packet identifier and checksum.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }
}

impl Otg {
    /// Sets the connection of PA9, at which VBUS is sensed. By default it is connected to VBUS.
    pub fn set_sensed(&mut self, sensed: Vbus) {
        self.sensed = sensed;
        self.vbus = sensed == Vbus::High;
    }

    /// Switches VBUS on (a powered cable is plugged in) or off at `at`.
    pub fn set_vbus(&mut self, on: bool, at: Cycle) {
        self.vbus = match self.sensed {
            Vbus::Sensed => on,
            Vbus::Open => false,
            Vbus::High => true,
        };
        self.update_session(at);
        self.mark_changed();
    }

    /// Returns the cycle since which D+ has been pulled up, which shows a full-speed device to the
    /// host; `None` while D+ is not pulled up.
    pub fn attached_since(&self) -> Option<Cycle> {
        self.attached
    }

    /// Begins a bus reset: the host drives SE0 (USBRST). The device answers to no address until
    /// software writes DCFG.DAD = 0.
    pub fn begin_bus_reset(&mut self) {
        self.events |= int::USBRST;
        self.dsts = 0;
        self.setup_stage = false;
        for endpoint in self.ins.iter_mut().chain(&mut self.outs) {
            endpoint.usb_reset();
        }
        self.mark_changed();
    }

    /// Ends the bus reset; the speed is known (ENUMDNE).
    pub fn end_bus_reset(&mut self) {
        self.events |= int::ENUMDNE;
        self.dsts = dsts::FULL_SPEED;
        self.mark_changed();
    }

    /// Suspends the device, because the bus has been idle for 3 ms (ESUSP, USBSUSP).
    pub fn suspend(&mut self) {
        self.events |= int::ESUSP | int::USBSUSP;
        self.dsts |= dsts::SUSPSTS;
        self.mark_changed();
    }

    /// Receives the start of frame `number` (0–2047).
    pub fn receive_sof(&mut self, number: u16) {
        self.frame = number & 0x7FF;
        self.dsts &= !dsts::SUSPSTS;
        self.raise(int::SOF);
    }

    /// Marks the end of the periodic transfers, after 80 % of the frame (EOPF).
    pub fn end_periodic_frame(&mut self) {
        self.raise(int::EOPF);
    }

    /// Sets a sticky bit of GINTSTS. Cheap if the bit is already set, which is the common case.
    fn raise(&mut self, bit: u32) {
        if self.events & bit == 0 {
            self.events |= bit;
            self.mark_changed();
        }
    }

    /// Returns whether a start of frame can raise the interrupt line.
    pub fn awaits_sof(&self) -> bool {
        self.mask & int::SOF != 0 && self.events & int::SOF == 0
    }

    /// Returns whether the end of the periodic part can raise the interrupt line.
    pub fn awaits_periodic_end(&self) -> bool {
        self.mask & int::EOPF != 0 && self.events & int::EOPF == 0
    }

    /// Returns the device address in DCFG.DAD.
    pub(super) fn programmed_address(&self) -> u8 {
        (self.dcfg >> 4 & 0x7F) as u8
    }

    fn is_addressed(&self, address: u8, endpoint: usize) -> bool {
        self.attached.is_some() && self.address == address && endpoint < ENDPOINTS
    }

    /// Receives a SETUP transaction to endpoint 0 at `address`, which is always accepted (RM0090
    /// section 34.17.6). Both directions answer NAK until software clears it.
    pub fn receive_setup(&mut self, address: u8, request: &[u8; 8]) -> Handshake {
        if !self.is_addressed(address, 0) {
            return Handshake::Silent;
        }
        self.receive
            .push(Status::Setup, 0, false, self.frame, request);
        for endpoint in [&mut self.ins[0], &mut self.outs[0]] {
            endpoint.clear(ctl::STALL);
            endpoint.set(ctl::NAKSTS | ctl::DPID);
        }
        let left = self.outs[0].upper;
        self.outs[0].upper = left.saturating_sub(1);
        self.setup_stage = true;
        self.mark_changed();
        Handshake::Ack
    }

    /// Ends the SETUP stage at the first token that follows it.
    fn end_setup_stage(&mut self, endpoint: usize) {
        if endpoint == 0 && self.setup_stage {
            self.setup_stage = false;
            self.receive
                .push(Status::SetupDone, 0, false, self.frame, &[]);
            self.mark_changed();
        }
    }

    /// Returns whether an OUT transaction of `length` bytes would change anything; `false` means
    /// that the answer would be NAK.
    pub fn out_ready(&self, address: u8, endpoint: usize, length: usize) -> bool {
        let Some(out) = self.outs.get(endpoint) else {
            return true;
        };
        // Data, their status word and that of the completed transfer.
        let words = length.div_ceil(4) + 2;
        let room = self.receive.len() + words <= self.rx_size as usize;
        endpoint == 0 && self.setup_stage
            || !out.has(ctl::USBAEP)
            || out.has(ctl::STALL)
            || !self.is_addressed(address, endpoint)
            || room && !out.has(ctl::NAKSTS) && self.dctl & dctl::GONSTS == 0
    }

    /// Receives an OUT transaction whose data packet ends now.
    ///
    /// EPENA is ignored: the manual says that software sets it for each transfer, but STM32F4 parts
    /// receive as long as NAKSTS is clear, and the HAL in the image relies on it.
    pub fn receive_out(&mut self, address: u8, endpoint: usize, packet: &Packet) -> Handshake {
        if !self.is_addressed(address, endpoint) || !self.outs[endpoint].has(ctl::USBAEP) {
            return Handshake::Silent;
        }
        let ready = self.out_ready(address, endpoint, packet.bytes().len());
        let nak = self.outs[endpoint].has(ctl::NAKSTS);
        self.end_setup_stage(endpoint);
        let out = &mut self.outs[endpoint];
        let length = packet.bytes().len() as u32;
        if out.has(ctl::STALL) {
            return Handshake::Stall;
        }
        if !ready || nak || length > out.max_packet() {
            return Handshake::Nak;
        }
        if out.data1() != packet.data1 {
            // A repetition: the host did not receive the handshake.
            return Handshake::Ack;
        }
        out.toggle();
        out.size = out.size.saturating_sub(length);
        out.packets = out.packets.saturating_sub(1);
        let done = out.packets == 0 || length < out.max_packet();
        if done {
            out.set(ctl::NAKSTS);
        }
        let (frame, bytes) = (self.frame, packet.bytes());
        self.receive
            .push(Status::Out, endpoint, packet.data1, frame, bytes);
        if done {
            self.receive
                .push(Status::OutDone, endpoint, packet.data1, frame, &[]);
        }
        self.mark_changed();
        Handshake::Ack
    }

    /// Returns whether an IN token would change anything or be answered by anything but NAK.
    pub fn in_ready(&self, address: u8, endpoint: usize) -> bool {
        let Some(source) = self.ins.get(endpoint) else {
            return true;
        };
        endpoint == 0 && self.setup_stage
            || !source.has(ctl::USBAEP)
            || source.has(ctl::STALL)
            || !self.is_addressed(address, endpoint)
            || self.packet_length(endpoint).is_some()
    }

    /// Returns the length of the complete packet that waits in the FIFO of `endpoint`.
    fn packet_length(&self, endpoint: usize) -> Option<u32> {
        let source = &self.ins[endpoint];
        let armed = source.has(ctl::EPENA) && !source.has(ctl::NAKSTS) && source.packets > 0;
        if !armed || self.dctl & dctl::GINSTS != 0 {
            return None;
        }
        let length = source.size.min(source.max_packet());
        let loaded = self.transmit[endpoint].len() as u32 * 4;
        (loaded >= length).then_some(length)
    }

    /// Answers an IN token that ends now. Data stay in the FIFO until [`Self::acknowledge`].
    pub fn in_token(&mut self, address: u8, endpoint: usize) -> Reply {
        if !self.is_addressed(address, endpoint) || !self.ins[endpoint].has(ctl::USBAEP) {
            return Reply::Silent;
        }
        self.end_setup_stage(endpoint);
        if self.ins[endpoint].has(ctl::STALL) {
            return Reply::Stall;
        }
        let Some(length) = self.packet_length(endpoint) else {
            return Reply::Nak;
        };
        let mut bytes = [0; 64];
        let to = bytes.get_mut(..length as usize).unwrap_or_default();
        self.transmit[endpoint].copy(to);
        Reply::Data(Packet::new(to, self.ins[endpoint].data1()))
    }

    /// Processes the host's ACK of `length` bytes of IN data, which ends now.
    pub fn acknowledge(&mut self, endpoint: usize, length: usize) {
        let (Some(source), Some(fifo)) =
            (self.ins.get_mut(endpoint), self.transmit.get_mut(endpoint))
        else {
            return;
        };
        if endpoint == 0 {
            self.address = (self.dcfg >> 4 & 0x7F) as u8;
        }
        fifo.release(length as u32);
        source.toggle();
        source.size = source.size.saturating_sub(length as u32);
        source.packets = source.packets.saturating_sub(1);
        if source.packets == 0 {
            source.clear(ctl::EPENA);
            source.interrupt |= epint::XFRC;
        }
        self.mark_changed();
    }
}
