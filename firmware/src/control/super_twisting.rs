//! Super-twisting control of a joint angle: the paper's law and ours.
//!
//! The square root is that of the fixed-point bits: exact (floor), once per law
//! period. `micromath`'s would give the same bits on host and chip too
//! (docs/methods.md) and the loop would bear it, but it is 0 to 6 % high and its
//! f32 has 24 bits, where its argument here has up to 39: the law would be
//! converted there and back for a coarser root.

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

/// Bound of the sliding variable: 2^14 (°/s or rad/s), far beyond any joint.
/// It makes the shifts below provably fit.
const S_MAX: Q = Q::from_bits(1 << (14 + Q::FRAC_NBITS));

/// What [`Paper`] remembers: its integral term u_a.
#[derive(Clone, Copy, Debug, Default)]
pub struct PaperState {
    integral: Q,
}

/// The law of Hamana 2022: S = ė + λ·e, u = λ·√|S|·sgn S + u_a,
/// u_a' = W·sgn S, with e = θcmd − θres.
///
/// Equation (4) prints both terms with a minus; with (5) as printed that is
/// positive feedback, so the sign is turned. ρ is fixed at the paper's ½.
/// There is no anti-windup, as in the paper: u_a grows by W·h a step, without
/// bound but that of [`Q`].
///
/// The paper does not say in which unit angles enter. Degrees are assumed
/// because all its figures and tables are in degrees; results do not decide it:
/// with radians the simulated finger oscillates as well, a quarter less
/// (one-point) or a tenth less (two-point). Effort in volts above threshold, as
/// in (7)–(12).
#[derive(Clone, Copy, Debug)]
pub struct Paper {
    lambda: Q,
    /// W·h, V.
    w_step: Q,
}

impl Paper {
    /// Of λ.
    pub const LAMBDA_MILLI: Range = Range::new("lambda_milli", 1, GAIN_MAX_MILLI);
    /// Of W.
    pub const W_MILLI: Range = Range::new("w_milli", 0, GAIN_MAX_MILLI);

    /// Gains in thousandths, as in [`super::LawSpec::Paper`].
    pub(super) fn new(lambda: u32, w: u32, period_ms: u8) -> Result<Self, OutOfRange> {
        Self::LAMBDA_MILLI.check(lambda)?;
        Self::W_MILLI.check(w)?;
        Ok(Self {
            lambda: ratio(lambda.into(), 1000),
            w_step: ratio(u64::from(w) * u64::from(period_ms), 1_000_000),
        })
    }

    /// One period further: volts above threshold, not clamped.
    pub fn step(&self, state: &mut PaperState, error: Angle, rate: AngularRate) -> Effort {
        let s = surface(self.lambda, error, rate).clamp(-S_MAX, S_MAX);
        // λ <= 100 and a root <= 128.
        let root = product(self.lambda, square_root(s.abs()));
        state.integral = state.integral.saturating_add(with_sign_of(self.w_step, s));
        Effort::AboveThreshold(with_sign_of(root, s).saturating_add(state.integral))
    }
}

/// The super-twisting law alone, from a sliding variable to an effort, brought
/// to discrete time by the proper implicit form of Seeber & Andritsch
/// (Automatica 173 (2025) 112027).
///
/// z ≥ 0 solves (1 + h·b·k3)·z + h·b·k1·√z + h²·b·k2 = |s|, and is 0 if
/// |s| ≤ h²·b·k2, where `growth` is s/(h·b) and otherwise h·k2 with the sign of
/// s; the effort is v + (k1·√z + k3·z)·sgn s + 2·`growth`, then v grows by
/// `growth`. The linear term is Moreno & Osorio's (IEEE CDC 2008), 0 in the
/// paper. On σ' = b·(u + d) with |d'| ≤ L, k2 > L and k1 > √(k2 + L) (for b = 1),
/// it ends in |σ| ≤ L·h², which nothing betters; in this arithmetic within 4 bits
/// more.
#[derive(Clone, Copy, Debug)]
pub struct SuperTwisting {
    /// All in bits of [`Q`] but where said, below 2^32: one short product each.
    k1: u32,
    k3: u32,
    /// 1 + h·b·k3, at most 8, and its inverse.
    slope: u32,
    flat: u32,
    /// h·b·k1/2, at most 100, and its square in 2^-48.
    half: u32,
    quarter: u64,
    /// 1/(h·b) in 2^-20, at most 1000.
    inverse: u32,
    /// h²·b·k2, at most 40.
    dead_beat: u32,
    /// h·k2, at most 2.
    hk2: u32,
}

