//! Models RCC: oscillators, PLL, clock tree, clock security, block clocks and resets, reset causes
//! (RM0090 chapter 7, F405).
//!
//! In: register accesses, `stop_hse`, `reset`. Out: `Clocks` when they change, enabled blocks,
//! block resets, NMI.
//!
//! Assumed as immediate, since the manual gives no time: the switch to a ready source (SWS follows
//! SW), new prescalers, and the detection of a failed HSE.

mod block;
mod cause;
mod crystal;
mod registers;
#[cfg(test)]
mod tests;
mod tree;

pub use block::{APB1, APB2, BUSES, Block};
pub use cause::Cause;
pub use crystal::Crystal;
pub use tree::HSI_HZ;

use super::clock::{Clocks, cycles_in, rescale};
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};
use crystal::HSE_START_NS;
use tree::{Limits, Pll, Source};

/// HSI start-up, 2.2 µs typical (DS8626, HSI oscillator characteristics).
const HSI_START_NS: u64 = 2_200;
/// PLL lock, 300 µs at most (DS8626, main PLL characteristics).
const PLL_LOCK_NS: u64 = 300_000;
/// LSI start-up, 15 µs typical (DS8626, LSI oscillator characteristics).
const LSI_START_NS: u64 = 15_000;

mod cr {
    pub const HSION: u32 = 1;
    pub const HSIRDY: u32 = 1 << 1;
    pub const HSITRIM: u32 = 0x1F << 3;
    pub const HSEON: u32 = 1 << 16;
    pub const HSERDY: u32 = 1 << 17;
    pub const HSEBYP: u32 = 1 << 18;
    pub const CSSON: u32 = 1 << 19;
    pub const PLLI2SON: u32 = 1 << 26;
    pub const PLLON: u32 = 1 << 24;
    pub const PLLRDY: u32 = 1 << 25;
    pub const RESET: u32 = 0x0000_0083;
    pub const KNOWN: u32 =
        HSION | HSIRDY | HSITRIM | 0xFF << 8 | HSEON | HSERDY | HSEBYP | CSSON | PLLON | PLLRDY;
}

const PLLCFGR_RESET: u32 = 0x2400_3010;
const PLLCFGR_FIELDS: u32 = 0x0F43_7FFF;
const CFGR_FIELDS: u32 = 0xFFFF_FCF3;
/// AHB1 to APB2 low-power enables after reset (sections 7.3.15–7.3.19).
const LPENR_RESET: [u32; BUSES] = [0x7E67_91FF, 0x0000_00F1, 1, 0x36FE_C9FF, 0x0007_5F33];
const CSSF: u32 = 1 << 7;
const CSSC: u32 = 1 << 23;
const RMVF: u32 = 1 << 24;

/// Cycle at which each starting oscillator is ready; `Cycle::MAX` if it is not starting.
#[derive(Clone, PartialEq, Debug)]
struct Starting {
    hsi: Cycle,
    hse: Cycle,
    pll: Cycle,
    lsi: Cycle,
}

/// Reset and clock control.
#[derive(Clone, PartialEq, Debug)]
pub struct Rcc {
    hse_hz: u32,
    hse_start_ns: u64,
    hse_works: bool,
    /// Actual output P of the PLL, Hz, if an injected fault changes it.
    pll_hz: Option<u32>,
    /// Limits for the clocks that the registers select.
    limits: Limits,
    cr: u32,
    pllcfgr: u32,
    cfgr: u32,
    /// Level of NMI, which is also the break input of TIM1: clock security detected a failed HSE,
    /// and CIR.CSSC has not been written yet.
    pub(crate) cssf: bool,
    resets: [u32; BUSES],
    enables: [u32; BUSES],
    /// For each bus, the cycle from which the blocks in `fresh` answer.
    settled: [Cycle; BUSES],
    /// For each bus, the bits that the latest write to its enable register has set.
    fresh: [u32; BUSES],
    bdcr: u32,
    csr: u32,
    starting: Starting,
    source: Source,
    /// Present frequencies of the core, the buses and their timers.
    pub(crate) clocks: Clocks,
    changed: bool,
    new_resets: [u32; BUSES],
    backup_reset: bool,
    backup_writable: bool,
}

