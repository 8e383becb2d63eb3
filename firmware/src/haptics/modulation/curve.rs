//! A quartic over a joint's range: its value at an angle, and its extremes.

use crate::arithmetic::division::quotient;
use crate::range::Range;
use crate::units::Angle;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Share C of a muscle's intensity over its joint's range, as it travels on the wire: the Bernstein
/// coefficients of a quartic, in millionths.
///
/// C(u) = Σ bₖ·(4 over k)·uᵏ·(1 − u)⁴⁻ᵏ, where u = 0 at the joint's lowest angle and 1 at its
/// highest. Every quartic in the angle (Buatier de Mongeot, equation 3) has exactly one
/// representation of this form. The form has three advantages: b₀ and b₄ are C at the ends of the
/// range; rounding to millionths changes C by at most half a millionth everywhere; and C lies
/// between the smallest and the largest bₖ, on any part of the range between those of that part, so
/// that its extremes can be enclosed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct QuarticSpec(pub [i32; 5]);

/// A quartic ready for evaluation: bₖ in 2^-26, below 2^30 by validation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Curve([i32; 5]);

/// Position of an angle in its joint's range, 2^-28: 0…1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct RangePosition(i32);

/// Value of C in 2^-26.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Share(i32);

/// Range of a joint's angles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    low: Angle,
    /// Length of the range as bits of [`Angle`]: 1…2^25.
    length: u32,
}

/// Extreme value of a quartic and its position.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Extreme {
    /// Value of C in 2^-32 millionths.
    value: i64,
    /// Position u in 2^-14, from the lowest to the highest angle.
    pub at: u16,
}

/// The value 1 in millionths.
const MILLION: i32 = 1_000_000;
/// Fraction bits of a millionth during the search for extremes.
const FINE: u32 = 32;
/// Number of halvings of the range after which a piece is not divided further.
const DEPTH: u32 = 14;
/// Largest amount by which the true extremes of a quartic may exceed those found, 2^-32 millionths:
/// a quarter of a millionth. On a piece of h = 2^-14 of the range, both the coefficients and C lie
/// within 2·h²·d of the piece's ends, where d is the largest second difference of the bₖ (half of
/// it from the polygon of the bₖ to C, 3/2 from C to its ends): at most 4·8·10⁶, so 0.24.
const SLACK: i64 = 1 << (FINE - 2);
/// Largest effect of rounding to millionths on C, 2^-32 millionths.
const ROUNDING: i64 = 1 << (FINE - 1);

impl Share {
    /// Returns this share of `amplitude` (below 2^18), rounded to nearest; 0 for a negative share.
    #[inline]
    pub(super) const fn scale(self, amplitude: u32) -> u32 {
        // Below 2^18 · 2^30.
        let part = amplitude as u64 * (if self.0 > 0 { self.0 } else { 0 }) as u64;
        ((part + (1 << 25)) >> 26) as u32
    }
}

impl Span {
    /// Creates the range from the lowest to the highest angle, m°, both already checked.
    pub(super) fn new(low_mdeg: i32, high_mdeg: i32) -> Self {
        let low = Angle::from_millideg(low_mdeg);
        let length = Angle::from_millideg(high_mdeg) - low;
        Self {
            low,
            length: length.get().to_bits().max(1).cast_unsigned(),
        }
    }

    /// Returns the position of `angle`; angles outside the range count as its nearer end.
    #[inline]
    pub(super) fn position_of(&self, angle: Angle) -> RangePosition {
        let way = (angle - self.low).get().to_bits().max(0).cast_unsigned();
        // Below 2^31 · 2^28.
        let along = quotient(u64::from(way) << 28, self.length).unwrap_or(u32::MAX);
        RangePosition(along.min(1 << 28).cast_signed())
    }
}

impl Curve {
    pub(super) fn new(spec: &QuarticSpec) -> Self {
        // At most 8·10⁶ · 2^26, over 10⁶; rounded down, by less than 2^-26.
        let q26 = |b: i32| ((i64::from(b) << 26).div_euclid(MILLION.into())) as i32;
        Self(spec.0.map(q26))
    }