/// What [`SuperTwisting::push`] answers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Push {
    /// What to add to the integral v for the effort now.
    pub push: Q,
    /// By how much v grows until the next period.
    pub growth: Q,
}

/// Highest h·b·k1 and h·b·k3, which keep the root's argument below 2^14.
const ROOT_GAIN_MAX: u64 = 200;
const LINEAR_GAIN_MAX: u64 = 7;

impl SuperTwisting {
    /// Of b.
    pub const B_MILLI: Range = Range::new("b_milli", 1_000, 1_000_000);

    /// k1 (effort·s^-½), k2 (effort/s), b (rate of s per effort) and k3 (effort
    /// per s) in thousandths; period 1…20 ms.
    ///
    /// # Errors
    /// The first that is outside [`Self::k1_milli`], 0…100 000, [`Self::B_MILLI`],
    /// [`Self::k3_milli`] and [`Differentiator::STEP_MS`].
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

    /// Of k1 for this b and period: h·b·k1 <= 200.
    #[must_use]
    pub fn k1_milli(b_milli: u32, period_ms: u8) -> Range {
        let most = gain_max(ROOT_GAIN_MAX, b_milli, period_ms);
        Range::new("k1_milli", 1, GAIN_MAX_MILLI).with_max_at_most(most)
    }

    /// Of k3 for this b and period: h·b·k3 <= 7.
    #[must_use]
    pub fn k3_milli(b_milli: u32, period_ms: u8) -> Range {
        let most = gain_max(LINEAR_GAIN_MAX, b_milli, period_ms);
        Range::new("k3_milli", 0, GAIN_MAX_MILLI).with_max_at_most(most)
    }

    /// The answer to `s`, bounded to ±128.
    #[must_use]
    pub fn push(&self, s: Q) -> Push {
        self.push_bits(saturated(s.to_bits()))
    }

    /// The answer to `s` in bits of [`Q`].
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
        // Complement and one more, if s is negative.
        let sign = i64::from(s >> 31);
        Push {
            push: Q::from_bits((push ^ sign).wrapping_sub(sign)),
            growth: Q::from_bits((growth ^ sign).wrapping_sub(sign)),
        }
    }

    /// k1·√z + k3·z for |s| − h²·b·k2 = `rest` <= 2^31.
    #[inline(always)]
    fn outer_push(&self, rest: u32) -> u64 {
        // quarter < 2^62 and rest · slope <= 2^58.
        let linear = u64::from(rest).wrapping_mul(u64::from(self.slope));
        let square = self.quarter.wrapping_add(linear);
        // At least `half`, of whose square it is the root, and below 2^31.
        let root = division::square_root(square).wrapping_sub(self.half);
        // flat <= 2^24; what is left is √z: z <= 128, so below 2^28.
        let root = (u64::from(root).wrapping_mul(u64::from(self.flat)) >> Q::FRAC_NBITS) as u32;
        // k1, k3 < 2^31: gain < 2^35; times root below 2^63.
        let linear = u64::from(self.k3).wrapping_mul(u64::from(root)) >> Q::FRAC_NBITS;
        let gain = linear.wrapping_add(self.k1.into());
        gain.wrapping_mul(root.into()) >> Q::FRAC_NBITS
    }
}

/// The k in thousandths for which h·b·k is `most`.
fn gain_max(most: u64, b_milli: u32, period_ms: u8) -> u32 {
    let hb = (u64::from(b_milli) * u64::from(period_ms)).max(1);
    (most * 1_000_000_000 / hb).min(u32::MAX.into()) as u32
}

