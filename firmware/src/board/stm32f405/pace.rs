//! TIM1, which paces the tape: its overflow and matches, once per microsecond, request the tape's
//! DMA transfers.

use super::pac::timer::vals as timer;
use super::pac::{RCC, TIM1};
use super::timebase::{self, CYCLES_PER_US};
use crate::pulse::WINDOW_US;
use crate::safety::Fault;
use crate::units::Micros;
use cortex_m::peripheral::DWT;

/// TIM1 counts per microsecond: divides the core's clock to 1 MHz.
const TICKS: u16 = CYCLES_PER_US as u16;
/// Counts at which CH1, CH2 and CH3 match.
const MATCHES: [u16; 3] = [8, 20, 32];

/// Waits until [`LEAD`] cycles before the core cycle `target`, and sets TIM1's count so that its
/// overflow, once TIM1 runs, comes at `target`.
///
/// # Errors
/// Returns [`Fault::MissedDeadline`] if `target` is past or too near, and [`Fault::TimeBase`] if
/// the cycle counter stands still.
pub fn await_start(target: u32) -> Result<(), Fault> {
    let left = || target.wrapping_sub(DWT::cycle_count()).cast_signed();
    if left() < LEAD {
        return Err(Fault::MissedDeadline);
    }
    // The wait is bounded, because a debugger may stop the counter at any moment.
    if !(0..PATIENCE).any(|_| left() < LEAD) {
        return Err(Fault::TimeBase);
    }
    // The value lies above the counts of the matches: LEAD minus two polls and the cycles up to
    // CEN.
    let ticks = (left() - TO_ENABLE).clamp(8, LEAD) as u16;
    TIM1.cnt().write(|w| w.set_cnt(TICKS - ticks));
    Ok(())
}

/// Largest number of polls, at least 4 cycles each: together longer than the window that is waited
/// for.
const PATIENCE: u32 = WINDOW_US * CYCLES_PER_US / 4;
/// Cycles before the start at which the wait ends: longer than the wait's last poll, and short
/// enough that TIM1's count is past the matches.
const LEAD: i32 = 100;
/// Cycles from reading the cycle counter to TIM1's first tick, measured on the chip simulator.
const TO_ENABLE: i32 = 34;

/// Configures TIM1 without starting it, with requests enabled and 8 ticks before an overflow. The
/// first event is then an update, so both ports begin in the same microsecond.
pub fn prepare() {
    TIM1.cr1().write(|w| w.set_urs(timer::Urs::COUNTER_ONLY));
    TIM1.psc().write_value(0);
    TIM1.arr().write(|w| w.set_arr(TICKS - 1));
    TIM1.rcr().write(|w| w.0 = 0);
    // CH1–3 are frozen: a match requests DMA and moves no pin (RM0090 17.4.7). OC4REF, in PWM mode
    // 1, is TIM1's TRGO: it rises with the update and stays high for the first half of each
    // microsecond, long enough for TIM2, which runs at half of TIM1's clock, to see it every time.
    for (n, at) in MATCHES.into_iter().enumerate() {
        TIM1.ccr(n).write(|w| w.set_ccr(at));
    }
    TIM1.ccr(3).write(|w| w.set_ccr(TICKS / 2));
    TIM1.ccmr_output(0).write(|w| w.0 = 0);
    TIM1.ccmr_output(1)
        .write(|w| w.set_ocm(1, timer::Ocm::PWM_MODE1));
    TIM1.cr2().write(|w| w.set_mms(timer::Mms::COMPARE_OC4));
    TIM1.egr().write(|w| w.set_ug(true));
    TIM1.cnt().write(|w| w.set_cnt(TICKS - 8));
    TIM1.sr().write(|w| w.0 = 0);
    TIM1.dier().write(|w| {
        w.set_ude(true);
        w.set_ccde(0, true);
        w.set_ccde(1, true);
        w.set_ccde(2, true);
    });
}

/// Starts TIM1 and TIM2 without the tape, so that device time runs from 0. For a boot that found a
/// fault: nothing plays until another boot.
pub fn run_without_tape() {
    RCC.apb2enr().modify(|w| w.set_tim1en(true));
    let _ = RCC.apb2enr().read(); // ES0182: delay after clock enabling
    prepare();
    timebase::start(Micros::new(0));
    TIM1.cr1().modify(|w| w.set_cen(true));
}
