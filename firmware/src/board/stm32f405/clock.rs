//! Clocks, flash acceleration, supply monitoring, and protection of timers from debuggers.

use super::pac::{DBGMCU, EXTI, FLASH, PWR, RCC};
use crate::board::wiring::{BOARD, Clocks};
use cortex_m::peripheral::{DCB, DWT};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, LsConfig, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv,
    PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;

const CLOCKS: Clocks = BOARD.clocks;

/// Frequency of the HSI, Hz, which clocks the core after reset (DS8626: within 4 % over
/// temperature).
pub const HSI_HZ: u32 = 16_000_000;
/// EXTI line of the supply monitor, the PVD (RM0090 section 12.2.5).
pub const SUPPLY_LINE: usize = 16;
/// Level of the PVD: 2.93 V typical, falling (DS8626, reset and power control; from memory, to be
/// measured by docs/evidence/hil.md). The flash's wait states are those from 2.7 V on (RM0090 section 3.5.1)
/// ([`Clocks::wait_states`]).
const SUPPLY_THRESHOLD: u8 = 6;
/// REV_ID of chips whose prefetch disturbs the ADC (ES0182, revision A).
const REVISION_A: u16 = 0x1000;

/// Returns the HAL's configuration: the crystal through the PLL, according to the board's clock
/// tree. No RTC clock is selected, because that could reset the backup domain, which stores the
/// last fault.
#[must_use]
pub fn config() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(CLOCKS.crystal_hz),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll_src = PllSource::HSE;
    config.rcc.pll = Some(Pll {
        prediv: PllPreDiv::from_bits(CLOCKS.divider as u8),
        mul: PllMul::from_bits(CLOCKS.multiplier as u16),
        divp: Some(match CLOCKS.core_divider {
            2 => PllPDiv::DIV2,
            4 => PllPDiv::DIV4,
            6 => PllPDiv::DIV6,
            _ => PllPDiv::DIV8,
        }),
        divq: Some(PllQDiv::from_bits(CLOCKS.usb_divider as u8)),
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    const { assert!(Clocks::APB1_DIVIDER == 4 && Clocks::APB2_DIVIDER == 2) };
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.ls = LsConfig::off();
    // `keep_debug_bits` sets the bits that are needed.
    config.enable_debug_during_sleep = false;
    config
}

/// Enables caches, prefetch, the clock security system and the supply monitor, and keeps timers
/// running while a debugger halts the core. Calls `wait` to wait for the supply, with the outputs
/// disconnected and the pump off; it returns when its condition holds. Call after the HAL has set
/// clocks and wait states.
pub fn harden(wait: impl Fn(fn() -> bool)) {
    accelerate_flash();
    RCC.cr().modify(|w| w.set_csson(true));
    keep_debug_bits();
    watch_supply(wait);
}

/// Waits until the supply is above the threshold, then enables the interrupt for its fall.
fn watch_supply(wait: impl Fn(fn() -> bool)) {
    // PVDO rises when the supply falls below the threshold.
    EXTI.rtsr(0).modify(|w| w.set_line(SUPPLY_LINE, true));
    PWR.cr1().modify(|w| {
        w.set_pls(SUPPLY_THRESHOLD);
        w.set_pvde(true);
    });
    // A supply that was low from the start produces no further edge, and the edge that the detector
    // produces when it is enabled is not a fall. An edge after the line is cleared stays pending
    // until its interrupt is enabled.
    loop {
        wait(|| !PWR.csr1().read().pvdo());
        EXTI.pr(0).write(|w| w.set_line(SUPPLY_LINE, true));
        if !PWR.csr1().read().pvdo() {
            break;
        }
    }
    EXTI.imr(0).modify(|w| w.set_line(SUPPLY_LINE, true));
}

/// Resets the caches while they are off, then enables them (RM0090 section 3.5.2).
fn accelerate_flash() {
    FLASH.acr().modify(|w| {
        w.set_icen(false);
        w.set_dcen(false);
    });
    FLASH.acr().modify(|w| {
        w.set_icrst(true);
        w.set_dcrst(true);
    });
    FLASH.acr().modify(|w| {
        w.set_icrst(false);
        w.set_dcrst(false);
    });
    let prefetch = DBGMCU.idcode().read().rev_id() != REVISION_A;
    FLASH.acr().modify(|w| {
        w.set_icen(true);
        w.set_dcen(true);
        w.set_prften(prefetch);
    });
}

/// Sets the bits that debuggers write as well. They survive a system reset, and a debugger may
/// write them at any moment: probe-rs and OpenOCD restore or clear DBGMCU_CR when they detach,
/// clear DEMCR, and freeze watchdogs during a halt. So `registers` calls this again whenever it
/// finds them changed.
///
/// - The core's clock runs in sleep, so that a debugger can attach to a core that mostly sleeps,
///   and CYCCNT counts time (RM0090 section 38.16.1).
/// - A halted core neither freezes a pulse nor prevents the watchdog's reset.
/// - CYCCNT counts (Arm ARM C1.6.5, C1.8.7).
pub fn keep_debug_bits() {
    DBGMCU.cr().modify(|w| w.set_dbg_sleep(true));
    DBGMCU.apb1fzr().modify(|w| {
        w.set_tim2(false);
        w.set_iwdg(false);
    });
    DBGMCU.apb2fzr().modify(|w| {
        w.set_tim1(false);
        w.set_tim11(false);
    });
    const TRCENA: u32 = 1 << 24;
    const CYCCNTENA: u32 = 1;
    // SAFETY: no other code of this image uses DEMCR and DWT_CTRL after boot; both bits only enable
    // the cycle counter.
    unsafe {
        (*DCB::PTR).demcr.modify(|w| w | TRCENA);
        (*DWT::PTR).ctrl.modify(|w| w | CYCCNTENA);
    }
}
