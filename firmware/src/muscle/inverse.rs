//! From a wanted force to the pulses that give it: amplitude first, and where
//! that is at the wearer's limit, pulse rate.
//!
//! At a period T and a gain the calcium–force model settles to gain·F(T). Up
//! to limit·F(slowest T) only the amplitude changes, above it only T: a muscle
//! tires less at a low rate. F is tabled once over evenly spaced periods, in
//! which it is smoothest.

use super::calcium_force::{CalciumForce, CalciumForceSpec};
use super::settled::Steady;
use super::{Gain, OutOfRange, Parameter, Recruitment, within};
use crate::division::quotient;
use crate::units::{Amplitude, Force};
use fixed::types::{I16F16, U1F31};

/// Shortest and longest period that a force is had with, µs: 200 Hz, and 10 Hz,
/// below which a muscle twitches and its mean force says little.
pub const PERIOD_US: (u32, u32) = (5_000, 100_000);

/// Pieces of the table. Between their ends the mean force of Lee's subjects is
/// 0.9 % off from 10 to 100 Hz and 0.1 % from 20 to 60 Hz.
const PIECES: usize = 16;

/// Pulses that give a force.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Drive {
    /// At most the wearer's limit.
    pub amplitude: Amplitude,
    /// Burst start to burst start, µs.
    pub period_us: u32,
    /// More was wanted than the limits allow.
    pub limiting: bool,
}

/// One muscle's inverse between two pulse rates.
#[derive(Clone, Copy, Debug)]
pub struct Inverse {
    slowest_us: u32,
    fastest_us: u32,
    /// Mean force at the wearer's limit, N in 2^-16 and below 2^30, slowest rate
    /// first; never falls.
    forces: [u32; PIECES + 1],
    /// Gain at the wearer's limit, Q31.
    gain: u32,
    /// Least force but none, N in 2^-16: motor threshold at the slowest rate.
    least: u32,
    threshold: Amplitude,
    /// How late force follows at the slowest rate, µs, and what each 2^-16 N
    /// beyond it changes in that, µs in 2^-30.
    late_us: i64,
    late_change: i64,
}

impl Inverse {
    /// Tables a muscle whose pulses may come every `slowest_us` to every
    /// `fastest_us`; both the same for a fixed rate.
    ///
    /// # Errors
    /// [`OutOfRange`] names a parameter of the muscle or one of the periods.
    pub fn new(
        spec: CalciumForceSpec,
        recruitment: &Recruitment,
        slowest_us: u32,
        fastest_us: u32,
    ) -> Result<Self, OutOfRange> {
        let muscle = CalciumForce::new(spec)?;
        let (shortest, longest) = PERIOD_US;
        within(Parameter::Period, slowest_us, shortest, longest)?;
        within(Parameter::ShortestPeriod, fastest_us, shortest, slowest_us)?;
        let (threshold, limit) = (recruitment.spec().motor_threshold, recruitment.spec().limit);
        let gain_at = |amplitude| recruitment.gain(amplitude).get().to_bits();
        let (gain, least) = (gain_at(limit), gain_at(threshold));
        // Half of the shortest time constant at most, as the steps want it.
        let step_us = if spec.tau1_us < 4_000 { 1_000 } else { 2_000 };
        let steady = |period_us: u32| muscle.steady(period_us, step_us);
        // Full scale is below 2^30 in 2^-16 N, the product of fractions as well.
        let newtons = |share: u32, gain: u32| {
            let share = (u64::from(share) * u64::from(gain)) >> 31;
            ((share * u64::from(muscle.full_scale)) >> 32) as u32
        };
        // τ of a change of gain, and half a period until the next pulse is due.
        let late = |period_us: u32| {
            let Steady { force, activation } = steady(period_us);
            let scale = u64::from(spec.tau1_us + spec.tau2_us); // below 2^21
            let tau = quotient(scale * u64::from(force), activation).unwrap_or(0);
            i64::from(tau) + i64::from(period_us / 2)
        };
        let span = slowest_us.saturating_sub(fastest_us);
        let slow = steady(slowest_us);
        let mut forces = [newtons(slow.force, gain); PIECES + 1];
        if span > 0 {
            let mut before = 0;
            // The index is at most 16.
            for (index, force) in (0u32..).zip(&mut forces) {
                let period_us = slowest_us.saturating_sub(span * index / PIECES as u32);
                before = newtons(steady(period_us).force, gain).max(before);
                *force = before;
            }
        }
        let late_us = late(slowest_us);
        let beyond = forces
            .last()
            .copied()
            .unwrap_or(0)
            .saturating_sub(forces[0]);
        // Below 2^22 µs each: 2^52.
        let late_change = late(fastest_us).saturating_sub(late_us) << 30;
        Ok(Self {
            slowest_us,
            fastest_us,
            forces,
            gain,
            least: newtons(slow.force, least),
            threshold,
            late_us,
            late_change: late_change.checked_div(beyond.into()).unwrap_or(0),
        })
    }

