//! How long this computer kept the program from looking at its port: while it was
//! suspended, asleep or too busy. What a device did not say then, nobody listened for.

/// A shorter one is the ordinary work of a program, µs.
const LEAST_US: u64 = 10_000;

/// Times in which the port was not looked at, in the port's time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stalls {
    /// When it was looked at last, µs.
    seen_us: Option<u64>,
    /// In sum, µs.
    sum_us: u64,
    /// The longest of late: when it was over and how long it was, µs.
    longest: (u64, u64),
}

impl Stalls {
    /// A longest stall that is over for so long is forgotten for a shorter one, µs.
    const KEPT_US: u64 = 2_000_000;

    /// The program looks at its port at `now_us`, as it wanted to by `due_us` or, with 0,
    /// at once.
    pub(super) fn look(&mut self, now_us: u64, due_us: u64) {
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

    /// The sum of all so far, µs.
    pub(super) const fn sum_us(&self) -> u64 {
        self.sum_us
    }

    /// The longest that was over in the two seconds before `now_us`, µs; 0 for none.
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
        stalls.look(70_000_000, 0); // how long the port was there does not count
        stalls.look(70_500_000, 70_500_000); // a wait
        stalls.look(70_509_000, 0); // work
        assert_eq!((stalls.sum_us(), stalls.recent_us(70_509_000)), (0, 0));
        stalls.look(75_000_000, 70_511_000);
        assert_eq!(stalls.sum_us(), 4_489_000);
        stalls.look(75_100_000, 0);
        assert_eq!(stalls.sum_us(), 4_589_000);
        assert_eq!(stalls.recent_us(77_000_000), 4_489_000);
        assert_eq!(stalls.recent_us(77_000_001), 0);
        stalls.look(77_100_000, 77_080_000);
        assert_eq!(stalls.recent_us(77_100_000), 20_000);
    }
}
