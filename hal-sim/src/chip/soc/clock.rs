//! Clock frequencies, and real time counted in core cycles.

use crate::chip::Cycle;

/// Frequencies that the clock tree delivers, Hz (RM0090 figure 21).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// Core, memories, AHB.
    pub hclk_hz: u32,
    /// APB1.
    pub pclk1_hz: u32,
    /// APB2.
    pub pclk2_hz: u32,
    /// Timers on APB1: TIM2–7, 12–14.
    pub timer1_hz: u32,
    /// Timers on APB2: TIM1, 8–11.
    pub timer2_hz: u32,
    /// PLL output Q, for USB; 0 while the PLL is off.
    pub usb_hz: u32,
}

impl Clocks {
    /// Core cycles per APB1 cycle: 1, 2, 4, 8, 16.
    pub const fn apb1_divider(&self) -> u32 {
        self.hclk_hz / self.pclk1_hz
    }

    /// Core cycles per APB2 cycle: 1, 2, 4, 8, 16.
    pub const fn apb2_divider(&self) -> u32 {
        self.hclk_hz / self.pclk2_hz
    }

    /// Core cycles per timer cycle on APB1: 1, 2, 4, 8.
    pub const fn timer1_divider(&self) -> u32 {
        self.hclk_hz / self.timer1_hz
    }

    /// Core cycles per timer cycle on APB2: 1, 2, 4, 8.
    pub const fn timer2_divider(&self) -> u32 {
        self.hclk_hz / self.timer2_hz
    }
}

/// Core cycles in `ns` nanoseconds at `hz`, rounded up.
pub const fn cycles_in(ns: u64, hz: u32) -> Cycle {
    (ns as u128 * hz as u128).div_ceil(1_000_000_000) as u64 // < 2^64: ns of 10^19 at 1 GHz
}

/// The cycle of something due at `due` in real time, when at cycle `at` the
/// core clock changes from `old_hz` to `new_hz`. What is past, or never, stays.
pub fn rescale(due: Cycle, at: Cycle, old_hz: u32, new_hz: u32) -> Cycle {
    if due <= at || due == Cycle::MAX || old_hz == 0 {
        return due;
    }
    let left = u128::from(due - at) * u128::from(new_hz);
    at.saturating_add(u64::try_from(left.div_ceil(u128::from(old_hz))).unwrap_or(u64::MAX))
}

/// An oscillator that the core clock does not derive from, seen in core cycles:
/// tick n is the first cycle at or after its exact instant.
#[derive(Clone, PartialEq, Debug)]
pub struct Oscillator {
    hz: u32,
    core_hz: u32,
    since: Cycle,
    ticks: u64,
    /// Part of a tick gone at `since`, in 1/`core_hz`.
    fraction: u64,
}

impl Oscillator {
    /// An oscillator of `hz` (at least 1) with tick 0 at cycle `at`, while the
    /// core runs at `core_hz` (at least 1).
    pub fn new(hz: u32, core_hz: u32, at: Cycle) -> Self {
        Self {
            hz: hz.max(1),
            core_hz: core_hz.max(1),
            since: at,
            ticks: 0,
            fraction: 0,
        }
    }

    /// Ticks gone at cycle `at`.
    pub fn ticks(&self, at: Cycle) -> u64 {
        self.position(at).0
    }

    /// Cycle of tick `n`; the present anchor for ticks before it.
    pub fn cycle_of(&self, n: u64) -> Cycle {
        let ticks = u128::from(n.saturating_sub(self.ticks));
        let parts = (ticks * u128::from(self.core_hz)).saturating_sub(u128::from(self.fraction));
        let cycles = parts.div_ceil(u128::from(self.hz));
        self.since
            .saturating_add(u64::try_from(cycles).unwrap_or(u64::MAX))
    }

    /// From cycle `at` on the core runs at `core_hz`.
    pub fn set_core_hz(&mut self, core_hz: u32, at: Cycle) {
        let (ticks, fraction) = self.position(at);
        let core_hz = core_hz.max(1);
        self.ticks = ticks;
        // < core_hz: fraction < the old core_hz.
        self.fraction =
            (u128::from(fraction) * u128::from(core_hz) / u128::from(self.core_hz)) as u64;
        self.since = at;
        self.core_hz = core_hz;
    }

    /// From cycle `at` on its own frequency is `hz`, at least 1.
    pub fn set_hz(&mut self, hz: u32, at: Cycle) {
        (self.ticks, self.fraction) = self.position(at);
        self.since = at;
        self.hz = hz.max(1);
    }

    /// Frequency of the core that it is seen from, Hz.
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
