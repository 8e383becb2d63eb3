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

use super::calcium_force::{CalciumForce, TICK_US};
use super::segment::CALCIUM_END;
use crate::arithmetic::division;
use crate::arithmetic::exponential::{decay_fraction, exp_neg, ln_neg, mul_high};
use crate::arithmetic::reciprocal::Reciprocal;
use crate::units::Micros;

/// The slowest train, 0.5 Hz: a pulse later than this begins one. µs.
pub(super) const SLOWEST_US: u32 = 2_000_000;

/// The fastest rate told apart, µs; beyond it x̄ is within 1 % of its limit.
const FASTEST_US: u32 = 1_000;

/// The pulses of a train as far as they matter: the last two.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Rhythm {
    last: Micros,
    before: Micros,
    /// Bit 0: `last` is known, and not too long ago. Bit 1: so was `before`
    /// when `last` came.
    known: u32,
    /// Gain of the last pulse, Q31, as it came.
    pub(super) gain: u32,
}

impl Rhythm {
    pub(super) const NONE: Self = Self {
        last: Micros::new(0),
        before: Micros::new(0),
        known: 0,
        gain: 0,
    };

    /// A pulse at `at` with a gain above zero.
    #[inline(always)]
    pub(super) fn beat(&mut self, at: Micros, gain: u32) {
        (self.before, self.last) = (self.last, at);
        self.known = self.known << 1 | 1;
        self.gain = gain;
    }

    /// No pulse is known of any more.
    pub(super) fn forget(&mut self) {
        self.known = 0;
    }

    /// Time has come to `now`: a pulse too long ago is no train's.
    #[inline(always)]
    pub(super) fn pass(&mut self, now: Micros) {
        if now.elapsed_since(self.last) > SLOWEST_US {
            self.forget();
        }
    }

