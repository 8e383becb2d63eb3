//! Inverse of the muscle model: from a reference force to the pulses that produce it, first by
//! amplitude and, where the amplitude range ends, by pulse rate.
//!
//! At a period T and a gain, the calcium–force model settles to gain·F(T). From threshold·F(train's
//! T) to limit·F(train's T), only the amplitude changes. For larger forces only T changes, down to
//! the shortest period: a muscle fatigues less at a low rate. For smaller forces T grows at
//! threshold amplitude, up to the longest period. Forces between zero and the smallest force of the
//! slowest rate are not possible: the nearer of the two is produced and reported.
//!
//! F is tabulated once: above the train's rate over evenly spaced periods, where it is smoothest,
//! and below that rate over evenly spaced rates, to which it is nearly proportional.

use super::calcium_force::CalciumForce;
use super::settled::Steady;
use super::spec::CalciumForceSpec;
use super::{Gain, Recruitment};
use crate::arithmetic::division::quotient;
use crate::range::{OutOfRange, Range};
use crate::units::{Amplitude, Force, ForceRate};
use fixed::types::{I16F16, U1F31};

/// Number of pieces of a table. The interpolation error of the mean force of Lee's subjects is
/// 0.9 % from 10 to 100 Hz and 0.1 % from 20 to 60 Hz. Below 20 Hz it is 1.7 % for the subject
/// whose force curve bends most at 11 Hz (K05), and 0.8 % for the others.
const PIECES: usize = 16;

/// Mean forces, N in 2^-16 and below 2^30, slowest rate first; the sequence never falls.
type Forces = [u32; PIECES + 1];

/// Period of the slowest train, 0.5 Hz, µs.
const SLOWEST_US: u32 = 2_000_000;

/// Numerator of a pulse rate: a rate is this value divided by the period in µs.
const RATE: u64 = 1 << 40;

/// Pulses that produce a force.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Drive {
    /// Amplitude of the pulses, at most the wearer's limit.
    pub amplitude: Amplitude,
    /// Gain of pulses with that amplitude.
    pub gain: Gain,
    /// Mean force of the rested muscle, equal to the requested force unless `limiting` is set.
    pub force: Force,
    /// Period from burst start to burst start, µs.
    pub period_us: u32,
    /// Reason why `force` differs from the requested force; `None` if both are equal.
    pub limiting: Option<ForceLimit>,
}

/// Reason why the pulses produce another force than the requested one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ForceLimit {
    /// The force lies between zero and the smallest possible force.
    BelowLeast,
    /// The force is larger than the wearer's limits allow.
    AboveMost,
}

/// Inverse model of one muscle: computes amplitude and period of the pulses that produce a force.
#[derive(Clone, Copy, Debug)]
pub struct Inverse {
    slowest_us: u32,
    train_us: u32,
    fastest_us: u32,
    /// Mean forces at the wearer's limit, from the train's rate to the fastest.
    forces: Forces,
    /// Mean forces at motor threshold, from the slowest rate to the train's.
    slow: Forces,
    /// Gain at the wearer's limit, Q31.
    gain: u32,
    /// Gain at motor threshold, Q31.
    least_gain: u32,
    threshold: Amplitude,
    /// Lag of the force at the train's rate, µs.
    late_us: i64,
    /// Change of the lag per 2^-16 N of force above the force at the limit and the train's rate, µs
    /// in 2^-30.
    late_change: i64,
}

impl Inverse {
    /// Range of the period of a train whose amplitude controls a force: from 200 Hz to 10 Hz, below
    /// which a muscle twitches and its mean force has little meaning.
    pub const PERIOD_US: Range = Range::new("period_us", 5_000, 100_000);
    /// Range of the shortest period, to which the rate may rise; its upper end is the train's
    /// period if that is shorter.
    pub const MIN_PERIOD_US: Range = Range {
        field: "min_period_us",
        ..Self::PERIOD_US
    };
    /// Range of the longest period, to which the rate may fall; its lower end is the train's period
    /// if that is longer.
    pub const MAX_PERIOD_US: Range =
        Range::new("max_period_us", Self::PERIOD_US.min, SLOWEST_US as i32);

