//! Fatigue: the change of parameters of the calcium–force model with work (Ding, Wexler &
//! Binder-Macleod, J. Electromyogr. Kinesiol. 13:575, 2003),
//!
//! ```text
//! dA/dt  = (A₀ − A)/τfat + αA·F          αA < 0
//! dK/dt  = (K₀ − K)/τfat + αK·F
//! dτ1/dt = (τ1₀ − τ1)/τfat + ατ1·F
//! ```
//!
//! Method: one step per second with the mean force of that second. K and τ1 are linear in F and
//! exact for this force. The decrease of A is proportional to A itself: with r = |αA|·F/A held
//! constant, A relaxes exactly towards A₀/(1 + r·τfat), so A stays above zero for any step.
//!
//! A acts as a factor on the gain. τ1 may grow, so its muscle is scaled for the longest τ1, and an
//! update causes no step in the force.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::calcium_force::CalciumForce;
use super::spec::CalciumForceSpec;
use crate::arithmetic::division::quotient;
use crate::arithmetic::exponential::{exp_neg, mul_high};
use crate::range::{OutOfRange, Range};

/// Time between two updates, µs.
pub(super) const UPDATE_US: u32 = 1_000_000;

/// Longest τ1 that fatigue reaches, µs: the upper end of its range in [`CalciumForceSpec`].
const TAU1_MAX_US: u32 = CalciumForceSpec::TAU1_US.max as u32;
/// Largest K that fatigue reaches, U5F27: the upper end of its range in [`CalciumForceSpec`].
const K_MAX: u32 = 5 << 27;

/// Parameters of a muscle's fatigue and recovery.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct FatigueSpec {
    /// Rate −αA at which work reduces A, thousandths per s²: 0…10,000.
    pub alpha_a_milli_per_s2: u32,
    /// Rate αK at which work increases K, 10^-9 per N·s: 0…100,000,000.
    pub alpha_k_nano_per_n_s: u32,
    /// Rate ατ1 at which work increases τ1, 10^-9 per N (ns per N·s): 0…100,000,000.
    pub alpha_tau1_nano_per_n: u32,
    /// Time constant τfat of the recovery of A, K and τ1, ms: 10,000…1,000,000.
    pub tau_fat_ms: u32,
}

impl FatigueSpec {
    /// Ding's values for the human quadriceps: αA = −4.0e-7 ms⁻², αK = 1.9e-8 ms⁻¹N⁻¹, ατ1 = 2.1e-5
    /// N⁻¹, τfat = 127 s, at A₀ = 3.009 N/ms. They come from later papers and code that quote them,
    /// and were not measured on the arm.
    pub const QUADRICEPS: Self = Self {
        alpha_a_milli_per_s2: 400,
        alpha_k_nano_per_n_s: 19_000,
        alpha_tau1_nano_per_n: 21_000,
        tau_fat_ms: 127_000,
    };
    /// Range of [`Self::alpha_a_milli_per_s2`].
    pub const ALPHA_A_MILLI_PER_S2: Range = Range::new("alpha_a_milli_per_s2", 0, 10_000);
    /// Range of [`Self::alpha_k_nano_per_n_s`].
    pub const ALPHA_K_NANO_PER_N_S: Range = Range::new("alpha_k_nano_per_n_s", 0, 100_000_000);
    /// Range of [`Self::alpha_tau1_nano_per_n`].
    pub const ALPHA_TAU1_NANO_PER_N: Range = Range::new("alpha_tau1_nano_per_n", 0, 100_000_000);
    /// Range of [`Self::tau_fat_ms`].
    pub const TAU_FAT_MS: Range = Range::new("tau_fat_ms", 10_000, 1_000_000);

    /// Parameter A₀ of the muscle of [`Self::QUADRICEPS`], mN/s.
    const QUADRICEPS_A: u64 = 3_009_000;

