//! Device time: TIM2 counts TIM1's updates (ITR0, RM0090 TIM2_SMCR) with 32 bits of microseconds,
//! so that time and tape cannot drift apart.
//!
//! CH1 captures the trigger input, CH2 starts refills, CH3 starts the injected conversion of ADC1
//! at an exact microsecond.

use super::pac::timer::vals;
use super::pac::{RCC, TIM1, TIM2};
use crate::board::wiring::BOARD;
use crate::device::REFILL_OFFSET_US;
use crate::units::{Micros, us};
use cortex_m::peripheral::DWT;

const CAPTURE: usize = 0;
const REFILL: usize = 1;
const SAMPLE: usize = 2;

/// Configures TIM2 and stops it one microsecond before `first`, which it reaches with TIM1's next
/// update. Arms the first refill.
pub fn start(first: Micros) {
    RCC.apb1enr().modify(|w| w.set_tim2en(true));
    let _ = RCC.apb1enr().read(); // ES0182: delay after clock enabling
    TIM2.cr1().write(|w| w.set_urs(vals::Urs::COUNTER_ONLY));
    TIM2.dier().write(|w| w.0 = 0);
    TIM2.smcr().write(|w| {
        w.set_ts(vals::Ts::ITR0);
        w.set_sms(vals::Sms::EXT_CLOCK_MODE);
    });
    TIM2.psc().write_value(0);
    TIM2.arr().write_value(u32::MAX);
    // CC1S = 01: IC1 on TI1, eight equal samples at 84 MHz (95 ns). CH2 is a frozen output: its
    // match only sets the flag.
    TIM2.ccmr_input(0).write(|w| {
        w.set_ccs(CAPTURE, vals::CcmrInputCcs::from_bits(0b01));
        w.set_icf(CAPTURE, vals::FilterValue::FCK_INT_N8);
    });
    TIM2.ccmr_output(1)
        .write(|w| w.set_ocm(SAMPLE - 2, vals::Ocm::FORCE_INACTIVE));
    TIM2.ccer().write(|w| w.set_cce(CAPTURE, true)); // rising edge
    TIM2.cr2().write(|w| w.set_mms(vals::Mms::COMPARE_OC3));
    TIM2.egr().write(|w| w.set_ug(true));
    TIM2.cnt().write_value((first - us(1)).get());
    TIM2.sr().write(|w| w.0 = 0);
    // At that time, the previous window has been erased to its last slot.
    refill_at(first + us(REFILL_OFFSET_US));
    TIM2.dier().write(|w| w.set_ccie(REFILL, true));
    TIM2.cr1().modify(|w| w.set_cen(true));
}

/// Returns the device time.
#[must_use]
pub fn now() -> Micros {
    Micros::new(TIM2.cnt().read())
}

/// Device time to the tick of TIM1, and the core cycle at which it was read.
#[derive(Clone, Copy)]
pub struct Instant {
    us: Micros,
    ticks: u32,
    cycle: u32,
}

impl Instant {
    /// Reads the present instant. TIM1 and TIM2 must be running.
    #[must_use]
    pub fn now() -> Self {
        // A microsecond may end between the readings. One repetition is enough, because nothing
        // preempts the caller for ten.
        let read = || {
            let us = now();
            let ticks = TIM1.cnt().read().cnt().into();
            let cycle = DWT::cycle_count();
            (us == now()).then_some(Self { us, ticks, cycle })
        };
        read().or_else(read).unwrap_or(Self {
            us: now(),
            ticks: 0,
            cycle: DWT::cycle_count(),
        })
    }

    /// Returns the core cycle at which `at`, up to some seconds ahead, begins.
    #[must_use]
    pub fn cycle_of(self, at: Micros) -> u32 {
        let ahead = at.elapsed_since(self.us).wrapping_mul(CYCLES_PER_US);
        self.cycle.wrapping_add(ahead).wrapping_sub(self.ticks)
    }
}

/// Core cycles per microsecond; TIM1 counts the core's clock.
pub const CYCLES_PER_US: u32 = BOARD.clocks.cycles_per_us();

/// Sets the time of the next refill and clears the request of the last.
pub fn refill_at(at: Micros) {
    TIM2.ccr(REFILL).write_value(at.get());
    // Flags clear by writing 0 and ignore 1 (RM0090 18.4.5).
    TIM2.sr().write(|w| {
        w.0 = u32::MAX;
        w.set_ccif(REFILL, false);
    });
}

/// Returns the trigger edge captured since the last call. Reading CCR1 clears the flag.
#[must_use]
pub fn captured() -> Option<Micros> {
    TIM2.sr()
        .read()
        .ccif(CAPTURE)
        .then(|| Micros::new(TIM2.ccr(CAPTURE).read()))
}

/// Starts the injected conversion at `at`, by a rising edge of OC3REF. Returns `false`, without a
/// conversion, if `at` is less than 2 µs ahead.
pub fn sample_at(at: Micros) -> bool {
    let mode = |m| TIM2.ccmr_output(1).write(|w| w.set_ocm(SAMPLE - 2, m));
    mode(vals::Ocm::FORCE_INACTIVE);
    if (at - now()).us() < 2 {
        return false;
    }
    TIM2.ccr(SAMPLE).write_value(at.get());
    mode(vals::Ocm::ACTIVE_ON_MATCH);
    true
}
