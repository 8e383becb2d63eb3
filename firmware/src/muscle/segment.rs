//! A segment of the force curve, which is planned once and read at any time within it.
//!
//! Between pulses eq. (3) of Lee 2020 is linear in F with coefficients known in closed form. Over a
//! segment of h, in s = (t − t₀)/h,
//!
//! ```text
//! dF/ds = u − z·F      u = (h/τm)·gain·x,   z = h/τ      (F in A·τm)
//! ```
//!
//! The third stage pair of Lobatto IIIA (Hermite–Simpson) solves the equation in closed form from u
//! and z at both ends and in the middle; the cubic through F and dF/ds at both ends is the dense
//! output. The middle needs no division: with n = K + C and m = K·τ1/(τ1 + τ2) + C,
//!
//! ```text
//! x = C/n,   z = h/(τ1 + τ2)·n/m = h/(τ1 + τ2) + t
//! dx/ds = −(h/τc)·x·(1 − x),   dz/ds = (h/τc)·t·C/m
//! ```
//!
//! so cubics through both ends, with these slopes, give x and z in the middle to the fourth order.
//! One reciprocal of a product serves all four quotients.
//!
//! Formats: `Qn` are 2^-n. C and K are U5F27; F is Q31 of A·τm.

use super::spec::CalciumForceSpec;
use crate::arithmetic::division::quotient;
use crate::arithmetic::exponential::{decay, decay_around_middle, mul_high};
use crate::arithmetic::reciprocal::{inverse, signed_high, signed_high_rounded};

/// Calcium that one pulse adds to C: 1 in U5F27.
pub(super) const ONE_PULSE: u32 = 1 << 27;

/// Largest calcium C in the fixed-point format, at which C saturates; one pulse adds 1 to C. The
/// slowest τc allowed (100 ms) reaches 20.5 at the fastest train of single pulses allowed (200 Hz),
/// and [`CalciumForceSpec::check_train`] refuses bursts that exceed 24. With K ≤ 5 the sum K + C
/// stays below 32.
pub(super) const CALCIUM_END: u32 = 24;

/// Time before its end at which a segment is renewed, µs, so that no pulse comes after the end: one
/// control tick. No segment is shorter.
pub(super) const TICK_US: u32 = 1_000;
/// Longest segment, µs.
const LONGEST_US: u32 = 13_500;
/// Force of a muscle without calcium, Q31, below which it is rounded down, so that it falls in every
/// segment: above it, a segment takes at least two units away by itself (h/τ1 is 0.005 or more).
const SMALL_FORCE: i32 = 1 << 9;

/// Constants with which the segments of one muscle are planned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Time after its middle up to which a tick leaves a segment as it is, µs: h/2 less a
    /// [tick](TICK_US), for even h of 1,000…13,500 µs.
    pub(super) fresh_us: i32,
    /// Half the length of a segment, h/2, µs.
    pub(super) half_us: i32,
    /// Ratio 1 µs/h, Q32, rounded down, so that h times the ratio stays below 1.
    per_us: u32,
    /// Coefficients of the decay of C, d0 + s·(d1 + s·(d2 + s·(d3 + s·d4))) in Q31, for an s of
    /// −1/2…1/2: e^(−h/2τc), then the terms in s; the signs alternate.
    decay: [i32; 5],
    /// Decay e^(−h/τc) over the segment, Q32: 0.59 or more.
    to_end: u32,
    /// Ratio h/8τc, Q34: at most 0.065, below 2^31.
    slope: i32,
    /// Ratio h/τm, Q32: below 2^32.
    length: u32,
    /// Parameter K, U5F27.
    k: u32,
    /// Term K·τ1/(τ1 + τ2), U5F27 shifted left by `floor_shift` until its top bit is set.
    floor: u32,
    /// Number of bits by which `floor` is shifted left.
    floor_shift: u32,
    /// Rate h/(τ1 + τ2) less a millionth, Q31: below 1.
    fastest: i32,
    /// Term (h/(τ1 + τ2))·K·τ2/(τ1 + τ2), U5F27 shifted left by `span_shift`, as `floor` is.
    span: u32,
    /// Number of bits by which `span` is shifted left.
    span_shift: u32,
}