    /// Tabulates a muscle under a train with a pulse every `train_us`. At the wearer's limit the
    /// period may fall to `fastest_us`, and at motor threshold it may rise to `slowest_us`; both
    /// equal the train's period for a fixed rate.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] with the first offending parameter of the muscle or period.
    pub fn new(
        spec: CalciumForceSpec,
        recruitment: &Recruitment,
        train_us: u32,
        fastest_us: u32,
        slowest_us: u32,
    ) -> Result<Self, OutOfRange> {
        let muscle = CalciumForce::new(spec)?;
        Self::PERIOD_US.check(train_us)?;
        Self::MIN_PERIOD_US
            .with_max_at_most(train_us)
            .check(fastest_us)?;
        Self::MAX_PERIOD_US
            .with_min_at_least(train_us)
            .check(slowest_us)?;
        let (threshold, limit) = (recruitment.spec().motor_threshold, recruitment.spec().limit);
        let gain_at = |amplitude| recruitment.gain(amplitude).get().to_bits();
        let (gain, least) = (gain_at(limit), gain_at(threshold));
        // At most half of the shortest time constant, as the steps require.
        let step_us = if spec.tau1_us < 4_000 { 1_000 } else { 2_000 };
        let steady = |period_us: u32| muscle.steady(period_us, step_us);
        // Full scale is below 2^30 in 2^-16 N, and so is the product of the fractions.
        let newtons = |share: u32, gain: u32| {
            let share = (u64::from(share) * u64::from(gain)) >> 31;
            ((share * u64::from(muscle.full_scale >> 1)) >> 32) as u32
        };
        // Sum of τ of a change of gain and half a period until the next pulse is due.
        let late = |period_us: u32, Steady { force, activation }: Steady| {
            let scale = u64::from(spec.tau1_us + spec.tau2_us); // below 2^21
            let tau = quotient(scale * u64::from(force), activation).unwrap_or(0);
            i64::from(tau) + i64::from(period_us / 2)
        };
        let span = train_us.saturating_sub(fastest_us);
        let train = steady(train_us);
        let mut fastest = train;
        let mut forces = [newtons(train.force, gain); PIECES + 1];
        if span > 0 {
            let mut before = forces[0];
            // The index is at most 16, where the period is the shortest.
            for (index, force) in (0u32..).zip(&mut forces).skip(1) {
                fastest = steady(train_us.saturating_sub(span * index / PIECES as u32));
                before = newtons(fastest.force, gain).max(before);
                *force = before;
            }
        }
        let at_train = newtons(train.force, least);
        let mut slow = [at_train; PIECES + 1];
        if slowest_us > train_us {
            let mut before = 0;
            // At 16 the period is the train's.
            for (index, force) in (0u64..).zip(&mut slow).take(PIECES) {
                let twitches = steady(period_at(index << 16, slowest_us, train_us));
                before = newtons(twitches.force, least).max(before).min(at_train);
                *force = before;
            }
        }
        let late_us = late(train_us, train);
        let beyond = forces
            .last()
            .copied()
            .unwrap_or(0)
            .saturating_sub(forces[0]);
        // Below 2^22 µs each: 2^52.
        let late_change = late(fastest_us, fastest).saturating_sub(late_us) << 30;
        Ok(Self {
            slowest_us,
            train_us,
            fastest_us,
            forces,
            slow,
            gain,
            least_gain: least,
            threshold,
            late_us,
            late_change: late_change.checked_div(beyond.into()).unwrap_or(0),
        })
    }

    /// Returns the smallest steady force above zero, and the largest.
    #[must_use]
    pub fn force_range(&self) -> (Force, Force) {
        let force = |bits: u32| Force::new(I16F16::from_bits(bits.cast_signed())); // below 2^30
        (force(self.min_force_bits()), force(self.max_force_bits()))
    }

    fn max_force_bits(&self) -> u32 {
        self.forces.last().copied().unwrap_or(0)
    }

    fn min_force_bits(&self) -> u32 {
        self.slow.first().copied().unwrap_or(0)
    }

    /// Returns the force to request from [`Self::drive`] so that the force is `force` now while it
    /// changes at `rate`. Force lags behind its pulses by one time constant of the model, and the
    /// amplitude of a pulse by half a period. Saturates.
    #[must_use]
    pub fn compensate_lag(&self, force: Force, rate: ForceRate) -> Force {
        let bits = i64::from(force.get().to_bits());
        // Below 2^22 · 2^31; divided by 10^6, which is 2^36/68 719 to 7e-6.
        let lead = self
            .lag_us(bits)
            .wrapping_mul(i64::from(rate.get().to_bits()))
            >> 20;
        let bits = bits.wrapping_add(lead.wrapping_mul(68_719) >> 16);
        let bits = bits.clamp(i32::MIN.into(), i32::MAX.into());
        Force::new(I16F16::from_bits(bits as i32))
    }