impl Rcc {
    /// Creates the block in its power-on state, with this crystal. The clocks of a crystal that is
    /// off its nominal frequency may exceed the data sheet by as much.
    pub fn new(crystal: Crystal) -> Self {
        let is_nominal = crystal.hz.is_multiple_of(1_000_000);
        let clocks = Clocks {
            hclk_hz: HSI_HZ,
            pclk1_hz: HSI_HZ,
            pclk2_hz: HSI_HZ,
            timer1_hz: HSI_HZ,
            timer2_hz: HSI_HZ,
            usb_hz: 0,
        };
        Self {
            hse_hz: crystal.hz,
            hse_start_ns: crystal.start_ns.unwrap_or(HSE_START_NS),
            hse_works: crystal.start_ns.is_some(),
            pll_hz: None,
            limits: if is_nominal {
                Limits::DATA_SHEET
            } else {
                Limits::KNOWN
            },
            cr: cr::RESET,
            pllcfgr: PLLCFGR_RESET,
            cfgr: 0,
            cssf: false,
            resets: [0; BUSES],
            enables: [1 << 20, 0, 0, 0, 0],
            settled: [0; BUSES],
            fresh: [0; BUSES],
            bdcr: 0,
            csr: Cause::PowerOn.flags(),
            starting: Starting {
                hsi: Cycle::MAX,
                hse: Cycle::MAX,
                pll: Cycle::MAX,
                lsi: Cycle::MAX,
            },
            source: Source::Hsi,
            clocks,
            changed: true,
            new_resets: [0; BUSES],
            backup_reset: false,
            backup_writable: false,
        }
    }

    /// Resets the registers. Flags of earlier resets stay until RMVF or power-on; BDCR stays.
    pub fn reset(&mut self, cause: Cause) {
        let flags = match cause {
            Cause::PowerOn => 0,
            _ => self.csr & 0xFE00_0000,
        };
        *self = Self {
            csr: flags | cause.flags(),
            bdcr: self.bdcr,
            hse_works: self.hse_works,
            pll_hz: self.pll_hz,
            ..Self::new(Crystal {
                hz: self.hse_hz,
                start_ns: Some(self.hse_start_ns),
            })
        };
    }

    /// Returns the frequencies, if they changed since the last call (or reset).
    pub fn take_change(&mut self) -> Option<Clocks> {
        std::mem::take(&mut self.changed).then_some(self.clocks)
    }

    /// Returns the blocks to reset: those whose reset bit was set since the last call.
    pub fn take_resets(&mut self) -> impl Iterator<Item = Block> + use<> {
        Block::in_masks(std::mem::take(&mut self.new_resets))
    }

    /// Returns whether BDCR.BDRST reset the backup domain since the last call.
    pub fn take_backup_reset(&mut self) -> bool {
        std::mem::take(&mut self.backup_reset)
    }

    /// Returns whether `block` answers at `at`. If its clock is off or its reset is held, reads
    /// give 0 and writes are ignored.
    ///
    /// # Errors
    /// Fails for an access sooner after enabling than the errata allow.
    #[inline]
    pub fn is_enabled(&self, block: Block, at: Cycle) -> Modelled<bool> {
        let (bus, bit) = block.place();
        let mask = 1 << bit;
        refuse_if(
            self.fresh[bus] & mask != 0 && at < self.settled[bus],
            "an access too soon after the clock was enabled (ES0182, delay after clock enabling)",
        )?;
        Ok(self.enables[bus] & !self.resets[bus] & mask != 0)
    }

    /// Treats just enabled clocks as settled: a real probe's next access comes late, while the
    /// simulator's debugger takes no simulated time.
    pub const fn settle(&mut self) {
        self.fresh = [0; BUSES];
    }

    /// Returns whether the enable bit at this bus and bit is set.
    pub const fn is_set(&self, (bus, bit): (usize, u32)) -> bool {
        self.enables[bus] >> bit & 1 != 0
    }

    /// Returns the crystal's frequency, Hz, and its divider RTCPRE for RTC and TIM11, 2 to 31;
    /// `None` if it is off or not divided (section 7.3.3).
    pub const fn hse_rtc(&self) -> (u32, Option<u32>) {
        let rtcpre = self.cfgr >> 16 & 0x1F;
        let is_there = self.hse_works && self.cr & cr::HSERDY != 0 && rtcpre >= 2;
        (self.hse_hz, if is_there { Some(rtcpre) } else { None })
    }

