//! Telemetry samples of the controller, at the period that a host asked for.

use super::{Controller, MuscleTables, Phase, TickResult};
use crate::device::mail::ControllerMail;
use crate::haptics::Wall;
use crate::link::{ForceSample, Telemetry};
use crate::pulse::CHANNELS;
use crate::units::{Angle, Force, Micros};

/// The host's request for telemetry samples, and the time to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Subscription {
    /// Number of ticks from sample to sample; 0 for no samples.
    period: u16,
    until_sample: u16,
}

impl Subscription {
    /// Starts samples every `period` ticks from now on. If the period is the same as before, the
    /// phase is kept: a host may repeat its subscription to compare clocks.
    pub(super) const fn subscribe(&mut self, period: u16) {
        if self.period != period {
            (self.period, self.until_sample) = (period, period);
        }
    }

    /// Returns whether a sample is due in this tick.
    const fn is_due(&mut self) -> bool {
        self.until_sample = self.until_sample.saturating_sub(1);
        if self.period == 0 || self.until_sample != 0 {
            return false;
        }
        self.until_sample = self.period;
        true
    }
}

impl Controller {
    /// Posts a sample if one is due.
    pub(super) fn post_sample(
        &mut self,
        now: Micros,
        acted: Option<&TickResult>,
        tables: &MuscleTables,
        mail: &mut ControllerMail<'_>,
    ) {
        if !self.subscription.is_due() {
            return;
        }
        let mut sample = Telemetry {
            at: now,
            reference_centideg: self.target(acted).map(Angle::to_centideg),
            measured_centideg: acted.map(|acted| acted.measured.to_centideg()),
            effort_milli: acted.and_then(|acted| acted.effort_milli),
            limiting: core::mem::take(&mut self.limiting),
            wrench: self.take_wrench(),
            lift: self.lift_sample(),
            state: self.state,
            ..Telemetry::default()
        };
        for channel in 0..CHANNELS as u8 {
            if self.setup.channels & 1 << channel != 0 {
                let stimulus = self.in_force.stimulus(channel);
                let amplitude = stimulus.map(|stimulus| stimulus.amplitude);
                let _ = sample.amplitudes.push(amplitude); // as many slots as channels
                if self.setup.live_widths & 1 << channel != 0 {
                    let width_us = stimulus.map(|stimulus| stimulus.width_us);
                    let _ = sample.widths_us.push(width_us); // same
                }
            }
        }
        let muscles = self.setup.muscles.iter().zip(&self.muscles);
        for ((muscle, state), table) in muscles.zip(tables.all()) {
            let force = muscle.force.predicted_force(table, state);
            let _ = sample.forces_mn.push(force.map(Force::to_millinewton)); // same
        }
        for (force, followed) in self.setup.forces.iter().zip(&mut self.forces) {
            let force = ForceSample {
                reference_mn: followed.reference_mn,
                period_us: self.in_force.period_us(force.channel),
                gap: followed.gap.take(),
            };
            let _ = sample.force_control.push(force); // same
        }
        let _ = mail.post_sample(sample); // counted
    }

    /// Returns the angle that the joint has to follow, or the angle of the wall, which needs no
    /// measurement.
    fn target(&self, acted: Option<&TickResult>) -> Option<Angle> {
        let wall = self.setup.wall.as_ref();
        let stands = wall.filter(|_| self.phase == Phase::Running);
        acted
            .and_then(|acted| acted.target)
            .or_else(|| stands.map(Wall::wall_angle))
    }
}
