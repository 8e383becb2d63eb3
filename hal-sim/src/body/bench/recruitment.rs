//! Recruitment: the share of fibres that a pulse excites.
//!
//! Every fibre has its own threshold. The distribution has a smallest threshold, so that force
//! rises gradually from zero, unlike the exponential that Lee 2020 fits (equation 5). Pulse width
//! acts through the strength-duration relation.

use super::InvalidBench;
use std::f64::consts::FRAC_1_SQRT_2;

/// Strength-duration relation I = rheobase·(1 + chronaxie/width) (Weiss; Geddes 2004: reliable for
/// rectangular pulses of constant current only).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrengthDuration {
    /// Width at which the threshold is twice the rheobase, µs; above 0.
    pub chronaxie_us: f64,
    /// Width to which thresholds refer, µs; above 0.
    pub reference_us: f64,
}

impl StrengthDuration {
    /// Returns the current at the reference width that excites as much as `current_ma` does in
    /// `width_us`, mA; 0 for a width of 0.
    #[must_use]
    pub fn equivalent_ma(&self, current_ma: f64, width_us: f64) -> f64 {
        if width_us <= 0.0 {
            return 0.0;
        }
        let at = |width_us: f64| 1.0 + self.chronaxie_us / width_us;
        current_ma * at(self.reference_us) / at(width_us)
    }

    /// Returns the threshold at `width_us` (above 0) of a fibre whose threshold at the reference
    /// width is `reference_ma`, mA.
    #[must_use]
    pub fn threshold_ma(&self, reference_ma: f64, width_us: f64) -> f64 {
        let at = |width_us: f64| 1.0 + self.chronaxie_us / width_us;
        reference_ma * at(width_us) / at(self.reference_us)
    }
}

/// Fibres with normally distributed thresholds, truncated at the smallest one. Thresholds and
/// strengths are in mA at the reference width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pool {
    lowest: f64,
    middle: f64,
    spread: f64,
    /// Share of the untruncated normal distribution below the smallest threshold.
    cut: f64,
}

impl Pool {
    /// Creates a pool with thresholds from `lowest` on, normally distributed around `middle` with
    /// standard deviation `spread` (above 0).
    ///
    /// # Errors
    /// Returns the name of the invalid parameter: `lowest` or `spread` if it is not above 0,
    /// `middle` if almost the whole distribution would lie below the smallest threshold.
    pub fn new(lowest: f64, middle: f64, spread: f64) -> Result<Self, InvalidBench> {
        let cut = normal_cdf((lowest - middle) / spread);
        match () {
            () if !(lowest.is_finite() && lowest > 0.0) => Err(InvalidBench("lowest")),
            () if !(spread.is_finite() && spread > 0.0) => Err(InvalidBench("spread")),
            () if !(middle.is_finite() && cut < 1.0 - 1e-9) => Err(InvalidBench("middle")),
            () => Ok(Self {
                lowest,
                middle,
                spread,
                cut,
            }),
        }
    }

    /// Creates a pool from `lowest`, `spread` and a ratio: a pulse of strength `weak` excites
    /// `ratio` (between 0 and 1, exclusive) times as many fibres as a pulse of strength `strong`.
    /// Bisection finds the middle of the distribution.
    ///
    /// # Errors
    /// Returns the name of the invalid parameter, or `ratio` if no middle gives this ratio.
    pub fn from_ratio(
        (lowest, spread): (f64, f64),
        (weak, strong): (f64, f64),
        ratio: f64,
    ) -> Result<Self, InvalidBench> {
        // A higher middle makes the ratio smaller, because most fibres then need a stronger pulse.
        let (mut low, mut high) = (lowest - 4.0 * spread, strong + 12.0 * spread);
        let at = |middle| {
            Self::new(lowest, middle, spread).map(|pool| pool.share(weak) / pool.share(strong))
        };
        if !(at(low)? >= ratio && at(high)? <= ratio) {
            return Err(InvalidBench("ratio"));
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match at(middle)? > ratio {
                true => low = middle,
                false => high = middle,
            }
        }
        Self::new(lowest, 0.5 * (low + high), spread)
    }

