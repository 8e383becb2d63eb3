//! Models TIM11 as the chip uses it to measure its own clock: a 16-bit up-counter whose channel 1
//! captures the crystal, divided by RCC_CFGR's RTCPRE (HSE_RTC; RM0090 chapter 19, TIM11_OR, and
//! section 7.3.3).
//!
//! Count and captures are computed only when they are read, from the time of enabling and the edges
//! of an [`Oscillator`]. Pin, outputs, interrupts, and changes of settings while it counts are not
//! modelled.

use super::clock::Oscillator;
use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled, refuse_if};

/// Timer clocks from an edge to its capture, assumed as for the inputs of the other timers.
const SYNCHRONISATION: u64 = 2;

mod bit {
    pub const CEN: u32 = 1;
    pub const CC1IF: u32 = 1 << 1;
    pub const CC1OF: u32 = 1 << 9;
    /// CCMR1: input capture 1 is connected to input TI1.
    pub const CC1S: u32 = 0b01;
    /// CCMR1: prescaler of input capture 1.
    pub const IC1PSC: u32 = 0b11 << 2;
    pub const CC1E: u32 = 1;
    /// TIM11_OR: the divided crystal clock HSE_RTC is connected to TI1.
    pub const HSE_RTC: u32 = 0b10;
}

/// TIM11, whose channel 1 captures the counter at edges of the divided crystal clock.
#[derive(Clone, PartialEq, Debug)]
pub struct Tim11 {
    /// HCLK cycles per timer clock.
    divider: u64,
    cr1: u32,
    ccmr1: u32,
    ccer: u32,
    arr: u32,
    ccr1: u32,
    sr: u32,
    option: u32,
    /// Whether a debugger has stopped the counter.
    held: bool,
    /// Value of the counter, and the cycle at which it had that value.
    count: (u64, Cycle),
    /// The crystal and its divider RTCPRE, while it oscillates and is divided.
    crystal: Option<(Oscillator, u32)>,
    /// Number of the crystal edge that is captured next.
    next: u64,
}

impl Default for Tim11 {
    fn default() -> Self {
        Self {
            divider: 1,
            cr1: 0,
            ccmr1: 0,
            ccer: 0,
            arr: 0xFFFF,
            ccr1: 0,
            sr: 0,
            option: 0,
            held: false,
            count: (0, 0),
            crystal: None,
            next: 0,
        }
    }
}

impl Tim11 {
    /// Resets its registers; crystal and clock stay.
    pub fn reset(&mut self) {
        *self = Self {
            divider: self.divider,
            held: self.held,
            crystal: self.crystal.clone(),
            ..Self::default()
        };
    }

    /// Connects a crystal of `hz`, divided by `rtcpre`, from `at` on; the core runs at `core_hz`.
    /// `rtcpre` is `None` if the crystal is off or not divided.
    pub fn set_crystal(&mut self, hz: u32, rtcpre: Option<u32>, core_hz: u32, at: Cycle) {
        let divided_by = self.crystal.as_ref().map(|crystal| crystal.1);
        if divided_by == rtcpre {
            return;
        }
        self.capture(at);
        let oscillator = match self.crystal.take() {
            Some((oscillator, _)) => oscillator,
            None => Oscillator::new(hz, core_hz, at),
        };
        self.crystal = rtcpre.map(|divided_by| (oscillator, divided_by));
        self.begin(at);
    }

    /// Sets the core clock to `core_hz`, and the timer clock to `divider` core cycles, from `at`
    /// on.
    pub fn set_clock(&mut self, core_hz: u32, divider: u32, at: Cycle) {
        self.capture(at);
        self.count = (self.count_at(at), at);
        self.divider = u64::from(divider).max(1);
        if let Some((oscillator, _)) = &mut self.crystal {
            oscillator.set_core_hz(core_hz, at);
        }
    }