    /// Returns the lag of a force in 2^-16 N: below 2^22 µs.
    fn lag_us(&self, force: i64) -> i64 {
        let slowest = i64::from(self.forces.first().copied().unwrap_or(0));
        let above = force.wrapping_sub(slowest);
        let beyond = i64::from(self.max_force_bits()).wrapping_sub(slowest);
        let above = above.max(0).min(beyond); // never falls: beyond >= 0
        // At most the whole change: 2^21 µs in 2^-30.
        self.late_us
            .wrapping_add(above.wrapping_mul(self.late_change) >> 30)
    }

    /// Returns the share of its distance to the force of `drive` that the rested muscle covers in
    /// one millisecond, Q24.
    #[must_use]
    pub fn response_per_ms(&self, drive: &Drive) -> u32 {
        let late_us = self.lag_us(drive.force.get().to_bits().into());
        let half_us = i64::from(drive.period_us.min(self.train_us) / 2);
        // At most a half, as no time constant is below 2 ms.
        let tau_us = late_us.wrapping_sub(half_us).max(2_000) as u32; // below 2^22
        quotient(1_000 << 24, tau_us).unwrap_or(u32::MAX)
    }

    /// Returns the pulses for a steady mean force. Between zero and the smallest force, returns the
    /// nearer of the two, and from half of the smallest force on the smallest force. The result
    /// therefore exceeds the request by at most half of the smallest force.
    #[must_use]
    pub fn drive(&self, recruitment: &Recruitment, force: Force) -> Drive {
        let wanted = force.get().to_bits().max(0).cast_unsigned();
        let (least, most) = (self.min_force_bits(), self.max_force_bits());
        // At the train's rate.
        let at_threshold = self.slow.last().copied().unwrap_or(0);
        let at_train = self.forces.first().copied().unwrap_or(0);
        let (amplitude, gain, period_us) = if wanted <= least {
            if wanted < least.div_ceil(2) {
                (Amplitude::ZERO, 0, self.train_us)
            } else {
                (self.threshold, self.least_gain, self.slowest_us)
            }
        } else if wanted <= at_threshold {
            // The end of the table is the train's period.
            let period_us = table_position(&self.slow, wanted).map_or(self.train_us, |place| {
                period_at(place, self.slowest_us, self.train_us)
            });
            (self.threshold, self.least_gain, period_us)
        } else if wanted <= at_train {
            // At most the limit's gain, as wanted <= at_train.
            let gain = quotient(u64::from(wanted) * u64::from(self.gain), at_train);
            let gain = gain.unwrap_or(0);
            let amplitude = recruitment.amplitude_for_gain(Gain::new(U1F31::from_bits(gain)));
            (amplitude, gain, self.train_us)
        } else {
            (
                recruitment.spec().limit,
                self.gain,
                self.period_for_force(wanted),
            )
        };
        let given = match gain {
            0 => 0,
            _ => wanted.clamp(least, most),
        };
        Drive {
            amplitude,
            gain: Gain::new(U1F31::from_bits(gain)),
            force: Force::new(I16F16::from_bits(given.cast_signed())), // below 2^30
            period_us,
            limiting: if wanted > most {
                Some(ForceLimit::AboveMost)
            } else if wanted > 0 && wanted < least {
                Some(ForceLimit::BelowLeast)
            } else {
                None
            },
        }
    }

    /// Returns the period that produces `wanted` at the wearer's limit, µs.
    fn period_for_force(&self, wanted: u32) -> u32 {
        let Some(pieces) = table_position(&self.forces, wanted) else {
            return self.fastest_us;
        };
        let span = self.train_us.saturating_sub(self.fastest_us); // below 2^17
        let shorter = (u64::from(span) * pieces) / ((PIECES as u64) << 16);
        self.train_us.saturating_sub(shorter as u32)
    }
}