/// Force F over a segment, from its middle: f0 + f1·s + f2·s² + f3·s³ for an s of −1/2…1/2, Q31.
/// The highest power comes first, in the order of evaluation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Curve([i32; 4]);

impl Curve {
    /// Curve of a muscle without force.
    pub(super) const NONE: Self = Self([0; 4]);

    /// Returns F (Q31, at least 0) at the position s (Q32).
    #[inline(always)]
    pub(super) const fn at(&self, s: i32) -> i32 {
        let force = self.unrounded(s);
        force & !(force >> 31)
    }

    /// Returns F at s before the clamp at zero: rounding may leave a few units below zero.
    #[inline(always)]
    pub(super) const fn unrounded(&self, s: i32) -> i32 {
        // F and the intermediate values stay below 1, so no operation wraps.
        let [f3, f2, f1, f0] = self.0;
        let rest = f2.wrapping_add(signed_high_rounded(f3, s));
        let rest = f1.wrapping_add(signed_high_rounded(rest, s));
        f0.wrapping_add(signed_high_rounded(rest, s))
    }
}

/// Values at one end of a segment that follow from C and K.
struct End {
    /// Activation x, Q28.
    x: i32,
    /// Reciprocal 1/m, shifted: Q28.
    per_m: u32,
    /// Difference t = z − h/(τ1 + τ2), Q28.
    t: i32,
}

impl Segment {
    /// Returns h for a muscle, µs: a share of τc, for C, and of τ without and with calcium; less if
    /// both are short and K is large, so that force follows C closely. Errors grow with h⁴; the
    /// shares were found by experiment (docs/evidence/methods.md).
    fn max_length_us(spec: &CalciumForceSpec) -> u32 {
        // K/(K + 1) in 2^-10 is at most 853. Every product below stays under 2^31 by the ranges of
        // the parameters.
        let linear = spec.k_micro / 100 * 1024 / (spec.k_micro / 100 + 10_000);
        let of_calcium = spec.tau_c_us * 45 / 100;
        let span = spec.tau1_us * 13 / 2 / 64 * (2444 - linear) / 38;
        let of_force = (spec.tau1_us * 32 + spec.tau2_us.min(span) * 13) / 100;
        let of_force = of_force / 64 * (6132 - linear) / 96;
        let (less, more) = (of_calcium.min(of_force), of_calcium.max(of_force));
        // Above 600, as τ1 is 2 ms or more and τc 5 ms.
        let ratio = less * 1024 / more;
        let shorter = less * ratio / 1024 * linear / 1787;
        let h = less - shorter;
        // Muscles as slow and as sensitive as Lee's allow longer segments.
        let is_like_lees = spec.tau_c_us >= 10_000 && spec.k_micro <= 700_000;
        let h = if is_like_lees { h * 23 / 20 } else { h };
        h.min(spec.tau1_us).clamp(TICK_US, LONGEST_US) & !1
    }

    /// Derives the constants for the segments of a checked `spec`, without those that
    /// [`Self::retune`] sets.
    pub(super) fn new(spec: &CalciumForceSpec, tau_m_us: u32) -> Self {
        let us = Self::max_length_us(spec);
        // Each quotient fits by the ranges stated at the fields.
        let over =
            |numerator: u64, denominator: u32| quotient(numerator, denominator).unwrap_or(u32::MAX);
        // h/τc, Q32: at most 0.52.
        let z = over(u64::from(us) << 32, spec.tau_c_us);
        Self {
            fresh_us: (us / 2).cast_signed() - TICK_US.cast_signed(),
            half_us: (us / 2).cast_signed(),
            per_us: over((1 << 32) - 1, us),
            decay: decay_around_middle(z),
            // Below 2^31, as z is above 0.
            to_end: decay(z) << 1,
            slope: (z >> 1) as i32,
            length: over(u64::from(us) << 32, tau_m_us),
            k: 0,
            floor: 0,
            floor_shift: 0,
            fastest: 0,
            span: 0,
            span_shift: 0,
        }
    }

