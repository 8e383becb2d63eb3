//! Models OTG_FS as a USB device (RM0090 chapter 34), at 0x5000_0000.
//!
//! In: register accesses, and packets from the cable (`cable`). Out: packets, the pull-up on D+,
//! one interrupt line. The host at the other end is in `chip::usb`; host mode, isochronous
//! transfers, remote wake-up and pins are not modelled. `registers` defines the bits, `access`
//! their effects; `endpoint` and `fifo` are the parts.

mod access;
mod cable;
mod endpoint;
mod fifo;
mod registers;
#[cfg(test)]
mod tests;

pub use cable::{Handshake, Packet, Reply};

use crate::chip::board::wiring::Vbus;
use crate::chip::soc::peripheral::{Cycle, Modelled, Peripheral};
use endpoint::{Direction, Endpoint};
use fifo::{Receive, Transmit};
use registers::*;

/// Number of endpoints in each direction, endpoint 0 included (RM0090 section 34.4.1).
pub const ENDPOINTS: usize = 4;

/// Assumed time from VBUS or the start of its sensing until the B session is valid, µs: the manual
/// gives no figure for comparator and filter. It matters: the image clears GINTSTS 0.27 µs after it
/// switches sensing on, and if the session were valid earlier, SRQINT would be lost and the port
/// never served.
const VBUS_VALID_US: u64 = 100;

/// USB controller OTG_FS as a device: its registers, its FIFOs, and the state of the cable.
#[derive(Clone, PartialEq, Debug)]
pub struct Otg {
    hz: u64,
    now: Cycle,
    /// Counter that grows whenever the answers of [`Self::in_ready`], [`Self::out_ready`],
    /// [`Self::attached`] or [`Self::awaits_sof`] may have changed.
    pub(crate) changes: u64,
    /// Level of the OTG_FS global interrupt (position 67).
    pub(crate) line: bool,
    /// Whether VBUS is present at the connector.
    vbus: bool,
    sensed: Vbus,
    /// Whether VBUS was detected as valid, or the cycle at which it will be.
    session: Session,
    /// Cycle since which D+ has been pulled up.
    attached: Option<Cycle>,
    /// Self-clearing bits of GRSTCTL, and the cycle until which they stay set.
    resetting: (u32, Cycle),
    /// Field TXFNUM of GRSTCTL as last written, at its place in the register: which transmit FIFO
    /// is flushed.
    flushed: u32,
    ahbcfg: u32,
    usbcfg: u32,
    otgint: u32,
    /// Sticky bits of GINTSTS.
    events: u32,
    mask: u32,
    rx_size: u32,
    ccfg: u32,
    dcfg: u32,
    /// Address that the device answers to: DCFG.DAD, but a new address counts only after the status
    /// stage of SET_ADDRESS, because software writes it earlier (section 34.17.5).
    address: u8,
    /// Bits SDIS, GINSTS, GONSTS and POPRGDNE of DCTL.
    dctl: u32,
    /// Whether the global OUT NAK is in effect.
    out_nak_effective: bool,
    dsts: u32,
    frame: u16,
    in_mask: u32,
    out_mask: u32,
    endpoint_mask: u32,
    empty_mask: u32,
    /// Whether a SETUP packet was received and its stage has not ended yet.
    setup_stage: bool,
    receive: Receive,
    transmit: [Transmit; ENDPOINTS],
    ins: [Endpoint; ENDPOINTS],
    outs: [Endpoint; ENDPOINTS],
}

/// State of the B session, in which the host at the other end supplies VBUS.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Session {
    Invalid,
    ValidFrom(Cycle),
    Valid,
}

impl Otg {
    /// Returns whether both controllers behave identically from now on; their counters of changes
    /// may differ.
    pub fn is_equivalent_to(&self, other: &Self) -> bool {
        let mut otg = self.clone();
        otg.changes = other.changes;
        otg == *other
    }

    /// Creates the controller in its power-on state, without VBUS, with a core clock of `hz` hertz.
    pub fn new(hz: u64) -> Self {
        Self {
            hz,
            now: 0,
            changes: 0,
            line: false,
            vbus: false,
            sensed: Vbus::Sensed,
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

    /// Sets the core clock to `hz` hertz from cycle `at` on.
    pub fn set_hz(&mut self, hz: u64, at: Cycle) {
        if let Session::ValidFrom(then) = self.session {
            let left = then.saturating_sub(at);
            self.session = Session::ValidFrom(at + left * hz / self.hz.max(1));
        }
        self.hz = hz;
    }

    /// Resets the peripheral (AHB2RSTR.OTGFSRST); the cable stays connected.
    pub fn reset_registers(&mut self, at: Cycle) {
        *self = Self {
            now: at,
            vbus: self.vbus,
            sensed: self.sensed,
            changes: self.changes,
            ..Self::new(self.hz)
        };
        self.mark_changed();
    }

    /// Counts a change and updates the interrupt line.
    fn mark_changed(&mut self) {
        self.changes += 1;
        self.line = self.ahbcfg & ahbcfg::GINT != 0 && self.status() & self.mask != 0;
    }

    /// Returns GINTSTS: the stored events, and the bits that follow the present state.
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

    /// Updates the pull-up of D+: on while the transceiver is on, VBUS is valid or assumed to be,
    /// and software has not disconnected (sections 34.5.2, 34.16.2).
    fn update_pull_up(&mut self, at: Cycle) {
        let sensed = self.ccfg & ccfg::NOVBUSSENS != 0 || self.session == Session::Valid;
        let up = self.ccfg & ccfg::PWRDWN != 0 && sensed && self.dctl & dctl::SDIS == 0;
        self.attached = match (up, self.attached) {
            (true, None) => Some(at),
            (true, since) => since,
            (false, _) => None,
        };
    }

    /// Updates the session after a change of VBUS or its sensing.
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
