//! What the cheaper rungs know of a train: when its last pulse came, how long
//! after the one before, and what activation such a train holds.
//!
//! Over a period T of a steady train, with u = e^(−T/τc), calcium falls from
//! C⁺ = 1/(1 − u) to C⁻ = C⁺ − 1. Integrating x = C/(K + C) over the exact
//! decay of Lee 2020, eq. (2), gives
//!
//! ```text
//! mean of x over T       x̄ = τc/T · ln((K + C⁺)/(K + C⁻))
//! mean of x² over T      x̄ − τc/T · K·(1/(K + C⁻) − 1/(K + C⁺))
//! area of x after the last pulse    w = τc · ln((K + C⁺)/K)
//! ```
//!
//! A pulse is then taken to hold x at one level for some time and to leave
//! nothing. Level X = (mean of x²)/x̄ and time w/X keep the area; where the
//! next pulse comes before that time is over, level x̄ is what a period holds.

use super::calcium_force::{CALCIUM_MAX_UPPER, CalciumForce, TICK_US};
use super::exponential::{decay_fraction, exp_neg, ln_neg, mul_high, quotient};
use super::reciprocal::Reciprocal;
use crate::units::Micros;

/// The slowest train, 0.5 Hz: a pulse later than this begins one. µs.
pub(super) const SLOWEST_US: u32 = 2_000_000;

/// The fastest rate told apart, µs; beyond it x̄ is within 1 % of its limit.
const FASTEST_US: u32 = 1_000;

/// The pulses of a train as far as they matter: two gains and one interval.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Rhythm {
    last: Micros,
    /// From the pulse before to the last one, µs; `SLOWEST_US` after a pause,
    /// 0 if no pulse came within that time.
    interval_us: u32,
    /// Gain of the last pulse, Q31, as it came.
    pub(super) gain: u32,
    /// Gain of the pulse before.
    pub(super) gain_before: u32,
}

impl Rhythm {
    pub(super) const NONE: Self = Self {
        last: Micros(0),
        interval_us: 0,
        gain: 0,
        gain_before: 0,
    };

    /// A pulse at `at` with a gain above zero.
    pub(super) fn beat(&mut self, at: Micros, gain: u32) {
        self.forget(at);
        self.interval_us = match self.interval_us {
            0 => SLOWEST_US,
            _ => at.elapsed_since(self.last).clamp(FASTEST_US, SLOWEST_US),
        };
        self.last = at;
        (self.gain_before, self.gain) = (self.gain, gain);
    }

    /// Time has come to `now`: a pulse too long ago is no train's.
    #[inline(always)]
    pub(super) fn forget(&mut self, now: Micros) {
        if now.elapsed_since(self.last) > SLOWEST_US {
            self.interval_us = 0;
        }
    }

    /// The interval, if a train is known of.
    pub(super) const fn interval_us(&self) -> Option<u32> {
        match self.interval_us {
            0 => None,
            known => Some(known),
        }
    }

    /// Time from the last pulse to `now`, µs; 0 if it is still to come.
    pub(super) const fn age_us(&self, now: Micros) -> u32 {
        now.elapsed_since(self.last)
    }
}

/// What a pulse of a train with some interval does to a muscle's activation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Drive {
    /// The interval all this holds for, µs; 0 for none.
    pub(super) interval_us: u32,
    /// How long after a pulse activation holds, µs.
    pub(super) on_us: u32,
    /// Force that full gain approaches meanwhile, Q31 of full scale.
    pub(super) target: u32,
    /// 1 ms over the time constant of the rise, τ1 + τ2·level, Q32.
    pub(super) rise: u32,
    /// 1 ms over the time constant of the fall, τ1 + τ2·level/8, Q32. The
    /// eighth is a fit: of 0, 1/8, 1/4, 1/2 and 1, and of τc or τc/2 instead,
    /// it has the least error against the calcium–force model over the ten
    /// subjects of table 4, in bursts as in trains of changing rate.
    pub(super) fall: u32,
    /// Time constants of rise and fall over τm, Q32.
    taus: [u32; 2],
}

impl Drive {
    pub(super) const NONE: Self = Self {
        interval_us: 0,
        on_us: 0,
        target: 0,
        rise: 0,
        fall: 0,
        taus: [0; 2],
    };

    /// The closed form at the head of this file for a train whose pulses are
    /// `interval_us` ≤ 2 s apart.
    pub(super) fn of(muscle: &CalciumForce, interval_us: u32) -> Self {
        let (level, on_us) = level_and_time(muscle, interval_us.max(FASTEST_US));
        let tau = |part: u32| {
            // As in `CalciumForce::activation`: within 1, above 0.
            muscle
                .tau_floor
                .wrapping_add(mul_high(muscle.tau_span, part))
        };
        let taus = [tau(level), tau(level >> 3)];
        let rates = taus
            .map(|tau| Reciprocal::of(tau).times(mul_high(TICK_US << 22, muscle.length_per_us)));
        Self {
            interval_us,
            on_us,
            target: mul_high(level, taus[0]) >> 1,
            rise: rates[0],
            fall: rates[1],
            taus,
        }
    }

