//! OTG_FS as a device (RM0090 chapter 34), at 0x5000_0000.
//!
//! In: register accesses, and packets from the cable (`cable`). Out: packets,
//! the pull-up on D+, one interrupt line. Not here: the host at the other end
//! (`chip::usb`), host mode, isochronous transfers, remote wake-up, pins.
//! `registers` has the bits, `endpoint` and `fifo` the parts.

mod cable;
mod endpoint;
mod fifo;
mod registers;
#[cfg(test)]
mod tests;

pub use cable::{Answer, Packet, Reply};

use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::Unmodelled;
use crate::chip::soc::Peripheral;
use endpoint::{Direction, Endpoint};
use fifo::{Receive, Status, Transmit};
use registers::*;

/// Endpoints in each direction, endpoint 0 included (RM0090 section 34.4.1).
pub const ENDPOINTS: usize = 4;

/// From VBUS at PA9 to the B session being valid: the manual gives no figure
/// for comparator and filter. Assumed: longer than start-up code that clears
/// GINTSTS after it switched sensing on, or SRQINT would be lost.
const VBUS_VALID_US: u64 = 100;
/// A FIFO flush or core reset takes 8 cycles of the slower clock, the PHY's
/// 48 MHz (RM0090 section 34.16.2, GRSTCTL).
const RESET_PHY_CYCLES: u64 = 8;

