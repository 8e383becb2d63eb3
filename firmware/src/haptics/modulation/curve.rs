//! A quartic over a joint's range: what it is at an angle, and its extremes.

use crate::arithmetic::division::quotient;
use crate::range::Range;
use crate::units::Angle;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A share C of a muscle's intensity over its joint's range, as it travels on the wire:
/// the Bernstein coefficients of a quartic, in millionths.
///
/// C(u) = Σ bₖ·(4 over k)·uᵏ·(1 − u)⁴⁻ᵏ, u = 0 at the joint's lowest angle and 1 at its
/// highest. Any quartic in the angle (Buatier de Mongeot, equation 3) is one of these and
/// no other. This form because b₀ and b₄ are C at the ends of the range; because
/// rounding to millionths moves C by half a millionth at most, wherever; and because C
/// lies between the least and the largest bₖ, on any part of the range by that part's
/// own, so that its extremes can be enclosed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct QuarticSpec(pub [i32; 5]);

/// A quartic ready to be evaluated: bₖ in 2^-26, below 2^30 by validation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Curve([i32; 5]);

/// Where in its joint's range an angle lies, 2^-28: 0…1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct RangePosition(i32);

/// C in 2^-26.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Share(i32);

/// The angles of a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    low: Angle,
    /// Bits of [`Angle`]: 1…2^25.
    length: u32,
}

/// A value that a quartic has, and where.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Extreme {
    /// C in 2^-32 millionths.
    value: i64,
    /// u in 2^-14.
    pub at: u16,
}

/// One.
const MILLION: i32 = 1_000_000;
/// Bits below a millionth while extremes are searched.
const FINE: u32 = 32;
/// Halvings of the range until a piece needs none.
const DEPTH: u32 = 14;
/// How far the extremes of a quartic may lie beyond those found, 2^-32 millionths: a
/// quarter of one. On a piece of h = 2^-14 of the range both the coefficients and C lie
/// within 2·h²·d of its ends, d the largest second difference of the bₖ (half of it from
/// the polygon of the bₖ to C, 3/2 from C to its ends): at most 4·8·10⁶, so 0.24.
const SLACK: i64 = 1 << (FINE - 2);
/// What rounding to millionths can do to C, 2^-32 millionths.
const ROUNDING: i64 = 1 << (FINE - 1);

impl Share {
    /// This share of `whole` (below 2^18), to the nearest; of a negative share 0.
    #[inline]
    pub(super) const fn scale(self, whole: u32) -> u32 {
        // Below 2^18 · 2^30.
        let part = whole as u64 * (if self.0 > 0 { self.0 } else { 0 }) as u64;
        ((part + (1 << 25)) >> 26) as u32
    }
}

impl Span {
    /// From the lowest to the highest angle, m°, checked.
    pub(super) fn new(low_mdeg: i32, high_mdeg: i32) -> Self {
        let low = Angle::from_millideg(low_mdeg);
        let length = Angle::from_millideg(high_mdeg) - low;
        Self {
            low,
            length: length.get().to_bits().max(1).cast_unsigned(),
        }
    }

    /// Where `angle` lies; outside the range at its nearer end.
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

    /// C, by de Casteljau: too small by less than 5·2^-26, for each step rounds down and
    /// none enlarges what came before. That is 7.5·10^-8, a thousandth of a bit of a
    /// 14-bit and a 200th of a 16-bit DAC.
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

/// From `a` to `b` by `u`, rounded down: between them.
#[inline(always)]
const fn interpolate(a: i32, b: i32, u: RangePosition) -> i32 {
    // |a|, |b| < 2^30, so the way is below 2^31, u at most 2^28.
    let way = b.wrapping_sub(a) as i64 * u.0 as i64;
    a.wrapping_add((way >> 28) as i32)
}

impl QuarticSpec {
    /// Of each coefficient, of a drop's as well: a quartic that keeps 0…1 has none beyond −5.34…6.34 (those of
    /// Chebyshev's, which are the largest: (1 ± 35/3)/2).
    pub const COEFFICIENT: Range = Range::new("lift", -8 * MILLION, 8 * MILLION);
    /// Of C itself, millionths.
    pub const SHARE: Range = Range::new("lift", 0, MILLION);