    /// Returns whether the LSI oscillates and is ready (RCC_CSR.LSIRDY).
    pub const fn is_lsi_ready(&self) -> bool {
        self.csr & 1 << 1 != 0
    }

    /// Sets whether BDCR can be written (PWR_CR.DBP).
    pub fn set_backup_writable(&mut self, writable: bool) {
        self.backup_writable = writable;
    }

    /// Stops the crystal permanently at `at`, as an injected fault.
    ///
    /// # Errors
    /// Fails if clock security is off and the core would have no clock.
    pub fn stop_hse(&mut self, at: Cycle) -> Modelled {
        self.hse_works = false;
        self.starting.hse = Cycle::MAX;
        if self.cr & cr::HSERDY == 0 {
            return Ok(());
        }
        let drives_pll = self.cr & cr::PLLON != 0 && self.pllcfgr & 1 << 22 != 0;
        let drives_core = self.source == Source::Hse || self.source == Source::Pll && drives_pll;
        if self.cr & cr::CSSON == 0 {
            self.cr &= !cr::HSERDY;
            return if drives_core || drives_pll {
                Err(Unmodelled("HSE failed while clock security was off"))
            } else {
                Ok(())
            };
        }
        self.cssf = true;
        self.cr &= !(cr::HSEON | cr::HSERDY);
        if drives_core {
            // HSI is forced on; its start-up is not modelled here.
            self.cr |= cr::HSION | cr::HSIRDY;
            self.cfgr &= !3;
            self.source = Source::Hsi;
        }
        if drives_pll {
            self.cr &= !(cr::PLLON | cr::PLLRDY);
            self.starting.pll = Cycle::MAX;
        }
        self.update_clocks(at)
    }

    /// Sets the PLL's output P to `hz` from `at` on, and Q in proportion, regardless of registers
    /// and resets: the fault is a lost lock or a wrong crystal.
    ///
    /// # Errors
    /// Fails for prescalers that are not modelled.
    pub fn set_pll_hz(&mut self, hz: u32, at: Cycle) -> Modelled {
        self.pll_hz = Some(hz);
        self.update_clocks(at)
    }

    /// Returns whether the clocks are those that the registers select: no fault was injected with
    /// [`Self::set_pll_hz`].
    pub const fn matches_registers(&self) -> bool {
        self.pll_hz.is_none()
    }

    /// Returns whether an inverted register bit has driven the clocks beyond the data sheet.
    pub fn exceeds_data_sheet(&self) -> bool {
        self.limits != Limits::DATA_SHEET
    }

    fn write_cr(&mut self, value: u32, at: Cycle) -> Modelled {
        // PLLI2S clocks no modelled block.
        refuse_if(
            value & !(cr::KNOWN | cr::PLLI2SON) != 0,
            "RCC_CR: reserved bits",
        )?;
        let in_use = self.clock_bits_in_use();
        let trim = value & cr::HSITRIM;
        refuse_if(
            trim != self.cr & cr::HSITRIM && in_use & cr::HSION != 0,
            "RCC_CR: HSITRIM changed while the HSI is in use",
        )?;
        let i2s = value & cr::PLLI2SON;
        // The source of the core clock cannot be switched off.
        let value = value & (cr::HSION | cr::HSEON | cr::HSEBYP | cr::CSSON | cr::PLLON) | in_use;
        let hz = self.clocks.hclk_hz;
        for (on, ready, start_ns) in [
            (cr::HSION, cr::HSIRDY, HSI_START_NS),
            (cr::HSEON, cr::HSERDY, self.hse_start_ns),
            (cr::PLLON, cr::PLLRDY, PLL_LOCK_NS),
        ] {
            let due = if value & on == 0 {
                self.cr &= !ready;
                Cycle::MAX
            } else if self.cr & on != 0 {
                continue;
            } else if on == cr::HSEON && !self.hse_works {
                Cycle::MAX
            } else {
                if on == cr::PLLON {
                    self.check_pll_source()?;
                }
                at.saturating_add(cycles_in(start_ns, hz))
            };
            match on {
                cr::HSION => self.starting.hsi = due,
                cr::HSEON => self.starting.hse = due,
                _ => self.starting.pll = due,
            }
        }
        let kept = cr::HSIRDY | cr::HSERDY | cr::PLLRDY | 0xFF00;
        self.cr = value | i2s | trim | self.cr & kept;
        self.update_clocks(at)
    }

