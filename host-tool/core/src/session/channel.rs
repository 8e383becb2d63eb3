//! A channel of a session, and the unit of its amplitudes.

use firmware::control::{ForceControl, ForceSpec};
use firmware::muscle::Recruitment;
use firmware::safety::{ChannelSpec, StageSpec};
use firmware::units::Amplitude;

use super::muscle::Muscle;
use crate::fields::decimal::format_scaled;
use crate::fields::error::Problem;
use crate::fields::table::Table;
use crate::wearer::Unit;

/// One output channel of a session, with its optional muscle model and force control.
#[derive(Clone, PartialEq, Debug)]
pub struct Channel {
    /// Number in session files and on the board, 1–10. See [`Channel::index`] for the number on the
    /// link.
    pub number: u8,
    /// Name that the wearer uses for the channel.
    pub name: String,
    /// Train, output stage and amplitude limit, as the device receives them.
    pub spec: ChannelSpec,
    /// Model of the muscle under the electrodes; `None` if the device predicts no force for this
    /// channel.
    pub muscle: Option<Muscle>,
    /// Force control of the muscle on the device; `None` if the file gives the channel no `force`.
    pub force: Option<ForceSpec>,
}

impl Channel {
    /// Returns the index by which the protocol addresses the channel: 0–9, one less than its
    /// number.
    #[must_use]
    pub const fn index(&self) -> u8 {
        self.number - 1 // 1–10
    }

    /// Returns the force control as the device runs it, or `None` if the channel has no valid
    /// muscle or no `force` table.
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

    /// Returns whether a setpoint may ask for a pulse width other than the train's own. This is so
    /// if `max_width_us` is larger than `width_us`.
    #[must_use]
    pub const fn has_live_width(&self) -> bool {
        self.spec.train.max_width_us > self.spec.train.width_us
    }

    /// Returns the unit of the amplitudes: mA for a current stage, V for a voltage stage.
    #[must_use]
    pub const fn unit(&self) -> Unit {
        match self.spec.stage {
            StageSpec::Current { .. } => Unit::Milliampere,
            StageSpec::Voltage { .. } => Unit::Volt,
        }
    }

    /// Reports that the field `name` asks for more than the channel's limit.
    pub(super) fn report_above_limit(&self, t: &Table<'_>, name: &str) {
        let (channel, limit) = (self.number, self.format_amplitude(self.spec.limit));
        t.report(name, Problem::AboveChannelLimit { channel, limit });
    }

    /// Formats an amplitude of this channel for people, for example "28 V".
    #[must_use]
    pub fn format_amplitude(&self, amplitude: Amplitude) -> String {
        let value = format_scaled(amplitude.get().into(), 3);
        format!("{value} {}", self.unit().symbol())
    }
}
