//! Force from pulses: the calcium–force model of Lee, Kim & Jung 2020,
//! Sensors 20, eqs. (2)–(3),
//!
//! ```text
//! dC/dt = u − C/τc            u: one unit impulse per pulse
//! dF/dt = A·gain·x − F/τ      x = C/(K + C),  τ = τ1 + τ2·x
//! ```
//!
//! Method: exponential time differencing at the midpoint. Over a step of h,
//! C decays exactly; x and τ are taken at the step's middle, and
//! F ← F + (1 − e^(−h/τ))·(A·gain·x·τ − F). Steps are 1 ms and are split at
//! each pulse's own microsecond. Source and decay share one 1 − e^(−z), so
//! that an error in it shifts time a little and never the steady force.
//!
//! Formats: `Q31`, `Q32` are fractions of 1 in 2^-31, 2^-32. C is U5F59: 32
//! holds K + C, and its tail must reach far below K = 0.002. F is Q63 of the
//! full scale A·(τ1 + τ2), which no force can pass; only its upper word is
//! ever read, the lower keeps what a step of 1 µs would otherwise lose.

use fixed::types::{I16F16, U5F27};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::exponential::{decay_fraction, mul_high};
use super::{Gain, OutOfRange, Parameter, within};
use crate::units::{Force, Micros};

/// The longest step, and the one whose factors are computed beforehand.
const TICK_US: u32 = 1000;

/// C of one pulse, U5F59.
const ONE_PULSE: u64 = 1 << 59;

/// Where C saturates, U5F59. The slowest τc allowed (100 ms) reaches 20.5 at
/// the fastest train allowed (200 Hz); with K ≤ 5 the sum K + C stays below 32.
const CALCIUM_MAX: u64 = 24 << 59;

/// One muscle's parameters, as a host sends them. Table 4 of Lee 2020 lists
/// ten subjects' (with τ2 of K06 misprinted: 176 ms, not 17.6).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct CalciumForceSpec {
    /// A, the force scaling factor at [`Gain::FULL`], mN/s: 100…10,000,000.
    pub a_mn_per_s: u32,
    /// K, the calcium level of half activation, millionths: 2,000…5,000,000.
    pub k_micro: u32,
    /// τc, decay of calcium, µs: 5,000…100,000.
    pub tau_c_us: u32,
    /// τ1, decay of force without calcium, µs: 2,000…200,000.
    pub tau1_us: u32,
    /// τ2, what full activation adds to τ1, µs: 1,000…1,000,000.
    pub tau2_us: u32,
}

/// What a step of some length h multiplies with; all Q32.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// e^(−h/2τc).
    to_middle: u32,
    /// e^(−h/τc).
    to_end: u32,
    /// h/(τ1 + τ2).
    length: u32,
}

/// A validated muscle: parameters and the constants derived from them. Any
/// number of [`CalciumForceState`]s can run on one.
///
/// Accuracy: for every subject of Lee's table 4 at 10–100 Hz the worst error
/// is below 0.012 % of the train's peak; `firmware/tests/muscle_accuracy.rs`
/// prints it. It grows with (1 ms/τ)², τ being the shortest time constant.
#[derive(Clone, Copy, Debug)]
pub struct CalciumForce {
    /// K, U5F27.
    k: u32,
    /// τ1/(τ1 + τ2), Q32.
    tau_floor: u32,
    /// 1 − `tau_floor`, Q32, so that no x can carry their sum past 1.
    tau_span: u32,
    /// 1 µs/2τc in 2^-42: below 2^29, as τc is 5 ms or more.
    half_decay_per_us: u32,
    /// 1 µs/(τ1 + τ2) in 2^-42: below 2^31, as τ1 + τ2 is 3 ms or more.
    length_per_us: u32,
    /// A step of 1 ms.
    tick: Step,
    /// A·(τ1 + τ2), N in Q16.16: below 12,000 N.
    full_scale: u32,
}

/// Where one muscle is. 32 bytes, freely copied.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CalciumForceState {
    /// C, U5F59, at most `CALCIUM_MAX` + 1.
    calcium: u64,
    /// F over full scale, Q63: 0 ≤ force < 2^63.
    force: i64,
    /// Gain of the last pulse that reached the muscle, Q31.
    gain: u32,
    /// The time all this holds for.
    at: Micros,
}

impl CalciumForceState {
    /// A muscle without calcium or force, at time `at`.
    #[must_use]
    pub const fn at_rest(at: Micros) -> Self {
        Self {
            calcium: 0,
            force: 0,
            gain: 0,
            at,
        }
    }

