//! Generic rules in fixed-point formats like those of the device: 32-bit high products, reciprocals
//! from a 16-bit division and a Newton step, and the device's exponential.
//!
//! Formats: `Qn` are 2^-n. C and K are U5F27; F is Q31 of A·τm with τm = τ1 + τ2; x and rates are
//! Q30. With n = K + C and m = K·τ1/τm + C, x = C/n and h/τ = (h/τm)·n/m. Over a step of h, in s of
//! 0…1, dF/ds = u − z·F with u = (h/τm)·x and z = h/τ. A step is at most 7/4 τ1, so that both are
//! below 2.

use core::marker::PhantomData;
use firmware::arithmetic::exponential::exp2_neg;
use firmware::muscle::CalciumForceSpec;

/// Calcium that one pulse adds to C: 1 in U5F27.
pub(super) const ONE_PULSE: u32 = 1 << 27;
/// Constant log2 e, Q31.
const LOG2_E: u64 = 3_098_164_009;

/// Returns the upper word of a product.
#[inline(always)]
pub(super) const fn high(a: u32, b: u32) -> u32 {
    ((a as u64 * b as u64) >> 32) as u32
}

/// Returns the product of two signed numbers without the lowest `dropped` bits, rounded to nearest.
/// The result must fit.
#[inline(always)]
const fn product(a: i32, b: i32, dropped: u32) -> i32 {
    let half = 1i64 << (dropped - 1);
    ((a as i64 * b as i64).wrapping_add(half) >> dropped) as i32
}

/// Computes 1/p for p in 0.25…1, Q32, as Q29, within 1.3e-7: the product of one 16-bit division and
/// one Newton step.
#[inline(always)]
const fn inverse(p: u32) -> u32 {
    let coarse = u32::MAX / ((p >> 16) | 1);
    // coarse·p − 1 in 2^-40 is below 2^-13, so its lower word contains the whole value.
    let above = (p >> 8).wrapping_mul(coarse) as i32;
    let less = ((coarse << 5) as i64 * above as i64) >> 32;
    (coarse << 13).wrapping_sub(less as u32)
}

/// Shifts left by a positive number of bits, right by a negative one; at most 31.
#[inline(always)]
const fn shifted(word: u32, left: i32) -> u32 {
    if left >= 0 {
        word.wrapping_shl(left.cast_unsigned())
    } else {
        word.wrapping_shr(left.unsigned_abs())
    }
}

/// Coefficients of the equation of F at one value of C, before the length of a step scales them.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    /// Share x of bound cross-bridges, Q29.
    x: u32,
    /// Ratio τm/τ = n/m, Q29, less the shift in `octaves`.
    ratio: u32,
    /// Left shift of `ratio`, 0…31.
    octaves: u32,
    /// Ratio m/n = τ/τm, Q29.
    inverse_ratio: u32,
}

/// Drive u and rate z at one place in a step, both Q30.
#[derive(Clone, Copy, Debug)]
pub struct Scaled {
    u: i32,
    z: i32,
}

impl Scaled {
    /// Returns dF/ds at the force `f` (Q31), Q30.
    #[inline(always)]
    pub(super) fn slope(&self, f: i32) -> i32 {
        self.u.wrapping_sub(product(self.z, f, 31))
    }
}

/// Constants that depend only on the length of a step.
#[derive(Clone, Copy, Debug)]
pub struct StepFactors {
    /// Ratio h/τm, Q32 with the top bit set.
    length: u32,
    /// Left shift of `length`, negative where h is shorter than τm.
    octaves: i32,
    /// Decay of C to the two places inside the step, and to its end, Q31.
    left: [u32; 3],
}

/// Rule that integrates F over a step along the exact C, in the formats of this module.
pub trait NativeRule {
    /// Places inside the step where the rule evaluates the equation, as parts of 2^28.
    const INSIDE: [u32; 2];
    /// Returns F (Q31) at the end of a step that begins with `f`. `ends` are the coefficients at
    /// both ends of the step, and `inside` those at the places inside it, with x·τ/τm, Q29.
    fn force(ends: [Scaled; 2], inside: [(Scaled, u32); 2], f: i32) -> i32;
}

/// Hermite–Simpson (see [`super::lobatto`]), as F1 − F0 = (g0 + 4gm + g1 − zm(g0 − g1)/2)/(6 + z1 +
/// zm(2 + z1/2)) with the slopes g at the force F0.
#[derive(Clone, Copy, Debug)]
pub struct NativeHermiteSimpson;