/// [`SuperTwisting`] on the surface s = ė + λ·e in rad/s, with ki·e beside the sign in the
/// integral, a feed-forward, and anti-windup: the integral rests while the effort
/// is beyond ±1 and would go further out. Effort is a fraction of the way from
/// threshold to maximum.
///
/// # Where [`super::LawSpec::RECOMMENDED`] comes from
/// `flexor chart control --search`: 100 tries over 20 training wearers, the nominal
/// one, 7 earlier and 12 widened, one- and two-point, as for every other law. One set
/// of numbers serves all: [`super::LawSpec::for_wearer`] scales it by the wearer's
/// strength. k1 was kept above 0.045 and k2 above 0.01; left free, a search sends both
/// towards 0: on these fingers the linear terms, the feed-forward, the predictor and
/// learning do the work, and no advantage of the super-twisting term over a PID is
/// claimed. All of it is simulation; no wearer has been driven with these gains.
///
/// [`super::LawSpec::ALONE`] is older: see `firmware/tests/control_finger`.
#[derive(Clone, Copy, Debug)]
pub struct Recommended {
    /// Bits of [`Q`], below 2^31.
    lambda: i32,
    /// ki·h, bits of [`Q`], below 2^26.
    ki_step: i32,
    twist: SuperTwisting,
}

impl Recommended {
    /// Of λ.
    pub const LAMBDA_MILLI: Range = Range::new("lambda_milli", 100, GAIN_MAX_MILLI);
    /// Of k2.
    pub const K2_MILLI: Range = Range::new("k2_milli", 10, GAIN_MAX_MILLI);
    /// Of ki.
    pub const KI_MILLI: Range = Range::new("ki_milli", 0, GAIN_MAX_MILLI);

    /// λ, ki and [k1, k2, b, k3] in thousandths, as in
    /// [`super::LawSpec::Recommended`].
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

    /// One period further, with this share of the feedback: fraction of the range,
    /// not clamped.
    #[inline]
    pub(super) fn step(
        &self,
        integral: &mut Integral,
        error: Angle,
        rate: AngularRate,
        aid: &FeedbackAid,
    ) -> Effort {
        let e = radians(error.get());
        // Below 2^31 each: the product is below 2^62.
        let ahead = i64::from(self.lambda).wrapping_mul(i64::from(e)) >> Q::FRAC_NBITS;
        let s = saturated(ahead).saturating_add(radians(rate.get()));
        let Push { push, growth } = self.twist.push_bits(s);
        let by_error = i64::from(self.ki_step).wrapping_mul(i64::from(e)) >> Q::FRAC_NBITS;
        let growth = aid.scale_feedback(growth.wrapping_add(Q::from_bits(by_error)));
        let torque = aid.scale_feedback(push).wrapping_add(aid.forward);
        let side = aid.integral_side(torque);
        // Below 2^9 and 2^6: nothing wraps.
        let v = integral.at(side).wrapping_add(torque);
        if !aid.delayed.clamps(v, growth) {
            integral.grow(side, growth);
        }
        Effort::Fraction(v)
    }
}

/// ė + λ·e, in °/s: below 100 · 2^15 + 2^15 < 2^22.
fn surface(lambda: Q, error: Angle, rate: AngularRate) -> Q {
    product(Q::from_num(error.get()), lambda) + Q::from_num(rate.get())
}

/// `size` with the sign of `s`; 0 if `s` is.
fn with_sign_of(size: Q, s: Q) -> Q {
    match s.cmp(&Q::ZERO) {
        Ordering::Greater => size,
        Ordering::Equal => Q::ZERO,
        Ordering::Less => -size,
    }
}

/// Floor of the square root of 0 <= x < 2^15, exact to the last bit; 0 below.
fn square_root(x: Q) -> Q {
    let bits = x.to_bits().clamp(0, 2 * S_MAX.to_bits()).cast_unsigned();
    // bits <= 2^39, shifted <= 2^63; the root is <= 2^32.
    Q::from_bits(division::square_root(bits << Q::FRAC_NBITS).into())
}
