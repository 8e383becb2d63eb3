//! Values between the points of a measured grid.
//!
//! Errors are straight lines there between the logarithms of an axis and the
//! logarithm of the error: over a factor of two in time or pulse rate they follow
//! powers, not lines. Of a pair of rates, slow ≤ fast, the cell that a diagonal
//! cuts is a triangle, so that equal rates lie between equal rates only.

use super::grid::pair;

/// Weights are parts of this along one axis.
const WHOLE: u64 = 1 << 8;

/// Where a value lies on a rising axis: a point of it, and how far from there to
/// the next one, in parts of [`WHOLE`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Place {
    low: usize,
    part: u64,
}

impl Place {
    /// The place of `value`, at the first or last point if it lies beyond.
    /// `offset`, added to all, lets an axis begin at 0.
    pub(super) fn on(axis: &[u32], offset: u32, value: u32) -> Self {
        let above = axis.partition_point(|&point| point <= value);
        let low = above.saturating_sub(1);
        let position = |value: u32| u64::from(log2(value.saturating_add(offset)));
        let (Some(&from), Some(&to)) = (axis.get(low), axis.get(above)) else {
            return Self { low, part: 0 };
        };
        if value <= from {
            return Self { low, part: 0 };
        }
        let (from, to, here) = (position(from), position(to), position(value));
        let passed = here.saturating_sub(from).saturating_mul(WHOLE);
        let part = passed.checked_div(to.saturating_sub(from)).unwrap_or(0);
        Self {
            low,
            part: part.min(WHOLE),
        }
    }

    /// This place, but not before the first point above `least`: the next one if
    /// it lies between.
    pub(super) fn above(self, axis: &[u32], least: u32) -> Self {
        let is_below = axis.get(self.low).is_some_and(|&point| point <= least);
        if is_below && self.part > 0 {
            return Self {
                low: self.low.saturating_add(1),
                part: 0,
            };
        }
        self
    }

    /// The two points and their weights.
    fn ends(self) -> [(usize, u64); 2] {
        let high = self.low.saturating_add(1);
        [
            (self.low, WHOLE.saturating_sub(self.part)),
            (high, self.part),
        ]
    }
}

/// The pairs around two rates, `slow` ≤ `fast`, among `rates`, and their weights
/// in parts of [`WHOLE`]².
fn pairs(rates: usize, slow: Place, fast: Place) -> [(usize, u64); 4] {
    let square = |weight: u64| weight.saturating_mul(WHOLE);
    if slow.low == fast.low {
        let (low, high) = (slow.low, slow.low.saturating_add(1));
        return [
            (
                pair(rates, low, low),
                square(WHOLE.saturating_sub(fast.part)),
            ),
            (
                pair(rates, low, high),
                square(fast.part.saturating_sub(slow.part)),
            ),
            (pair(rates, high, high), square(slow.part)),
            (0, 0),
        ];
    }
    let [(a, of_a), (b, of_b)] = slow.ends();
    let [(c, of_c), (d, of_d)] = fast.ends();
    [
        (pair(rates, a, c), of_a.saturating_mul(of_c)),
        (pair(rates, a, d), of_a.saturating_mul(of_d)),
        (pair(rates, b, c), of_b.saturating_mul(of_c)),
        (pair(rates, b, d), of_b.saturating_mul(of_d)),
    ]
}

