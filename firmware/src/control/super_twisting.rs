//! Super-twisting control of a joint angle: the paper's law and ours.
//!
//! The square root is that of the fixed-point bits: exact (floor) and the same
//! on every machine, once per law period. `micromath`'s, up to 6 % high, would
//! make host and chip differ and gain nothing here.

use super::law::{Effort, Q, RAD_PER_DEG, product, ratio};
use crate::division;
use crate::units::{Angle, AngularRate};
use core::cmp::Ordering;

/// Bound of the sliding variable: 2^14 (°/s or rad/s), far beyond any joint.
/// It makes the shifts below provably fit.
const S_MAX: Q = Q::from_bits(1 << (14 + Q::FRAC_NBITS));

/// What either law remembers: its integral term u_a.
#[derive(Clone, Copy, Debug, Default)]
pub struct TwistState {
    integral: Q,
}

impl TwistState {
    /// The integral term u_a, in the law's unit.
    #[must_use]
    pub fn integral(&self) -> Q {
        self.integral
    }
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
    /// Gains in thousandths; ranges are checked by
    /// [`super::joint::Joint::new`].
    #[must_use]
    pub(super) fn new(lambda_milli: u32, w_milli: u32, period_ms: u8) -> Self {
        Self {
            lambda: ratio(lambda_milli.into(), 1000),
            w_step: ratio(u64::from(w_milli) * u64::from(period_ms), 1_000_000),
        }
    }

    /// One period further: volts above threshold, not clamped.
    pub fn step(&self, state: &mut TwistState, error: Angle, rate: AngularRate) -> Effort {
        let s = surface(self.lambda, error, rate).clamp(-S_MAX, S_MAX);
        // λ <= 100 and a root <= 128.
        let root = product(self.lambda, square_root(s.abs()));
        state.integral = state.integral.saturating_add(signed(self.w_step, s));
        Effort::AboveThreshold(signed(root, s).saturating_add(state.integral))
    }
}

/// The super-twisting law alone, from a sliding variable to an effort, brought
/// to discrete time by the proper implicit form of Seeber & Andritsch
/// (Automatica 173 (2025) 112027).
///
/// z ≥ 0 solves z + h·b·k1·√z + h²·b·k2 = |s|, and is 0 if |s| ≤ h²·b·k2, where
/// `growth` is s/(h·b) and otherwise h·k2 with the sign of s; the effort is
/// v + k1·√z·sgn s + 2·`growth`, then v grows by `growth`. On σ' = b·(u + d) with
/// |d'| ≤ L, k2 > L and k1 > √(k2 + L) (for b = 1), it ends in |σ| ≤ L·h²,
/// which nothing betters; in this arithmetic within 4 bits more.
#[derive(Clone, Copy, Debug)]
pub struct Twist {
    k1: Q,
    /// h·b·k1/2 and its square.
    half: Q,
    quarter: Q,
    /// 1/(h·b).
    inverse: Q,
    /// h²·b·k2.
    dead_beat: Q,
    /// h·k2.
    hk2: Q,
}

/// What [`Twist::push`] answers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Push {
    /// What to add to the integral v for the effort now.
    pub push: Q,
    /// By how much v grows until the next period.
    pub growth: Q,
}

/// Highest h·b·k1, which keeps the squares below 2^15.
const ROOT_GAIN_MAX: u64 = 200;

impl Twist {
    /// k1 (effort·s^-½), k2 (effort/s) and b (rate of s per effort) in
    /// thousandths, 1…100 000, 0…100 000 and 1000…1 000 000; period 1…20 ms.
    /// `None` outside these, or if h·b·k1 exceeds 200.
    #[must_use]
    pub fn new(k1_milli: u32, k2_milli: u32, b_milli: u32, period_ms: u8) -> Option<Self> {
        let valid = (1..=100_000).contains(&k1_milli)
            && k2_milli <= 100_000
            && (1000..=1_000_000).contains(&b_milli)
            && (1..=20).contains(&period_ms)
            && k1_milli <= Self::k1_max_milli(b_milli, period_ms);
        if !valid {
            return None;
        }
        let [k1, k2] = [k1_milli.into(), k2_milli.into()];
        let [b, h] = [b_milli.into(), u64::from(period_ms)];
        // Largest numerator: h·h·b·k2 <= 400 · 1e6 · 1e5 = 4e13.
        let half = ratio(h * b * k1, 2_000_000_000);
        Some(Self {
            k1: ratio(k1, 1000),
            half,
            // half <= 100.
            quarter: product(half, half),
            inverse: ratio(1_000_000, h * b),
            dead_beat: ratio(h * h * b * k2, 1_000_000_000_000),
            hk2: ratio(h * k2, 1_000_000),
        })
    }

    /// Highest k1 for this b and period, thousandths.
    pub(super) fn k1_max_milli(b_milli: u32, period_ms: u8) -> u32 {
        let hb = (u64::from(b_milli) * u64::from(period_ms)).max(1);
        // At most 100 000.
        (ROOT_GAIN_MAX * 1_000_000_000 / hb).min(100_000) as u32
    }

    /// The answer to `s`, bounded to ±2^14.
    #[must_use]
    pub fn push(&self, s: Q) -> Push {
        let s = s.clamp(-S_MAX, S_MAX);
        let size = s.abs();
        let rest = size - self.dead_beat;
        let (push, growth) = if rest <= Q::ZERO {
            // size <= dead_beat <= 40, inverse <= 1000.
            (Q::ZERO, product(self.inverse, size).min(self.hk2))
        } else {
            // Below 2^15; the root is at least `half` but for one bit.
            let root = square_root(self.quarter + rest) - self.half;
            // root <= 128, k1 <= 100.
            (product(self.k1, root.max(Q::ZERO)), self.hk2)
        };
        Push {
            push: signed(push + growth + growth, s),
            growth: signed(growth, s),
        }
    }
}

/// [`Twist`] on the surface s = ė + λ·e in rad/s, with anti-windup: the
/// integral rests while the effort is beyond ±1 and would go further out.
/// Effort is a fraction of the way from threshold to maximum.
#[derive(Clone, Copy, Debug)]
pub struct Recommended {
    lambda: Q,
    twist: Twist,
}

impl Recommended {
    /// λ in thousandths, 100…100 000.
    #[must_use]
    pub(super) fn new(lambda_milli: u32, twist: Twist) -> Self {
        Self {
            lambda: ratio(lambda_milli.into(), 1000),
            twist,
        }
    }

    /// One period further: fraction of the range, not clamped.
    pub fn step(&self, state: &mut TwistState, error: Angle, rate: AngularRate) -> Effort {
        // The surface is below 2^22 °/s.
        let s = product(surface(self.lambda, error, rate), RAD_PER_DEG);
        let Push { push, growth } = self.twist.push(s);
        let v = state.integral.saturating_add(push);
        let outward = (v > Q::ONE && growth > Q::ZERO) || (v < -Q::ONE && growth < Q::ZERO);
        if !outward {
            state.integral = state.integral.saturating_add(growth);
        }
        Effort::Fraction(v)
    }
}

/// ė + λ·e, in °/s: below 100 · 2^15 + 2^15 < 2^22.
fn surface(lambda: Q, error: Angle, rate: AngularRate) -> Q {
    product(Q::from_num(error.0), lambda) + Q::from_num(rate.0)
}

/// `size` with the sign of `s`; 0 if `s` is.
fn signed(size: Q, s: Q) -> Q {
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
