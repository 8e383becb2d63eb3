//! A host's amplitudes: carried out at once, or in the window that contains their time.

use super::Pulser;
use crate::device::mail::{Answered, Order, PulserMail};
use crate::pulse::WINDOW_US;
use crate::safety::{Denied, Stimuli, Timed};
use crate::units::{Micros, us};

impl Pulser {
    /// Takes amplitudes that hold from `at` on, or from now. What is due in the window at
    /// `start` or was before is carried out, behind what waits and is due no later; of what
    /// was due before, it is counted. All else waits.
    pub(super) fn accept_amplitudes(
        &mut self,
        order: &Order,
        at: Option<Micros>,
        stimuli: &Stimuli,
        start: Micros,
        mail: &mut PulserMail<'_>,
    ) -> Result<(), Denied> {
        if let Some(at) = at
            && at.has_reached(start + us(WINDOW_US))
        {
            let timed = Timed {
                seq: order.seq,
                at,
                stimuli: *stimuli,
            };
            self.guard.wait_for_time(&timed, start)?;
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

    /// Carries out what waits and is due at `until` or before, in the window at `start`: one
    /// order, for no two are due in a window. Its request was acknowledged when it began to
    /// wait; if it is refused now, that is said then.
    #[inline(never)]
    pub(super) fn carry_out_due(
        &mut self,
        until: Micros,
        start: Micros,
        mail: &mut PulserMail<'_>,
    ) {
        let Some(order) = self.guard.take_due(until, start) else {
            return;
        };
        if let denied @ Err(_) = self.set_amplitudes(&order.stimuli, start) {
            self.verdict(order.seq, start, denied, Answered::Setpoint, mail);
        }
    }

    /// Once in the image: it is long.
    #[inline(never)]
    fn set_amplitudes(&mut self, stimuli: &Stimuli, start: Micros) -> Result<(), Denied> {
        self.guard.set_amplitudes(stimuli.channels(), start)
    }
}