    /// Evaluates C with de Casteljau's algorithm. The result is too small by less than 5·2^-26,
    /// because each step rounds down and none enlarges earlier errors. That is 7.5·10^-8, a
    /// thousandth of a bit of a 14-bit DAC and a 200th of a bit of a 16-bit DAC.
    #[inline]
    pub(super) const fn at(&self, u: RangePosition) -> Share {
        let [a, b, c, d, e] = self.0;
        let (a, b, c, d) = (
            interpolate(a, b, u),
            interpolate(b, c, u),
            interpolate(c, d, u),
            interpolate(d, e, u),
        );
        let (a, b, c) = (
            interpolate(a, b, u),
            interpolate(b, c, u),
            interpolate(c, d, u),
        );
        let (a, b) = (interpolate(a, b, u), interpolate(b, c, u));
        Share(interpolate(a, b, u))
    }
}

/// Interpolates from `a` to `b` by `u`, rounded down; the result lies between them.
#[inline(always)]
const fn interpolate(a: i32, b: i32, u: RangePosition) -> i32 {
    // |a|, |b| < 2^30, so the difference is below 2^31, and u is at most 2^28.
    let way = b.wrapping_sub(a) as i64 * u.0 as i64;
    a.wrapping_add((way >> 28) as i32)
}

impl QuarticSpec {
    /// Range of each coefficient of `lift`; it also applies to the field `drop`. A quartic that
    /// stays within 0…1 has no coefficient beyond −5.34…6.34 (those of Chebyshev's quartic, which
    /// are the largest: (1 ± 35/3)/2).
    pub const COEFFICIENT: Range = Range::new("lift", -8 * MILLION, 8 * MILLION);
    /// Range of C itself, millionths.
    pub const SHARE: Range = Range::new("lift", 0, MILLION);

    /// Returns the maximum of C, for coefficients within [`Self::COEFFICIENT`]. Over the whole
    /// range, not only at certain angles, C exceeds this maximum by at most a quarter of a
    /// millionth.
    #[must_use]
    pub fn highest(&self) -> Extreme {
        find_maximum(self.0.map(|b| i64::from(b) << FINE)).0
    }

    /// Returns the minimum of C, with the accuracy of [`Self::highest`].
    #[must_use]
    pub fn lowest(&self) -> Extreme {
        let (found, _) = find_maximum(self.0.map(|b| -(i64::from(b) << FINE)));
        Extreme {
            value: -found.value,
            ..found
        }
    }

    /// Returns an upper bound of C, for limits that must not be exceeded.
    pub(super) fn peak(&self) -> Share {
        // Converts millionths in 2^-32 to 1 in 2^-26; at most 8·10⁶ · 2^32, and 2^29 at the end.
        let above = self.highest().value + SLACK;
        Share((above.div_euclid(64 * i64::from(MILLION)) + 1) as i32)
    }
}

impl Extreme {
    /// Returns C at the extreme, millionths, rounded outwards: values outside 0…1 never become
    /// values inside.
    #[must_use]
    pub fn millionths(self) -> i32 {
        let floor = self.value >> FINE; // within ±8·10⁶
        let is_whole = floor << FINE == self.value;
        let up = !is_whole && self.value > 0;
        (floor + i64::from(up)) as i32
    }

    /// Returns whether C is below 0 or above 1 at the extreme by more than rounding of its
    /// coefficients can cause: half a millionth, which no amplitude shows.
    #[must_use]
    pub const fn is_outside(self) -> bool {
        self.value < -ROUNDING || self.value > ((MILLION as i64) << FINE) + ROUNDING
    }
}

/// A part of the range with its own coefficients.
#[derive(Clone, Copy)]
struct Piece {
    coefficients: [i64; 5],
    /// Start of the piece, as u in 2^-14.
    from: u16,
    /// Length of the piece, as a part of u in 2^-14.
    length: u16,
}

