//! OTG_FS as a device (RM0090 chapter 34), at 0x5000_0000.
//!
//! In: register accesses, and packets from the cable (`cable`). Out: packets,
//! the pull-up on D+, one interrupt line. Not here: the host at the other end
//! (`chip::usb`), host mode, isochronous transfers, remote wake-up, pins.
//! `registers` has the bits, `access` what they do, `endpoint` and `fifo` are
//! the parts.

mod access;
mod cable;
mod endpoint;
mod fifo;
mod registers;
#[cfg(test)]
mod tests;

pub use cable::{Handshake, Packet, Reply};

use crate::chip::soc::peripheral::{Cycle, Modelled, Peripheral};
use endpoint::{Direction, Endpoint};
use fifo::{Receive, Transmit};
use registers::*;

/// Endpoints in each direction, endpoint 0 included (RM0090 section 34.4.1).
pub const ENDPOINTS: usize = 4;

/// From VBUS, or sensing switched on, to the B session being valid: the manual
/// gives no figure for comparator and filter. Assumed. It matters: the image
/// clears GINTSTS 0.27 µs after it switched sensing on, and were the session
/// valid before, SRQINT would be lost and the port never served.
const VBUS_VALID_US: u64 = 100;

/// The controller.
#[derive(Clone, PartialEq, Debug)]
pub struct Otg {
    hz: u64,
    now: Cycle,
    /// Grows whenever the answers of [`Self::in_ready`], [`Self::out_ready`],
    /// [`Self::attached`] or [`Self::awaits_sof`] may have changed.
    pub(crate) changes: u64,
    /// Level of the OTG_FS global interrupt (position 67).
    pub(crate) line: bool,
    /// VBUS at the connector.
    vbus: bool,
    /// VBUS was found valid, or will be at this cycle.
    session: Session,
    /// Since when D+ has been pulled up.
    attached: Option<Cycle>,
    /// GRSTCTL's self-clearing bits stay until then.
    resetting: (u32, Cycle),
    /// TXFNUM as written.
    flushed: u32,
    ahbcfg: u32,
    usbcfg: u32,
    otgint: u32,
    /// GINTSTS's sticky bits.
    events: u32,
    mask: u32,
    rx_size: u32,
    ccfg: u32,
    dcfg: u32,
    /// The address that the device answers to: DCFG.DAD, but a new one only
    /// counts once the status stage of SET_ADDRESS is over, since software
    /// writes it before (section 34.17.5).
    address: u8,
    /// DCTL's SDIS, GINSTS, GONSTS, POPRGDNE; global OUT NAK in effect.
    dctl: u32,
    out_nak_effective: bool,
    dsts: u32,
    frame: u16,
    in_mask: u32,
    out_mask: u32,
    endpoint_mask: u32,
    empty_mask: u32,
    /// A SETUP came and its stage has not ended yet.
    setup_stage: bool,
    receive: Receive,
    transmit: [Transmit; ENDPOINTS],
    ins: [Endpoint; ENDPOINTS],
    outs: [Endpoint; ENDPOINTS],
}

/// Whether the B session is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Session {
    Invalid,
    ValidFrom(Cycle),
    Valid,
}

impl Otg {
    /// Whether both do the same from now on: how often something changed may differ.
    pub fn is_equivalent_to(&self, other: &Self) -> bool {
        let mut otg = self.clone();
        otg.changes = other.changes;
        otg == *other
    }

    /// As after power-on, no VBUS, with a core clock of `hz` hertz.
    pub fn new(hz: u64) -> Self {
        Self {
            hz,
            now: 0,
            changes: 0,
            line: false,
            vbus: false,
            session: Session::Invalid,
            attached: None,
            resetting: (0, 0),
            flushed: 0,
            ahbcfg: 0,
            usbcfg: usbcfg::RESET,
            otgint: 0,
            events: 0,
            mask: 0,
            rx_size: 0x200,
            ccfg: 0,
            dcfg: dcfg::RESET,
            address: 0,
            dctl: 0,
            out_nak_effective: false,
            dsts: 0,
            frame: 0,
            in_mask: 0,
            out_mask: 0,
            endpoint_mask: 0,
            empty_mask: 0,
            setup_stage: false,
            receive: Receive::default(),
            transmit: std::array::from_fn(|n| {
                Transmit::new(if n == 0 { 0x0200_0200 } else { 0x0200_0400 })
            }),
            ins: std::array::from_fn(|n| Endpoint::new(n, Direction::In)),
            outs: std::array::from_fn(|n| Endpoint::new(n, Direction::Out)),
        }
    }

    /// The core clock is `hz` hertz from cycle `at` on.
    pub fn set_hz(&mut self, hz: u64, at: Cycle) {
        if let Session::ValidFrom(then) = self.session {
            let left = then.saturating_sub(at);
            self.session = Session::ValidFrom(at + left * hz / self.hz.max(1));
        }
        self.hz = hz;
    }