    /// The least force but none and the most, steady.
    #[must_use]
    pub fn reach(&self) -> (Force, Force) {
        let force = |bits: u32| Force(I16F16::from_bits(bits.cast_signed())); // below 2^30
        (force(self.least), force(self.most()))
    }

    fn most(&self) -> u32 {
        self.forces.last().copied().unwrap_or(0)
    }

    /// What to want of [`Self::drive`] so that force is `force` now while it
    /// changes by `newtons_per_s`: force lags behind its pulses by one time
    /// constant, which the model gives, and a pulse's amplitude by half a period.
    /// Saturates.
    #[must_use]
    pub fn ahead(&self, force: Force, newtons_per_s: I16F16) -> Force {
        let bits = i64::from(force.0.to_bits());
        let slowest = i64::from(self.forces.first().copied().unwrap_or(0));
        let above = bits.wrapping_sub(slowest);
        let beyond = i64::from(self.most()).wrapping_sub(slowest);
        let above = above.max(0).min(beyond); // never falls: beyond >= 0
        // At most the whole change: 2^21 µs in 2^-30.
        let change = above.wrapping_mul(self.late_change) >> 30;
        // Below 2^22 · 2^31; over 10^6, which is 2^36/68 719 to 7e-6.
        let late_us = self.late_us.wrapping_add(change);
        let lead = late_us.wrapping_mul(i64::from(newtons_per_s.to_bits())) >> 20;
        let bits = bits.wrapping_add(lead.wrapping_mul(68_719) >> 16);
        let bits = bits.clamp(i32::MIN.into(), i32::MAX.into());
        Force(I16F16::from_bits(bits as i32))
    }

    /// The pulses for a steady mean force. Below the least force: motor
    /// threshold from half of it on, else none.
    #[must_use]
    pub fn drive(&self, recruitment: &Recruitment, force: Force) -> Drive {
        let wanted = force.0.to_bits().max(0).cast_unsigned();
        let slowest = self.forces.first().copied().unwrap_or(0);
        let (amplitude, period_us) = if wanted <= self.least {
            let none = wanted < self.least.div_ceil(2);
            let amplitude = if none {
                Amplitude::ZERO
            } else {
                self.threshold
            };
            (amplitude, self.slowest_us)
        } else if wanted <= slowest {
            // At most the limit's gain, by wanted <= slowest.
            let gain = quotient(u64::from(wanted) * u64::from(self.gain), slowest);
            let gain = Gain::new(U1F31::from_bits(gain.unwrap_or(0)));
            (recruitment.amplitude_for_gain(gain), self.slowest_us)
        } else {
            (recruitment.spec().limit, self.period(wanted))
        };
        Drive {
            amplitude,
            period_us,
            limiting: wanted > self.most(),
        }
    }

    /// The period that gives `wanted` at the wearer's limit.
    fn period(&self, wanted: u32) -> u32 {
        let above = self.forces.partition_point(|&force| force <= wanted);
        let (Some(&high), Some(&low)) = (
            self.forces.get(above),
            above
                .checked_sub(1)
                .and_then(|below| self.forces.get(below)),
        ) else {
            return self.fastest_us;
        };
        // low <= wanted < high: a part below 2^16 of a piece; above is 1…16.
        let way = u64::from(wanted.saturating_sub(low)) << 16;
        let part = quotient(way, high.saturating_sub(low)).unwrap_or(0);
        let pieces = ((above as u64).saturating_sub(1) << 16) + u64::from(part);
        let span = self.slowest_us.saturating_sub(self.fastest_us); // below 2^17
        let shorter = (u64::from(span) * pieces) / ((PIECES as u64) << 16);
        self.slowest_us.saturating_sub(shorter as u32)
    }
}