/// The controller.
#[derive(Clone, Debug)]
pub struct Otg {
    hz: u64,
    now: Cycle,
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
    /// As after power-on, no VBUS, with a core clock of `hz` hertz.
    #[must_use]
    pub fn new(hz: u64) -> Self {
        Self {
            hz,
            now: 0,
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
        let vbus = self.vbus;
        *self = Self::new(self.hz);
        self.now = at;
        self.vbus = vbus;
    }

    /// Level of the OTG_FS global interrupt (position 67).
    #[must_use]
    pub fn irq(&self) -> bool {
        self.ahbcfg & ahbcfg::GINT != 0 && self.status() & self.mask != 0
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
    fn read(&mut self, offset: u32, size: Size, at: Cycle) -> Result<u32, Unmodelled> {
        if size != Size::Word {
            return Err(Unmodelled("OTG_FS access other than 32 bits"));
        }
        self.advance(at)?;
        match offset {
            offset::FIFO..0x5000 => self.receive.data(),
            offset::IN_ENDPOINTS..offset::OUT_ENDPOINTS => self.read_in_endpoint(offset),
            offset::OUT_ENDPOINTS..offset::PCGCCTL => self.read_out_endpoint(offset),
            offset::DCFG..offset::IN_ENDPOINTS => self.read_device(offset),
            _ => self.read_core(offset),
        }
    }

    fn write(&mut self, offset: u32, size: Size, value: u32, at: Cycle) -> Result<(), Unmodelled> {
        if size != Size::Word {
            return Err(Unmodelled("OTG_FS access other than 32 bits"));
        }
        self.advance(at)?;
        match offset {
            offset::FIFO..0x5000 => self.transmit[(offset >> 12) as usize - 1].push(value),
            offset::IN_ENDPOINTS..offset::OUT_ENDPOINTS => self.write_in_endpoint(offset, value),
            offset::OUT_ENDPOINTS..offset::PCGCCTL => self.write_out_endpoint(offset, value),
            offset::DCFG..offset::IN_ENDPOINTS => self.write_device(offset, value, at),
            _ => self.write_core(offset, value, at),
        }
    }

    fn advance(&mut self, to: Cycle) -> Result<(), Unmodelled> {
        self.now = to;
        if let Session::ValidFrom(then) = self.session
            && then <= to
        {
            self.session = Session::Valid;
            self.events |= int::SRQINT;
            self.update_pull_up(then);
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

/// The registers, block by block.
impl Otg {
    fn read_core(&mut self, offset: u32) -> Result<u32, Unmodelled> {
        Ok(match offset {
            offset::GOTGCTL if self.session == Session::Valid => otgctl::CIDSTS | otgctl::BSVLD,
            offset::GOTGCTL => otgctl::CIDSTS,
            offset::GOTGINT => self.otgint,
            offset::GAHBCFG => self.ahbcfg,
            offset::GUSBCFG => self.usbcfg | usbcfg::PHSEL,
            offset::GRSTCTL => {
                let (bits, until) = self.resetting;
                let busy = if self.now < until { bits } else { 0 };
                rstctl::AHBIDL | self.flushed | busy
            }
            offset::GINTSTS => self.status(),
            offset::GINTMSK => self.mask,
            offset::GRXSTSR => self.receive.peek()?,
            offset::GRXSTSP => self.pop()?,
            offset::GRXFSIZ => self.rx_size,
            offset::DIEPTXF0 => self.transmit[0].register(),
            offset::DIEPTXF1..=offset::DIEPTXF3 => self.transmit[tx_fifo(offset)].register(),
            offset::GCCFG => self.ccfg,
            // Silicon answers 0x1200 where the manual prints 0x1100; GHWCFG4 is
            // not in the manual. Both as TinyUSB's table of DWC2 cores has them
            // for the STM32F407's full-speed port.
            offset::CID => 0x0000_1200,
            offset::GHWCFG4 => 0x0FF0_8030,
            offset::PCGCCTL => 0,
            _ => return Err(Unmodelled("OTG_FS register")),
        })
    }

    fn write_core(&mut self, offset: u32, value: u32, at: Cycle) -> Result<(), Unmodelled> {
        match offset {
            offset::GOTGINT => self.otgint &= !value,
            offset::GAHBCFG => self.ahbcfg = value & (ahbcfg::GINT | ahbcfg::TXFELVL),
            offset::GUSBCFG if value & usbcfg::FHMOD != 0 => {
                return Err(Unmodelled("OTG_FS host mode"));
            }
            offset::GUSBCFG => self.usbcfg = value & usbcfg::WRITABLE,
            offset::GRSTCTL => return self.write_reset(value, at),
            offset::GINTSTS => self.events &= !(value & int::STICKY),
            offset::GINTMSK if value & int::UNMODELLED != 0 => {
                return Err(Unmodelled("OTG_FS interrupt of host mode or isochronous"));
            }
            offset::GINTMSK => self.mask = value & int::MASKABLE,
            offset::GRXFSIZ if !(16..=fifo::MEMORY_WORDS).contains(&value) => {
                return Err(Unmodelled("OTG_FS GRXFSIZ beyond 320 words or under 16"));
            }
            offset::GRXFSIZ => self.rx_size = value,
            offset::DIEPTXF0 => return self.transmit[0].configure(value),
            offset::DIEPTXF1..=offset::DIEPTXF3 => {
                return self.transmit[tx_fifo(offset)].configure(value);
            }
            offset::GCCFG if value & (ccfg::VBUSASEN | ccfg::SOFOUTEN) != 0 => {
                return Err(Unmodelled("OTG_FS A-device sensing or SOF output"));
            }
            offset::GCCFG => {
                self.ccfg = value & (ccfg::PWRDWN | ccfg::VBUSBSEN | ccfg::NOVBUSSENS);
                self.update_session(at);
            }
            offset::PCGCCTL if value == 0 => {}
            _ => return Err(Unmodelled("OTG_FS register")),
        }
        Ok(())
    }

    fn write_reset(&mut self, value: u32, at: Cycle) -> Result<(), Unmodelled> {
        if value & rstctl::HOST != 0 {
            return Err(Unmodelled("OTG_FS GRSTCTL HSRST or FCRST"));
        }
        let bits = value & (rstctl::CSRST | rstctl::RXFFLSH | rstctl::TXFFLSH);
        self.flushed = value & rstctl::TXFNUM;
        if bits & rstctl::CSRST != 0 {
            self.core_reset(at);
        }
        if bits & rstctl::RXFFLSH != 0 {
            self.receive.flush();
        }
        if bits & rstctl::TXFFLSH != 0 {
            let number = self.flushed >> 6;
            for (n, fifo) in self.transmit.iter_mut().enumerate() {
                if number == rstctl::ALL || number as usize == n {
                    fifo.flush();
                }
            }
        }
        if bits != 0 {
            self.resetting = (bits, at + RESET_PHY_CYCLES * self.hz / 48_000_000);
        }
        Ok(())
    }

    /// GRSTCTL.CSRST: all registers but the PHY's and the board's settings.
    fn core_reset(&mut self, at: Cycle) {
        let mut fresh = Self::new(self.hz);
        fresh.now = at;
        fresh.vbus = self.vbus;
        fresh.session = self.session;
        fresh.ccfg = self.ccfg;
        fresh.usbcfg = self.usbcfg;
        fresh.attached = self.attached;
        *self = fresh;
        self.update_pull_up(at);
    }

    /// GRXSTSP: some entries act when they are taken (section 34.17.6).
    fn pop(&mut self) -> Result<u32, Unmodelled> {
        let popped = self.receive.pop()?;
        let endpoint = &mut self.outs[popped.endpoint.min(ENDPOINTS - 1)];
        match popped.status {
            s if s == Status::OutDone as u32 => {
                endpoint.clear(ctl::EPENA);
                endpoint.interrupt |= epint::XFRC;
            }
            s if s == Status::SetupDone as u32 => {
                endpoint.clear(ctl::EPENA);
                endpoint.interrupt |= epint::STUP;
            }
            s if s == Status::GlobalNak as u32 => self.out_nak_effective = true,
            _ => {}
        }
        Ok(popped.word)
    }

    fn read_device(&mut self, offset: u32) -> Result<u32, Unmodelled> {
        Ok(match offset {
            offset::DCFG => self.dcfg,
            offset::DCTL => self.dctl,
            offset::DSTS => self.dsts | u32::from(self.frame) << 8,
            offset::DIEPMSK => self.in_mask,
            offset::DOEPMSK => self.out_mask,
            offset::DAINT => self.daint(),
            offset::DAINTMSK => self.endpoint_mask,
            offset::DIEPEMPMSK => self.empty_mask,
            _ => return Err(Unmodelled("OTG_FS device register")),
        })
    }

    fn write_device(&mut self, offset: u32, value: u32, at: Cycle) -> Result<(), Unmodelled> {
        let interrupts = epint::XFRC | epint::EPDISD;
        match offset {
            offset::DCFG if value & dcfg::DSPD != dcfg::DSPD => {
                return Err(Unmodelled("OTG_FS DCFG DSPD other than full speed"));
            }
            offset::DCFG => {
                self.dcfg = dcfg::RESET | value & dcfg::WRITABLE;
                if self.programmed_address() == 0 {
                    self.address = 0;
                }
            }
            offset::DCTL if value & dctl::UNMODELLED != 0 => {
                return Err(Unmodelled("OTG_FS remote wake-up or test mode"));
            }
            offset::DCTL => self.write_control(value, at),
            offset::DIEPMSK if value & !(interrupts | epint::INEPNE) != 0 => {
                return Err(Unmodelled("OTG_FS DIEPMSK beyond XFRC, EPDISD, INEPNE"));
            }
            offset::DIEPMSK => self.in_mask = value,
            offset::DOEPMSK if value & !(interrupts | epint::STUP) != 0 => {
                return Err(Unmodelled("OTG_FS DOEPMSK beyond XFRC, EPDISD, STUP"));
            }
            offset::DOEPMSK => self.out_mask = value,
            offset::DAINTMSK => self.endpoint_mask = value & 0x000F_000F,
            offset::DIEPEMPMSK => self.empty_mask = value & 0xF,
            _ => return Err(Unmodelled("OTG_FS device register")),
        }
        Ok(())
    }

    fn write_control(&mut self, value: u32, at: Cycle) {
        let kept = dctl::SDIS | dctl::POPRGDNE;
        self.dctl = self.dctl & !kept | value & kept;
        if value & dctl::SGINAK != 0 {
            self.dctl |= dctl::GINSTS;
        }
        if value & dctl::CGINAK != 0 {
            self.dctl &= !dctl::GINSTS;
        }
        if value & dctl::SGONAK != 0 && self.dctl & dctl::GONSTS == 0 {
            self.dctl |= dctl::GONSTS;
            self.receive
                .push(Status::GlobalNak, 0, false, self.frame, &[]);
        }
        if value & dctl::CGONAK != 0 {
            self.dctl &= !dctl::GONSTS;
            self.out_nak_effective = false;
        }
        self.update_pull_up(at);
    }

    fn read_in_endpoint(&mut self, offset: u32) -> Result<u32, Unmodelled> {
        let (n, register) = endpoint_register(offset)?;
        Ok(match register {
            offset::EP_CTL => self.ins[n].control(),
            offset::EP_INT => self.in_interrupt(n),
            offset::EP_TSIZ => self.ins[n].transfer_size(),
            offset::EP_DTXFSTS => self.transmit[n].free(),
            _ => return Err(Unmodelled("OTG_FS IN endpoint register")),
        })
    }

    fn write_in_endpoint(&mut self, offset: u32, value: u32) -> Result<(), Unmodelled> {
        let (n, register) = endpoint_register(offset)?;
        match register {
            offset::EP_CTL => self.ins[n].write_control(value)?,
            offset::EP_INT => self.ins[n].interrupt &= !value,
            offset::EP_TSIZ => self.ins[n].write_transfer_size(value),
            _ => return Err(Unmodelled("OTG_FS IN endpoint register")),
        }
        Ok(())
    }

    fn read_out_endpoint(&mut self, offset: u32) -> Result<u32, Unmodelled> {
        let (n, register) = endpoint_register(offset)?;
        Ok(match register {
            offset::EP_CTL => self.outs[n].control(),
            offset::EP_INT => self.outs[n].interrupt,
            offset::EP_TSIZ => self.outs[n].transfer_size(),
            _ => return Err(Unmodelled("OTG_FS OUT endpoint register")),
        })
    }

    fn write_out_endpoint(&mut self, offset: u32, value: u32) -> Result<(), Unmodelled> {
        let (n, register) = endpoint_register(offset)?;
        match register {
            offset::EP_CTL => self.outs[n].write_control(value)?,
            offset::EP_INT => self.outs[n].interrupt &= !value,
            offset::EP_TSIZ => self.outs[n].write_transfer_size(value),
            _ => return Err(Unmodelled("OTG_FS OUT endpoint register")),
        }
        Ok(())
    }
}

/// Number of the transmit FIFO whose DIEPTXFn is at `offset`.
fn tx_fifo(offset: u32) -> usize {
    ((offset - offset::DIEPTXF1) / 4 + 1) as usize
}

/// Endpoint and register within it; the file holds those of one direction from
/// a multiple of 0x100 on.
fn endpoint_register(offset: u32) -> Result<(usize, u32), Unmodelled> {
    let n = ((offset % 0x200) / 0x20) as usize;
    // 0x900 and 0xB00 both lie 0x100 past a multiple of 0x200.
    match n.checked_sub(8).filter(|n| *n < ENDPOINTS) {
        Some(n) => Ok((n, offset % 0x20)),
        None => Err(Unmodelled("OTG_FS endpoint beyond 3")),
    }
}
