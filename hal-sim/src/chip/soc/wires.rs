//! Connections between the blocks: clocks, resets, pins.

use super::clock::{Clocks, Oscillator};
use super::crc::Crc;
use super::dbgmcu::Dbgmcu;
use super::map::{Unit, playback_block};
use super::playback::Slip;
use super::rcc::{Block, Cause};
use super::timer::Clocking;
use super::{Exti, Peripheral, Soc, Syscfg, exti, gpio};
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Bus, Modelled};

/// Power-down reset level, typical, mV (DS8626). Below it no part of the chip works.
const POWER_DOWN_MV: u32 = 1680;

impl Soc {
    /// Makes the next `advance` look for the next event again, after a change of the state that no
    /// bus access made.
    pub const fn reschedule(&mut self) {
        self.reschedule_at(self.now);
    }

    /// Makes the first `advance` to `at` or later look for the next event again.
    pub(super) const fn reschedule_at(&mut self, at: Cycle) {
        self.event = at;
        self.due = at;
    }

    pub(super) fn find_event(&self) -> Cycle {
        let sample = self.adc.next_sample().map_or(Cycle::MAX, |s| s.at);
        [
            self.playback.next_event(),
            self.rcc.next_event(),
            sample,
            self.adc.next_event(),
            self.flash.next_event(),
            self.usart2.next_event(),
            self.otg.next_event(),
            self.iwdg.next_event(),
        ]
        .into_iter()
        .fold(Cycle::MAX, Cycle::min)
    }

    /// Makes stream `index` of DMA2 miss a request, or serve a request that was not made, as `slip`
    /// selects, at cycle `at`.
    ///
    /// # Errors
    /// Fails like [`super::Playback::slip`].
    pub fn slip(&mut self, index: usize, slip: Slip, at: Cycle) -> Modelled {
        self.advance(at)?;
        self.playback.slip(index, slip, at, &mut self.ram)?;
        self.reschedule_at(at);
        Ok(())
    }

    /// Injects a fault into the clock of timer `number`, 1 to 5, from `at` on.
    ///
    /// # Errors
    /// Fails like [`super::Playback::misclock`].
    pub fn misclock(&mut self, number: u8, clocking: Clocking, at: Cycle) -> Modelled {
        self.advance(at)?;
        self.playback
            .misclock(number, clocking, at, &mut self.ram)?;
        self.reschedule_at(at);
        Ok(())
    }

    /// Makes TIM1 restart every `cycles` timer clocks, regardless of its ARR, from `at` on.
    ///
    /// # Errors
    /// Fails like [`super::Playback::misreload`].
    pub fn misreload(&mut self, cycles: u32, at: Cycle) -> Modelled {
        self.advance(at)?;
        self.playback.misreload(cycles, at, &mut self.ram)?;
        self.reschedule_at(at);
        Ok(())
    }

    /// Connects a pin (port 0 is A) from outside to `level` at cycle `at`.
    pub fn drive(&mut self, port: usize, pin: usize, level: gpio::Level, at: Cycle) -> Modelled {
        let change = self.playback.drive(port, pin, level, at, &mut self.ram)?;
        if let Some(high) = change {
            self.exti.pin(port, pin, high, &self.syscfg);
        }
        self.reschedule_at(self.now.min(at));
        Ok(())
    }

    /// Sets the supply voltage to `mv` millivolts. If the voltage is too low for the chip to run,
    /// requests a reset; nothing else changes before that reset. A permanent loss of power would
    /// erase the RAM; its contents are kept here, because a booting program writes what it later
    /// reads.
    pub fn supply(&mut self, mv: u32) {
        let had = self.pwr.powered;
        self.pwr.supply(mv, self.flash.options() >> 2);
        if had && !self.pwr.powered {
            self.reset = Some(match mv < POWER_DOWN_MV {
                true => Cause::PowerOn,
                false => Cause::BrownOut,
            });
        }
        if !had && mv < POWER_DOWN_MV {
            self.rcc.reset(Cause::PowerOn); // power is completely lost only now
            self.dbgmcu = Dbgmcu::default();
            self.backup_sram.lose_contents();
        }
        self.follow_supply();
    }

    /// Returns whether the supply voltage suffices for the chip to run; otherwise the chip is held
    /// in reset.
    pub const fn is_powered(&self) -> bool {
        self.pwr.powered
    }

    /// Sets the frequency of the LSI to `hz` from `at` on: 17 to 47 kHz on an intact chip (DS8626).
    pub fn set_lsi_hz(&mut self, hz: u32, at: Cycle) {
        self.lsi_hz = hz;
        self.iwdg.set_lsi_hz(hz, at);
        self.playback.set_lsi_hz(hz, at);
        self.reschedule_at(self.now.min(at));
    }

    /// Sets the PLL's output to `hz` from `at` on, regardless of its registers.
    ///
    /// # Errors
    /// Fails like [`super::rcc::Rcc::set_pll_hz`].
    pub fn set_pll_hz(&mut self, hz: u32, at: Cycle) -> Modelled {
        self.rcc.set_pll_hz(hz, at)?;
        self.follow_clocks(at)?;
        self.reschedule_at(self.now.min(at));
        Ok(())
    }

