//! A host's amplitudes, which are carried out at once or in the window that contains their time.

use super::Pulser;
use crate::device::mail::{AnsweredOrder, Order, PulserMail};
use crate::pulse::WINDOW_US;
use crate::safety::{Denial, Stimuli, Timed};
use crate::units::{Micros, us};

impl Pulser {
    /// Accepts amplitudes that are valid from `at` on, or at once without `at`. If they are due in
    /// the window at `start` or earlier, they are carried out after the queued setpoints that are
    /// due no later; if they were due before `start`, they also count as late. Otherwise they are
    /// queued.
    pub(super) fn accept_amplitudes(
        &mut self,
        order: &Order,
        at: Option<Micros>,
        stimuli: &Stimuli,
        start: Micros,
        mail: &mut PulserMail<'_>,
    ) -> Result<(), Denial> {
        if let Some(at) = at
            && at.has_reached(start + us(WINDOW_US))
        {
            let timed = Timed {
                seq: order.seq,
                at,
                stimuli: *stimuli,
            };
            self.guard.queue_timed_order(&timed, start)?;
        } else {
            if let Some(at) = at {
                self.carry_out_due(at, start, mail);
            }
            self.set_amplitudes(stimuli, start)?;
            let is_late = at.is_some_and(|at| at.is_before(start));
            self.late_setpoints = self.late_setpoints.saturating_add(is_late.into());
        }
        self.guard.keep_alive(order.at);
        Ok(())
    }

    /// Carries out the queued setpoint that is due at `until` or before, in the window at `start`.
    /// There is at most one, because no two are due in one window. Its request was acknowledged
    /// when it was queued; if it is refused now, the refusal is reported now.
    #[inline(never)]
    pub(super) fn carry_out_due(
        &mut self,
        until: Micros,
        start: Micros,
        mail: &mut PulserMail<'_>,
    ) {
        let Some(order) = self.guard.take_due_order(until, start) else {
            return;
        };
        if let denied @ Err(_) = self.set_amplitudes(&order.stimuli, start) {
            self.answer_order(order.seq, start, denied, AnsweredOrder::Setpoint, mail);
        }
    }

    /// Sets the amplitudes now, unless the guard refuses them. Never inlined, because the function
    /// is long and the image needs only one copy.
    #[inline(never)]
    fn set_amplitudes(&mut self, stimuli: &Stimuli, start: Micros) -> Result<(), Denial> {
        self.guard.set_amplitudes(stimuli.channels(), start)
    }
}
