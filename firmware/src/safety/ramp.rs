//! Amplitude envelopes: a rise from zero and one common fall.

use crate::units::{Amplitude, Micros, us};

/// Rise of one channel. Restarts whenever its wanted amplitude was zero.
#[derive(Clone, Copy, Debug, Default, Hash)]
pub enum Rise {
    /// Nothing is wanted.
    #[default]
    Zero,
    /// Rising.
    Since {
        /// When it began.
        start: Micros,
        /// Bursts since then.
        bursts: u16,
    },
    /// Risen: without a time, so that a triggered train may wait for hours.
    Done,
}

impl Rise {
    /// Amplitude of a burst at `now` of a channel that wants `wanted` and rises linearly
    /// from zero over `rise_us`, and over `rise_bursts` of its bursts: whatever is less.
    /// Time alone would let a train with long pauses be at its full amplitude with its
    /// second burst.
    pub fn apply(
        &mut self,
        wanted: Amplitude,
        now: Micros,
        (rise_us, rise_bursts): (u32, u16),
    ) -> Amplitude {
        if wanted == Amplitude::ZERO {
            *self = Self::Zero;
            return wanted;
        }
        if let Self::Zero = self {
            *self = Self::Since {
                start: now,
                bursts: 0,
            };
        }
        let Self::Since { start, bursts } = self else {
            return wanted;
        };
        // Time goes forward: a negative distance is one beyond half the clock.
        let elapsed = (now - *start).us().cast_unsigned().min(rise_us);
        let played = (*bursts).min(rise_bursts);
        if (elapsed, played) == (rise_us, rise_bursts) {
            *self = Self::Done;
            return wanted;
        }
        *bursts = played.saturating_add(1);
        if elapsed == rise_us {
            // The clock may pass half its range before the bursts are played.
            *start = now - us(rise_us);
        }
        scale(wanted, elapsed, rise_us).min(scale(wanted, played.into(), rise_bursts.into()))
    }
}

/// The fall of all channels when stimulation stops.
#[derive(Clone, Copy, Debug, Hash)]
pub struct Fall {
    from: Micros,
    length_us: u32,
}

impl Fall {
    /// Starts at `from` and reaches zero `length_us` later.
    #[must_use]
    pub const fn new(from: Micros, length_us: u32) -> Self {
        Self { from, length_us }
    }

    /// When every output is isolated at the latest.
    #[must_use]
    pub fn end(&self) -> Micros {
        self.from + us(self.length_us)
    }

    /// What is left of `amplitude` at `now`.
    #[must_use]
    pub fn apply(&self, amplitude: Amplitude, now: Micros) -> Amplitude {
        let left = self.end().elapsed_since(now).min(self.length_us);
        scale(amplitude, left, self.length_us)
    }
}