    /// Mean force of the steady train at full gain, Q31 of full scale.
    ///
    /// In a steady train the force gained while activation holds, for a time
    /// D, is lost again until the period T is over. With ΔF that swing,
    /// integrating both parts gives T·mean = D·target − (τ_rise − τ_fall)·ΔF,
    /// where ΔF = target·(1 − p)(1 − q)/(1 − pq), p and q what is left of a
    /// rise after D and of a fall after T − D.
    pub(super) fn mean(&self, muscle: &CalciumForce) -> u32 {
        let Some(off_us) = self.interval_us.checked_sub(self.on_us) else {
            return self.target;
        };
        if off_us == 0 {
            return self.target;
        }
        let [rise, fall] = self.taus.map(u64::from);
        // µs over τm in Q32: 2^21 · 2^31 / 2^10.
        let over_tau_m = |us: u32| (u64::from(us) * u64::from(muscle.length_per_us)) >> 10;
        let left = |us: u32, tau: u64| u64::from(exp_neg(quotient_far(over_tau_m(us), tau)));
        const ONE: u64 = 1 << 31;
        let (p, q) = (left(self.on_us, rise), left(off_us, fall));
        // All Q31 and at most 1; p·q < 1, as q is after 1 µs of 1.2 s or more.
        let swing = (((ONE - p) * (ONE - q)) / (ONE - ((p * q) >> 31)).max(1)).min(ONE);
        let held = (u64::from(self.on_us) << 32) / u64::from(self.interval_us).max(1);
        // A fall is no slower than its rise. At most 1.2 s over 1 ms: 2^43.
        let lost = quotient(rise.saturating_sub(fall), over_tau_m(self.interval_us));
        // Q32 by Q31: 2^33 · 2^31 fits.
        let share = held.saturating_sub(((lost >> 10) * swing) >> 21);
        ((u64::from(self.target) * share) >> 32) as u32
    }

    /// What is left to hold `age_us` after a pulse, µs.
    pub(super) const fn left_us(&self, age_us: u32) -> u32 {
        self.on_us.saturating_sub(age_us)
    }
}

/// n/d in Q32 where d may be far smaller than n: saturates at 2^40.
fn quotient_far(n: u64, d: u64) -> u64 {
    if n >> 8 >= d { 1 << 40 } else { quotient(n, d) }
}

/// Level of activation, Q32, and how long a pulse holds it, µs.
fn level_and_time(muscle: &CalciumForce, interval_us: u32) -> (u32, u32) {
    let half_decay = u64::from(muscle.half_decay_per_us);
    // T/τc, Q32: 2^21 · 2^29 / 2^9, and 0.01 or more.
    let periods = (u64::from(interval_us) * half_decay) >> 9;
    // 1, u, 1 − u, K·(1 − u) in 2^-28: below 2^31.
    const ONE: u64 = 1 << 28;
    let kept = u64::from(exp_neg(periods)) >> 3;
    let renewed = ONE - kept.min(ONE - 1);
    let k = ((u64::from(muscle.k) * renewed) >> 27).max(1);
    // (K + C⁻)·(1 − u) and (K + C⁺)·(1 − u).
    let (low, high) = (k + kept, k + ONE);
    // Quotients of at most 1, Q31: k ≤ low < high.
    let over = |n: u64, d: u64| ((n << 31) / d.max(1)) as u32;
    let area_of_period = ln_neg(over(low, high));
    let mean = quotient(area_of_period, periods).min(u32::MAX.into());
    let spread = (u64::from(over(k, low)) * u64::from(over(renewed, high))) >> 31;
    let square = mean.saturating_sub(quotient(spread << 1, periods));
    // Mean of x² over mean of x: both Q32.
    let level = quotient(square, mean).clamp(1, u32::MAX.into());
    // In units of τc, Q32: at most 21.5 over a level of 0.01 or more.
    let area = ln_neg(over(k, high));
    let time = quotient(area, level);
    let (level, time) = if time >= periods {
        (mean, quotient(area, mean))
    } else {
        (quotient(area_of_period, time), time)
    };
    // 2^44 · 2^9 fits.
    let us = (time.min(1 << 44) << 9) / half_decay.max(1);
    (
        level.min(u32::MAX.into()) as u32,
        us.min(SLOWEST_US.into()) as u32,
    )
}

/// C just after the last pulse of a steady train with this rhythm, decayed
/// until `now`: U5F27.
pub(super) fn calcium(muscle: &CalciumForce, rhythm: &Rhythm, now: Micros) -> u32 {
    let Some(interval_us) = rhythm.interval_us() else {
        return 0;
    };
    let left = |us: u32| exp_neg((u64::from(us) * u64::from(muscle.half_decay_per_us)) >> 9);
    // 1 − u in Q31, above 0: an interval is 1 ms or more, τc at most 100.
    let renewed = (1u64 << 31).saturating_sub(left(interval_us).into()).max(1);
    let highest = ((1u64 << 58) / renewed).min(CALCIUM_MAX_UPPER.into());
    ((highest * u64::from(left(rhythm.age_us(now)))) >> 31) as u32
}

/// 1 − e^(−z·us/1000) for at most 1000 µs, z in Q32.
#[inline(always)]
pub(super) fn share(z: u32, us: u32) -> u32 {
    // 2^32/1000 a microsecond; 1000 of them stay below 1.
    decay_fraction(mul_high(z, us.wrapping_mul(4_294_967)))
}
