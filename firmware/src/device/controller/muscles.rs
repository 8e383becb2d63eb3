//! The muscle models of the controller.

use super::{Controller, MuscleTables, Phase};
use crate::device::mail::{ControlOrder, ControllerMail};
use crate::link::{Code, Refusal};
use crate::muscle::MuscleLevel;
use crate::safety::Fault;
use crate::units::{Amplitude, Micros};

impl Controller {
    /// Passes a pulse to the channel's muscle model and force control.
    pub(super) fn handle_pulse(
        &mut self,
        channel: u8,
        at: Micros,
        amplitude: Amplitude,
        tables: &MuscleTables,
    ) {
        let muscles = self.setup.muscles.iter().zip(&mut self.muscles);
        let mut muscles = muscles.zip(tables.all());
        let Some(((muscle, state), table)) =
            muscles.find(|((muscle, _), _)| muscle.channel == channel)
        else {
            return;
        };
        let gain = muscle.recruitment.gain(amplitude);
        muscle.force.pulse_by(table, state, at, gain);
        let mut forces = self.setup.forces.iter().zip(&mut self.forces);
        if let Some((force, followed)) = forces.find(|(force, _)| force.channel == channel) {
            force.note_pulse(&mut followed.state, gain, state.strength());
        }
    }

    /// Advances the muscle models to the tick's time, and their tables by a row.
    pub(super) fn advance_muscles(
        &mut self,
        now: Micros,
        tables: &mut MuscleTables,
        mail: &mut ControllerMail<'_>,
    ) {
        let muscles = self.setup.muscles.iter().zip(&mut self.muscles);
        for ((muscle, state), table) in muscles.zip(tables.all()) {
            muscle.force.advance_by(table, state, now);
        }
        tables.solve_row(&self.setup.muscles, &mut self.muscles);
        if !tables.is_row_intact() {
            let _ = mail.post_order(ControlOrder::Fault(Fault::Ram)); // counted
        }
    }

    /// Lets another level compute the force of a channel's muscle, from `now` on.
    pub(super) fn change_model_level(
        &mut self,
        channel: u8,
        level: MuscleLevel,
        now: Micros,
    ) -> Result<(), Refusal<'static>> {
        if self.phase == Phase::Off {
            return Err(Refusal::new(Code::NotArmed, "state"));
        }
        let mut muscles = self.setup.muscles.iter().zip(&mut self.muscles);
        let (muscle, state) = muscles
            .find(|(muscle, _)| muscle.channel == channel)
            .ok_or(Refusal::new(Code::NoMuscle, "muscle").with_channel(channel))?;
        muscle
            .force
            .switch(state, level, now)
            .map_err(|_| Refusal::new(Code::NoFatigue, "fatigue").with_channel(channel))
    }
}
