//! A channel of a session, and what its amplitudes are.

use firmware::control::{ForceControl, ForceSpec};
use firmware::muscle::Recruitment;
use firmware::safety::{ChannelSpec, StageSpec};
use firmware::units::Amplitude;

use super::muscle::Muscle;
use crate::fields::decimal::in_units;
use crate::fields::error::Problem;
use crate::fields::table::Table;
use crate::wearer::Unit;

/// One channel of a session.
#[derive(Clone, PartialEq, Debug)]
pub struct Channel {
    /// Its number in files and on the board, 1–10; the link counts from 0.
    pub number: u8,
    /// What the wearer calls it.
    pub name: String,
    /// Its train, stage and limit, as the device gets them.
    pub spec: ChannelSpec,
    /// The muscle under it, if its force is to be predicted.
    pub muscle: Option<Muscle>,
    /// How the device controls that muscle's force, if the host asks for forces.
    pub force: Option<ForceSpec>,
}

impl Channel {
    /// Its number on the link, 0–9.
    #[must_use]
    pub const fn index(&self) -> u8 {
        self.number - 1 // 1–10
    }

    /// Its force control as the device will run it.
    pub(super) fn force_control(&self) -> Option<ForceControl> {
        let muscle = self.muscle.as_ref()?;
        let recruitment = Recruitment::new(muscle.recruitment).ok()?;
        let period_us = self.spec.train.period_us;
        ForceControl::new(
            self.index(),
            &self.force?,
            muscle.force,
            recruitment,
            period_us,
        )
        .ok()
    }

    /// Whether a setpoint may ask for another width than the train's own.
    #[must_use]
    pub const fn has_live_width(&self) -> bool {
        self.spec.train.max_width_us > self.spec.train.width_us
    }

    /// What its amplitudes are.
    #[must_use]
    pub const fn unit(&self) -> Unit {
        match self.spec.stage {
            StageSpec::Current { .. } => Unit::Milliampere,
            StageSpec::Voltage { .. } => Unit::Volt,
        }
    }

    /// Tells that a field asks for more than its limit.
    pub(super) fn tell_above_limit(&self, t: &Table<'_>, name: &str) {
        let (channel, limit) = (self.number, self.display(self.spec.limit));
        t.say(name, Problem::AboveChannelLimit { channel, limit });
    }

    /// An amplitude of this channel for people: "28 V".
    #[must_use]
    pub fn display(&self, amplitude: Amplitude) -> String {
        let value = in_units(amplitude.get().into(), 3);
        format!("{value} {}", self.unit().symbol())
    }
}
