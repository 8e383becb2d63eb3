//! Force from pulses: the calcium–force model of Lee, Kim & Jung 2020, Sensors 20, eqs. (2)–(3),
//!
//! ```text
//! dC/dt = u − C/τc            u: one unit impulse per pulse
//! dF/dt = A·gain·x − F/τ      x = C/(K + C),  τ = τ1 + τ2·x
//! ```
//!
//! Method: C decays exactly. F is planned over [segments](super::segment) of up to 13.5 ms. A
//! segment begins with a pulse, at its own microsecond, or at the end of the previous segment. F
//! can be read from the segment's cubic at any time within it.
//!
//! A tick without a pulse costs almost nothing; a tick with a pulse plans once. A segment is
//! renewed one tick before its end, so that no pulse comes after the end.

use fixed::types::{I16F16, U5F27};

use super::Gain;
use super::segment::{CALCIUM_END, Curve, ONE_PULSE, Segment};
use super::spec::CalciumForceSpec;
use crate::arithmetic::exponential::mul_high;
use crate::arithmetic::reciprocal::{Reciprocal, signed_high_rounded};
use crate::range::OutOfRange;
use crate::units::{Force, Micros, us};

/// State of one muscle: 32 bytes, freely copied.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(C)] // the fields that a tick loads are adjacent
pub struct CalciumForceState {
    /// Time of the segment's middle.
    middle: Micros,
    /// Time from `middle` to the time of the state, µs: within the segment, or at rest.
    since_us: i32,
    /// Force F around `middle`, as a share of A·τm.
    force: Curve,
    /// Calcium C at the segment's beginning, U5F27, at most [`CALCIUM_END`].
    calcium: u32,
    /// Drive of F, h/τm·gain in Q31, by the last pulse that reached the muscle.
    drive: i32,
}

impl CalciumForceState {
    /// Creates a muscle without calcium or force, at time `at`.
    #[must_use]
    pub const fn at_rest(at: Micros) -> Self {
        Self {
            middle: at,
            since_us: 0,
            force: Curve::NONE,
            calcium: 0,
            drive: 0,
        }
    }

    /// Returns whether no effect of any pulse is left: calcium and force are exactly zero.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.calcium == 0 && self.force == Curve::NONE
    }

    /// Returns the time up to which the state has been advanced.
    #[must_use]
    pub fn at(&self) -> Micros {
        self.middle + us(self.since_us.cast_unsigned())
    }
}

/// A validated muscle: its parameters and the constants derived from them. Any number of
/// [`CalciumForceState`]s can use one muscle.
///
/// Accuracy: for every subject of Lee's table 4 at 10–100 Hz, the largest error, read every 1 ms,
/// is below 0.005 % of the train's peak. `firmware/tests/muscle_accuracy.rs` prints the error, and
/// `flexor chart accuracy` the error over all muscles that [`Self::new`] accepts.
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
    /// Parameter K, U5F27.
    pub(super) k: u32,
    /// Ratio τ1/τm, Q32; τm is τ1 + τ2, or more if τ1 may grow.
    pub(super) tau_floor: u32,
    /// Ratio τ2/τm, Q32, such that the sum of both ratios stays below 1 for every x.
    pub(super) tau_span: u32,
    /// Ratio 1 µs/2τc in 2^-42: below 2^29, as τc is 5 ms or more.
    pub(super) half_decay_per_us: u32,
    /// Ratio 1 µs/τm in 2^-42: below 2^31, as τm is 3 ms or more.
    pub(super) length_per_us: u32,
    /// Product A·τm, 2^-17 N: below 12,000 N.
    pub(super) full_scale: u32,
    segment: Segment,
}

impl CalciumForce {
    /// Largest calcium C in the fixed-point format, at which C saturates; one pulse adds 1 to C.
    pub const CALCIUM_END: u32 = CALCIUM_END;

    /// Derives the constants of a muscle.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] with the first parameter outside the range stated at
    /// [`CalciumForceSpec`]. Within the ranges no later computation can overflow.
    pub fn new(spec: CalciumForceSpec) -> Result<Self, OutOfRange> {
        spec.check()?;
        Ok(Self::derive(spec, spec.tau1_us))
    }

    /// Derives the constants of a checked `spec` whose τ1 may grow to `tau1_max_us`, which is at
    /// most 200,000 and at least the present τ1. τm is the sum of that maximum and τ2.
    pub(super) fn derive(spec: CalciumForceSpec, tau1_max_us: u32) -> Self {
        // By the ranges above, τm is in 3,000…1,200,000 µs.
        let tau_m_us = tau1_max_us + spec.tau2_us;
        let tau_us = tau_m_us as u64;
        // At most 2^32·200/201.
        let tau_floor = (((spec.tau1_us as u64) << 32) / tau_us) as u32;
        let tau_span = ((spec.tau2_us as u64) << 32) / tau_us;
        // 10^7 mN/s · 1.2·10^6 µs · 2^17 = 1.6·10^18 fits; the quotient, below 12,000 · 2^17, fits
        // 31 bits.
        let full_scale = ((spec.a_mn_per_s as u64 * tau_us) << 17) / 1_000_000_000;
        let mut muscle = Self {
            // At most 5 · 2^27.
            k: (((spec.k_micro as u64) << 27) / 1_000_000) as u32,
            tau_floor,
            tau_span: (tau_span as u32).min(u32::MAX - tau_floor),
            half_decay_per_us: ((1 << 41) / spec.tau_c_us as u64) as u32,
            length_per_us: ((1 << 42) / tau_us) as u32,
            full_scale: full_scale as u32,
            segment: Segment::new(&spec, tau_m_us),
        };
        muscle.retune();
        muscle
    }

