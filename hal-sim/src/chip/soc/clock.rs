//! Clock frequencies, and conversion of real time into core cycles.

use crate::chip::Cycle;

/// Frequencies that the clock tree delivers, Hz (RM0090 figure 21).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// Clock of core, memories and AHB.
    pub hclk_hz: u32,
    /// Clock of the peripherals on APB1.
    pub pclk1_hz: u32,
    /// Clock of the peripherals on APB2.
    pub pclk2_hz: u32,
    /// Clock of the timers on APB1: TIM2–7, 12–14.
    pub timer1_hz: u32,
    /// Clock of the timers on APB2: TIM1, 8–11.
    pub timer2_hz: u32,
    /// PLL output Q, for USB; 0 while the PLL is off.
    pub usb_hz: u32,
}

impl Clocks {
    /// Returns the core cycles per APB1 cycle: 1, 2, 4, 8, 16.
    pub const fn apb1_divider(&self) -> u32 {
        self.hclk_hz / self.pclk1_hz
    }

    /// Returns the core cycles per APB2 cycle: 1, 2, 4, 8, 16.
    pub const fn apb2_divider(&self) -> u32 {
        self.hclk_hz / self.pclk2_hz
    }

    /// Returns the core cycles per timer cycle on APB1: 1, 2, 4, 8.
    pub const fn timer1_divider(&self) -> u32 {
        self.hclk_hz / self.timer1_hz
    }

    /// Returns the core cycles per timer cycle on APB2: 1, 2, 4, 8.
    pub const fn timer2_divider(&self) -> u32 {
        self.hclk_hz / self.timer2_hz
    }
}

/// Returns the core cycles in `ns` nanoseconds at `hz`, rounded up.
pub const fn cycles_in(ns: u64, hz: u32) -> Cycle {
    (ns as u128 * hz as u128).div_ceil(1_000_000_000) as u64 // < 2^64 up to 10^19 ns at 1 GHz
}

/// Returns the new cycle of an event due at `due` in real time, after the core clock changed from
/// `old_hz` to `new_hz` at cycle `at`. A past event, or one that never comes, keeps its cycle.
pub fn rescale(due: Cycle, at: Cycle, old_hz: u32, new_hz: u32) -> Cycle {
    if due <= at || due == Cycle::MAX || old_hz == 0 {
        return due;
    }
    let left = u128::from(due - at) * u128::from(new_hz);
    at.saturating_add(u64::try_from(left.div_ceil(u128::from(old_hz))).unwrap_or(u64::MAX))
}

/// An oscillator independent of the core clock, measured in core cycles: tick n is the first cycle
/// at or after its exact time.
#[derive(Clone, PartialEq, Debug)]
pub struct Oscillator {
    hz: u32,
    core_hz: u32,
    since: Cycle,
    ticks: u64,
    /// Fraction of a tick that has passed at `since`, in 1/`core_hz`.
    fraction: u64,
}

impl Oscillator {
    /// Creates an oscillator of `hz` (at least 1) with tick 0 at cycle `at`, while the core runs at
    /// `core_hz` (at least 1).
    pub fn new(hz: u32, core_hz: u32, at: Cycle) -> Self {
        Self {
            hz: hz.max(1),
            core_hz: core_hz.max(1),
            since: at,
            ticks: 0,
            fraction: 0,
        }
    }

    /// Returns the number of ticks up to cycle `at`.
    pub fn ticks(&self, at: Cycle) -> u64 {
        self.position(at).0
    }

    /// Returns the cycle of tick `n`; for ticks before the latest clock change, the cycle of that
    /// change.
    pub fn cycle_of(&self, n: u64) -> Cycle {
        let ticks = u128::from(n.saturating_sub(self.ticks));
        let parts = (ticks * u128::from(self.core_hz)).saturating_sub(u128::from(self.fraction));
        let cycles = parts.div_ceil(u128::from(self.hz));
        self.since
            .saturating_add(u64::try_from(cycles).unwrap_or(u64::MAX))
    }

    /// Sets the core clock to `core_hz` from cycle `at` on.
    pub fn set_core_hz(&mut self, core_hz: u32, at: Cycle) {
        let (ticks, fraction) = self.position(at);
        let core_hz = core_hz.max(1);
        self.ticks = ticks;
        // < core_hz, because fraction < the old core_hz.
        self.fraction =
            (u128::from(fraction) * u128::from(core_hz) / u128::from(self.core_hz)) as u64;
        self.since = at;
        self.core_hz = core_hz;
    }

    /// Sets the oscillator's own frequency to `hz`, at least 1, from cycle `at` on.
    pub fn set_hz(&mut self, hz: u32, at: Cycle) {
        (self.ticks, self.fraction) = self.position(at);
        self.since = at;
        self.hz = hz.max(1);
    }

    /// Returns the frequency of the core clock, Hz, in whose cycles the oscillator is measured.
    pub const fn core_hz(&self) -> u32 {
        self.core_hz
    }

    fn position(&self, at: Cycle) -> (u64, u64) {
        let gone = u128::from(at.saturating_sub(self.since));
        let parts = gone * u128::from(self.hz) + u128::from(self.fraction);
        let core_hz = u128::from(self.core_hz);
        // A run of 2^64 cycles has fewer than 2^64 ticks of a slower clock.
        (
            self.ticks.wrapping_add((parts / core_hz) as u64),
            (parts % core_hz) as u64,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_and_their_cycles_agree() {
        let lsi = Oscillator::new(32_000, 168_000_000, 100);
        for n in 0..1000 {
            let cycle = lsi.cycle_of(n);
            assert_eq!(lsi.ticks(cycle), n);
            assert_eq!(cycle, 100 + n * 5250);
            assert!(n == 0 || lsi.ticks(cycle - 1) == n - 1);
        }
    }

    #[test]
    fn a_faster_core_sees_the_same_instants() {
        let mut lsi = Oscillator::new(32_000, 16_000_000, 0);
        assert_eq!(lsi.cycle_of(3), 1500);
        lsi.set_core_hz(168_000_000, 750); // half way from tick 1 to tick 2
        assert_eq!(lsi.ticks(750), 1);
        assert_eq!(lsi.cycle_of(2), 750 + 2625);
        assert_eq!(lsi.cycle_of(3), 750 + 2625 + 5250);
    }

    #[test]
    fn what_is_due_in_real_time_moves_with_the_core_clock() {
        assert_eq!(rescale(1600, 1000, 16_000_000, 168_000_000), 7300);
        assert_eq!(rescale(900, 1000, 16_000_000, 168_000_000), 900);
        assert_eq!(rescale(Cycle::MAX, 1000, 1, 2), Cycle::MAX);
        assert_eq!(cycles_in(2_000, 16_000_000), 32);
    }
}
