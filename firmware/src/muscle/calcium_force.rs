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
//! F ← F + (1 − e^(−h/τ))·(A·gain·x·τ − F). Steps are 1 ms; a pulse parts its
//! step at its own microsecond, each part with its own middle. Source and
//! decay share one 1 − e^(−z), so that an error in it shifts time a little and
//! never the steady force.
//!
//! Formats: `Q31`, `Q32` are fractions of 1 in 2^-31, 2^-32. C is U5F59: 32
//! holds K + C, and its tail must reach far below K = 0.002. F is Q63 of the
//! full scale A·(τ1 + τ2), which no force can pass; only its upper word is
//! ever read, the lower keeps what a step of 1 µs would otherwise lose.

use core::sync::atomic::{Ordering, compiler_fence};

use fixed::types::I16F16;

use super::Gain;
use super::calcium_state::{self, CALCIUM_MAX_UPPER, CalciumForceState};
use super::spec::CalciumForceSpec;
use crate::arithmetic::exponential::{decay, decay_fraction, lag, mul_high};
use crate::arithmetic::reciprocal::Reciprocal;
use crate::range::OutOfRange;
use crate::units::{Force, Micros};

/// The longest step, and the one whose factors are computed beforehand.
pub(super) const TICK_US: u32 = 1000;

/// What a step of some length h multiplies with; all Q32.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// e^(−h/2τc).
    to_middle: u32,
    /// e^(−h/τc).
    to_end: u32,
    /// h/τm.
    length: u32,
}

/// A validated muscle: parameters and the constants derived from them. Any
/// number of [`CalciumForceState`]s can run on one.
///
/// Accuracy: for every subject of Lee's table 4 at 10–100 Hz the worst error
/// is below 0.012 % of the train's peak; `firmware/tests/muscle_accuracy.rs`
/// prints it. It grows with (1 ms/τ)², τ being the shortest time constant.
///
/// ```
/// use firmware::muscle::{CalciumForce, CalciumForceSpec, CalciumForceState, Gain};
/// use firmware::units::Micros;
///
/// let k01 = CalciumForceSpec {
///     a_mn_per_s: 121_900,
///     k_micro: 300_000,
///     tau_c_us: 20_800,
///     tau1_us: 33_100,
///     tau2_us: 194_400,
/// };
/// let muscle = CalciumForce::new(k01)?;
/// let mut state = CalciumForceState::at_rest(Micros::new(0));
/// muscle.pulse(&mut state, Micros::new(250), Gain::FULL);
/// muscle.advance(&mut state, Micros::new(60_000));
/// assert!(muscle.force(&state).to_millinewton() > 1_000); // one twitch
/// # Ok::<(), firmware::range::OutOfRange>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CalciumForce {
    /// K, U5F27.
    pub(super) k: u32,
    /// τ1/τm, Q32; τm is τ1 + τ2, or more where τ1 may grow.
    pub(super) tau_floor: u32,
    /// τ2/τm, Q32, such that no x can carry their sum past 1.
    pub(super) tau_span: u32,
    /// 1 µs/2τc in 2^-42: below 2^29, as τc is 5 ms or more.
    pub(super) half_decay_per_us: u32,
    /// 1 µs/τm in 2^-42: below 2^31, as τm is 3 ms or more.
    pub(super) length_per_us: u32,
    /// A step of 1 ms.
    tick: Step,
    /// A·τm, N in Q16.16: below 12,000 N.
    pub(super) full_scale: u32,
}

impl CalciumForce {
    /// C, in pulses, where the fixed point ends: there it saturates.
    pub const CALCIUM_END: u32 = calcium_state::CALCIUM_END;

    /// Derives the constants of a muscle.
    ///
    /// # Errors
    /// [`OutOfRange`] naming the first parameter outside the range stated at
    /// [`CalciumForceSpec`]; within them no later computation can overflow.
    pub fn new(spec: CalciumForceSpec) -> Result<Self, OutOfRange> {
        spec.check()?;
        Ok(Self::derive(spec, spec.tau1_us))
    }

