//! Super-twisting control of a joint angle: the paper's controller and the recommended one.
//!
//! The square root is that of the fixed-point bits: exact (floor), once per controller period. The
//! root of `micromath` would give the same bits on host and chip too (docs/evidence/methods.md), and the
//! control loop would tolerate it. But it is 0 to 6 % high, and its f32 has 24 bits, whereas the
//! argument here has up to 39. Its use would need conversions in both directions for a less
//! accurate root.

use super::differentiator::Differentiator;
use super::effort::Effort;
use super::integral::Integral;
use super::refusal::GAIN_MAX_MILLI;
use super::response::FeedbackAid;
use crate::arithmetic::division;
use crate::arithmetic::fixed_point::{Q, product, radians, ratio, saturated};
use crate::range::{OutOfRange, Range};
use crate::units::{Angle, AngularRate};
use core::cmp::Ordering;

/// Bound of the sliding variable: 2^14 (°/s or rad/s), far beyond any joint. It ensures that the
/// shifts below fit.
const S_MAX: Q = Q::from_bits(1 << (14 + Q::FRAC_NBITS));

/// State of [`Paper`]: its integral term u_a.
#[derive(Clone, Copy, Debug, Default)]
pub struct PaperState {
    integral: Q,
}

/// The controller of Hamana 2022: S = ė + λ·e, u = λ·√|S|·sgn S + u_a, u_a' = W·sgn S, with e =
/// θcmd − θres.
///
/// Equation (4) prints both terms with a minus. Together with (5) as printed this is positive
/// feedback, so the sign is reversed here. ρ is fixed at the paper's ½. As in the paper there is no
/// anti-windup: u_a grows by W·h per step, bounded only by the range of [`Q`].
///
/// The paper does not state the unit of angles. Degrees are assumed because all its figures and
/// tables are in degrees. Results do not decide the question: with radians the simulated finger
/// oscillates as well, a quarter less (one-point) or a tenth less (two-point). The effort is in
/// volts above threshold, as in (7)–(12).
#[derive(Clone, Copy, Debug)]
pub struct Paper {
    lambda: Q,
    /// Product W·h of gain and period, V.
    w_step: Q,
}

impl Paper {
    /// Range of λ, thousandths.
    pub const LAMBDA_MILLI: Range = Range::new("lambda_milli", 1, GAIN_MAX_MILLI);
    /// Range of W, thousandths of V/s.
    pub const W_MILLI: Range = Range::new("w_milli", 0, GAIN_MAX_MILLI);

    /// Validates gains in thousandths, as in [`super::LawSpec::Paper`].
    pub(super) fn new(lambda: u32, w: u32, period_ms: u8) -> Result<Self, OutOfRange> {
        Self::LAMBDA_MILLI.check(lambda)?;
        Self::W_MILLI.check(w)?;
        Ok(Self {
            lambda: ratio(lambda.into(), 1000),
            w_step: ratio(u64::from(w) * u64::from(period_ms), 1_000_000),
        })
    }

    /// Advances by one period, and returns the effort in volts above threshold, not clamped.
    pub fn step(&self, state: &mut PaperState, error: Angle, rate: AngularRate) -> Effort {
        let s = surface(self.lambda, error, rate).clamp(-S_MAX, S_MAX);
        // λ <= 100 and a root <= 128.
        let root = product(self.lambda, square_root(s.abs()));
        state.integral = state.integral.saturating_add(with_sign_of(self.w_step, s));
        Effort::AboveThreshold(with_sign_of(root, s).saturating_add(state.integral))
    }
}