    /// Whether nothing is left of any pulse: calcium and force exactly zero.
    #[must_use]
    pub const fn is_at_rest(&self) -> bool {
        self.calcium == 0 && self.force == 0
    }

    /// C of eq. (2), in pulses: 0…25, rounded down to 2^-27.
    #[must_use]
    pub const fn calcium(&self) -> U5F27 {
        U5F27::from_bits((self.calcium >> 32) as u32)
    }

    /// The time the state holds for.
    #[must_use]
    pub const fn at(&self) -> Micros {
        self.at
    }
}

impl CalciumForce {
    /// Derives the constants of a muscle.
    ///
    /// # Errors
    /// [`OutOfRange`] naming the first parameter outside the range stated at
    /// [`CalciumForceSpec`]; within them no later computation can overflow.
    pub fn new(spec: CalciumForceSpec) -> Result<Self, OutOfRange> {
        spec.check()?;
        // Ranges above: τ1 + τ2 in 3,000…1,200,000 µs.
        let tau_us = (spec.tau1_us + spec.tau2_us) as u64;
        let tau_floor = (((spec.tau1_us as u64) << 32) / tau_us) as u32;
        // 10^7 mN/s · 1.2·10^6 µs · 2^16 = 7.9·10^17 fits; the quotient,
        // below 12,000 · 2^16, fits 32 bits.
        let full_scale = ((spec.a_mn_per_s as u64 * tau_us) << 16) / 1_000_000_000;
        let mut muscle = Self {
            // At most 5 · 2^27.
            k: (((spec.k_micro as u64) << 27) / 1_000_000) as u32,
            tau_floor,
            tau_span: u32::MAX - tau_floor,
            half_decay_per_us: ((1 << 41) / spec.tau_c_us as u64) as u32,
            length_per_us: ((1 << 42) / tau_us) as u32,
            tick: Step {
                to_middle: 0,
                to_end: 0,
                length: 0,
            },
            full_scale: full_scale as u32,
        };
        muscle.tick = muscle.step_of(TICK_US);
        Ok(muscle)
    }

    /// A pulse at `at`: lets time pass until then, adds 1 to C and drives the
    /// muscle with `gain` from now on (eq. 6). A pulse with [`Gain::ZERO`]
    /// reaches no fibre and leaves the muscle as it was. A pulse older than
    /// the state counts as of the state's time.
    pub fn pulse(&self, state: &mut CalciumForceState, at: Micros, gain: Gain) {
        self.advance(state, at);
        if gain == Gain::ZERO {
            return;
        }
        state.gain = gain.get().to_bits();
        // 25 · 2^59 < 2^64: C never starts above CALCIUM_MAX.
        state.calcium = state.calcium.wrapping_add(ONE_PULSE).min(CALCIUM_MAX);
    }

    /// Lets time pass until `to`, which may be up to 35 min ahead; an earlier
    /// time changes nothing.
    ///
    /// Costs one step per millisecond or part of one until the muscle is at
    /// rest, and nothing from then on. Rest comes, by the ranges of the
    /// parameters, within 7 s of the last pulse: no call takes more than
    /// 7,000 steps (2,500 for the muscles of table 4).
    pub fn advance(&self, state: &mut CalciumForceState, to: Micros) {
        let mut left_us = to.elapsed_since(state.at);
        if left_us == 0 {
            return;
        }
        state.at = to;
        while left_us > 0 && !state.is_at_rest() {
            let step = if left_us >= TICK_US {
                self.tick
            } else {
                self.step_of(left_us)
            };
            self.step(state, step);
            left_us = left_us.saturating_sub(TICK_US);
        }
    }

    /// The muscle's force, 0…12,000 N.
    #[must_use]
    pub const fn force(&self, state: &CalciumForceState) -> Force {
        // Q31 · Q16.16, rounded: below 2^31 · 2^30 + 2^30, so that the
        // shifted result fits 31 bits.
        let product = (state.force >> 32) as u64 * self.full_scale as u64;
        Force(I16F16::from_bits(((product + (1 << 30)) >> 31) as i32))
    }

    /// The factors of a step of `us` ≤ 1000 microseconds.
    #[inline(always)]
    fn step_of(&self, us: u32) -> Step {
        // us · 2^22 < 2^32; times 2^-42 and the upper word leaves 2^-32.
        let us = us << 22;
        // h/2τc is at most 0.1, within decay_fraction's domain.
        let to_middle = !decay_fraction(mul_high(us, self.half_decay_per_us));
        Step {
            to_middle,
            to_end: mul_high(to_middle, to_middle),
            length: mul_high(us, self.length_per_us),
        }
    }