    /// Scales the quadriceps' fatigue to a muscle of another strength, with A in mN/s (above 0). A
    /// muscle that works at the same share of its own strength fatigues alike, so rates per newton
    /// grow as A shrinks. This is an assumption, because values of other muscles are not available.
    #[must_use]
    pub fn scaled_to(a_mn_per_s: u32) -> Self {
        let per_newton = |alpha: u32, range: Range| {
            let scaled = u64::from(alpha) * Self::QUADRICEPS_A / u64::from(a_mn_per_s.max(1));
            scaled.min(range.max as u64) as u32
        };
        Self {
            alpha_k_nano_per_n_s: per_newton(
                Self::QUADRICEPS.alpha_k_nano_per_n_s,
                Self::ALPHA_K_NANO_PER_N_S,
            ),
            alpha_tau1_nano_per_n: per_newton(
                Self::QUADRICEPS.alpha_tau1_nano_per_n,
                Self::ALPHA_TAU1_NANO_PER_N,
            ),
            ..Self::QUADRICEPS
        }
    }

    /// Checks each parameter against its documented range.
    fn check(&self) -> Result<(), OutOfRange> {
        Self::ALPHA_A_MILLI_PER_S2.check(self.alpha_a_milli_per_s2)?;
        Self::ALPHA_K_NANO_PER_N_S.check(self.alpha_k_nano_per_n_s)?;
        Self::ALPHA_TAU1_NANO_PER_N.check(self.alpha_tau1_nano_per_n)?;
        Self::TAU_FAT_MS.check(self.tau_fat_ms)
    }
}

/// Validated fatigue model of one muscle, with constants per update.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fatigue {
    /// Recovery 1 s/τfat, Q32: at most 0.1.
    recovery: u32,
    /// Decay e^(−1 s/τfat), Q32.
    kept: u32,
    /// Loss of A/A₀ at full scale, |αA|·τm·1 s, Q28, at most 12.
    loss: u32,
    /// Increase of K per second at full scale, U5F27. Saturates, because K reaches its end within a
    /// second at a smaller force.
    k_gain: u32,
    /// Increase of τ1/τm per second at full scale, Q32. Saturates as `k_gain` does.
    tau1_gain: u32,
    /// Parameter K of the fresh muscle, U5F27.
    k: u32,
    /// Ratio τ1/τm of the fresh muscle, Q32.
    tau1: u32,
    /// Ratio of the longest τ1 to τm, Q32.
    tau1_max: u32,
}

/// State of a muscle's fatigue.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FatigueState {
    /// Ratio A/A₀, Q31.
    pub(super) a: u32,
    /// Sum of F (Q31 of full scale) times µs since the last update.
    work: u64,
    /// Time since the last update, µs.
    since_us: u32,
}

impl FatigueState {
    /// State of a fresh muscle.
    pub(super) const NONE: Self = Self {
        a: 1 << 31,
        work: 0,
        since_us: 0,
    };

    /// Returns the part of a gain that fatigue leaves, both Q31. A gain above zero never becomes
    /// zero.
    #[inline(always)]
    pub(super) fn fatigued_gain(&self, gain: u32) -> u32 {
        // Both are at most 2^31.
        ((u64::from(gain) * u64::from(self.a)) >> 31).max(1) as u32
    }
}