impl NativeRule for NativeHermiteSimpson {
    const INSIDE: [u32; 2] = [1 << 27; 2];
    #[inline(always)]
    fn force([begin, end]: [Scaled; 2], inside: [(Scaled, u32); 2], f: i32) -> i32 {
        let (middle, _) = inside[0];
        let (g0, gm, g1) = (begin.slope(f), middle.slope(f), end.slope(f));
        // An eighth of the numerator, Q30: each slope is below 2, so the sum is below 1.5.
        let sum = (g0 >> 3).wrapping_add(g1 >> 3).wrapping_add(gm >> 1);
        let bend = (g0 >> 1).wrapping_sub(g1 >> 1); // below 2
        let sum = sum.wrapping_sub(product(middle.z, bend, 30) >> 3);
        // A sixteenth of the denominator, Q32: 6/16 to 14/16.
        let both = product(middle.z, end.z, 31) as u32; // half of the product, Q30
        let over = 0x6000_0000u32
            .wrapping_add((end.z as u32) >> 2)
            .wrapping_add((middle.z as u32) >> 1)
            .wrapping_add(both >> 2);
        // Q30 · Q29 · 8/16 is Q60; the inverse is below 2.7.
        f.wrapping_add(product(sum, inverse(over) as i32, 29))
    }
}

/// Gauss exponential, see [`super::exponential::GaussExponential`].
#[derive(Clone, Copy, Debug)]
pub struct NativeGauss;

/// Returns e^−z for z ≥ 0 in Q30, as Q31.
#[inline(always)]
fn decay(z: u32) -> u32 {
    // Q30 · Q31 is Q61, below 2^64.
    exp2_neg(u64::from(z).wrapping_mul(LOG2_E) >> 29)
}

impl NativeRule for NativeGauss {
    const INSIDE: [u32; 2] = [56_727_087, 211_708_369];
    #[inline(always)]
    fn force(_: [Scaled; 2], inside: [(Scaled, u32); 2], f: i32) -> i32 {
        // The integral of the linear rate from a node n to the end of the step is (1 − n)·((1 −
        // m)·z0 + m·z1): z0/4 + 0.54·z1 from the first node, z1/4 − 0.04·z0 from the second, Q31.
        const MORE: u64 = 1_156_796_043;
        const LESS: u64 = 83_054_219;
        let [(begin, _), (end, _)] = inside;
        let rates = [begin.z as u64, end.z as u64];
        // Each product is below 2^62.
        let first = (rates[0] << 29).wrapping_add(rates[1].wrapping_mul(MORE)) >> 31;
        let second = (rates[1] << 29).saturating_sub(rates[0].wrapping_mul(LESS)) >> 31;
        let source = |u: i32, rest: u64| high(u as u32, decay(rest as u32)); // Q29
        let kept = decay((rates[0].wrapping_add(rates[1]) >> 1) as u32);
        let added = source(begin.u, first).wrapping_add(source(end.u, second)); // half of it is Q30
        let f = high(f as u32, kept) << 1;
        f.wrapping_add(added << 1) as i32
    }
}

/// Exponential midpoint, see [`super::exponential::EtdMidpoint`].
#[derive(Clone, Copy, Debug)]
pub struct NativeEtdMidpoint;

impl NativeRule for NativeEtdMidpoint {
    const INSIDE: [u32; 2] = [1 << 27; 2];
    #[inline(always)]
    fn force(_: [Scaled; 2], inside: [(Scaled, u32); 2], f: i32) -> i32 {
        let (middle, steady) = inside[0];
        let share = (1u32 << 31).wrapping_sub(decay(middle.z as u32));
        // The steady state is at most 1, as Q31 saturates.
        let goal = (steady << 2).min(i32::MAX as u32) as i32;
        f.wrapping_add(product(share as i32, goal.wrapping_sub(f), 31))
    }
}

/// A muscle that a rule integrates in the formats of this module.
#[derive(Clone, Copy, Debug)]
pub struct NativeMuscle<M> {
    /// Parameter K, U5F27.
    k: u32,
    /// Product K·τ1/τm, U5F59.
    floor: u64,
    /// Ratio 1 µs/τm, 2^-32 with the top bit set, and its left shift, negative.
    per_tau: (u32, i32),
    /// Octaves by which C falls in 1 µs, Q48.
    fall: u64,
    rule: PhantomData<M>,
}

