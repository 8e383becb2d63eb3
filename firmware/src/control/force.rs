//! Force control of one channel: computes amplitude and pulse rate from timed force setpoints with
//! the inverse of the muscle model, and corrects them with the force that the muscle model
//! predicts, if one runs. No force is measured.

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
    /// Shortest period, to which the pulse rate may rise once the amplitude is at the wearer's
    /// limit, µs: from 5000 to the train's period. Equal to the train's period for a rate that
    /// never rises.
    pub min_period_us: u32,
    /// Behaviour of the reference between and after setpoints.
    pub hold: HoldPolicy,
    /// Longest period, to which the pulse rate may fall once the amplitude is at motor threshold,
    /// µs: from the train's period to 2,000,000. `None` means the train's period: the rate never
    /// falls.
    pub max_period_us: Option<u32>,
}

impl ForceSpec {
    /// Checks everything that does not depend on the channel: that the periods are valid for some
    /// train, not that they suit the channel's own.
    ///
    /// # Errors
    /// Returns the first offending field and its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_hold()?;
        Inverse::MIN_PERIOD_US.check(self.min_period_us)?;
        if let Some(longest_us) = self.max_period_us {
            Inverse::MAX_PERIOD_US.check(longest_us)?;
        }
        Ok(())
    }

    /// Checks only the behaviour between setpoints.
    ///
    /// # Errors
    /// Returns the offending field and its range.
    pub fn check_hold(&self) -> Result<(), OutOfRange> {
        if let HoldPolicy::Extrapolate { max_ms } = self.hold {
            HoldPolicy::MAX_MS.check(max_ms)?;
        }
        Ok(())
    }
}

/// Validated force control of a channel. Everything that changes is in a [`ForceState`].
#[derive(Clone, Debug)]
pub struct ForceControl {
    /// Number of the channel, from 0.
    pub channel: u8,
    hold: HoldPolicy,
    recruitment: Recruitment,
    inverse: Inverse,
}

/// State of a channel under force control. Every stimulation must begin with a fresh state.
#[derive(Clone, Debug, Default)]
pub struct ForceState {
    track: SetpointTrack<Force>,
    /// Correction by the predicted force, present while a model predicts the muscle's force.
    steering: Option<Steering>,
}

/// Output of force control for a channel from this tick on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ForceOrders {
    /// Reference force now.
    pub target: Force,
    /// Amplitude and period of the pulses for the corrected force.
    pub drive: Drive,
    /// Gap of unreachable forces that contains the reference, if there is one.
    pub gap: Option<ForceGap>,
}

/// Two forces between which the wearer's limits make no force possible, as they travel on the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ForceGap {
    /// Lower end of the gap, mN: always zero.
    pub lower_mn: u32,
    /// Upper end of the gap, mN, rounded up: the force at motor threshold and the slowest rate.
    pub upper_mn: u32,
}

/// Reason why a force setpoint was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ForceError {
    /// The wearer's limits do not allow the force.
    OutOfReach {
        /// Smallest force above zero that the limits allow, mN.
        min_mn: u32,
        /// Largest force that the limits allow, mN.
        max_mn: u32,
    },
    /// The setpoint's time is not acceptable.
    Setpoint(SetpointError),
}

impl ForceControl {
    /// Creates force control of `channel`, whose train has a period of `period_us`.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] with the offending muscle parameter or period.
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

    /// Returns the smallest force above zero and the largest force that the wearer's limits allow.
    #[must_use]
    pub fn force_range(&self) -> (Force, Force) {
        self.inverse.force_range()
    }

    /// Returns [`Self::force_range`] in whole mN. A setpoint may ask for zero, or for a force from
    /// the first to the second value.
    #[must_use]
    pub fn force_range_mn(&self) -> (u32, u32) {
        let (least, most) = self.force_range();
        let min_mn = least.to_millinewton(); // below 2^25
        let is_short = Force::from_millinewton(min_mn) < least;
        let max_mn = most.to_millinewton();
        ((min_mn + u32::from(is_short)).min(max_mn), max_mn)
    }

    /// Accepts a force valid from `at`; see [`SetpointTrack::accept`].
    ///
    /// # Errors
    /// Returns [`ForceError`] if the force is refused. The state is then unchanged.
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

    /// Records a pulse of the channel that drives its muscle with `gain`. `strength` is the share
    /// of parameter A that fatigue has left.
    pub fn note_pulse(&self, state: &mut ForceState, gain: Gain, strength: U1F31) {
        if let Some(steering) = &mut state.steering {
            steering.record_pulse(gain, strength, &self.inverse);
        }
    }

    /// Runs one control tick with the force that the muscle model predicts, if a model runs.
    /// Returns `None` until the first setpoint is due. Compensates the muscle's lag behind a
    /// changing force, as far as the limits and zero allow.
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
            // Deviations of the inverse's table count neither as saturation nor as lack of force.
            let (least, most) = self.force_range();
            let (least, most) = (least.get(), most.get());
            let slack = least.saturating_sub(least / 50)..=most.saturating_add(most / 100);
            if slack.contains(&wanted.get()) {
                drive.limiting = None;
            }
        }
        let gap = (drive.limiting == Some(ForceLimit::BelowLeast)).then(|| ForceGap {
            lower_mn: 0,
            upper_mn: self.force_range_mn().0,
        });
        Some(ForceOrders { target, drive, gap })
    }
}
