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

/// The implicit (backward Euler) super-twisting law with anti-windup.
///
/// s = ė + λ·e in rad/s; r = √|s|; w = s / (|s| + h·b·k1·r + h²·b·k2);
/// v = u_a + (k1·r + 2·h·k2)·w; u_a grows by h·k2·w unless |v| > 1 and w would
/// push it further out. Effort is a fraction of the way from threshold to
/// maximum. b is the plant's assumed gain, h the period: with fixed b the law
/// is not invariant to its rate.
///
/// # Where [`super::LawSpec::RECOMMENDED`] comes from
/// `cargo test --release -p firmware --test control_finger -- --ignored
/// --nocapture` repeats the search: 240 candidates for each period of 11, 5 and
/// 2 ms over the four gains and the cutoff, judged by the mean RMSE of one- and
/// two-point tracking of 45 ± 40° at 0.2 Hz over 12 random simulated wearers
/// (±30 %), then shown on 40 others: 1.8°, 1.7° and 1.5°. The shortest period
/// was best and its gains, rounded, are the default. The same search gives the
/// PID 1.8° on those 40 and less than this law on the nominal finger (0.7°
/// against 1.2°, two-point): no general advantage of super-twisting is claimed.
/// All of it is simulation; no wearer has been driven with these gains.
#[derive(Clone, Copy, Debug)]
pub struct Recommended {
    lambda: Q,
    k1: Q,
    /// h·b·k1.
    hbk1: Q,
    /// h²·b·k2.
    hhbk2: Q,
    /// h·k2.
    hk2: Q,
}

impl Recommended {
    /// Gains in thousandths; ranges are checked by
    /// [`super::joint::Joint::new`].
    #[must_use]
    pub(super) fn new(lambda: u32, k1: u32, k2: u32, b: u32, period_ms: u8) -> Self {
        let [k1, k2, b, h] = [k1.into(), k2.into(), b.into(), u64::from(period_ms)];
        // Largest numerators: k1, k2 <= 1e5, b <= 1e6, h <= 20: 4e13.
        Self {
            lambda: ratio(lambda.into(), 1000),
            k1: ratio(k1, 1000),
            hbk1: ratio(h * b * k1, 1_000_000_000),
            hhbk2: ratio(h * h * b * k2, 1_000_000_000_000),
            hk2: ratio(h * k2, 1_000_000),
        }
    }

    /// One period further: fraction of the range, not clamped.
    pub fn step(&self, state: &mut TwistState, error: Angle, rate: AngularRate) -> Effort {
        // The surface is below 2^22 °/s.
        let s = product(surface(self.lambda, error, rate), RAD_PER_DEG).clamp(-S_MAX, S_MAX);
        // r <= 128, k1 <= 100, hbk1 <= 2000, hhbk2 <= 40, hk2 <= 2: no product
        // and no sum of them reaches 2^19.
        let r = square_root(s.abs());
        let w = quotient(s, s.abs() + product(self.hbk1, r) + self.hhbk2);
        let push = product(self.k1, r) + self.hk2 + self.hk2;
        let v = state.integral.saturating_add(product(push, w));
        let outward = (v > Q::ONE && w > Q::ZERO) || (v < -Q::ONE && w < Q::ZERO);
        if !outward {
            state.integral = state.integral.saturating_add(product(self.hk2, w));
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

/// Floor of the square root of 0 <= x <= [`S_MAX`], exact to the last bit;
/// 0 below.
fn square_root(x: Q) -> Q {
    let bits = x.to_bits().clamp(0, S_MAX.to_bits()).cast_unsigned();
    // bits <= 2^38, shifted <= 2^62; the root is <= 2^31.
    Q::from_bits(division::square_root(bits << Q::FRAC_NBITS).into())
}

/// s / d for |s| <= [`S_MAX`] and |s| <= d: within ±1, rounded towards 0; 0
/// for s = 0. Exact for d < 256, beyond that one bit too large now and then.
fn quotient(s: Q, d: Q) -> Q {
    if s == Q::ZERO {
        return Q::ZERO;
    }
    let (dividend, divisor) = (s.to_bits().unsigned_abs(), d.to_bits().unsigned_abs());
    // 0 < dividend <= divisor. Shifted until the divisor's top bit is that of
    // 64, no bit is lost; from below 256 all are in the upper half then.
    let shift = divisor.leading_zeros();
    let (dividend, divisor) = (dividend << shift, (divisor << shift >> 32) as u32);
    let fraction = division::quotient(dividend, divisor)
        .map_or(Q::ONE, |w| Q::from_bits((w >> (32 - Q::FRAC_NBITS)).into()));
    if s < Q::ZERO { -fraction } else { fraction }
}