    /// From the pulse before to the last one, µs; `SLOWEST_US` after a pause,
    /// `None` in one.
    pub(super) const fn interval_us(&self) -> Option<u32> {
        let interval_us = self.last.elapsed_since(self.before);
        match self.known & 3 {
            0 | 2 => None,
            3 if interval_us < SLOWEST_US => Some(interval_us),
            _ => Some(SLOWEST_US),
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
        let [rise, fall] = self.taus;
        // µs over τm in Q32: 2^21 · 2^31 / 2^10.
        let over_tau_m = |us: u32| (u64::from(us) * u64::from(muscle.length_per_us)) >> 10;
        let left = |us: u32, tau: u32| u64::from(left_of(over_tau_m(us), tau));
        const ONE: u64 = 1 << 31;
        // All Q31 and at most 1; p·q < 1, as q is after 1 µs of 1.2 s or more.
        let (p, q) = (left(self.on_us, rise), left(off_us, fall));
        let both = (ONE - ((p * q) >> 31)) as u32;
        let swing = quotient((ONE - p) * (ONE - q), both)
            .unwrap_or(0)
            .min(1 << 31);
        let held = quotient(u64::from(self.on_us) << 32, self.interval_us).unwrap_or(u32::MAX);
        // Q22, as it may pass 1. T/τm is at most 2^41 in Q32.
        let period = (over_tau_m(self.interval_us) >> 10) as u32;
        // A fall is no slower than its rise.
        let slower = u64::from(rise.saturating_sub(fall)) << 12;
        let lost = quotient(slower, period).unwrap_or(u32::MAX);
        // Q22 by Q31: 2^32 · 2^31 fits.
        let share = u64::from(held).saturating_sub((u64::from(lost) * u64::from(swing)) >> 21);
        mul_high(self.target, share as u32) // at most `held`
    }

    /// What is left to hold `age_us` after a pulse, µs.
    pub(super) const fn left_us(&self, age_us: u32) -> u32 {
        self.on_us.saturating_sub(age_us)
    }
}

/// e^(−n/tau), Q31, for n below 2^41.
#[inline(never)]
fn left_of(n: u64, tau: u32) -> u32 {
    if n >> 5 >= u64::from(tau) {
        return 0; // e^-32
    }
    // 2^37 · 2^26 fits; the quotient is below 32 · 2^26.
    exp_neg(u64::from(quotient(n << 26, tau).unwrap_or(u32::MAX)) << 6)
}

/// [`division::quotient`] in one copy: a dozen, inlined, make the closed form
/// four times as long, too long for a branch cache of 1 KiB.
#[inline(never)]
const fn quotient(numerator: u64, denominator: u32) -> Option<u32> {
    division::quotient(numerator, denominator)
}

/// Level of activation, Q32, and how long a pulse holds it, µs.
fn level_and_time(muscle: &CalciumForce, interval_us: u32) -> (u32, u32) {
    let half_decay = muscle.half_decay_per_us;
    // T/τc, Q32: 2^21 · 2^29 / 2^9, and 0.01 or more. In Q23 it fits 32 bits.
    let periods = (u64::from(interval_us) * u64::from(half_decay)) >> 9;
    let per_period = |n: u64| quotient(n << 23, (periods >> 9) as u32).unwrap_or(u32::MAX);
    // 1, u, 1 − u, K·(1 − u) in 2^-28: below 2^31.
    const ONE: u32 = 1 << 28;
    let kept = (exp_neg(periods) >> 3).min(ONE - 1);
    let renewed = ONE - kept;
    let k = ((u64::from(muscle.k) * u64::from(renewed)) >> 27).max(1) as u32;
    // (K + C⁻)·(1 − u) and (K + C⁺)·(1 − u).
    let (low, high) = (k + kept, k + ONE);
    // Quotients of at most 1, Q31: k ≤ low < high.
    let over = |n: u32, d: u32| quotient(u64::from(n) << 31, d).unwrap_or(1 << 31);
    // At most 21.5 in Q32; so are all areas, in units of τc.
    let area_of_period = ln_neg(over(low, high));
    let mean = per_period(area_of_period).max(1);
    let area = ln_neg(over(k, high));
    // Q20: 2^37 · 2^20 fits; an area over a level of 0.01 or more is below 2^12.
    let time_at = |level: u32| quotient(area << 20, level).unwrap_or(u32::MAX);
    let lone_level = || {
        // Q31·Q31, in Q32.
        let spread = (u64::from(over(k, low)) * u64::from(over(renewed, high))) >> 30;
        let square = mean.saturating_sub(per_period(spread));
        // Mean of x² over mean of x: both Q32.
        let level = quotient(u64::from(square) << 32, mean);
        level.unwrap_or(u32::MAX).max(1)
    };
    // No level is above 1: an area of a period or more lasts one.
    let lone_time = (area < periods).then(|| time_at(lone_level()));
    let (level, time) = match lone_time.filter(|&time| u64::from(time) < periods >> 12) {
        // The same area over a period at a lower level.
        Some(time) => {
            let lower = quotient(area_of_period << 20, time);
            (lower.unwrap_or(u32::MAX), time)
        }
        None => (mean, time_at(mean)),
    };
    // Q20 by 2^-41 per µs: 2^32 · 2^21 fits.
    let us = quotient(u64::from(time) << 21, half_decay).unwrap_or(u32::MAX);
    (level, us.min(SLOWEST_US))
}

/// C just after the last pulse of a steady train with this rhythm, decayed
/// until `now`: U5F27.
pub(super) fn calcium(muscle: &CalciumForce, rhythm: &Rhythm, now: Micros) -> u32 {
    let Some(interval_us) = rhythm.interval_us() else {
        return 0;
    };
    let interval_us = interval_us.max(FASTEST_US);
    let left = |us: u32| exp_neg((u64::from(us) * u64::from(muscle.half_decay_per_us)) >> 9);
    // 1 − u in Q31, above 0: an interval is 1 ms or more, τc at most 100.
    let renewed = (1u32 << 31).saturating_sub(left(interval_us));
    let highest = quotient(1 << 58, renewed).unwrap_or(u32::MAX);
    let highest = u64::from(highest.min(CALCIUM_END << 27));
    ((highest * u64::from(left(rhythm.age_us(now)))) >> 31) as u32
}

/// 1 − e^(−z·us/1000) for at most 1000 µs, z in Q32.
#[inline(always)]
pub(super) fn share(z: u32, us: u32) -> u32 {
    // 2^32/1000 a microsecond; 1000 of them stay below 1.
    decay_fraction(mul_high(z, us.wrapping_mul(4_294_967)))
}