    /// Adapts the segments to the present K and τ1.
    pub(super) fn retune(&mut self) {
        self.segment.retune(self.k, self.tau_floor, self.tau_span);
    }

    /// Applies a pulse at `at`: adds 1 to C at that time, and from then on drives the muscle with
    /// `gain` (eq. 6). Advances the state to `at`; an earlier pulse is applied at the state's time.
    /// A pulse with [`Gain::ZERO`] reaches no fibre and has no effect.
    #[inline]
    pub fn pulse(&self, state: &mut CalciumForceState, at: Micros, gain: Gain) {
        if gain != Gain::ZERO {
            self.pulse_with(state, at, gain.get().to_bits());
        }
    }

    /// Applies [`Self::pulse`] with a gain in Q31, above 0 and at most 1.
    #[inline(always)]
    pub(super) fn pulse_with(&self, state: &mut CalciumForceState, at: Micros, gain: u32) {
        let since_us = (at - state.middle).us().max(state.since_us);
        state.drive = self.segment.drive(gain);
        state.middle = self.begin_segment(state, since_us, ONE_PULSE);
    }

    /// Advances the state to `to`, which may be up to 35 min ahead; an earlier time has no effect.
    ///
    /// The call costs two comparisons until a segment ends, and nothing at rest. By the ranges of
    /// the parameters, a muscle comes to rest within 7 s of the last pulse, so no call plans more
    /// than 7,000 segments (1,000 for the muscles of table 4).
    #[inline(always)]
    pub fn advance(&self, state: &mut CalciumForceState, to: Micros) {
        let since_us = (to - state.middle).us();
        if since_us <= state.since_us {
            return;
        }
        if since_us > self.segment.fresh_us {
            // This is not the last statement, so that only this branch has registers to save.
            state.middle = self.begin_segment(state, since_us, 0);
        } else {
            state.since_us = since_us;
        }
    }

    /// Advances segment by segment until one extends to `since_us` after its middle, or until the
    /// muscle is at rest. Returns the time since the middle of the last segment, µs.
    #[cold]
    #[inline(never)]
    fn pass_segments(&self, state: &mut CalciumForceState, since_us: i32) -> i32 {
        let to = state.middle + us(since_us.cast_unsigned());
        loop {
            let since_us = (to - state.middle).us();
            if since_us <= self.segment.half_us || state.is_at_rest() {
                return since_us;
            }
            state.middle = self.begin_segment(state, self.segment.half_us, 0);
        }
    }

    /// Begins a segment `since_us` after the middle of the previous one, not before the state's
    /// time, with `more` calcium added. Returns the segment's middle, which the caller must store.
    /// The function is not inlined because it is long.
    #[inline(never)]
    fn begin_segment(&self, state: &mut CalciumForceState, since_us: i32, more: u32) -> Micros {
        let since_us = if since_us > self.segment.half_us {
            self.pass_segments(state, since_us)
        } else {
            since_us
        };
        let place = self.segment.place(since_us);
        let force = state.force.unrounded(place);
        // At most 25 · 2^27.
        let calcium = self.segment.decayed_calcium(state.calcium, place);
        let calcium = calcium.wrapping_add(more).min(CALCIUM_END << 27);
        state.since_us = self.segment.half_us.wrapping_neg();
        state.calcium = calcium;
        state.force = if calcium == 0 {
            self.segment.plan_decay(force)
        } else {
            self.segment.plan(force, calcium, state.drive)
        };
        let to_middle_us = since_us.wrapping_add(self.segment.half_us);
        state.middle + us(to_middle_us.cast_unsigned())
    }

    /// Drives the muscle with another gain (Q31) and the present constants, from the state's time
    /// on.
    pub(super) fn drive_with(&self, state: &mut CalciumForceState, gain: u32) {
        state.drive = self.segment.drive(gain);
        state.middle = self.begin_segment(state, state.since_us, 0);
    }

    /// Returns the muscle's force, 0…12,000 N, at [`CalciumForceState::at`].
    #[must_use]
    #[inline]
    pub fn force(&self, state: &CalciumForceState) -> Force {
        // Below 2^31 · 2^31, so the upper half fits.
        let newtons = signed_high_rounded(self.share(state) as i32, self.full_scale as i32);
        Force::new(I16F16::from_bits(newtons))
    }

    /// Returns F as a share of full scale at the state's time, Q31.
    #[inline(always)]
    pub(super) fn share(&self, state: &CalciumForceState) -> u32 {
        let place = self.segment.place(state.since_us);
        state.force.at(place) as u32 // never negative
    }

    /// Returns C of eq. (2) at the state's time, 0…24, rounded down to 2^-27; one pulse adds 1.
    #[must_use]
    pub fn calcium(&self, state: &CalciumForceState) -> U5F27 {
        let place = self.segment.place(state.since_us);
        U5F27::from_bits(self.segment.decayed_calcium(state.calcium, place))
    }

    /// Returns x and τ/τm, both Q32, at C = `calcium` in U5F27.
    #[inline(always)]
    pub(super) fn activation(&self, calcium: u32) -> (u32, u32) {
        // C ≤ 25 and K + C < 32. x stays below 1: K/(K + C) is at least 8.0e-5, and the error of
        // Reciprocal at most 2.5e-5.
        let x = Reciprocal::of(self.k.wrapping_add(calcium)).times(calcium);
        // Below 2^32, as floor + span is 2^32 − 1; above 0, as τ1 ≥ 2 ms.
        (x, self.tau_floor.wrapping_add(mul_high(self.tau_span, x)))
    }
}