    /// The constants of a checked `spec` whose τ1 may grow to `tau1_max_us`, at
    /// most 200,000 and at least its own: τm is that and τ2.
    pub(super) fn derive(spec: CalciumForceSpec, tau1_max_us: u32) -> Self {
        // Ranges above: τm in 3,000…1,200,000 µs.
        let tau_us = (tau1_max_us + spec.tau2_us) as u64;
        // At most 2^32·200/201.
        let tau_floor = (((spec.tau1_us as u64) << 32) / tau_us) as u32;
        let tau_span = ((spec.tau2_us as u64) << 32) / tau_us;
        // 10^7 mN/s · 1.2·10^6 µs · 2^16 = 7.9·10^17 fits; the quotient,
        // below 12,000 · 2^16, fits 32 bits.
        let full_scale = ((spec.a_mn_per_s as u64 * tau_us) << 16) / 1_000_000_000;
        let mut muscle = Self {
            // At most 5 · 2^27.
            k: (((spec.k_micro as u64) << 27) / 1_000_000) as u32,
            tau_floor,
            tau_span: (tau_span as u32).min(u32::MAX - tau_floor),
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
        muscle
    }

    /// A pulse at `at`: adds 1 to C then, and from then on drives the muscle
    /// with `gain` (eq. 6). A pulse less than a millisecond ahead of the state
    /// waits for [`Self::advance`] to pass it, so that a tick with a pulse
    /// inside it is one step; for one further ahead, or with another waiting,
    /// time passes until `at`. An older pulse counts as of the state's time.
    /// A pulse with [`Gain::ZERO`] reaches no fibre and leaves the muscle as
    /// it was.
    #[inline]
    pub fn pulse(&self, state: &mut CalciumForceState, at: Micros, gain: Gain) {
        if gain != Gain::ZERO {
            self.pulse_with(state, at, gain.get().to_bits());
        }
    }

    /// [`Self::pulse`] with a gain in Q31: above 0, at most 1.
    #[inline(always)]
    pub(super) fn pulse_with(&self, state: &mut CalciumForceState, at: Micros, gain: u32) {
        let ahead_us = (at - state.at).us().cast_unsigned();
        if state.waiting_us == 0 && ahead_us < TICK_US && ahead_us > 0 {
            state.waiting_us = ahead_us;
            state.next_gain = gain;
        } else {
            self.pulse_at_once(state, at, gain);
        }
    }

    /// Lets time pass until `at`, then the pulse acts.
    #[cold]
    #[inline(never)]
    fn pulse_at_once(&self, state: &mut CalciumForceState, at: Micros, gain: u32) {
        self.advance_any(state, at);
        state.take(gain);
    }

    /// Lets time pass until `to`, which may be up to 35 min ahead; an earlier
    /// time changes nothing.
    ///
    /// Costs one step per millisecond or part of one until the muscle is at
    /// rest, and nothing from then on. A whole millisecond is also one step
    /// with a pulse inside it, at about the cost of two without. Rest comes, by the ranges of the
    /// parameters, within 7 s of the last pulse: no call takes more than
    /// 7,000 steps (2,500 for the muscles of table 4).
    #[inline]
    pub fn advance(&self, state: &mut CalciumForceState, to: Micros) {
        if (to - state.at).us() == TICK_US.cast_signed() {
            state.at = to;
            self.tick(state);
        } else {
            self.advance_any(state, to);
        }
    }

    /// [`Self::advance`] by any time: ticks, then what is left.
    #[cold]
    #[inline(never)]
    fn advance_any(&self, state: &mut CalciumForceState, to: Micros) {
        let mut left_us = to.elapsed_since(state.at);
        if left_us == 0 {
            return;
        }
        state.at = to;
        while left_us >= TICK_US && !state.is_at_rest() {
            self.tick(state);
            left_us = left_us.wrapping_sub(TICK_US);
        }
        let until_pulse_us = state.waiting_us;
        if (1..=left_us).contains(&until_pulse_us) {
            self.part_of_tick(state, until_pulse_us);
            left_us = left_us.wrapping_sub(until_pulse_us);
            state.waiting_us = 0;
            state.take(state.next_gain);
        }
        if left_us > 0 && !state.is_at_rest() {
            self.part_of_tick(state, left_us);
            state.waiting_us = state.waiting_us.saturating_sub(left_us);
        }
    }

    /// 1 ms: a waiting pulse, less than that ahead, falls within.
    #[inline(never)]
    fn tick(&self, state: &mut CalciumForceState) {
        let until_pulse_us = state.waiting_us;
        if until_pulse_us > 0 {
            self.tick_with_pulse(state, until_pulse_us);
        } else if !state.is_at_rest() {
            self.step(state, &self.tick);
        }
    }

    /// `us` ≤ 1000 microseconds without a pulse.
    #[inline(never)]
    fn part_of_tick(&self, state: &mut CalciumForceState, us: u32) {
        self.step(state, &self.step_of(us));
    }

    /// The muscle's force, 0…12,000 N, at [`CalciumForceState::at`].
    #[must_use]
    pub const fn force(&self, state: &CalciumForceState) -> Force {
        self.newtons((state.force >> 32) as u32)
    }

    /// A force over full scale, Q31 and at most 1, in newtons.
    pub(super) const fn newtons(&self, force: u32) -> Force {
        // Q31 · Q16.16, rounded: below 2^31 · 2^30 + 2^30, so that the
        // shifted result fits 31 bits.
        let product = force as u64 * self.full_scale as u64;
        Force::new(I16F16::from_bits(((product + (1 << 30)) >> 31) as i32))
    }

    /// The factors of a step of `us` ≤ 1000 microseconds.
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

    /// x and τ/(τ1 + τ2), both Q32, at C = `calcium` in U5F27.
    #[inline(always)]
    pub(super) fn activation(&self, calcium: u32) -> (u32, u32) {
        // C ≤ 25, K + C < 32. x stays below 1: K/(K + C) is at least
        // 8.0e-5, Reciprocal's error at most 2.5e-5.
        let x = Reciprocal::of(self.k.wrapping_add(calcium)).times(calcium);
        // Below 2^32, as floor + span is 2^32 − 1; above 0 by τ1 ≥ 2 ms.
        (x, self.tau_floor.wrapping_add(mul_high(self.tau_span, x)))
    }

    /// One step of the method at the head of this file.
    #[inline(always)]
    fn step(&self, state: &mut CalciumForceState, step: &Step) {
        let (upper, lower) = ((state.calcium >> 32) as u32, state.calcium as u32);
        let (x, tau) = self.activation(mul_high(upper, step.to_middle));
        // z = h/τ ≤ 1 ms/2 ms up to Reciprocal's error: within decay_fraction's
        // domain, which also keeps 1 − e^−z below half, an i32.
        let share = decay_fraction(Reciprocal::of(tau).times(step.length)) as i32;
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

    /// 1 ms with the waiting pulse inside it.
    ///
    /// With z1, z2 the parts' h/τ and a1, a2 their h·x·gain, all over full
    /// scale, the two steps of the method's own are, but for terms of third
    /// order, F ← F + p·(a1 + a2 − z·F + (a2·z1 − a1·z2)/2), z = z1 + z2 and
    /// p = (1 − e^−z)/z.
    #[inline(always)]
    fn tick_with_pulse(&self, state: &mut CalciumForceState, until_pulse_us: u32) {
        // Both below 1000, and 22 bits up below 2^32 as in step_of.
        let before = until_pulse_us << 22;
        let after = TICK_US.wrapping_sub(until_pulse_us) << 22;
        state.waiting_us = 0;
        // To second order, e^−u is 1.7e-4 off at most: enough for an x that
        // holds for less than a tick.
        let u = mul_high(before, self.half_decay_per_us);
        let fall = !mul_high(u, !(u >> 1));
        let fall_after = decay(mul_high(after, self.half_decay_per_us));

        let upper = (state.calcium >> 32) as u32;
        let middle1 = mul_high(upper, fall);
        // Half of the first part is over; the rest of it and half of the
        // second are half of the tick. The sum is at most 25 · 2^27.
        let middle2 = mul_high(middle1, self.tick.to_middle).wrapping_add(fall_after >> 5);

        // What the old lower word would carry is below 2^-27 of a pulse.
        let old = u64::from(upper) * u64::from(self.tick.to_end);
        let new = mul_high(fall_after, fall_after) >> 5;
        let calcium_upper = ((old >> 32) as u32)
            .wrapping_add(new)
            .min(CALCIUM_MAX_UPPER);
        state.calcium = u64::from(calcium_upper) << 32 | u64::from(old as u32);
        // Costs nothing itself. Without the two fences everything is loaded
        // at once and waits on the stack: 20 cycles.
        compiler_fence(Ordering::SeqCst);

        let (x1, tau1) = self.activation(middle1);
        let (x2, tau2) = self.activation(middle2);
        // The parts' lengths add up to the tick's, both rounded down.
        let length1 = mul_high(before, self.length_per_us);
        let length2 = self.tick.length.wrapping_sub(length1);
        // One division for both h/τ: 1/(τ1·τ2). Their sum is below 0.505.
        let both = Reciprocal::of(mul_high(tau1, tau2));
        let z1 = both.times(mul_high(length1, tau2));
        let z2 = both.times(mul_high(length2, tau1));
        let z = z1.wrapping_add(z2);

        compiler_fence(Ordering::SeqCst);
        // With gains ≤ 1, a1 + a2 < z·2^31, and z·F as well: below 2^31. F
        // stays above 0, as the correction takes at most half of a1 and z·F
        // half of F; it stays below full scale, as a/z is x·τ but for twice
        // Reciprocal's error, and 1 − x is more than that.
        let a1 = mul_high(mul_high(length1, x1), state.gain);
        let a2 = mul_high(mul_high(length2, x2), state.next_gain);
        let order = (mul_high(a2, z1) as i32).wrapping_sub(mul_high(a1, z2) as i32) >> 1;
        let lost = mul_high(z, (state.force >> 32) as u32);
        let drive = (a1.wrapping_add(a2).wrapping_sub(lost) as i32).wrapping_add(order);
        // drive·(1 − lag), the 1 in the upper word alone.
        let lag = (lag(z) as i32).wrapping_neg();
        let force = state
            .force
            .wrapping_add(i64::from(drive).wrapping_mul(i64::from(lag)));
        let force_upper = ((force >> 32) as i32).wrapping_add(drive);
        state.force = i64::from(force_upper) << 32 | i64::from(force as u32);

        state.gain = state.next_gain;
    }
}