/// Returns the position of `wanted` in a table, pieces in 2^-16 from its beginning, or `None` if
/// the table does not contain the force.
fn table_position(forces: &Forces, wanted: u32) -> Option<u64> {
    let above = forces.partition_point(|&force| force <= wanted);
    let high = forces.get(above)?;
    let below = above.checked_sub(1)?;
    let low = forces.get(below)?;
    // low <= wanted < high, so the fraction of a piece is below 2^16; below is 0…15.
    let way = u64::from(wanted.saturating_sub(*low)) << 16;
    let part = quotient(way, high.saturating_sub(*low)).unwrap_or(0);
    Some(((below as u64) << 16) + u64::from(part))
}

/// Returns the period at a position in the table of slow rates (pieces in 2^-16 from its
/// beginning), µs.
fn period_at(place: u64, slowest_us: u32, train_us: u32) -> u32 {
    let rate = |period_us| quotient(RATE, period_us).unwrap_or(u32::MAX);
    let (low, high) = (rate(slowest_us), rate(train_us));
    // Below 2^28 · 2^20.
    let higher = u64::from(high.saturating_sub(low)).wrapping_mul(place) >> 20;
    let rate = u64::from(low).wrapping_add(higher) as u32; // between the two
    let period_us = quotient(RATE, rate).unwrap_or(u32::MAX);
    period_us.max(train_us).min(slowest_us)
}

#[cfg(test)]
mod tests {
    use super::super::settled::{STEPS_LONG, STEPS_MAX, counting};
    use super::*;
    use crate::muscle::RecruitmentSpec;
    use proptest::prelude::*;

    /// Cycles of a step of the model, of a long step, and of the remaining work per period: more
    /// than the chip simulator counts in row `inverse_table_slow` of docs/charts/cycles.csv.
    const CYCLES: [u32; 3] = [210, 260, 800];

    /// All periods of the longest table take the largest number of short steps.
    const CYCLES_MOST: u32 = (2 * PIECES as u32 + 1) * (STEPS_MAX * CYCLES[0] + CYCLES[2]);

    // The watchdog acts at the earliest 4.08 ms after its last refresh. The session waits for a
    // request for up to 1 ms of this time, and interrupts of the other owners may prolong the table
    // by a third: 2.31 ms are left for the table.
    const _: () = assert!(CYCLES_MOST < 388_000 && STEPS_LONG * CYCLES[1] < STEPS_MAX * CYCLES[0]);

    fn cost(spec: CalciumForceSpec, [train, fastest, slowest]: [u32; 3]) -> u32 {
        let recruitment = Recruitment::new(RecruitmentSpec {
            motor_threshold: Amplitude::new(10_000),
            limit: Amplitude::new(20_000),
            reference: Amplitude::new(20_000),
            slope_micro: 300_000,
        });
        counting::take();
        Inverse::new(spec, &recruitment.unwrap(), train, fastest, slowest).unwrap();
        let (short, long) = counting::take();
        let periods = 2 * PIECES as u32 + 1;
        let [step, long_step, period] = CYCLES;
        short * step + long * long_step + periods * period
    }

    /// Slow rates just above the period with the largest number of short steps are the longest
    /// case.
    #[test]
    fn the_longest_table_takes_what_the_watchdog_leaves() {
        let spec = CalciumForceSpec {
            a_mn_per_s: 100_000,
            k_micro: 2_000,
            tau_c_us: 34_166,
            tau1_us: 14_961,
            tau2_us: 493_992,
        };
        assert_eq!(cost(spec, [99_442, 99_097, 99_459]), CYCLES_MOST);
    }

    proptest! {
        #[test]
        fn no_table_takes_more(
            k_micro in 2_000u32..=5_000_000,
            tau_c_us in 5_000u32..=100_000,
            tau1_us in 2_000u32..=200_000,
            tau2_us in 1_000u32..=1_000_000,
            train in 5_000u32..=100_000,
            faster in 0.0..=1.0,
            slower in 0.0..=1.0,
        ) {
            let way = |from: u32, to: u32, part: f64| from + (f64::from(to - from) * part) as u32;
            let tau1_us = tau1_us.max((20 * tau2_us).div_ceil(k_micro - 20)).max(2_200);
            let spec = CalciumForceSpec { a_mn_per_s: 100_000, k_micro, tau_c_us, tau1_us, tau2_us };
            let periods = [train, way(5_000, train, faster), way(train, 2_000_000, slower)];
            prop_assert!(cost(spec, periods) <= CYCLES_MOST);
        }
    }
}