    /// Returns the share of the fibres, 0 to 1, that a pulse of this strength (mA at the reference
    /// width) excites.
    #[must_use]
    pub fn share(&self, strength: f64) -> f64 {
        if strength <= self.lowest {
            return 0.0;
        }
        let below = normal_cdf((strength - self.middle) / self.spread);
        ((below - self.cut) / (1.0 - self.cut)).clamp(0.0, 1.0)
    }

    /// Returns the smallest threshold of a fibre, mA at the reference width.
    #[must_use]
    pub const fn lowest(&self) -> f64 {
        self.lowest
    }

    /// Returns the strength that excites this `share` (0 to 1) of the fibres, found by bisection;
    /// the smallest threshold for a share of 0.
    #[must_use]
    pub fn strength(&self, share: f64) -> f64 {
        let (mut low, mut high) = (
            self.lowest,
            self.lowest.max(self.middle) + 10.0 * self.spread,
        );
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            match self.share(middle) < share {
                true => low = middle,
                false => high = middle,
            }
        }
        if share <= 0.0 { self.lowest } else { high }
    }
}

/// Returns the cumulative distribution function of the standard normal distribution.
fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_rises_from_nothing_at_the_lowest_threshold_to_all() {
        let pool = Pool::new(8.0, 12.0, 2.5).unwrap();
        assert_eq!(
            [0.0, 7.9, 8.0].map(|current_ma| pool.share(current_ma)),
            [0.0; 3]
        );
        let shares: Vec<f64> = (80..400)
            .map(|tenth| pool.share(f64::from(tenth) * 0.1))
            .collect();
        assert!(shares.windows(2).all(|window| window[1] >= window[0]));
        // Force begins without a jump.
        assert!(shares[1] < 0.01 && shares[1] > 0.0);
        assert!((shares[319] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_pool_goes_through_a_ratio() {
        for ratio in [0.12, 0.3, 0.5] {
            let pool = Pool::from_ratio((8.0, 2.5), (10.0, 15.0), ratio).unwrap();
            assert!((pool.share(10.0) / pool.share(15.0) - ratio).abs() < 1e-9);
        }
    }

    #[test]
    fn a_strength_excites_the_share_it_was_asked_for() {
        let pool = Pool::new(8.0, 12.0, 2.5).unwrap();
        for share in [0.001, 0.1, 0.9] {
            assert!((pool.share(pool.strength(share)) - share).abs() < 1e-9);
        }
        assert_eq!(pool.strength(0.0), 8.0);
    }

    /// The threshold at the chronaxie is twice the rheobase, and the conversion back agrees.
    #[test]
    fn width_trades_for_current() {
        let law = StrengthDuration {
            chronaxie_us: 200.0,
            reference_us: 400.0,
        };
        let rheobase = 10.0 / 1.5;
        assert!((law.threshold_ma(10.0, 200.0) - 2.0 * rheobase).abs() < 1e-12);
        assert!((law.equivalent_ma(2.0 * rheobase, 200.0) - 10.0).abs() < 1e-12);
        assert_eq!(law.equivalent_ma(10.0, 0.0), 0.0);
    }

    #[test]
    fn what_no_pool_has_is_named() {
        assert_eq!(Pool::new(0.0, 1.0, 1.0), Err(InvalidBench("lowest")));
        assert_eq!(Pool::new(1.0, 1.0, 0.0), Err(InvalidBench("spread")));
        assert_eq!(Pool::new(9.0, 1.0, 0.5), Err(InvalidBench("middle")));
        let none = Pool::from_ratio((8.0, 2.5), (10.0, 15.0), 1.5);
        assert_eq!(none, Err(InvalidBench("ratio")));
    }
}
