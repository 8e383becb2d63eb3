//! Measures how long this computer kept the program from looking at its port, because it was
//! suspended, asleep or too busy. A message that the device did not send then is no evidence
//! against the device, because nobody listened.

/// Shortest time that counts as a stall, µs. The program's own work takes less.
const LEAST_US: u64 = 10_000;

/// Stalls: times during which the program should have read from its port but did not run.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stalls {
    /// Time at which the program last attended to its port, µs; `None` before the first time.
    seen_us: Option<u64>,
    /// Sum of all stalls, µs.
    sum_us: u64,
    /// Longest recent stall: the time at which it ended, and its length, µs.
    longest: (u64, u64),
}

impl Stalls {
    /// Time after its end for which the longest stall is kept although shorter ones follow, µs.
    const KEPT_US: u64 = 2_000_000;

    /// Notes that the program attends to its port at `now_us`. It wanted to do so by `due_us`, or
    /// immediately if `due_us` is 0; the delay counts as a stall if it is long enough.
    pub(super) fn record_look(&mut self, now_us: u64, due_us: u64) {
        let wanted_us = self.seen_us.unwrap_or(now_us).max(due_us);
        let stall_us = now_us.saturating_sub(wanted_us);
        self.seen_us = Some(now_us);
        if stall_us < LEAST_US {
            return;
        }
        self.sum_us += stall_us;
        if stall_us >= self.recent_us(now_us) {
            self.longest = (now_us, stall_us);
        }
    }

    /// Returns the sum of all stalls so far, µs.
    pub(super) const fn sum_us(&self) -> u64 {
        self.sum_us
    }

    /// Returns the longest stall that ended in the two seconds before `now_us`, µs; 0 if there was
    /// none.
    pub(super) const fn recent_us(&self, now_us: u64) -> u64 {
        let (over_us, stall_us) = self.longest;
        if now_us.saturating_sub(over_us) > Self::KEPT_US {
            return 0;
        }
        stall_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_not_wanted_is_a_stall() {
        let mut stalls = Stalls::default();
        stalls.record_look(70_000_000, 0); // how long the port was there does not count
        stalls.record_look(70_500_000, 70_500_000); // a wait
        stalls.record_look(70_509_000, 0); // work
        assert_eq!((stalls.sum_us(), stalls.recent_us(70_509_000)), (0, 0));
        stalls.record_look(75_000_000, 70_511_000);
        assert_eq!(stalls.sum_us(), 4_489_000);
        stalls.record_look(75_100_000, 0);
        assert_eq!(stalls.sum_us(), 4_589_000);
        assert_eq!(stalls.recent_us(77_000_000), 4_489_000);
        assert_eq!(stalls.recent_us(77_000_001), 0);
        stalls.record_look(77_100_000, 77_080_000);
        assert_eq!(stalls.recent_us(77_100_000), 20_000);
    }
}
