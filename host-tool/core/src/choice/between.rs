//! Values between the points of a measured grid.
//!
//! Errors are straight lines there between the logarithms of an axis and the
//! logarithm of the error: over a factor of two in time or pulse rate they follow
//! powers, not lines. Of a pair of rates, slow ≤ fast, the cell that a diagonal
//! cuts is a triangle, so that equal rates lie between equal rates only.

use super::measured::Table;

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
        let part = match axis.get(above) {
            Some(&to) if value > axis[low] => {
                let from = position(axis[low]);
                (position(value) - from) * WHOLE / (position(to) - from)
            }
            _ => 0,
        };
        Self { low, part }
    }

    /// This place, but not before the first point above `least`: the next one if
    /// it lies between.
    pub(super) fn above(self, axis: &[u32], least: u32) -> Self {
        if axis[self.low] <= least && self.part > 0 {
            return Self {
                low: self.low + 1,
                part: 0,
            };
        }
        self
    }

    /// The two points and their weights.
    fn ends(self) -> [(usize, u64); 2] {
        [(self.low, WHOLE - self.part), (self.low + 1, self.part)]
    }
}

/// The pairs around two rates, `slow` ≤ `fast`, and their weights in parts of
/// [`WHOLE`]².
fn pairs(slow: Place, fast: Place) -> Vec<([usize; 2], u64)> {
    if slow.low == fast.low {
        let (low, high) = (slow.low, slow.low + 1);
        return vec![
            ([low, low], WHOLE * (WHOLE - fast.part)),
            ([low, high], WHOLE * (fast.part - slow.part)),
            ([high, high], WHOLE * slow.part),
        ];
    }
    let of_slow = |(a, of_a)| fast.ends().map(|(b, of_b)| ([a, b], of_a * of_b));
    slow.ends().into_iter().flat_map(of_slow).collect()
}

/// The value of a candidate among up to 32 measured ones around a scene: `times`
/// are its places on the table's first axes, the others are its rates. None if one
/// with a weight is missing.
///
/// On the careful side: half of how far the neighbours are from their mean, on
/// average, is added to it. A measured scene is itself, and where neighbours
/// agree nothing is added.
pub(super) fn value<const N: usize>(
    table: &Table,
    times: [Place; N],
    [slow, fast]: [Place; 2],
    candidate: usize,
) -> Option<u16> {
    let mut around = vec![(0, 1)];
    for (place, length) in times.into_iter().zip(table.lengths()) {
        let along = |(at, weight)| {
            place
                .ends()
                .map(|(n, part)| (at * length + n, weight * part))
        };
        around = around.into_iter().flat_map(along).collect();
    }
    let [rates, candidates] = [table.lengths()[N], table.lengths()[N + 2]];
    let mut weighted = Vec::new();
    for (at, weight) in around {
        for ([slow, fast], part) in pairs(slow, fast) {
            if weight * part > 0 {
                let cell = ((at * rates + slow) * rates + fast) * candidates + candidate;
                weighted.push((log2(table.cell(cell)?.into()), weight * part));
            }
        }
    }
    // All weights together are a power of two of at most 2^40, a logarithm is below
    // 2^20.
    let whole: u64 = weighted.iter().map(|(_, weight)| weight).sum();
    let mean = |of: &dyn Fn(u32) -> u32| {
        let sum: u64 = weighted
            .iter()
            .map(|(log, weight)| weight * u64::from(of(*log)))
            .sum();
        (sum / whole) as u32
    };
    let middle = mean(&|log| log);
    let apart = mean(&|log| log.abs_diff(middle));
    Some(exp2(middle + apart / 2))
}

/// log2 in 2^-16, a straight line between powers of two; 0 counts as 1.
fn log2(x: u32) -> u32 {
    let x = x.max(1);
    let whole = x.ilog2();
    // 2^16 to 2^17 − 1.
    let mantissa = (u64::from(x) << 16) >> whole;
    (whole << 16) + mantissa as u32 - (1 << 16)
}

/// Its inverse, up to 65,535.
fn exp2(log: u32) -> u16 {
    let (whole, fraction) = (log >> 16, log & 0xFFFF);
    if whole >= 16 {
        return u16::MAX;
    }
    let mantissa = u64::from(fraction) + (1 << 16);
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
        let on = |value| Place::on(&[1, 4, 16, 20], 0, value);
        for slow in 0..=20 {
            for fast in slow..=20 {
                let sum: u64 = pairs(on(slow), on(fast)).iter().map(|p| p.1).sum();
                assert_eq!(sum, WHOLE * WHOLE, "{slow} {fast}");
            }
            for ([a, b], weight) in pairs(on(slow), on(slow)) {
                assert!(a == b || weight == 0, "{slow} {a} {b}");
            }
        }
    }

    #[test]
    fn a_power_is_met_between_its_points() {
        // Errors 100·2^place over an axis of powers of four.
        let axis = [1u32, 4, 16, 64];
        let table = Table::by(&[4, 1, 1, 1], |cell| Some(100u16 << cell));
        let none = Place { low: 0, part: 0 };
        let at = |value| value_of(&table, Place::on(&axis, 0, value), none).unwrap();
        assert_eq!([at(1), at(4), at(64)], [100, 200, 800]);
        // Half a power of two apart from both: 283, and a quarter of it more.
        assert!((at(8)).abs_diff(336) < 20, "{}", at(8));
        let empty = Table::by(&[1, 1, 1, 1], |_| None);
        assert_eq!(value_of(&empty, none, none), None);
    }

    fn value_of(table: &Table, burst: Place, rate: Place) -> Option<u16> {
        value(table, [burst], [rate, rate], 0)
    }
}
