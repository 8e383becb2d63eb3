//! Check of the core's clock against the crystal, from which the PLL derives it, in each window. If
//! the PLL loses its lock or multiplies by another factor, every phase becomes shorter or longer,
//! and counters of the same clock cannot show that.
//!
//! TIM11 counts the core's clock in laps of 8 µs and captures every eighth edge of a 1 MHz clock
//! divided from the crystal (HSE_RTC; RM0090 chapter 19, TIM11_OR). While the PLL multiplies by its
//! configured factor, every capture falls at the same count.

use super::clock::HSI_HZ;
use super::pac::timer::vals;
use super::pac::{RCC, TIM11};
use super::wait::within;
use crate::board::wiring::BOARD;

/// Divider from the crystal to 1 MHz, for RCC_CFGR.RTCPRE (RM0090 section 7.3.3).
const RTCPRE: u8 = BOARD.clocks.crystal_mhz() as u8;
/// Prescaler of the capture: every eighth edge.
const IC1PSC: u8 = 0b11;
/// Core cycles from one capture to the next.
pub const LAP: u16 = 8 * BOARD.clocks.cycles_per_us() as u16;
/// Largest deviation of a capture because of synchroniser and jitter, in counts either way: from
/// memory, to be measured by docs/evidence/hil.md. A clock error of 0.3 % moves each capture by as much.
const TOLERANCE: u16 = 4;

/// Captures in one measurement, each of [`MEASURED_EDGES`] periods of the crystal.
const CAPTURES: u32 = 16;
/// Largest divider from the crystal to HSE_RTC (RM0090 section 7.3.3), so that a crystal of 26 MHz
/// still stays below 1 MHz.
const LARGEST_RTCPRE: u8 = 31;
/// Periods of the crystal from one capture to the next: every eighth edge of HSE_RTC.
const MEASURED_EDGES: u32 = 8 * LARGEST_RTCPRE as u32;
/// Longest wait for a capture, core cycles at the HSI: 1 ms, eight times that of a crystal of 2 MHz.
const CAPTURE_CYCLES: u32 = HSI_HZ / 1_000;

/// Measures the frequency of the crystal, Hz, against the HSI, which must clock core and TIM11, and
/// leaves TIM11 as after reset. `None` if HSE_RTC is not captured.
pub fn measure() -> Option<u32> {
    RCC.cfgr().modify(|w| w.set_rtcpre(LARGEST_RTCPRE));
    RCC.apb2enr().modify(|w| w.set_tim11en(true));
    let _ = RCC.apb2enr().read(); // ES0182: delay after clock enabling
    capture_crystal(u16::MAX);
    let counts = count_captures();
    RCC.apb2rstr().modify(|w| w.set_tim11rst(true));
    RCC.apb2rstr().modify(|w| w.set_tim11rst(false));
    // Below 2^16 counts: 16 · 248 periods of at least 1 MHz are at most 63 488 counts. The product
    // has 36 bits.
    let periods = u64::from(CAPTURES * MEASURED_EDGES);
    Some((periods * u64::from(HSI_HZ) / u64::from(counts?.max(1))) as u32)
}

/// Returns the counts of TIM11 during [`CAPTURES`] captures.
fn count_captures() -> Option<u16> {
    let capture = || {
        within(CAPTURE_CYCLES, || TIM11.sr().read().ccif(0))?;
        Some(TIM11.ccr(0).read().ccr()) // reading clears the flag
    };
    let first = capture()?;
    let mut last = first;
    for _ in 0..CAPTURES {
        last = capture()?;
    }
    Some(last.wrapping_sub(first))
}

/// Makes TIM11, whose clock is on, count up to `top` and capture every eighth edge of HSE_RTC.
fn capture_crystal(top: u16) {
    TIM11.or().write_value(0b10); // TI1_RMP: HSE_RTC
    TIM11.arr().write(|w| w.set_arr(top));
    TIM11.ccmr_input(0).write(|w| {
        w.set_ccs(0, vals::CcmrInputCcs::from_bits(0b01)); // IC1 on TI1
        w.set_icpsc(0, IC1PSC);
    });
    TIM11.ccer().write(|w| w.set_cce(0, true));
    TIM11.cr1().write(|w| w.set_cen(true));
}

/// Check of the core's clock. From the first check on, it stores the count within a lap at which
/// captures fall.
pub struct Crystal {
    place: Option<u16>,
}

impl Crystal {
    /// Starts TIM11. RTCPRE divides the crystal although the RTC itself stays off.
    pub fn start() -> Self {
        RCC.cfgr().modify(|w| w.set_rtcpre(RTCPRE));
        RCC.apb2enr().modify(|w| w.set_tim11en(true));
        let _ = RCC.apb2enr().read(); // ES0182: delay after clock enabling
        capture_crystal(LAP - 1);
        Self { place: None }
    }

    /// Returns whether the core's clock deviates from its configured multiple of the crystal, or no
    /// capture occurred since the last call, which must be at least 8 µs ago.
    pub fn disagrees(&mut self) -> bool {
        let captured = TIM11.sr().read().ccif(0);
        let count = TIM11.ccr(0).read().ccr(); // reading clears the flag
        let off = count.abs_diff(*self.place.get_or_insert(count));
        !captured || off.min(LAP.wrapping_sub(off)) > TOLERANCE
    }
}

/// Returns TIM11's count: core cycles since the start of the lap, below [`LAP`].
#[inline]
pub fn count() -> u16 {
    TIM11.cnt().read().cnt()
}