    /// Adapts the segments to K (U5F27), τ1 and τ2 (over τm, Q32; their sum below 2^32).
    pub(super) fn retune(&mut self, k: u32, tau1: u32, tau2: u32) {
        let tau_sum = tau1.saturating_add(tau2);
        let share = |tau: u32| quotient(u64::from(tau) << 32, tau_sum).unwrap_or(u32::MAX);
        let fastest = quotient(u64::from(self.length) << 31, tau_sum).unwrap_or(0);
        // A millionth less, so that z stays below 1 if h equals τ1.
        let fastest = fastest - (fastest >> 20);
        let (floor, floor_shift) = normalize(u64::from(share(tau1)) * u64::from(k));
        let (span, shift) = normalize(u64::from(share(tau2)) * u64::from(k));
        let (span, more) = normalize(u64::from(span) * u64::from(fastest));
        self.k = k;
        (self.floor, self.floor_shift) = (floor, floor_shift);
        self.fastest = fastest as i32;
        // The format Q31 leaves a shift by one.
        (self.span, self.span_shift) = (span, (shift + more).saturating_sub(1));
    }

    /// Returns the drive of F by a pulse of `gain` (Q31): h/τm·gain, Q31.
    #[inline(always)]
    pub(super) const fn drive(&self, gain: u32) -> i32 {
        mul_high(self.length, gain) as i32 // below 2^31
    }

    /// Returns the position s of a [`Curve`], Q32, at a time since the segment's middle, µs.
    #[inline(always)]
    pub(super) fn place(&self, since_middle_us: i32) -> i32 {
        // Within half a segment, so |s| is at most 1/2.
        since_middle_us.wrapping_mul(self.per_us.cast_signed())
    }

    /// Returns the part of `calcium` that is left at `place`.
    #[inline(always)]
    pub(super) fn decayed_calcium(&self, calcium: u32, place: i32) -> u32 {
        // At most 1 at the beginning, and never below 0.6, so no sum wraps. Rounding down lets the
        // calcium reach zero.
        let [d0, d1, d2, d3, d4] = self.decay;
        let rest = d3.wrapping_add(signed_high(d4, place));
        let rest = d2.wrapping_add(signed_high(rest, place));
        let rest = d1.wrapping_add(signed_high(rest, place));
        let left = d0.wrapping_add(signed_high(rest, place));
        mul_high(calcium, (left as u32) << 1)
    }

    /// Plans the segment that begins with `force`, `calcium` (U5F27, at most 24) and the `drive` of
    /// the last pulse.
    ///
    /// No sum wraps: z and u are below 1 by the choice of h, and F ≤ 1, so slopes stay below 1; the
    /// curve's coefficients are at most the sums of these.
    #[inline(always)]
    pub(super) fn plan(&self, force: i32, calcium: u32, drive: i32) -> Curve {
        let (begin, end, turn) = self.ends(calcium);
        let (z0, z1) = (self.rate(&begin), self.rate(&end));
        const ONE: i32 = 1 << 28;
        // x0 − x1 and z0 − z1 times the complement to 1: slopes over h/τc, Q24.
        let x_sum = begin.x.wrapping_add(end.x);
        let x_bend = signed_high(begin.x.wrapping_sub(end.x), ONE.wrapping_sub(x_sum));
        let turn = mul_high(turn, begin.per_m.wrapping_add(end.per_m)) as i32;
        let z_bend = signed_high(begin.t.wrapping_sub(end.t), ONE.wrapping_sub(turn));
        // Values in the middle, Q31.
        let xm = (x_sum << 2).wrapping_sub(signed_high(x_bend, self.slope) << 5);
        let z_mean = (z0 as u32).wrapping_add(z1 as u32) >> 1;
        let zm = (z_mean as i32).wrapping_add(signed_high(z_bend, self.slope) << 5);
        // dF/ds with F as at the beginning, Q30; one product and one sum in one instruction.
        let less = force.wrapping_neg();
        let slope = |x: i32, z: i32| {
            signed_high_rounded(drive, x).wrapping_add(signed_high_rounded(z, less))
        };
        let g0 = slope(begin.x << 3, z0);
        let gm = slope(xm, zm);
        let g1 = slope(end.x << 3, z1);
        // F1 − F0 = (g0 + 4gm + g1 − zm(g0 − g1)/2)/(6 + z1 + zm(2 + z1/2)): numerator over 4 in
        // Q30, denominator over 16 in Q32.
        let sum = (g0.wrapping_add(g1) >> 2).wrapping_add(gm);
        let sum = sum.wrapping_sub(signed_high(zm, g0.wrapping_sub(g1)) >> 2);
        let over = 0x6000_0000u32
            .wrapping_add((z1 >> 3) as u32)
            .wrapping_add((zm >> 2) as u32)
            .wrapping_add((signed_high(zm, z1) >> 3) as u32);
        let rise = signed_high_rounded(sum, inverse(over) as i32); // Q29
        let end_slope = g1.wrapping_sub(signed_high(z1, rise) << 2);
        let bend = end_slope.wrapping_sub(g0);
        let turn = g0.wrapping_add(end_slope).wrapping_sub(rise << 2) << 1;
        let slope = (rise << 2).wrapping_sub(turn >> 2);
        let middle = force.wrapping_add(rise << 1).wrapping_sub(bend >> 2);
        Curve([turn, bend, slope, middle])
    }