    /// Stops or resumes the counter at `at`, as a debugger does (DBGMCU); captures continue.
    pub fn hold(&mut self, held: bool, at: Cycle) {
        self.capture(at);
        self.count = (self.count_at(at), at);
        self.held = held;
    }

    /// Returns the number of crystal edges from one capture to the next.
    fn period(&self) -> u64 {
        let divided_by = self.crystal.as_ref().map_or(1, |crystal| crystal.1);
        u64::from(divided_by) << (self.ccmr1 >> 2 & 0b11)
    }

    /// Starts to count crystal edges towards the next capture at `at`.
    fn begin(&mut self, at: Cycle) {
        if let Some((oscillator, _)) = &self.crystal {
            self.next = oscillator.ticks(at) + self.period();
        }
    }

    fn count_at(&self, at: Cycle) -> u64 {
        let (count, since) = self.count;
        if self.cr1 & bit::CEN == 0 || self.held {
            return count;
        }
        (count + at.saturating_sub(since) / self.divider) % (u64::from(self.arr) + 1)
    }

    /// Executes all captures up to `to`.
    fn capture(&mut self, to: Cycle) {
        let captures = self.ccer & bit::CC1E != 0 && self.ccmr1 & 0b11 == bit::CC1S;
        let delay = SYNCHRONISATION * self.divider;
        let Some((oscillator, _)) = &self.crystal else {
            return;
        };
        if !captures || self.option != bit::HSE_RTC {
            return;
        }
        let edges = oscillator.ticks(to.saturating_sub(delay));
        let Some(behind) = edges.checked_sub(self.next) else {
            return;
        };
        let period = self.period();
        let last = edges - behind % period;
        let at = oscillator.cycle_of(last).next_multiple_of(self.divider) + delay;
        self.ccr1 = self.count_at(at) as u32; // below 2^16: the remainder of a division by ARR + 1
        if self.sr & bit::CC1IF != 0 || behind >= period {
            self.sr |= bit::CC1OF;
        }
        self.sr |= bit::CC1IF;
        self.next = last + period;
    }
}