impl<M: NativeRule> NativeMuscle<M> {
    /// Computes the constants of a muscle.
    pub(super) fn new(spec: &CalciumForceSpec) -> Self {
        let tau_m_us = f64::from(spec.tau1_us) + f64::from(spec.tau2_us);
        let k = f64::from(spec.k_micro) * 1e-6 * f64::from(ONE_PULSE);
        // 2^62/τm with its top bit moved to the top of a word.
        let per_us = (1u64 << 62) / u64::from(spec.tau1_us.saturating_add(spec.tau2_us)).max(1);
        let shift = per_us.leading_zeros();
        let whole = f64::from(1u32 << 31) * 2.0;
        Self {
            k: (k + 0.5) as u32,
            floor: (k * f64::from(spec.tau1_us) / tau_m_us * whole) as u64,
            per_tau: (
                ((per_us << shift) >> 32) as u32,
                2i32.wrapping_sub(shift.cast_signed()),
            ),
            fall: (core::f64::consts::LOG2_E / f64::from(spec.tau_c_us) * whole * 65_536.0) as u64,
            rule: PhantomData,
        }
    }

    /// Returns the longest step that the formats allow, µs.
    pub(super) fn longest_us(spec: &CalciumForceSpec) -> u32 {
        (spec.tau1_us / 4).saturating_mul(7).max(1)
    }

    /// Returns the factor by which C decays in `us` microseconds, Q31.
    #[inline(always)]
    pub(super) fn decay_in(&self, us: u32) -> u32 {
        // Below 2^36 (τc of 5 ms) times 2^18 µs.
        exp2_neg(self.fall.wrapping_mul(us.into()) >> 16)
    }

    /// Computes the constants of a step of `us` microseconds.
    #[inline(always)]
    pub(super) fn factors(&self, us: u32) -> StepFactors {
        let (per_us, octaves) = self.per_tau;
        let length = u64::from(us) * u64::from(per_us);
        let shift = length.leading_zeros();
        // At most 5.8 octaves, Q32, times Q28.
        let fall = self.fall.wrapping_mul(us.into()) >> 16;
        let octaves_of = |part: u32| fall.wrapping_mul(part.into()) >> 28;
        let [first, second] = const { M::INSIDE };
        let near = exp2_neg(octaves_of(first));
        let far = match first == second {
            true => near,
            false => exp2_neg(octaves_of(second)),
        };
        StepFactors {
            length: ((length << shift) >> 32) as u32,
            octaves: octaves.wrapping_add(32i32.wrapping_sub(shift.cast_signed())),
            left: [near, far, high(near, far) << 1],
        }
    }

    /// Returns the coefficients at `c`, U5F27.
    #[inline(always)]
    pub(super) fn coefficients(&self, c: u32) -> Coefficients {
        let n = self.k.wrapping_add(c); // below 2^32, as C is below 27
        let shift = n.leading_zeros() & 31;
        let n = n << shift;
        let m = (c << shift).wrapping_add(((self.floor << shift) >> 32) as u32);
        let octaves = m.leading_zeros() & 31;
        let per_n = inverse(n);
        Coefficients {
            x: high(c << shift, per_n),
            ratio: high(n, inverse(m << octaves)),
            octaves,
            inverse_ratio: high(m, per_n),
        }
    }

    /// Scales coefficients by the length of a step.
    #[inline(always)]
    pub(super) fn scaled(step: &StepFactors, at: &Coefficients) -> Scaled {
        let StepFactors {
            length, octaves, ..
        } = *step;
        // Both products are Q29.
        let z_octaves = octaves
            .wrapping_add(at.octaves.cast_signed())
            .wrapping_add(1);
        let u = shifted(high(at.x, length), octaves.wrapping_add(1));
        let z = shifted(high(at.ratio, length), z_octaves);
        Scaled {
            u: u as i32,
            z: z.min(i32::MAX as u32) as i32,
        }
    }

    /// Returns drive and rate, and the steady state x·τ/τm (Q29), where `left` of `c` is left.
    #[inline(always)]
    fn inside(&self, step: &StepFactors, c: u32, left: u32) -> (Scaled, u32) {
        let at = self.coefficients(high(c, left) << 1);
        (Self::scaled(step, &at), high(at.x, at.inverse_ratio) << 3)
    }

    /// Advances C (U5F27) and F (Q31) by one step, and returns them with the coefficients at its
    /// end.
    #[inline(always)]
    pub(super) fn step(
        &self,
        step: &StepFactors,
        here: &Coefficients,
        c: u32,
        f: i32,
    ) -> (u32, i32, Coefficients) {
        let first = self.inside(step, c, step.left[0]);
        let [near, far] = const { M::INSIDE };
        let second = if near == far {
            first
        } else {
            self.inside(step, c, step.left[1])
        };
        let end_c = high(c, step.left[2]) << 1;
        let end = self.coefficients(end_c);
        let ends = [Self::scaled(step, here), Self::scaled(step, &end)];
        let force = M::force(ends, [first, second], f);
        (end_c, force & !(force >> 31), end)
    }
}