/// Returns the maximum, and the number of halvings. Pieces are halved while their coefficients,
/// which enclose them, allow a value that exceeds the largest value found by more than [`SLACK`].
fn find_maximum(coefficients: [i64; 5]) -> (Extreme, u32) {
    let [first, .., last] = coefficients;
    let mut best = Extreme {
        value: first,
        at: 0,
    };
    best.raise_to(last, 1 << DEPTH);
    let full_curve = Piece {
        coefficients,
        from: 0,
        length: 1 << DEPTH,
    };
    // At most one half of each length, and the present piece.
    let mut left: heapless::Vec<Piece, { DEPTH as usize + 1 }> = heapless::Vec::new();
    let mut piece = Some(full_curve);
    let mut halved = 0u32;
    while let Some(segment) = piece.take().or_else(|| left.pop()) {
        let [a, b, c, d, e] = segment.coefficients;
        let highest = a.max(b).max(c).max(d).max(e);
        if highest - best.value <= SLACK || segment.length < 2 {
            continue; // below 2^57
        }
        halved = halved.saturating_add(1);
        let (near, far) = segment.halves();
        let [middle, ..] = far.coefficients;
        best.raise_to(middle, far.from);
        let _ = left.push(far); // as many places as lengths
        piece = Some(near);
    }
    (best, halved)
}

impl Extreme {
    fn raise_to(&mut self, value: i64, at: u16) {
        if value > self.value {
            *self = Self { value, at };
        }
    }
}

impl Piece {
    /// Halves the piece (de Casteljau at ½). Values stay below 2^55 and never grow; each step
    /// rounds down by less than 2^-32 millionths, and 4·14 such errors are negligible.
    fn halves(&self) -> (Self, Self) {
        let [a, b, c, d, e] = self.coefficients;
        let half = |x: i64, y: i64| (x + y) >> 1;
        let (ab, bc, cd, de) = (half(a, b), half(b, c), half(c, d), half(d, e));
        let (abc, bcd, cde) = (half(ab, bc), half(bc, cd), half(cd, de));
        let (left, right) = (half(abc, bcd), half(bcd, cde));
        let middle = half(left, right);
        let length = self.length >> 1;
        let near = Self {
            coefficients: [a, ab, abc, left, middle],
            from: self.from,
            length,
        };
        let far = Self {
            coefficients: [middle, right, cde, de, e],
            from: self.from + length, // at most 2^14
            length,
        };
        (near, far)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::println;

    fn halved(millionths: [i32; 5]) -> u32 {
        find_maximum(millionths.map(|b| i64::from(b) << FINE)).1
    }

    /// The search ends in bounded time for every quartic: few pieces stay open on the way down,
    /// even if the quartic is almost flat.
    #[test]
    fn a_search_ends_soon() {
        let mut random = 0x9e37_79b9_7f4a_7c15_u64; // the seed
        let mut worst = (0, [0; 5]);
        for round in 0..400_000 {
            // Coefficients over their whole range, and ever flatter ones.
            let size = 8_000_000 >> (round % 24);
            let coefficients = [0; 5].map(|_: i32| {
                random = random.wrapping_mul(6_364_136_223_846_793_005);
                random = random.wrapping_add(1_442_695_040_888_963_407);
                ((random >> 33) as i64 * (2 * size + 1) / (1 << 31) - size) as i32
            });
            worst = worst.max((halved(coefficients), coefficients));
        }
        // Chebyshev's quartic: both ends as high as the middle, with flat parts in between.
        for twin in [[0, 8_000_000, -8_000_000, 8_000_000, 0], [1, -7, 12, -7, 1]] {
            worst = worst.max((halved(twin), twin));
        }
        println!("at most {} halvings, by {:?}", worst.0, worst.1);
        assert!((20..=60).contains(&worst.0), "{worst:?}");
    }
}