/// `amplitude · part / whole`, rounded down; zero for `whole` = 0.
fn scale(amplitude: Amplitude, part: u32, whole: u32) -> Amplitude {
    if part == whole && whole > 0 {
        return amplitude; // as mostly
    }
    // The core divides no 64 bits, and few products need them.
    if let Some(product) = amplitude.get().checked_mul(part) {
        return Amplitude::new(product.checked_div(whole).unwrap_or(0));
    }
    let scaled = (u64::from(amplitude.get()) * u64::from(part)).checked_div(u64::from(whole));
    // part <= whole, so the quotient is at most `amplitude`.
    Amplitude::new(scaled.unwrap_or(0) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rises_linearly_and_restarts_from_zero() {
        let mut rise = Rise::default();
        let full = Amplitude::new(10_000);
        let t0 = Micros::new(u32::MAX - 50_000);
        assert_eq!(rise.apply(full, t0, (100_000, 1)), Amplitude::new(0));
        assert_eq!(
            rise.apply(full, t0 + us(25_000), (100_000, 1)),
            Amplitude::new(2_500)
        );
        assert_eq!(rise.apply(full, t0 + us(100_000), (100_000, 1)), full);
        assert_eq!(
            rise.apply(Amplitude::ZERO, t0 + us(120_000), (100_000, 1)),
            Amplitude::ZERO
        );
        assert_eq!(
            rise.apply(full, t0 + us(140_000), (100_000, 1)),
            Amplitude::new(0)
        );
    }

    #[test]
    fn a_train_with_long_pauses_rises_burst_by_burst() {
        let mut rise = Rise::default();
        let full = Amplitude::new(10_000);
        let mut at = |burst: u32| rise.apply(full, Micros::new(burst << 29), (100_000, 4));
        let seen = [0, 1, 2, 3, 4, 5].map(|burst| at(burst).get());
        assert_eq!(seen, [0, 2_500, 5_000, 7_500, 10_000, 10_000]);
        // Time still counts: the fifth of five bursts within it is not full.
        let mut rise = Rise::default();
        let mut at = |burst: u32| rise.apply(full, Micros::new(burst * 20_000), (100_000, 2));
        let seen = [0, 1, 2, 3, 4, 5].map(|burst| at(burst).get());
        assert_eq!(seen, [0, 2_000, 4_000, 6_000, 8_000, 10_000]);
    }

    #[test]
    fn parts_are_exact_in_32_bits_and_in_64() {
        for (amplitude, part, whole) in [(42_949, 99_999, 100_000), (42_950, 99_999, 100_000)] {
            let exact = (f64::from(amplitude) * f64::from(part) / f64::from(whole)) as u32;
            assert_eq!(scale(Amplitude::new(amplitude), part, whole).get(), exact);
        }
        assert_eq!(scale(Amplitude::new(150_000), 1, 0), Amplitude::ZERO);
        assert_eq!(scale(Amplitude::new(1), 0, 0), Amplitude::ZERO);
    }

    #[test]
    fn falls_to_zero_at_its_end() {
        let fall = Fall::new(Micros::new(1000), 50_000);
        let full = Amplitude::new(1000);
        assert_eq!(fall.apply(full, Micros::new(0)), full);
        assert_eq!(fall.apply(full, Micros::new(26_000)), Amplitude::new(500));
        assert_eq!(fall.apply(full, fall.end()), Amplitude::ZERO);
        assert_eq!(fall.apply(full, fall.end() + us(9)), Amplitude::ZERO);
    }

    /// Every fall that a wearer may have, at each of its microseconds.
    #[test]
    fn no_fall_rises_or_outlasts_its_time() {
        for full in [1, 65_537, 150_000].map(Amplitude::new) {
            for fall_us in (5..=100).map(|ms| ms * 1_000) {
                let from = Micros::new(u32::MAX - fall_us / 2); // the clock wraps on the way
                let fall = Fall::new(from, fall_us);
                let mut last = full;
                for after in 0..=fall_us {
                    let left = fall.apply(full, from + us(after));
                    let is_due = after * 2 != fall_us || left.get() <= full.get().div_ceil(2);
                    assert!(left <= last && is_due, "{full:?}, {fall_us} µs: {after}");
                    last = left;
                }
                assert_eq!(last, Amplitude::ZERO);
            }
        }
    }

    /// Every rise that a wearer may have, with a burst in each window.
    #[test]
    fn no_rise_is_quicker_than_the_wearers() {
        let full = Amplitude::new(100_000);
        for rise_us in (1..=5_000).map(|ms| ms * 1_000) {
            let start = Micros::new(u32::MAX - rise_us / 2);
            let mut rise = Rise::default();
            let mut last = Amplitude::ZERO;
            for after in (0..=rise_us).step_by(250) {
                let now = rise.apply(full, start + us(after), (rise_us, 1));
                let most = u64::from(full.get()) * u64::from(after) / u64::from(rise_us);
                assert!(
                    now >= last && u64::from(now.get()) <= most,
                    "{rise_us}: {after}"
                );
                last = now;
            }
            assert_eq!(last, full);
        }
    }
}