impl Peripheral for Tim11 {
    fn read(&mut self, offset: u32, at: Cycle) -> Modelled<u32> {
        self.capture(at);
        let word = match offset {
            0x00 => self.cr1,
            0x0C | 0x28 => 0, // DIER, PSC
            0x10 => self.sr,
            0x18 => self.ccmr1,
            0x20 => self.ccer,
            0x24 => self.count_at(at) as u32, // below 2^16, as above
            0x2C => self.arr,
            0x34 => {
                self.sr &= !bit::CC1IF;
                self.ccr1
            }
            0x50 => self.option,
            _ => return Err(Unmodelled("TIM11 register")),
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        self.capture(at);
        let counts = self.cr1 & bit::CEN != 0;
        refuse_if(
            counts && !matches!(offset, 0x00 | 0x10),
            "TIM11: a setting written while the timer counts",
        )?;
        match offset {
            0x00 => {
                refuse_if(value & !bit::CEN != 0, "TIM11_CR1: a bit other than CEN")?;
                self.count = (self.count_at(at), at);
                self.cr1 = value;
            }
            0x0C | 0x28 => refuse_if(value != 0, "TIM11: interrupts, a prescaler")?,
            0x10 => self.sr &= value,
            0x18 => {
                let known = bit::CC1S | bit::IC1PSC;
                refuse_if(value & !known != 0, "TIM11_CCMR1: outputs, a filter")?;
                self.ccmr1 = value;
            }
            0x20 => {
                refuse_if(value & !bit::CC1E != 0, "TIM11_CCER: falling edges")?;
                self.ccer = value;
                self.begin(at);
            }
            0x24 => self.count = (u64::from(value & 0xFFFF), at),
            0x2C => self.arr = value & 0xFFFF,
            0x50 => self.option = value & 0b11,
            _ => return Err(Unmodelled("TIM11 register")),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    const CR1: u32 = 0x00;
    const SR: u32 = 0x10;
    const CNT: u32 = 0x24;
    const CCR1: u32 = 0x34;
    /// HCLK cycles of 64 periods of 8 MHz at 168 MHz.
    const LAP: u64 = 1344;

    /// Creates a timer that captures every 64th period of a crystal of 8 MHz and restarts after the
    /// same time.
    fn timer() -> Tim11 {
        let mut timer = Tim11::default();
        timer.set_clock(168_000_000, 1, 0);
        timer.set_crystal(8_000_000, Some(8), 168_000_000, 0);
        timer.set(0x50, bit::HSE_RTC, 10);
        timer.set(0x18, bit::CC1S | bit::IC1PSC, 20);
        timer.set(0x2C, LAP as u32 - 1, 30);
        timer.set(0x20, bit::CC1E, 40);
        timer.set(CR1, bit::CEN, 50);
        timer
    }

    #[test]
    fn a_clock_of_the_crystal_is_captured_at_one_count_for_ever() {
        let mut timer = timer();
        let first = 21 * (1 + 64) + SYNCHRONISATION; // edge 65 is the 64th since cycle 40
        assert_eq!(timer.get(SR, first - 1), 0);
        assert_eq!(timer.get(SR, first), bit::CC1IF);
        assert_eq!(u64::from(timer.get(CCR1, first)), (first - 50) % LAP);
        assert_eq!(timer.get(SR, first), 0, "reading CCR1 clears the flag");
        for at in [first + LAP, first + 9 * LAP, first + 1_000_000 * LAP + 700] {
            let (flags, capture) = (timer.get(SR, at), timer.get(CCR1, at));
            assert_eq!(u64::from(capture), (first - 50) % LAP, "{at}");
            assert_ne!(flags & bit::CC1IF, 0);
            assert_eq!(flags & bit::CC1OF != 0, at > first + LAP, "{at}");
        }
    }

    #[test]
    fn a_clock_that_is_another_moves_it() {
        let mut timer = timer();
        timer.set_clock(84_000_000, 1, 100_000);
        // 64 periods are now 672 counts: consecutive captures are half a lap apart.
        let [first, second, third] = [1, 2, 3].map(|n| timer.get(CCR1, 101_344 + 672 * n));
        assert_eq!((first.abs_diff(second), first), (672, third));
        timer.set_clock(168_000_000 + 1_680_000, 1, 200_000);
        let [first, third] = [1, 3].map(|n| timer.get(CCR1, 200_000 + 1_358 * n));
        assert!(
            (26..=28).contains(&first.abs_diff(third)),
            "1 % faster: {first} {third}"
        );
    }

    #[test]
    fn a_debugger_that_holds_it_moves_it() {
        let mut timer = timer();
        let before = timer.get(CCR1, 100_000);
        timer.hold(true, 100_000);
        timer.hold(false, 100_100);
        let after = timer.get(CCR1, 110_000);
        assert_eq!((before + LAP as u32 - 100) % LAP as u32, after);
    }

    #[test]
    fn without_crystal_or_input_nothing_is_captured() {
        let mut timer = timer();
        timer.set_crystal(8_000_000, None, 168_000_000, 5_000);
        timer.set(SR, 0, 5_000);
        assert_eq!(timer.get(SR, 100_000), 0);
        let mut timer = Tim11::default();
        timer.set_crystal(8_000_000, Some(8), 168_000_000, 0);
        timer.set(0x18, bit::CC1S, 0);
        timer.set(0x20, bit::CC1E, 0);
        timer.set(CR1, bit::CEN, 0);
        assert_eq!(timer.get(SR, 100_000), 0, "its pin");
        assert_eq!(timer.get(CNT, 100_000), 100_000 % 0x1_0000);
        assert!(timer.write(0x2C, 9, 100_000).is_err());
        assert!(timer.write(CR1, 1 << 3, 100_000).is_err());
    }
}
