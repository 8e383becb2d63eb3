//! Control of the channels under force control.

use super::{Controller, MuscleTables, Phase};
use crate::control::ForceOrders;
use crate::device::mail::{ControlOrder, ControllerMail};
use crate::safety::State;
use crate::units::Micros;

impl Controller {
    /// Runs the channels under force control while stimulating.
    pub(super) fn control_forces(
        &mut self,
        now: Micros,
        tables: &MuscleTables,
        mail: &mut ControllerMail<'_>,
    ) {
        if self.phase != Phase::Running {
            return;
        }
        let muscles = self.setup.muscles.iter().zip(&self.muscles);
        let mut muscles = muscles.zip(tables.all());
        for (force, followed) in self.setup.forces.iter().zip(&mut self.forces) {
            // Both are sorted by channel, and every channel under force control has a muscle.
            let muscle = muscles.find(|((muscle, _), _)| muscle.channel == force.channel);
            let predicted = muscle
                .and_then(|((muscle, state), table)| muscle.force.predicted_force(table, state));
            let orders = force.tick(&mut followed.state, now, predicted);
            let Some(ForceOrders { target, drive, gap }) = orders else {
                continue;
            };
            self.limiting |= drive.limiting.is_some();
            followed.reference_mn = Some(target.to_nearest_millinewton());
            followed.gap = gap.or(followed.gap); // since the last sample, as `limiting`
            if self.state == State::Stimulating {
                self.in_force.set_amplitude(force.channel, drive.amplitude);
                self.in_force.set_period(force.channel, drive.period_us);
            }
            let pulses = ControlOrder::Pulses {
                channel: force.channel,
                amplitude: drive.amplitude,
                period_us: drive.period_us,
            };
            let _ = mail.post_order(pulses); // counted
        }
    }
}
