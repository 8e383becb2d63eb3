//! One channel under force control: from timed wanted forces to amplitude and
//! pulse rate, through its muscle run backwards, steered by the force that the muscle's
//! model predicts, if one runs. Nothing is measured.

use super::setpoint::{HoldPolicy, SetpointError, SetpointTrack};
use super::steering::Steering;
use crate::muscle::{CalciumForceSpec, Drive, ForceLimit, Gain, Inverse, Recruitment};
use crate::range::OutOfRange;
use crate::units::{Force, ForceRate, Micros};
use fixed::types::U1F31;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Force control of a channel as it travels on the wire, unvalidated.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ForceSpec {
    /// Shortest period, to which the pulse rate may rise once the amplitude is at
    /// the wearer's limit, µs: 5000 up to the train's period. The same as that for a
    /// rate that never rises.
    pub min_period_us: u32,
    /// What to do between and after setpoints.
    pub hold: HoldPolicy,
    /// Longest period, to which the pulse rate may fall once the amplitude is at
    /// motor threshold, µs: the train's period up to 2,000,000. `None` is the
    /// train's: the rate never falls.
    pub max_period_us: Option<u32>,
}

impl ForceSpec {
    /// Checks what can be checked without the channel: that the periods are some
    /// train's, not that they fit its own.
    ///
    /// # Errors
    /// The field and what it may be.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_hold()?;
        Inverse::MIN_PERIOD_US.check(self.min_period_us)?;
        if let Some(longest_us) = self.max_period_us {
            Inverse::MAX_PERIOD_US.check(longest_us)?;
        }
        Ok(())
    }

    /// Checks what to do between setpoints alone.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn check_hold(&self) -> Result<(), OutOfRange> {
        if let HoldPolicy::Extrapolate { max_ms } = self.hold {
            HoldPolicy::MAX_MS.check(max_ms)?;
        }
        Ok(())
    }
}

/// A validated channel under force control. What changes is a [`ForceState`].
#[derive(Clone, Debug)]
pub struct ForceControl {
    /// From 0.
    pub channel: u8,
    hold: HoldPolicy,
    recruitment: Recruitment,
    inverse: Inverse,
}

/// What a channel under force control remembers. Begin every stimulation with a
/// fresh one.
#[derive(Clone, Debug, Default)]
pub struct ForceState {
    track: SetpointTrack<Force>,
    /// While a model predicts the muscle's force.
    steering: Option<Steering>,
}

/// What a channel is to do from this tick on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ForceOrders {
    /// The force wanted now.
    pub target: Force,
    /// The pulses for it.
    pub drive: Drive,
    /// Between which two it lies, if it cannot be given.
    pub gap: Option<ForceGap>,
}

/// Two forces with none between them that the wearer's limits can give, as they
/// travel on the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ForceGap {
    /// The lower one, mN: none.
    pub below_mn: u32,
    /// The upper one, mN, rounded up: that at motor threshold and the slowest rate.
    pub above_mn: u32,
}

/// Why a wanted force was not taken.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ForceError {
    /// The wearer's limits cannot give it.
    OutOfReach {
        /// The least they can but none, mN.
        min_mn: u32,
        /// The most they can, mN.
        max_mn: u32,
    },
    /// Its time.
    Setpoint(SetpointError),
}

impl ForceControl {
    /// Force control of `channel`, whose train has a period of `period_us`.
    ///
    /// # Errors
    /// [`OutOfRange`] names a parameter of the muscle or a period.
    pub fn new(
        channel: u8,
        spec: &ForceSpec,
        muscle: CalciumForceSpec,
        recruitment: Recruitment,
        period_us: u32,
    ) -> Result<Self, OutOfRange> {
        let fastest_us = spec.min_period_us;
        let slowest_us = spec.max_period_us.unwrap_or(period_us);
        let inverse = Inverse::new(muscle, &recruitment, period_us, fastest_us, slowest_us)?;
        Ok(Self {
            channel,
            hold: spec.hold,
            inverse,
            recruitment,
        })
    }

    /// The least force but none and the most that the wearer's limits allow.
    #[must_use]
    pub fn force_range(&self) -> (Force, Force) {
        self.inverse.force_range()
    }

    /// [`Self::force_range`] in whole mN that can be asked for: none, and from the first
    /// to the second.
    #[must_use]
    pub fn force_range_mn(&self) -> (u32, u32) {
        let (least, most) = self.force_range();
        let min_mn = least.to_millinewton(); // below 2^25
        let is_short = Force::from_millinewton(min_mn) < least;
        let max_mn = most.to_millinewton();
        ((min_mn + u32::from(is_short)).min(max_mn), max_mn)
    }

    /// Takes a force valid from `at`; see [`SetpointTrack::accept`].
    ///
    /// # Errors
    /// [`ForceError`]; the state is unchanged then.
    pub fn accept_setpoint(
        &self,
        state: &mut ForceState,
        now: Micros,
        at: Micros,
        millinewton: u32,
        rate: Option<ForceRate>,
    ) -> Result<(), ForceError> {
        let (min_mn, max_mn) = self.force_range_mn();
        if millinewton > max_mn {
            return Err(ForceError::OutOfReach { min_mn, max_mn });
        }
        let force = Force::from_millinewton(millinewton);
        let taken = state.track.accept(now, at, force, rate);
        taken.map_err(ForceError::Setpoint)
    }

    /// A pulse of the channel that drives its muscle with `gain`, of whose A work has
    /// left `strength`.
    pub fn note_pulse(&self, state: &mut ForceState, gain: Gain, strength: U1F31) {
        if let Some(steering) = &mut state.steering {
            steering.record_pulse(gain, strength, &self.inverse);
        }
    }

    /// One control tick, with what the muscle's model predicts if one runs. `None`
    /// until the first setpoint is due: nobody has asked for anything. A force that
    /// changes is answered ahead of the muscle's lag, as far as limits and zero allow.
    pub fn tick(
        &self,
        state: &mut ForceState,
        now: Micros,
        predicted: Option<Force>,
    ) -> Option<ForceOrders> {
        match predicted {
            Some(predicted) => state
                .steering
                .get_or_insert_default()
                .record_prediction(predicted),
            None => state.steering = None,
        }
        let (target, rate) = state.track.motion_at(now, self.hold)?;
        let mut wanted = self.inverse.compensate_lag(target, rate);
        if let Some(steering) = &state.steering {
            wanted = steering.correct(wanted);
        }
        let mut drive = self.inverse.drive(&self.recruitment, wanted);
        if let Some(steering) = &mut state.steering {
            steering.record_order(&drive);
            // What the inverse's table errs is neither strength nor want of it.
            let (least, most) = self.force_range();
            let (least, most) = (least.get(), most.get());
            let slack = least.saturating_sub(least / 50)..=most.saturating_add(most / 100);
            if slack.contains(&wanted.get()) {
                drive.limiting = None;
            }
        }
        let gap = (drive.limiting == Some(ForceLimit::BelowLeast)).then(|| ForceGap {
            below_mn: 0,
            above_mn: self.force_range_mn().0,
        });
        Some(ForceOrders { target, drive, gap })
    }
}
