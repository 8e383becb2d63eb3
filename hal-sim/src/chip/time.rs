//! Converts between cycles of a core whose clock changes and real time.

use crate::chip::Cycle;

/// Number of picoseconds in a second.
const SECOND_PS: u128 = 1_000_000_000_000;
/// Number of picoseconds in a microsecond.
const US_PS: u128 = 1_000_000;
/// Number of picoseconds in a nanosecond.
const NS_PS: u128 = 1_000;

/// A stretch of time with a constant clock of `hz`. It begins at `cycle`, which is at time `ps`.
#[derive(Clone, Copy, PartialEq, Debug)]
struct ClockSegment {
    cycle: Cycle,
    ps: u128,
    hz: u32,
}

/// Conversion between cycles and time, with the history of the clock.
#[derive(Clone, PartialEq, Debug)]
pub struct Time {
    /// Stretches of time with a constant clock, in order of time; the first begins at time 0.
    stretches: Vec<ClockSegment>,
}

impl Time {
    /// Creates a time scale whose time 0 is cycle `origin`, with a clock of `hz`.
    pub fn new(origin: Cycle, hz: u32) -> Self {
        let first = ClockSegment {
            cycle: origin,
            ps: 0,
            hz,
        };
        Self {
            stretches: vec![first],
        }
    }

    /// Changes the clock to `hz` from `cycle` on.
    pub fn set_hz(&mut self, hz: u32, cycle: Cycle) {
        let Some(last) = self.stretches.last_mut() else {
            return;
        };
        if last.hz == hz {
            return;
        }
        let ps = last.ps_at(cycle);
        match cycle <= last.cycle {
            true => last.hz = hz,
            false => self.stretches.push(ClockSegment { cycle, ps, hz }),
        }
    }

    /// Returns the time at `cycle`, µs, rounded down; 0 before the origin.
    pub fn us(&self, cycle: Cycle) -> u64 {
        (self.ps(cycle) / US_PS) as u64
    }

    /// Returns the time at `cycle`, ns, rounded down; 0 before the origin.
    pub fn ns(&self, cycle: Cycle) -> u64 {
        (self.ps(cycle) / NS_PS) as u64
    }

    fn ps(&self, cycle: Cycle) -> u128 {
        let after = self
            .stretches
            .partition_point(|stretch| stretch.cycle <= cycle);
        let stretch = self.stretches.get(after.saturating_sub(1));
        stretch.map_or(0, |stretch| stretch.ps_at(cycle))
    }

    /// Returns the first cycle at or after time `us`, µs.
    pub fn cycle(&self, us: u64) -> Cycle {
        self.cycle_of(u128::from(us) * US_PS)
    }

    /// Returns the first cycle at or after time `ns`, ns.
    pub fn cycle_of_ns(&self, ns: u64) -> Cycle {
        self.cycle_of(u128::from(ns) * NS_PS)
    }

    fn cycle_of(&self, ps: u128) -> Cycle {
        let after = self.stretches.partition_point(|stretch| stretch.ps <= ps);
        let stretch = self.stretches.get(after.saturating_sub(1));
        stretch.map_or(0, |stretch| stretch.cycle_of(ps))
    }
}

impl ClockSegment {
    fn ps_at(&self, cycle: Cycle) -> u128 {
        let cycles = u128::from(cycle.saturating_sub(self.cycle));
        self.ps + cycles * SECOND_PS / u128::from(self.hz.max(1))
    }

    fn cycle_of(&self, ps: u128) -> Cycle {
        let cycles = (ps.saturating_sub(self.ps) * u128::from(self.hz)).div_ceil(SECOND_PS);
        self.cycle + cycles as u64 // a run has fewer than 2^64 cycles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn microseconds_have_168_cycles_until_the_clock_changes() {
        let mut time = Time::new(1_000, 168_000_000);
        for us in [0, 1, 7, 999_999, 10_000_000_000] {
            assert_eq!(time.cycle(us), 1_000 + us * 168);
            assert_eq!(time.us(1_000 + us * 168), us);
            assert_eq!(time.us(1_000 + us * 168 + 167), us);
        }
        assert_eq!(time.us(0), 0);
        // 16 MHz from 10 µs on, then 84 MHz from 20 µs on.
        time.set_hz(16_000_000, 1_000 + 1_680);
        time.set_hz(84_000_000, 1_000 + 1_680 + 160);
        assert_eq!((time.cycle(9), time.cycle(10)), (2_512, 2_680));
        assert_eq!((time.cycle(11), time.us(2_680 + 17)), (2_696, 11));
        assert_eq!((time.cycle(20), time.cycle(21)), (2_840, 2_924));
        assert_eq!((time.us(2_839), time.us(2_924 + 84)), (19, 22));
        assert_eq!(
            (time.ns(2_840 + 21), time.cycle_of_ns(20_250)),
            (20_250, 2_861)
        );
    }
}