/// The super-twisting algorithm alone, from a sliding variable to an effort, in the proper implicit
/// discretisation of Seeber & Andritsch (Automatica 173 (2025) 112027).
///
/// z ≥ 0 solves (1 + h·b·k3)·z + h·b·k1·√z + h²·b·k2 = |s|, and is 0 if |s| ≤ h²·b·k2. In that case
/// `growth` is s/(h·b), otherwise h·k2 with the sign of s. The effort is v + (k1·√z + k3·z)·sgn s +
/// 2·`growth`; then v grows by `growth`. The linear term is that of Moreno & Osorio (IEEE CDC
/// 2008); it is 0 in the paper. On σ' = b·(u + d) with |d'| ≤ L, k2 > L and k1 > √(k2 + L) (for b =
/// 1), the algorithm converges to |σ| ≤ L·h², the best possible bound; this arithmetic adds at most
/// 4 bits.
#[derive(Clone, Copy, Debug)]
pub struct SuperTwisting {
    /// Gain k1. Like all fields unless stated otherwise, it holds bits of [`Q`] below 2^32, so that
    /// each needs one short product.
    k1: u32,
    /// Gain k3.
    k3: u32,
    /// Factor 1 + h·b·k3, at most 8.
    slope: u32,
    /// Inverse of `slope`.
    flat: u32,
    /// Half of h·b·k1, at most 100.
    half: u32,
    /// Square of `half`, 2^-48.
    quarter: u64,
    /// Inverse 1/(h·b) in 2^-20, at most 1000.
    inverse: u32,
    /// Width h²·b·k2 of the boundary layer, at most 40.
    dead_beat: u32,
    /// Product h·k2, at most 2.
    hk2: u32,
}

/// Result of [`SuperTwisting::push`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Push {
    /// Value to add to the integral v for the effort now.
    pub push: Q,
    /// Growth of v until the next period.
    pub growth: Q,
}

/// Largest h·b·k1, which keeps the root's argument below 2^14.
const ROOT_GAIN_MAX: u64 = 200;
/// Largest h·b·k3, which keeps the root's argument below 2^14.
const LINEAR_GAIN_MAX: u64 = 7;

impl SuperTwisting {
    /// Range of b, thousandths.
    pub const B_MILLI: Range = Range::new("b_milli", 1_000, 1_000_000);

    /// Validates k1 (effort·s^-½), k2 (effort/s), b (rate of s per effort) and k3 (effort per s) in
    /// thousandths for a period of 1…20 ms.
    ///
    /// # Errors
    /// Returns the first value outside [`Self::k1_milli`], 0…100 000, [`Self::B_MILLI`],
    /// [`Self::k3_milli`] or [`Differentiator::STEP_MS`].
    pub fn new(k1: u32, k2: u32, b: u32, k3: u32, period_ms: u8) -> Result<Self, OutOfRange> {
        Differentiator::STEP_MS.check(period_ms)?;
        Self::B_MILLI.check(b)?;
        Self::k1_milli(b, period_ms).check(k1)?;
        Range::new("k2_milli", 0, GAIN_MAX_MILLI).check(k2)?;
        Self::k3_milli(b, period_ms).check(k3)?;
        let [k1, k2, b, k3, h] = [
            k1.into(),
            k2.into(),
            b.into(),
            k3.into(),
            u64::from(period_ms),
        ];
        // Largest numerators: h·b·k1 <= 2e11, h·h·b·k2 <= 400 · 1e6 · 1e5 = 4e13.
        let bits = |numerator, denominator| ratio(numerator, denominator).to_bits() as u32;
        let linear = h * b * k3; // <= 7e9
        let half = bits(h * b * k1, 2_000_000_000);
        Ok(Self {
            k1: bits(k1, 1000),
            k3: bits(k3, 1000),
            slope: bits(1_000_000_000 + linear, 1_000_000_000),
            flat: bits(1_000_000_000, 1_000_000_000 + linear),
            half,
            quarter: u64::from(half) * u64::from(half),
            inverse: (ratio(1_000_000, h * b).to_bits() >> 4) as u32,
            dead_beat: bits(h * h * b * k2, 1_000_000_000_000),
            hk2: bits(h * k2, 1_000_000),
        })
    }

    /// Returns the range of k1, thousandths, for this b and period: h·b·k1 <= 200.
    #[must_use]
    pub fn k1_milli(b_milli: u32, period_ms: u8) -> Range {
        let most = gain_max(ROOT_GAIN_MAX, b_milli, period_ms);
        Range::new("k1_milli", 1, GAIN_MAX_MILLI).with_max_at_most(most)
    }