/// The value among up to 32 measured ones around a scene. `measured` gives the
/// one at a time at work, a burst, a ramp and a pair of rates. None if one with
/// a weight is missing.
///
/// On the careful side: half of how far the neighbours are from their mean, on
/// average, is added to it. A measured scene is itself, and where neighbours
/// agree nothing is added.
pub(super) fn value(
    times: [Place; 3],
    rates: usize,
    [slow, fast]: [Place; 2],
    measured: impl Fn(usize, usize, usize, usize) -> Option<u16>,
) -> Option<u16> {
    let pairs = pairs(rates, slow, fast);
    let [session, burst, ramp] = times.map(Place::ends);
    // The mean of a function of the logarithms.
    let mean = |function: &dyn Fn(u32) -> u32| {
        let mut sum = 0u64;
        for (session, of_session) in session {
            for (burst, of_burst) in burst {
                for (ramp, of_ramp) in ramp {
                    let times = of_session.saturating_mul(of_burst).saturating_mul(of_ramp);
                    for (pair, of_pair) in pairs {
                        // At most 2^24 · 2^16, and all weights together are that;
                        // a logarithm is below 2^20.
                        let weight = times.saturating_mul(of_pair);
                        if weight > 0 {
                            let log = log2(measured(session, burst, ramp, pair)?.into());
                            let part = weight.saturating_mul(function(log).into());
                            sum = sum.saturating_add(part);
                        }
                    }
                }
            }
        }
        Some((sum >> 40) as u32) // below 2^20
    };
    let middle = mean(&|log| log)?;
    let apart = mean(&|log| log.abs_diff(middle))?;
    Some(exp2(middle.saturating_add(apart / 2)))
}

/// log2 in 2^-16, a straight line between powers of two; 0 counts as 1.
fn log2(x: u32) -> u32 {
    let x = x.max(1);
    let whole = x.ilog2();
    // 2^16 to 2^17 − 1.
    let mantissa = (u64::from(x) << 16) >> whole;
    (whole << 16).saturating_add((mantissa as u32).saturating_sub(1 << 16))
}

/// Its inverse, up to 65,535.
fn exp2(log: u32) -> u16 {
    let (whole, fraction) = (log >> 16, log & 0xFFFF);
    if whole >= 16 {
        return u16::MAX;
    }
    let mantissa = u64::from(fraction).saturating_add(1 << 16);
    ((mantissa << whole) >> 16) as u16 // below 2^16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_go_to_and_fro() {
        for x in [1, 2, 3, 999, 1_000, 40_000, 65_535u16] {
            assert!(x - exp2(log2(x.into())) <= 1, "{x}");
        }
        assert!((1..5_000).all(|x| log2(x) < log2(x + 1)));
    }

    #[test]
    fn a_point_is_itself_and_beyond_the_ends_is_the_end() {
        let axis = [0, 10, 100];
        for (value, low, part) in [(0, 0, 0), (10, 1, 0), (100, 2, 0), (5_000, 2, 0)] {
            assert_eq!(Place::on(&axis, 20, value), Place { low, part });
        }
        let within = Place::on(&axis, 20, 40);
        assert_eq!(within.low, 1);
        assert!((1..WHOLE).contains(&within.part));
    }

    #[test]
    fn weights_are_whole_and_equal_rates_lie_between_equal_rates() {
        for slow in 0..=20 {
            for fast in slow..=20 {
                let on = |value| Place::on(&[1, 4, 16, 20], 0, value);
                let sum: u64 = pairs(4, on(slow), on(fast)).iter().map(|p| p.1).sum();
                assert_eq!(sum, WHOLE * WHOLE, "{slow} {fast}");
            }
            let here = Place::on(&[1, 4, 16, 20], 0, slow);
            for (place, weight) in pairs(4, here, here) {
                let is_equal = [0, 4, 7, 9].contains(&place);
                assert!(is_equal || weight == 0, "{slow} {place}");
            }
        }
    }

    #[test]
    fn a_power_is_met_between_its_points() {
        // Errors 100·2^place over an axis of powers of four.
        let axis = [1u32, 4, 16, 64];
        let measured = |_, burst: usize, _, _| Some(100u16 << burst);
        let none = Place { low: 0, part: 0 };
        let at = |value| {
            let burst = Place::on(&axis, 0, value);
            value_of(burst, none, measured).unwrap()
        };
        assert_eq!([at(1), at(4), at(64)], [100, 200, 800]);
        // Half a power of two apart from both: 283, and a quarter of it more.
        assert!((at(8)).abs_diff(336) < 20, "{}", at(8));
        assert_eq!(value_of(none, none, |_, _, _, _| None), None);
    }

    fn value_of(
        burst: Place,
        none: Place,
        measured: impl Fn(usize, usize, usize, usize) -> Option<u16>,
    ) -> Option<u16> {
        value([none, burst, none], 1, [none, none], measured)
    }
}