    /// RCC resets the peripheral (AHB2RSTR.OTGFSRST); the cable stays.
    pub fn reset_registers(&mut self, at: Cycle) {
        *self = Self {
            now: at,
            vbus: self.vbus,
            changes: self.changes,
            ..Self::new(self.hz)
        };
        self.mark_changed();
    }

    /// Something changed.
    fn mark_changed(&mut self) {
        self.changes += 1;
        self.line = self.ahbcfg & ahbcfg::GINT != 0 && self.status() & self.mask != 0;
    }

    /// GINTSTS.
    fn status(&self) -> u32 {
        let daint = self.daint() & self.endpoint_mask;
        let levels = [
            (int::OTGINT, self.otgint != 0),
            (int::RXFLVL, self.receive.has_entry()),
            (int::GINAKEFF, self.dctl & dctl::GINSTS != 0),
            (int::GONAKEFF, self.out_nak_effective),
            (int::IEPINT, daint & 0xFFFF != 0),
            (int::OEPINT, daint >> 16 != 0),
        ];
        // The two FIFO levels of host mode keep their reset value.
        let levels = levels.iter().filter(|l| l.1).fold(0, |bits, l| bits | l.0);
        self.events | levels | int::NPTXFE | int::PTXFE
    }

    fn daint(&self) -> u32 {
        let mut bits = 0;
        for n in 0..ENDPOINTS {
            let empty = self.in_interrupt(n) & epint::TXFE != 0 && self.empty_mask >> n & 1 != 0;
            if self.ins[n].interrupt & self.in_mask != 0 || empty {
                bits |= 1 << n;
            }
            if self.outs[n].interrupt & self.out_mask != 0 {
                bits |= 1 << (16 + n);
            }
        }
        bits
    }

    fn in_interrupt(&self, n: usize) -> u32 {
        let completely = self.ahbcfg & ahbcfg::TXFELVL != 0;
        let level = if self.transmit[n].is_empty(completely) {
            epint::TXFE
        } else {
            0
        };
        self.ins[n].interrupt | level
    }

    /// D+ is pulled up while the transceiver is on, VBUS is valid or taken as
    /// valid, and software did not disconnect (sections 34.5.2, 34.16.2).
    fn update_pull_up(&mut self, at: Cycle) {
        let sensed = self.ccfg & ccfg::NOVBUSSENS != 0 || self.session == Session::Valid;
        let up = self.ccfg & ccfg::PWRDWN != 0 && sensed && self.dctl & dctl::SDIS == 0;
        self.attached = match (up, self.attached) {
            (true, None) => Some(at),
            (true, since) => since,
            (false, _) => None,
        };
    }

    /// VBUS or its sensing changed.
    fn update_session(&mut self, at: Cycle) {
        let sensing = ccfg::PWRDWN | ccfg::VBUSBSEN;
        let valid = self.vbus && self.ccfg & sensing == sensing;
        match (valid, self.session) {
            (true, Session::Invalid) => {
                self.session = Session::ValidFrom(at + VBUS_VALID_US * self.hz / 1_000_000);
            }
            (false, Session::Valid) => {
                self.session = Session::Invalid;
                self.otgint |= SEDET;
            }
            (false, _) => self.session = Session::Invalid,
            (true, _) => {}
        }
        self.update_pull_up(at);
    }
}

impl Peripheral for Otg {
    fn read(&mut self, offset: u32, at: Cycle) -> Modelled<u32> {
        self.advance(at)?;
        match offset {
            offset::FIFO..0x5000 => {
                let word = self.receive.data();
                self.mark_changed();
                word
            }
            offset::IN_ENDPOINTS..offset::OUT_ENDPOINTS => self.read_in_endpoint(offset),
            offset::OUT_ENDPOINTS..offset::PCGCCTL => self.read_out_endpoint(offset),
            offset::DCFG..offset::IN_ENDPOINTS => self.read_device(offset),
            _ => self.read_core(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        self.advance(at)?;
        match offset {
            offset::FIFO..0x5000 => self.transmit[(offset >> 12) as usize - 1].push(value)?,
            offset::IN_ENDPOINTS..offset::OUT_ENDPOINTS => self.write_in_endpoint(offset, value)?,
            offset::OUT_ENDPOINTS..offset::PCGCCTL => self.write_out_endpoint(offset, value)?,
            offset::DCFG..offset::IN_ENDPOINTS => self.write_device(offset, value, at)?,
            _ => self.write_core(offset, value, at)?,
        }
        self.mark_changed();
        Ok(())
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        self.now = to;
        if let Session::ValidFrom(then) = self.session
            && then <= to
        {
            self.session = Session::Valid;
            self.events |= int::SRQINT;
            self.update_pull_up(then);
            self.mark_changed();
        }
        Ok(())
    }

    fn next_event(&self) -> Cycle {
        match self.session {
            Session::ValidFrom(then) => then,
            _ => Cycle::MAX,
        }
    }
}