    /// Returns the range of k3, thousandths, for this b and period: h·b·k3 <= 7.
    #[must_use]
    pub fn k3_milli(b_milli: u32, period_ms: u8) -> Range {
        let most = gain_max(LINEAR_GAIN_MAX, b_milli, period_ms);
        Range::new("k3_milli", 0, GAIN_MAX_MILLI).with_max_at_most(most)
    }

    /// Computes the response to the sliding variable `s`, which is bounded to ±128.
    #[must_use]
    pub fn push(&self, s: Q) -> Push {
        self.push_bits(saturated(s.to_bits()))
    }

    /// Computes the response to `s` in bits of [`Q`].
    #[inline(always)]
    fn push_bits(&self, s: i32) -> Push {
        let size = s.unsigned_abs(); // at most 2^31
        let (push, growth) = match size.checked_sub(self.dead_beat) {
            None | Some(0) => {
                // size <= dead_beat < 2^30, inverse < 2^30.
                let growth = (u64::from(self.inverse).wrapping_mul(u64::from(size))) >> 20;
                (0, growth.min(self.hk2.into()) as u32)
            }
            Some(rest) => (self.outer_push(rest), self.hk2),
        };
        // push < 2^38, growth < 2^26.
        let push = push.wrapping_add(u64::from(growth << 1)).cast_signed();
        let growth = i64::from(growth);
        // If s is negative, both are negated as two's complement.
        let sign = i64::from(s >> 31);
        Push {
            push: Q::from_bits((push ^ sign).wrapping_sub(sign)),
            growth: Q::from_bits((growth ^ sign).wrapping_sub(sign)),
        }
    }

    /// Computes k1·√z + k3·z for |s| − h²·b·k2 = `rest` <= 2^31.
    #[inline(always)]
    fn outer_push(&self, rest: u32) -> u64 {
        // quarter < 2^62 and rest · slope <= 2^58.
        let linear = u64::from(rest).wrapping_mul(u64::from(self.slope));
        let square = self.quarter.wrapping_add(linear);
        // The root is at least `half`, whose square is part of the argument, and below 2^31.
        let root = division::square_root(square).wrapping_sub(self.half);
        // flat <= 2^24; the result is √z with z <= 128, so below 2^28.
        let root = (u64::from(root).wrapping_mul(u64::from(self.flat)) >> Q::FRAC_NBITS) as u32;
        // k1, k3 < 2^31: gain < 2^35; its product with root is below 2^63.
        let linear = u64::from(self.k3).wrapping_mul(u64::from(root)) >> Q::FRAC_NBITS;
        let gain = linear.wrapping_add(self.k1.into());
        gain.wrapping_mul(root.into()) >> Q::FRAC_NBITS
    }
}

/// Returns the gain k, thousandths, for which h·b·k is `most`.
fn gain_max(most: u64, b_milli: u32, period_ms: u8) -> u32 {
    let hb = (u64::from(b_milli) * u64::from(period_ms)).max(1);
    (most * 1_000_000_000 / hb).min(u32::MAX.into()) as u32
}

/// [`SuperTwisting`] on the surface s = ė + λ·e in rad/s, with ki·e beside the sign in the
/// integral, a feed-forward, and anti-windup: the integral stays constant while the effort is
/// beyond ±1 and would grow further. The effort is a fraction of the range from threshold to
/// maximum.
///
/// # Source of [`super::LawSpec::RECOMMENDED`]
/// `flexor chart control --search` found these gains with 100 tries over 20 training wearers (the
/// nominal one, 7 earlier and 12 widened, one- and two-point), as for every other controller. One
/// set of gains serves all wearers: [`super::LawSpec::for_wearer`] scales it by the wearer's
/// strength. k1 was kept above 0.045 and k2 above 0.01, because an unconstrained search moves both
/// towards 0: on these fingers the linear terms, the feed-forward, the predictor and the learning
/// do the work, and no advantage of the super-twisting term over a PID is claimed. All of this is
/// simulation; no wearer has been driven with these gains.
///
/// [`super::LawSpec::ALONE`] is older: see `firmware/tests/control_finger`.
#[derive(Clone, Copy, Debug)]
pub struct Recommended {
    /// Gain λ as bits of [`Q`], below 2^31.
    lambda: i32,
    /// Product ki·h as bits of [`Q`], below 2^26.
    ki_step: i32,
    twist: SuperTwisting,
}