    /// One step of the method at the head of this file.
    #[inline(always)]
    fn step(&self, state: &mut CalciumForceState, step: Step) {
        let (upper, lower) = ((state.calcium >> 32) as u32, state.calcium as u32);
        let middle = mul_high(upper, step.to_middle);
        // K + C < 32 (CALCIUM_MAX). x stays below 1: K/(K + C) is at least
        // 8.3e-5, reciprocal's error at most 2.5e-5.
        let (shift, inverse) = reciprocal(self.k.wrapping_add(middle));
        let x = scale(middle.wrapping_shl(shift), inverse);
        // Below 2^32, as floor + span is 2^32 − 1; above 0 by τ1 ≥ 2 ms.
        let tau = self.tau_floor.wrapping_add(mul_high(self.tau_span, x));
        // z = h/τ ≤ 1 ms/2 ms up to that error: within decay_fraction's
        // domain, which also keeps 1 − e^−z below half, an i32.
        let (shift, inverse) = reciprocal(tau);
        let share = decay_fraction(scale(step.length.wrapping_shl(shift), inverse)) as i32;
        // Q32 · Q32 · Q31 with gain ≤ 1: below 2^31, as is the force's word.
        let target = mul_high(mul_high(x, tau), state.gain) as i32;
        let way = target.wrapping_sub((state.force >> 32) as i32);
        // |way| < 2^31 and share < 2^31. F moves part of the way between two
        // values in 0…2^63, so it stays there.
        let change = i64::from(way).wrapping_mul(i64::from(share));
        state.force = state.force.wrapping_add(change);

        // C shrinks, so the sum fits. Always rounded down: C reaches zero.
        let carried = u64::from(mul_high(lower, step.to_end));
        state.calcium = (u64::from(upper) * u64::from(step.to_end)).wrapping_add(carried);
        if state.calcium >> 32 == 0 {
            state.calcium = 0; // below 2^-27 of a pulse
            if state.force >> 32 == 0 {
                state.force = 0; // below 2^-31 of full scale
            }
        }
    }
}

impl CalciumForceSpec {
    /// Each parameter against its documented range.
    fn check(&self) -> Result<(), OutOfRange> {
        within(Parameter::A, self.a_mn_per_s, 100, 10_000_000)?;
        within(Parameter::K, self.k_micro, 2_000, 5_000_000)?;
        within(Parameter::TauC, self.tau_c_us, 5_000, 100_000)?;
        within(Parameter::Tau1, self.tau1_us, 2_000, 200_000)?;
        within(Parameter::Tau2, self.tau2_us, 1_000, 1_000_000)
    }
}

/// For d > 0: how far to shift d left until its top bit is set, and about
/// 2^49 over the shifted d, within 2.5e-5 and without bias. One 32-bit
/// division: its error differs from step to step and averages out.
#[inline(always)]
fn reciprocal(d: u32) -> (u32, u32) {
    let shift = d.leading_zeros();
    // The middle of what 16 bits tell d apart from: 2^16…2^17, odd.
    let normal = (d.wrapping_shl(shift) >> 15) | 1;
    // The quotient is below 2^16; four times that plus two is its middle.
    (shift, (u32::MAX / normal).wrapping_mul(4).wrapping_add(2))
}

/// n/d in Q32 from n shifted as d was and d's [`reciprocal`]; n < d.
#[inline(always)]
fn scale(shifted: u32, inverse: u32) -> u32 {
    // 32 + 18 bits; the quotient is below 1.
    ((u64::from(shifted) * u64::from(inverse)) >> 17) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn division_keeps_its_bound_and_has_no_bias() {
        let (mut worst, mut sum, mut n) = (0f64, 0f64, 0f64);
        for i in 0..2_000_000u32 {
            let d = (1u32 << 31).wrapping_add(i.wrapping_mul(1_073));
            let (shift, inverse) = reciprocal(d);
            assert_eq!(shift, 0);
            let error = f64::from(inverse) * f64::from(d) / 2f64.powi(49) - 1.0;
            (worst, sum, n) = (worst.max(error.abs()), sum + error, n + 1.0);
        }
        std::println!("reciprocal: worst {worst:e}, mean {:e}", sum / n);
        assert!((1.25e-5..2.5e-5).contains(&worst), "{worst:e}");
        assert!((sum / n).abs() < 1e-6, "{:e}", sum / n);
    }
}
