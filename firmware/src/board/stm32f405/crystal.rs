//! The core's clock against the crystal that the PLL makes it from, in each window. A PLL
//! that lost its lock, or multiplies by another factor, makes every phase shorter or
//! longer, and nothing that counts its clock could tell.
//!
//! TIM11 counts the core's clock in laps of eight microseconds, and captures every eighth of
//! the crystal's microseconds (HSE_RTC; RM0090 chapter 19, TIM11_OR): at one and the same
//! count for ever, as long as the PLL multiplies by what it is set to. If it does not, a
//! capture is elsewhere.

use super::pac::timer::vals;
use super::pac::{RCC, TIM11};
use crate::board::wiring::BOARD;

/// RCC_CFGR.RTCPRE divides the crystal to the 1 MHz that section 7.3.3 asks for.
const RTCPRE: u8 = BOARD.clocks.crystal_mhz() as u8;
/// Every eighth edge of that is captured.
const IC1PSC: u8 = 0b11;
/// Core cycles from one capture to the next.
pub const LAP: u16 = 8 * BOARD.clocks.cycles_per_us() as u16;
/// Counts that synchroniser and jitter may move a capture, each way: from memory, to be
/// measured by docs/hil.md. A clock that is 0.3 % wrong moves each by as much.
const TOLERANCE: u16 = 4;

/// Where in a lap captures fall.
pub struct Crystal {
    place: Option<u16>,
}

impl Crystal {
    /// Begins to count. RTCPRE divides without the RTC being clocked, which stays off.
    pub fn start() -> Self {
        RCC.cfgr().modify(|w| w.set_rtcpre(RTCPRE));
        RCC.apb2enr().modify(|w| w.set_tim11en(true));
        let _ = RCC.apb2enr().read(); // ES0182: delay after clock enabling
        TIM11.or().write_value(0b10); // TI1_RMP: HSE_RTC
        TIM11.arr().write(|w| w.set_arr(LAP - 1));
        TIM11.ccmr_input(0).write(|w| {
            w.set_ccs(0, vals::CcmrInputCcs::from_bits(0b01)); // IC1 on TI1
            w.set_icpsc(0, IC1PSC);
        });
        TIM11.ccer().write(|w| w.set_cce(0, true));
        TIM11.cr1().write(|w| w.set_cen(true));
        Self { place: None }
    }

    /// Whether the core's clock is not what it was made from the crystal to be, or nothing
    /// was captured since this was last asked, 8 µs ago or longer.
    pub fn disagrees(&mut self) -> bool {
        let captured = TIM11.sr().read().ccif(0);
        let count = TIM11.ccr(0).read().ccr(); // clears the flag
        let off = count.abs_diff(*self.place.get_or_insert(count));
        !captured || off.min(LAP.wrapping_sub(off)) > TOLERANCE
    }
}

/// TIM11's count: core cycles since the lap began, below [`LAP`].
#[inline]
pub fn count() -> u16 {
    TIM11.cnt().read().cnt()
}