impl Fatigue {
    /// Validates both specifications. Returns the muscle of `force`, scaled for the longest τ1, and
    /// its fatigue.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] with the first parameter outside its range.
    pub(super) fn new(
        force: CalciumForceSpec,
        spec: FatigueSpec,
    ) -> Result<(CalciumForce, Self), OutOfRange> {
        CalciumForce::new(force)?;
        spec.check()?;
        let muscle = CalciumForce::derive(force, TAU1_MAX_US);
        // At most 1,200,000 µs, 3,000 or more.
        let tau_us = u64::from(TAU1_MAX_US + force.tau2_us);
        // At most 2^32 · 1000 / 10,000.
        let recovery = ((1000u64 << 32) / u64::from(spec.tau_fat_ms)) as u32;
        // e^−x has its maximum at 2^31.
        let kept = exp_neg(recovery.into()).min((1 << 31) - 1) << 1;
        // Increase per second at a constant force, τfat·(1 − e^(−1 s/τfat)): in Q32, 0.95…1.
        let held = quotient(u64::from(u32::MAX - kept) << 32, recovery).unwrap_or(u32::MAX);
        // 10^4 · 1.2·10^6 · 2^28 fits; the quotient is at most 12 · 2^28.
        let loss = ((u64::from(spec.alpha_a_milli_per_s2) * tau_us) << 28) / 1_000_000_000;
        // A·τm in µN is at most 12,000·10^6; times 10^8 nano: 1.2·10^18.
        let full_un = u64::from(force.a_mn_per_s) * tau_us / 1000;
        let per_full = |alpha: u32| full_un * u64::from(alpha) / 1_000_000;
        // In 10^-9 of K, and of a second: clamped to 32 and to 1, whose shifts fit.
        let k_nano = per_full(spec.alpha_k_nano_per_n_s).min(32_000_000_000);
        let tau1_nano = per_full(spec.alpha_tau1_nano_per_n).min(1_000_000_000);
        // (2^32 − 1) · 2^32 fits.
        let gain =
            |per_second: u64| ((per_second.min(u32::MAX.into()) * u64::from(held)) >> 32) as u32;
        let k_gain = gain((k_nano << 27) / 1_000_000_000);
        let tau1_gain = gain((tau1_nano << 32) / (tau_us * 1000));
        Ok((
            muscle,
            Self {
                recovery,
                kept,
                loss: loss as u32,
                k_gain,
                tau1_gain,
                k: muscle.k,
                tau1: muscle.tau_floor,
                tau1_max: u32::MAX - muscle.tau_span,
            },
        ))
    }

    /// Advances by `us` microseconds with a force in Q31 at their end. Returns whether the muscle's
    /// parameters changed.
    #[inline(always)]
    pub(super) fn advance(
        &self,
        tired: &mut FatigueState,
        muscle: &mut CalciumForce,
        force: u32,
        us: u32,
    ) -> bool {
        // At most 2^31 · (10^6 + 10^3) between updates.
        let work = u64::from(force).wrapping_mul(u64::from(us));
        tired.work = tired.work.wrapping_add(work);
        tired.since_us = tired.since_us.wrapping_add(us);
        if tired.since_us < UPDATE_US {
            return false;
        }
        self.update(tired, muscle);
        true
    }

    /// Applies the mean force of one second.
    #[inline(never)]
    fn update(&self, tired: &mut FatigueState, muscle: &mut CalciumForce) {
        // At most 2^31, as no force is above full scale.
        let force = quotient(tired.work, tired.since_us).unwrap_or(1 << 31);
        tired.since_us = tired.since_us.wrapping_sub(UPDATE_US);
        tired.work = 0;
        let grown = |now: u32, fresh: u32, gain: u32, most: u32| {
            let above = mul_high(now.saturating_sub(fresh), self.kept);
            // Q31·gain·2 saturates instead of wrapping.
            let more = mul_high(gain, force).saturating_mul(2);
            fresh.saturating_add(above).saturating_add(more).min(most)
        };
        muscle.k = grown(muscle.k, self.k, self.k_gain, K_MAX.max(self.k));
        muscle.tau_floor = grown(muscle.tau_floor, self.tau1, self.tau1_gain, self.tau1_max);
        muscle.retune();
        tired.a = self.strength_after_second(tired.a, force);
    }

    /// Returns A/A₀ after a second at a mean force in Q31.
    fn strength_after_second(&self, a: u32, force: u32) -> u32 {
        // All in Q28: recovery is at most 0.1; loss is at most 12 · force, and loss over A/A₀ is
        // clamped to 15 per second.
        let recovery = (self.recovery >> 4).max(1);
        let loss = (u64::from(self.loss) * u64::from(force)) >> 31;
        let loss = quotient(loss << 31, a).unwrap_or(u32::MAX).min(15 << 28);
        let rate = recovery.saturating_add(loss);
        // Both in Q31.
        let end = quotient(u64::from(recovery) << 31, rate).unwrap_or(1 << 31);
        let left = exp_neg(u64::from(rate) << 4);
        let part = |way: u32| ((u64::from(way) * u64::from(left)) >> 31) as u32;
        // Approaches `end` with the remaining distance rounded down, so A₀ is reached.
        match a.checked_sub(end) {
            Some(above) => end + part(above), // at most a
            None => end.saturating_sub(part(end.saturating_sub(a))),
        }
    }
}