    /// Plans the segment of a muscle without calcium that begins with `force`. Its curve is linear in
    /// `force`, so it is planned in the finest unit that has room and then rounded: in Q31 itself,
    /// rounding would keep a small force from ever falling.
    #[cold]
    #[inline(never)]
    pub(super) fn plan_decay(&self, force: i32) -> Curve {
        if force <= 0 {
            return Curve::NONE;
        }
        // At most 29: a smaller force then begins at bit 29.
        let shift = force.leading_zeros().saturating_sub(2);
        let Curve(fine) = self.plan(force << shift, 0, 0);
        let rounding = if force < SMALL_FORCE {
            0
        } else {
            (1 << shift) / 2
        };
        Curve(fine.map(|power| power.wrapping_add(rounding) >> shift))
    }

    /// Returns the rate z = h/τ at one end of a segment, Q31.
    #[inline(always)]
    const fn rate(&self, end: &End) -> i32 {
        self.fastest.wrapping_add(end.t << 3)
    }

    /// Computes both ends of a segment that begins with `calcium`, and K·τ1/(τ1 + τ2) with the same
    /// shift.
    #[inline(always)]
    fn ends(&self, calcium: u32) -> (End, End, u32) {
        let later = mul_high(calcium, self.to_end);
        // Both are shifted alike, until the first has its top bit set, Q32: the second is 0.59 of
        // the first or more. Setting the lowest bit shows the compiler that shifts are below 32.
        let n0 = self.k.wrapping_add(calcium) | 1;
        let up = n0.leading_zeros();
        let (n0, n1) = (n0 << up, self.k.wrapping_add(later) << up);
        let (c0, c1) = (calcium << up, later << up);
        let floor = self.floor.wrapping_shr(self.floor_shift.wrapping_sub(up));
        let (m0, m1) = (c0.wrapping_add(floor) | 1, c1.wrapping_add(floor));
        let more = m0.leading_zeros();
        let (m0, m1) = (m0 << more, m1 << more);
        let shift = self.span_shift.wrapping_sub(up.wrapping_add(more));
        let span = self.span.wrapping_shr(shift);

        let (p0, p1) = (mul_high(n0, m0), mul_high(n1, m1));
        let product = mul_high(p0, p1) | 1; // 0.02 or more
        let last = product.leading_zeros();
        // 1/p0 and 1/p1 in Q28: at most 4 and 12.
        let inverse_product = inverse(product << last) >> 1;
        let (per0, per1) = (
            mul_high(inverse_product, p1) << last,
            mul_high(inverse_product, p0) << last,
        );
        let end = |c: u32, n: u32, m: u32, per: u32| {
            let per_m = mul_high(n, per);
            End {
                x: mul_high(c, mul_high(m, per)) as i32,
                per_m,
                t: mul_high(span, per_m) as i32,
            }
        };
        (end(c0, n0, m0, per0), end(c1, n1, m1, per1), floor << more)
    }
}

/// Converts a product in Q59 to U5F27, shifted left until its top bit is set. Returns it with the
/// shift.
const fn normalize(product: u64) -> (u32, u32) {
    let shift = product.leading_zeros();
    (((product << (shift & 63)) >> 32) as u32, shift)
}
