//! Orders of the session, and stops, which overtake them.

use super::Pulser;
use crate::device::mail::{
    AnsweredOrder, ControlEvent, Order, OrderKind, PulserMail, ReleaseAnswer, Report,
};
use crate::device::session::may_release;
use crate::pulse::Levels;
use crate::safety::{Denial, Fault, Inputs};
use crate::units::Micros;

impl Pulser {
    /// Carries out a stop, if one was raised, and then the posted orders. An order from before the
    /// stop is void; others are judged in the present state. Meanwhile nothing can be raised or
    /// posted, because the session has a lower interrupt priority.
    pub(super) fn accept_orders(
        &mut self,
        start: Micros,
        inputs: &Inputs,
        mail: &mut PulserMail<'_>,
    ) {
        let raised = mail.stop.count_raised();
        if raised != self.stops {
            self.stops = raised;
            if let Some(notice) = self.guard.stop(start) {
                self.announce(notice, start, mail);
            }
        }
        if self.stops_told != raised {
            let report = Report::Stopped {
                stops: raised,
                at: start,
                state: self.guard.state(),
            };
            if mail.report(report).is_ok() {
                self.stops_told = raised; // else again with the next window
            }
        }
        // One copy of the order as a whole: taken out as an `Option`, it is copied byte by byte,
        // twice.
        while let Some(&order) = mail.orders.peek() {
            let _ = mail.orders.dequeue();
            if order.stops == raised {
                self.accept_order(&order, start, inputs, mail);
            } else {
                self.void_order(&order, start, inputs, mail);
            }
        }
    }

    /// Handles an order that a stop has overtaken: it is void if it could cause output.
    fn void_order(
        &mut self,
        order: &Order,
        start: Micros,
        inputs: &Inputs,
        mail: &mut PulserMail<'_>,
    ) {
        let denied = match order.kind {
            OrderKind::Arm => {
                while mail.setup.dequeue().is_some() {}
                self.notify(ControlEvent::Refused, mail);
                Denial::Cancelled
            }
            OrderKind::Pulses => {
                let _ = mail.lists.dequeue();
                Denial::Stopped
            }
            OrderKind::Start | OrderKind::Amplitudes { .. } => Denial::Stopped,
            OrderKind::Acknowledge
            | OrderKind::Status
            | OrderKind::KeepAlive
            | OrderKind::Forget
            | OrderKind::Release { .. } => {
                return self.accept_order(order, start, inputs, mail);
            }
        };
        let answered = match order.kind {
            OrderKind::Start => AnsweredOrder::Start,
            _ => AnsweredOrder::Other,
        };
        self.answer_order(order.seq, start, Err(denied), answered, mail);
    }

    /// Hands over the time and charge spent of the wearer's allowance to be written.
    #[cold]
    #[inline(never)]
    pub(super) fn send_entry(&mut self, mail: &mut PulserMail<'_>) {
        if mail.send_entry(self.guard.entry()).is_ok() {
            self.guard.mark_entry_sent(); // else again with the next window
        }
    }

    /// Reports a change to the controller. If the controller does not take its mail, it would
    /// continue as before: that is a fault.
    pub(super) fn notify(&mut self, event: ControlEvent, mail: &mut PulserMail<'_>) {
        if mail.notify(event).is_err() {
            self.due = Some(Fault::Watchdog);
        }
    }

    fn accept_order(
        &mut self,
        order: &Order,
        start: Micros,
        inputs: &Inputs,
        mail: &mut PulserMail<'_>,
    ) {
        let mut answered = AnsweredOrder::Other;
        let result = match order.kind {
            OrderKind::Arm => match self.arm(order.seq, start, inputs, mail) {
                Ok(()) => return, // the verdict comes with the electrode check's
                denied => {
                    self.notify(ControlEvent::Refused, mail);
                    denied
                }
            },
            OrderKind::Start => {
                answered = AnsweredOrder::Start;
                self.start(start, order.at, mail)
            }
            OrderKind::Release { restarts } => {
                let state = self.guard.state();
                let _ = mail.report(Report::Released(ReleaseAnswer {
                    seq: order.seq,
                    at: start,
                    restarts,
                    is_granted: may_release(state, restarts) && self.arming.is_none(),
                    state,
                })); // counted
                return;
            }
            OrderKind::Acknowledge => self.guard.acknowledge(start).map(|()| {
                self.scheduler.ground_all();
                self.outputs.disarm(Levels::GROUNDED);
            }),
            OrderKind::KeepAlive => {
                self.guard.keep_alive(order.at);
                Ok(())
            }
            OrderKind::Amplitudes { at, ref stimuli } => {
                answered = AnsweredOrder::Setpoint;
                self.accept_amplitudes(order, at, stimuli, start, mail)
            }
            OrderKind::Forget => return self.guard.clear_timed_orders(),
            OrderKind::Pulses => {
                answered = AnsweredOrder::Setpoint;
                // The session put the list into the mailbox before it ordered.
                let played = match mail.lists.peek() {
                    Some(list) => self.guard.play_list(list, start),
                    None => Err(Denial::Busy),
                };
                let _ = mail.lists.dequeue();
                played.map(|()| self.guard.keep_alive(order.at))
            }
            OrderKind::Status => {
                let report = Report::Status {
                    seq: order.seq,
                    at: start,
                    state: self.guard.state(),
                    pulses: self.pulses,
                    idle_triggers: self.idle_triggers,
                    late_setpoints: self.late_setpoints,
                    fault: self.last_fault,
                    left: self.guard.remaining_allowance(start),
                };
                let _ = mail.report(report); // counted
                return;
            }
        };
        self.answer_order(order.seq, start, result, answered, mail);
    }

    fn arm(
        &mut self,
        seq: u16,
        start: Micros,
        inputs: &Inputs,
        mail: &mut PulserMail<'_>,
    ) -> Result<(), Denial> {
        // The session put a setup into the mailbox before it ordered. Read in place, because it is
        // long.
        let check = match mail.setup.peek() {
            Some(setup) => self.guard.arm(setup, inputs, start),
            None => Err(Denial::WrongState(self.guard.state())),
        };
        let _ = mail.setup.dequeue();
        let (check, epoch) = check?;
        let trains = check.trains();
        self.scheduler.start(&trains, &[], None, epoch);
        let train = |channel: u8| trains.get(usize::from(channel)).copied().flatten();
        let expected = |channel| self.guard.expected_output(channel, train(channel));
        self.outputs.arm(expected, &[]);
        (self.arming, self.begins) = (Some(seq), true);
        (self.second, self.pausing, self.owed) = (0, 0, 0);
        Ok(())
    }

    fn start(
        &mut self,
        start: Micros,
        heard: Micros,
        mail: &mut PulserMail<'_>,
    ) -> Result<(), Denial> {
        if !mail.control_events.ready() {
            return Err(Denial::Busy);
        }
        self.guard.start(heard)?;
        if let Some(setup) = self.guard.setup() {
            self.scheduler
                .start(&setup.trains(), &setup.groups, setup.sync, start);
            let train = |channel| setup.channel(channel).map(|config| config.train);
            let expected = |channel| self.guard.expected_output(channel, train(channel));
            self.outputs.arm(expected, &setup.groups);
        }
        self.notify(ControlEvent::Started, mail);
        Ok(())
    }
}
