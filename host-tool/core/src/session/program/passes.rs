//! The times at which a course begins, once or repeatedly.

/// Times at which the passes of a program on one channel begin.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Passes {
    /// Beginning of the first pass, µs after the start of the trains.
    pub(super) first_us: f64,
    /// Time from the beginning of one pass to the next, µs; `None` if there is only one pass.
    pub(super) every_us: Option<f64>,
    /// Number of passes; `None` if they continue until the session ends.
    pub(super) count: Option<u64>,
}

impl Passes {
    /// Returns the time at which the latest pass that began at or before `t_us` began, µs after the
    /// start of the trains; `None` before the first pass.
    pub(super) fn latest_start_us(&self, t_us: u64) -> Option<u64> {
        let since_us = t_us as f64 - self.first_us.round();
        if since_us < 0.0 {
            return None;
        }
        let Some(every_us) = self.every_us else {
            return Some(self.start_us(0));
        };
        let last = self.count.map_or(u64::MAX, |count| count.saturating_sub(1));
        let mut pass = (since_us / every_us) as u64; // saturates
        // Passes begin on whole microseconds, so the quotient may be off by one.
        if self.start_us(pass + 1) <= t_us {
            pass += 1;
        } else if self.start_us(pass) > t_us {
            pass = pass.saturating_sub(1);
        }
        Some(self.start_us(pass.min(last)))
    }

    /// Returns the time at which the pass with number `nth` (from 0) begins, µs after the start of
    /// the trains.
    pub(super) fn start_us(&self, nth: u64) -> u64 {
        let since_us = self.every_us.map_or(0.0, |every_us| every_us * nth as f64);
        (self.first_us + since_us).round() as u64 // not negative
    }

    /// Returns the number of passes that end within `duration_us`, if each lasts `lasts_us`.
    pub(super) fn count_within(&self, lasts_us: f64, duration_us: u64) -> u64 {
        let left_us = duration_us as f64 - self.first_us - lasts_us;
        match self.every_us {
            _ if left_us < 0.0 => 0,
            None => 1,
            Some(every_us) => (left_us / every_us) as u64 + 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_begin_on_whole_microseconds_and_end_with_their_count() {
        let passes = Passes {
            first_us: 10.0,
            every_us: Some(10.0 / 3.0),
            count: Some(3),
        };
        // Passes begin at 10, 13.33 and 16.67; the last one continues.
        let begun = [9, 10, 12, 13, 16, 17, 1_000].map(|t_us| passes.latest_start_us(t_us));
        let expected = [
            None,
            Some(10),
            Some(10),
            Some(13),
            Some(13),
            Some(17),
            Some(17),
        ];
        assert_eq!(begun, expected);
        assert_eq!(passes.count_within(3.0, 20), 3);
        assert_eq!(passes.count_within(3.0, 12), 0);
    }
}