impl Recommended {
    /// Range of λ, thousandths.
    pub const LAMBDA_MILLI: Range = Range::new("lambda_milli", 100, GAIN_MAX_MILLI);
    /// Range of k2, thousandths.
    pub const K2_MILLI: Range = Range::new("k2_milli", 10, GAIN_MAX_MILLI);
    /// Range of ki, thousandths.
    pub const KI_MILLI: Range = Range::new("ki_milli", 0, GAIN_MAX_MILLI);

    /// Validates λ, ki and [k1, k2, b, k3] in thousandths, as in [`super::LawSpec::Recommended`].
    pub(super) fn new(
        lambda: u32,
        ki: u32,
        [k1, k2, b, k3]: [u32; 4],
        period_ms: u8,
    ) -> Result<Self, OutOfRange> {
        Self::LAMBDA_MILLI.check(lambda)?;
        SuperTwisting::B_MILLI.check(b)?;
        SuperTwisting::k1_milli(b, period_ms).check(k1)?;
        Self::K2_MILLI.check(k2)?;
        let twist = SuperTwisting::new(k1, k2, b, k3, period_ms)?;
        Self::KI_MILLI.check(ki)?;
        let ki_step = ratio(u64::from(ki) * u64::from(period_ms), 1_000_000);
        Ok(Self {
            lambda: ratio(lambda.into(), 1000).to_bits() as i32,
            ki_step: ki_step.to_bits() as i32,
            twist,
        })
    }

    /// Advances by one period with the given share of the feedback. Returns the effort as a
    /// fraction of the range, not clamped.
    #[inline]
    pub(super) fn step(
        &self,
        integral: &mut Integral,
        error: Angle,
        rate: AngularRate,
        aid: &FeedbackAid,
    ) -> Effort {
        let e = radians(error.get());
        // Both factors are below 2^31, so the product is below 2^62.
        let ahead = i64::from(self.lambda).wrapping_mul(i64::from(e)) >> Q::FRAC_NBITS;
        let s = saturated(ahead).saturating_add(radians(rate.get()));
        let Push { push, growth } = self.twist.push_bits(s);
        let by_error = i64::from(self.ki_step).wrapping_mul(i64::from(e)) >> Q::FRAC_NBITS;
        let growth = aid.scale_feedback(growth.wrapping_add(Q::from_bits(by_error)));
        let torque = aid.scale_feedback(push).wrapping_add(aid.forward);
        let side = aid.integral_side(torque);
        // Below 2^9 and 2^6, so nothing wraps.
        let v = integral.at(side).wrapping_add(torque);
        if !aid.delayed.clamps(v, growth) {
            integral.grow(side, growth);
        }
        Effort::Fraction(v)
    }
}

/// Computes ė + λ·e, in °/s: below 100 · 2^15 + 2^15 < 2^22.
fn surface(lambda: Q, error: Angle, rate: AngularRate) -> Q {
    product(Q::from_num(error.get()), lambda) + Q::from_num(rate.get())
}

/// Returns `size` with the sign of `s`, or 0 if `s` is 0.
fn with_sign_of(size: Q, s: Q) -> Q {
    match s.cmp(&Q::ZERO) {
        Ordering::Greater => size,
        Ordering::Equal => Q::ZERO,
        Ordering::Less => -size,
    }
}

/// Computes the floor of the square root for 0 <= x < 2^15, exact to the last bit; 0 for negative
/// x.
fn square_root(x: Q) -> Q {
    let bits = x.to_bits().clamp(0, 2 * S_MAX.to_bits()).cast_unsigned();
    // bits <= 2^39, so shifted <= 2^63, and the root is <= 2^32.
    Q::from_bits(division::square_root(bits << Q::FRAC_NBITS).into())
}
