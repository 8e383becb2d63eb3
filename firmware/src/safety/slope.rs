//! Limit on the rise of an amplitude from one burst to the next, whatever came before.

use super::Wearer;
use crate::units::Amplitude;

/// Limit on how fast a channel's amplitude may rise at any time: `limit` per `rise_us` and per
/// `rise_bursts`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    limit: Amplitude,
    rise_us: u32,
    rise_bursts: u16,
}

impl Slope {
    /// Returns the slope of a channel with this amplitude limit.
    pub(super) const fn of(limit: Amplitude, wearer: &Wearer) -> Self {
        let (rise_us, rise_bursts) = wearer.rise();
        Self {
            limit,
            rise_us,
            rise_bursts,
        }
    }

    /// Returns by how much a burst may exceed the previous one, which began `since_us` before it.
    /// The result is at least 1.
    pub(super) fn max_increase(self, since_us: u32) -> Amplitude {
        let by_time = scale(self.limit, since_us.min(self.rise_us), self.rise_us);
        let by_burst = scale(self.limit, 1, self.rise_bursts.into());
        by_time.min(by_burst).max(Amplitude::new(1))
    }
}

/// Returns `amplitude · part / whole`, rounded down; zero for `whole` = 0.
pub(super) fn scale(amplitude: Amplitude, part: u32, whole: u32) -> Amplitude {
    if part == whole && whole > 0 {
        return amplitude; // as mostly
    }
    // The core has no 64-bit division, and few products need 64 bits.
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
    fn parts_are_exact_in_32_bits_and_in_64() {
        for (amplitude, part, whole) in [(42_949, 99_999, 100_000), (42_950, 99_999, 100_000)] {
            let exact = (f64::from(amplitude) * f64::from(part) / f64::from(whole)) as u32;
            assert_eq!(scale(Amplitude::new(amplitude), part, whole).get(), exact);
        }
        assert_eq!(scale(Amplitude::new(150_000), 1, 0), Amplitude::ZERO);
        assert_eq!(scale(Amplitude::new(1), 0, 0), Amplitude::ZERO);
    }
}