    /// Inverts `bits` of CFGR, or of PLLCFGR while the PLL is on and the register write-protected.
    /// The PLL uses the new factor from `at` on; loss of lock is not modelled. Returns `false` if
    /// `offset` is another register, or if it is PLLCFGR and the PLL is off.
    ///
    /// # Errors
    /// Fails for forbidden settings, or clocks beyond [`Limits::KNOWN`].
    pub fn upset(&mut self, offset: u32, bits: u32, at: Cycle) -> Modelled<bool> {
        match offset {
            0x04 if self.cr & cr::PLLON != 0 => self.pllcfgr ^= bits & PLLCFGR_FIELDS,
            0x08 => self.cfgr ^= bits & CFGR_FIELDS,
            _ => return Ok(false),
        }
        self.limits = Limits::KNOWN;
        self.follow_switch(at)?;
        let allowed = Limits::DATA_SHEET;
        let pll = Pll::decode(self.pllcfgr, self.hse_hz, &allowed);
        if pll.and_then(|_| allowed.check(&self.clocks)).is_ok() {
            self.limits = allowed;
        }
        Ok(true)
    }

    fn check_pll_source(&self) -> Modelled {
        let ready = if Pll::decode(self.pllcfgr, self.hse_hz, &self.limits)?.from_hse {
            cr::HSERDY
        } else {
            cr::HSIRDY
        };
        refuse_if(
            self.cr & ready == 0,
            "RCC: PLL switched on before its source is ready",
        )
    }

    /// Returns the bits of CR that switch on the sources of the core clock.
    const fn clock_bits_in_use(&self) -> u32 {
        let pll_source = if self.pllcfgr & 1 << 22 != 0 {
            cr::HSEON
        } else {
            cr::HSION
        };
        match self.source {
            Source::Hsi => cr::HSION,
            Source::Hse => cr::HSEON,
            Source::Pll => cr::PLLON | pll_source,
        }
    }

    fn write_cfgr(&mut self, value: u32, at: Cycle) -> Modelled {
        // MCO1 and MCO2 are on no pin, I2S and RTC are off.
        self.cfgr = value & CFGR_FIELDS;
        self.follow_switch(at)
    }

    /// Switches the system clock to the source that CFGR.SW selects, if that source is ready.
    fn follow_switch(&mut self, at: Cycle) -> Modelled {
        let Some(wanted) = Source::from_field(self.cfgr) else {
            return Err(Unmodelled("RCC_CFGR: SW = 3"));
        };
        let ready = match wanted {
            Source::Hsi => cr::HSIRDY,
            Source::Hse => cr::HSERDY,
            Source::Pll => cr::PLLRDY,
        };
        if self.cr & ready != 0 {
            self.source = wanted;
        }
        self.update_clocks(at)
    }

    fn update_clocks(&mut self, at: Cycle) -> Modelled {
        let pll = if self.cr & cr::PLLRDY != 0 {
            let pll = Pll::decode(self.pllcfgr, self.hse_hz, &self.limits)?;
            Some(self.pll_hz.map_or(pll, |hz| pll.running_at(hz)))
        } else {
            None
        };
        let sysclk = match self.source {
            Source::Hsi => HSI_HZ,
            Source::Hse => self.hse_hz,
            Source::Pll => pll.map_or(HSI_HZ, |pll| pll.p_hz),
        };
        let usb = pll.map_or(0, |pll| pll.q_hz);
        let clocks = tree::buses(sysclk, usb, self.cfgr);
        if self.matches_registers() {
            self.limits.check(&clocks)?;
        }
        if clocks == self.clocks {
            return Ok(());
        }
        let (old, new) = (self.clocks.hclk_hz, clocks.hclk_hz);
        let starting = &mut self.starting;
        for due in [
            &mut starting.hsi,
            &mut starting.hse,
            &mut starting.pll,
            &mut starting.lsi,
        ] {
            *due = rescale(*due, at, old, new);
        }
        self.clocks = clocks;
        self.changed = true;
        Ok(())
    }
}