    /// Where C is largest, of coefficients within [`Self::COEFFICIENT`]: nowhere in the
    /// range is it larger by more than a quarter of a millionth, not even at one angle.
    #[must_use]
    pub fn highest(&self) -> Extreme {
        find_maximum(self.0.map(|b| i64::from(b) << FINE)).0
    }

    /// Where C is smallest; as [`Self::highest`].
    #[must_use]
    pub fn lowest(&self) -> Extreme {
        let (found, _) = find_maximum(self.0.map(|b| -(i64::from(b) << FINE)));
        Extreme {
            value: -found.value,
            ..found
        }
    }

    /// The largest C, for what must not be passed: enclosed from above.
    pub(super) fn peak(&self) -> Share {
        // Millionths in 2^-32 to 1 in 2^-26; at most 8·10⁶ · 2^32, and 2^29 at the end.
        let above = self.highest().value + SLACK;
        Share((above.div_euclid(64 * i64::from(MILLION)) + 1) as i32)
    }
}

impl Extreme {
    /// C, millionths, rounded away from 0…1.
    #[must_use]
    pub fn millionths(self) -> i32 {
        let floor = self.value >> FINE; // within ±8·10⁶
        let is_whole = floor << FINE == self.value;
        let up = !is_whole && self.value > 0;
        (floor + i64::from(up)) as i32
    }

    /// Whether C is below 0 or above 1 there by more than what rounding its coefficients
    /// can do: half a millionth, which no amplitude shows.
    #[must_use]
    pub const fn is_outside(self) -> bool {
        self.value < -ROUNDING || self.value > ((MILLION as i64) << FINE) + ROUNDING
    }
}

/// A part of the range with its own coefficients.
#[derive(Clone, Copy)]
struct Piece {
    coefficients: [i64; 5],
    /// Where it begins and how long it is, 2^-14.
    from: u16,
    length: u16,
}

/// The largest value: pieces are halved while their coefficients, which enclose them,
/// leave room for one larger by more than [`SLACK`] than any found. And how many were.
fn find_maximum(coefficients: [i64; 5]) -> (Extreme, u32) {
    let [first, .., last] = coefficients;
    let mut best = Extreme {
        value: first,
        at: 0,
    };
    best.raise_to(last, 1 << DEPTH);
    let whole = Piece {
        coefficients,
        from: 0,
        length: 1 << DEPTH,
    };
    // One half of each length at most, and the piece at hand.
    let mut left: heapless::Vec<Piece, { DEPTH as usize + 1 }> = heapless::Vec::new();
    let mut piece = Some(whole);
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
    /// Cut in the middle (de Casteljau at ½). Below 2^55 and never larger; each step rounds
    /// down by less than 2^-32 millionths, 4·14 of them by nothing that counts.
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

    /// Every quartic is searched in bounded time: few pieces stay open on the way down,
    /// also where it is as good as flat.
    #[test]
    fn a_search_ends_soon() {
        let mut random = 0x9e37_79b9_7f4a_7c15_u64; // the seed
        let mut worst = (0, [0; 5]);
        for round in 0..400_000 {
            // Coefficients over the whole of their range, and ever flatter ones.
            let size = 8_000_000 >> (round % 24);
            let coefficients = [0; 5].map(|_: i32| {
                random = random.wrapping_mul(6_364_136_223_846_793_005);
                random = random.wrapping_add(1_442_695_040_888_963_407);
                ((random >> 33) as i64 * (2 * size + 1) / (1 << 31) - size) as i32
            });
            worst = worst.max((halved(coefficients), coefficients));
        }
        // Both ends as high as the middle, on the way to it flat: Chebyshev's.
        for twin in [[0, 8_000_000, -8_000_000, 8_000_000, 0], [1, -7, 12, -7, 1]] {
            worst = worst.max((halved(twin), twin));
        }
        println!("at most {} halvings, by {:?}", worst.0, worst.1);
        assert!((20..=60).contains(&worst.0), "{worst:?}");
    }
}
