//! Effects of reading and writing each register (RM0090 section 34.16).

use super::fifo::{self, Status};
use super::registers::*;
use super::{ENDPOINTS, Otg, Session};
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};

/// A FIFO flush or core reset takes 8 cycles of the slower clock, the PHY's 48 MHz (RM0090 section
/// 34.16.2, GRSTCTL).
const RESET_PHY_CYCLES: u64 = 8;

impl Otg {
    pub(super) fn read_core(&mut self, offset: u32) -> Modelled<u32> {
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
            offset::DIEPTXF0 => self.transmit[0].register,
            offset::DIEPTXF1..=offset::DIEPTXF3 => self.transmit[tx_fifo(offset)].register,
            offset::GCCFG => self.ccfg,
            // Silicon answers 0x1200 where the manual prints 0x1100; GHWCFG4 is not in the manual.
            // Both values are from TinyUSB's table of DWC2 cores, for the STM32F407's full-speed
            // port.
            offset::CID => 0x0000_1200,
            offset::GHWCFG4 => 0x0FF0_8030,
            offset::PCGCCTL => 0,
            _ => return Err(Unmodelled("OTG_FS register")),
        })
    }

    pub(super) fn write_core(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
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

    fn write_reset(&mut self, value: u32, at: Cycle) -> Modelled {
        refuse_if(value & rstctl::HOST != 0, "OTG_FS GRSTCTL HSRST or FCRST")?;
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

    /// Executes GRSTCTL.CSRST: resets all registers except the settings of PHY and board.
    fn core_reset(&mut self, at: Cycle) {
        *self = Self {
            now: at,
            changes: self.changes,
            vbus: self.vbus,
            sensed: self.sensed,
            session: self.session,
            ccfg: self.ccfg,
            usbcfg: self.usbcfg,
            attached: self.attached,
            ..Self::new(self.hz)
        };
        self.update_pull_up(at);
    }

    /// Reads GRXSTSP: some entries have an effect when they are popped (section 34.17.6).
    fn pop(&mut self) -> Modelled<u32> {
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
        self.mark_changed();
        Ok(popped.word)
    }

    pub(super) fn read_device(&mut self, offset: u32) -> Modelled<u32> {
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

    pub(super) fn write_device(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        let interrupts = epint::XFRC | epint::EPDISD;
        match offset {
            offset::DCFG if value & dcfg::DSPD != dcfg::DSPD => {
                return Err(Unmodelled("OTG_FS DCFG DSPD other than full speed"));
            }
            offset::DCFG if value & dcfg::PFIVL != 0 => {
                return Err(Unmodelled("OTG_FS DCFG PFIVL other than 80 %"));
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

    pub(super) fn read_in_endpoint(&mut self, offset: u32) -> Modelled<u32> {
        let (n, register) = endpoint_register(offset)?;
        Ok(match register {
            offset::EP_CTL => self.ins[n].control(),
            offset::EP_INT => self.in_interrupt(n),
            offset::EP_TSIZ => self.ins[n].transfer_size(),
            offset::EP_DTXFSTS => self.transmit[n].free(),
            _ => return Err(Unmodelled("OTG_FS IN endpoint register")),
        })
    }

    pub(super) fn write_in_endpoint(&mut self, offset: u32, value: u32) -> Modelled {
        let (n, register) = endpoint_register(offset)?;
        match register {
            offset::EP_CTL => self.ins[n].write_control(value)?,
            offset::EP_INT => self.ins[n].interrupt &= !value,
            offset::EP_TSIZ => self.ins[n].write_transfer_size(value),
            _ => return Err(Unmodelled("OTG_FS IN endpoint register")),
        }
        Ok(())
    }

    pub(super) fn read_out_endpoint(&mut self, offset: u32) -> Modelled<u32> {
        let (n, register) = endpoint_register(offset)?;
        Ok(match register {
            offset::EP_CTL => self.outs[n].control(),
            offset::EP_INT => self.outs[n].interrupt,
            offset::EP_TSIZ => self.outs[n].transfer_size(),
            _ => return Err(Unmodelled("OTG_FS OUT endpoint register")),
        })
    }

    pub(super) fn write_out_endpoint(&mut self, offset: u32, value: u32) -> Modelled {
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

/// Returns the number of the transmit FIFO whose DIEPTXFn is at `offset`.
fn tx_fifo(offset: u32) -> usize {
    ((offset - offset::DIEPTXF1) / 4 + 1) as usize
}

/// Returns the endpoint and the register within it. The registers of one direction start at a
/// multiple of 0x100.
fn endpoint_register(offset: u32) -> Modelled<(usize, u32)> {
    let n = ((offset % 0x200) / 0x20) as usize;
    // 0x900 and 0xB00 both lie 0x100 past a multiple of 0x200.
    match n.checked_sub(8).filter(|n| *n < ENDPOINTS) {
        Some(n) => Ok((n, offset % 0x20)),
        None => Err(Unmodelled("OTG_FS endpoint beyond 3")),
    }
}