    /// Informs the peripherals that a debugger halts or resumes the core at `at`. Timers and
    /// watchdog stand still while the core is halted if DBGMCU selects that (RM0090 section
    /// 38.16.2).
    ///
    /// # Errors
    /// Fails like [`super::Playback::misclock`].
    pub fn debug_halt(&mut self, halted: bool, at: Cycle) -> Modelled {
        self.playback.advance(at, &mut self.ram)?;
        let clocking = match halted {
            true => Clocking::Stands,
            false => Clocking::Every(1),
        };
        for number in 1..=5 {
            if self.dbgmcu.stops_timer(number) {
                self.playback
                    .misclock(number, clocking, at, &mut self.ram)?;
            }
        }
        if self.dbgmcu.stops_timer(11) {
            self.tim11.hold(halted, at);
        }
        if self.dbgmcu.stops_watchdog() {
            self.iwdg.hold(halted, at);
        }
        self.reschedule_at(self.now.min(at));
        Ok(())
    }

    fn follow_supply(&mut self) {
        let pvd = self.pwr.low;
        if pvd != self.pvd {
            self.pvd = pvd;
            self.exti.edge(exti::PVD, pvd);
            self.reschedule_at(self.now);
        }
    }

    /// Applies the effects of a register write of `unit` on other blocks.
    pub(super) fn follow_write(&mut self, unit: Unit, at: Cycle) -> Modelled {
        match unit {
            Unit::Rcc => {
                self.event = self.now; // a clock affects every block
                self.follow_clocks(at)?;
                self.follow_oscillators(at);
                for block in self.rcc.take_resets() {
                    self.reset_block(block, at)?;
                }
                if self.rcc.take_backup_reset() {
                    self.backup.reset_domain();
                }
                Ok(())
            }
            Unit::Pwr => {
                let writable = self.pwr.is_backup_writable();
                self.backup.set_writable(writable);
                self.backup_sram.set_writable(writable);
                self.rcc.set_backup_writable(writable);
                self.follow_supply();
                self.pwr.check_scale(self.hz())
            }
            Unit::Flash if self.rcc.exceeds_data_sheet() => {
                self.flash.check_known(self.pwr.supply_mv)
            }
            Unit::Flash => self.flash.check_wait_states(self.pwr.supply_mv),
            _ => Ok(()),
        }
    }

    /// Informs TIM5 of the LSI and TIM11 of the crystal when RCC switches them on or off. An LSI
    /// that only the watchdog keeps on is not reported.
    pub(super) fn follow_oscillators(&mut self, at: Cycle) {
        let (crystal_hz, rtcpre) = self.rcc.hse_rtc();
        let core_hz = self.rcc.clocks.hclk_hz;
        self.tim11.set_crystal(crystal_hz, rtcpre, core_hz, at);
        let is_on = self.rcc.is_lsi_ready();
        if is_on != self.lsi_is_on {
            self.lsi_is_on = is_on;
            let lsi = is_on.then(|| Oscillator::new(self.lsi_hz, core_hz, at));
            self.playback.set_lsi(lsi);
        }
    }

    fn reset_block(&mut self, block: Block, at: Cycle) -> Modelled {
        if let Some(block) = playback_block(block) {
            self.shares = [true; 2]; // until DMA2 is next written
            return self.playback.reset(block, at, &mut self.ram);
        }
        match block {
            Block::Crc => self.crc = Crc::default(),
            Block::OtgFs => self.otg.reset_registers(at),
            Block::Spi(3) => self.spi3.reset(),
            Block::Usart2 => self.usart2.reset(),
            Block::Pwr => {
                self.pwr.reset();
                return self.follow_write(Unit::Pwr, at);
            }
            Block::Adc => self.adc.reset(),
            Block::Timer(11) => self.tim11.reset(),
            Block::Syscfg => {
                self.syscfg = Syscfg::default();
                self.exti = Exti::default();
            }
            _ => {}
        }
        Ok(())
    }

    /// Passes the clock frequencies on to all blocks, if RCC has changed them.
    pub(super) fn follow_clocks(&mut self, at: Cycle) -> Modelled {
        let Some(clocks) = self.rcc.take_change() else {
            return Ok(());
        };
        let Clocks { hclk_hz, .. } = clocks;
        let (apb1, apb2) = (clocks.apb1_divider(), clocks.apb2_divider());
        self.playback.set_clocks(apb1, apb2, at, &mut self.ram)?;
        self.playback.set_core_hz(hclk_hz, at);
        self.tim11.set_clock(hclk_hz, clocks.timer2_divider(), at);
        self.flash.set_hz(hclk_hz, at);
        match (self.rcc.matches_registers(), self.rcc.exceeds_data_sheet()) {
            (true, false) => self.flash.check_wait_states(self.pwr.supply_mv)?,
            (true, true) => self.flash.check_known(self.pwr.supply_mv)?,
            (false, _) => {}
        }
        self.pwr.check_scale(hclk_hz)?;
        self.iwdg.set_hz(hclk_hz, at);
        self.otg.set_hz(hclk_hz.into(), at);
        self.adc.set_clock(hclk_hz, apb2);
        self.spi3.set_bus_divider(apb1);
        self.usart2.set_bus_divider(apb1);
        Ok(())
    }
}
