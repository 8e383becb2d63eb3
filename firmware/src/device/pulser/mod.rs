//! The part of the device program that owns the time on the pins: it renders each window with the
//! guard's permission.

mod orders;
mod sampling;
mod timed;

use super::mail::{AnsweredOrder, ControlEvent, ControlOrder, Edge, Mailboxes, PulserMail, Report};
use crate::pulse::{Levels, MAX_PULSES, Sample, Scheduler, WINDOW_US, WindowPlan};
use crate::safety::trip_levels;
use crate::safety::{
    Denial, Fault, FaultRecord, Guard, Inputs, Notice, OutputCheck, Setup, State, UsageAtBoot,
};
use crate::units::{Micros, us};
use heapless::Vec;

/// The pulser, which owns the guard and the scheduler. On a board it runs in one interrupt.
#[derive(Clone, Debug)]
pub struct Pulser {
    guard: Guard,
    scheduler: Scheduler,
    /// Checks the scheduler's windows before they play.
    outputs: OutputCheck,
    /// Number of the arm order whose electrode check is in progress.
    arming: Option<u16>,
    /// Whether an electrode check has just begun, and the comparators' levels must be written.
    begins: bool,
    last_fault: Option<FaultRecord>,
    /// The state that was last reported to the controller.
    told: State,
    /// Count of the stops that were carried out.
    stops: u32,
    /// Count of stops that was last reported to the session.
    stops_told: u32,
    /// Whether a control law's amplitudes rose faster than the wearer allows, and this is not
    /// reported yet.
    is_slowed: bool,
    /// A fault to latch with the next refill. It was found in this refill, so that the painted
    /// window can play to its end.
    due: Option<Fault>,
    pulses: u32,
    idle_triggers: u32,
    late_setpoints: u32,
    /// The channel sampled last, for taking turns.
    sampled: u8,
    /// Middles of phases in later windows that may be sampled, at most one for each pulse.
    phases: Vec<Sample, { 2 * MAX_PULSES }>,
    /// Channels whose next pulse is sampled in its second phase, bit i for channel i.
    second: u16,
    /// Channels whose next pulse is not sampled if their period is short, bit i for channel i. Such
    /// a channel is sampled in two of four pulses.
    pausing: u16,
    /// Number of samples taken since the latest reading arrived.
    owed: u8,
}

impl Pulser {
    /// Returns a pulser in its state after a reset. `latched` is the fault that was recorded
    /// before the reset, `found` the time and charge spent before it.
    #[must_use]
    pub fn new(latched: Option<FaultRecord>, found: UsageAtBoot) -> Self {
        Self {
            guard: Guard::new(latched, found),
            scheduler: Scheduler::new(),
            outputs: OutputCheck::new(),
            arming: None,
            begins: false,
            last_fault: latched,
            told: State::Boot,
            stops: 0,
            stops_told: 0,
            is_slowed: false,
            due: None,
            pulses: 0,
            idle_triggers: 0,
            late_setpoints: 0,
            sampled: 0,
            phases: Vec::new(),
            second: 0,
            pausing: 0,
            owed: 0,
        }
    }

    /// Returns the device's state as hosts see it.
    #[must_use]
    pub const fn state(&self) -> State {
        self.guard.state()
    }

    /// Returns whether a fault waits to be acknowledged.
    #[must_use]
    pub const fn is_latched(&self) -> bool {
        self.guard.is_latched()
    }

    /// Returns the latched or last fault, for the board to keep through a reset.
    #[must_use]
    pub const fn last_fault(&self) -> Option<FaultRecord> {
        self.last_fault
    }

    /// Returns the setup that is armed or was armed last; `None` before the first arming.
    #[must_use]
    pub const fn setup(&self) -> Option<&Setup> {
        self.guard.setup()
    }

    /// Renders the window at `start`; called once per window, 248 µs before the window plays.
    /// After an error the plan is disconnected, the fault is latched, and the caller must
    /// disconnect the outputs at once.
    ///
    /// # Errors
    /// Returns the fault that was latched.
    pub fn refill(
        &mut self,
        now: Micros,
        start: Micros,
        inputs: &Inputs,
        mail: &mut PulserMail<'_>,
        plan: &mut WindowPlan,
    ) -> Result<(), Fault> {
        let result = self.try_refill(start, inputs, mail, plan);
        if let Err(fault) = result {
            plan.reset(start, Levels::ISOLATED);
            self.fault(&FaultRecord::new(fault, now), mail);
        }
        if self.guard.has_entry_to_write() {
            self.send_entry(mail);
        }
        self.guard.renew_checksums();
        result
    }

    /// Replaces [`Self::refill`] of the window at `start` and returns `true`, if the refill would
    /// only carry out posted amplitudes and reset `plan` to the levels at its end. This is so if no
    /// other message was posted, the guard is at rest, and no edge or middle of a phase lies in the
    /// window. For simulators, which may then omit the refill.
    #[must_use]
    pub fn try_skip_refill(
        &mut self,
        start: Micros,
        inputs: &Inputs,
        mail: &mut Mailboxes,
    ) -> bool {
        let rests = self.scheduler.is_idle(start)
            && self.phases.is_empty()
            && !self.misses_readings()
            && !self.guard.is_order_due(start + us(WINDOW_US))
            && inputs.trigger.is_none()
            && self.scheduler.is_gate_still(inputs.held)
            && self.due.is_none()
            && self.told == self.guard.state()
            && !self.guard.has_entry_to_write()
            && mail.is_empty_for_pulser(self.stops_told)
            && self.guard.is_at_rest(start, inputs, &self.scheduler);
        while rests && let Some(order) = mail.next_control_order() {
            let _ = self.accept_control_order(&order, start); // no fault among them
        }
        if rests {
            self.guard.renew_checksums();
        }
        rests
    }

    /// Latches a fault found elsewhere; the caller disconnects the outputs at [`FaultRecord::at`].
    /// The residual charge of `found` is ignored.
    #[cold]
    pub fn fault(&mut self, found: &FaultRecord, mail: &mut PulserMail<'_>) {
        let now = found.at;
        let is_later = self.guard.is_latched();
        let notice = self.guard.fault(found, self.scheduler.residual_charge(now));
        if let (true, Notice::Faulted(first)) = (is_later, notice) {
            self.last_fault = Some(first); // told already; what came later is in Status
            self.guard.renew_checksums();
            return;
        }
        self.announce(notice, now, mail);
        self.notify_state(mail);
        self.guard.renew_checksums();
    }

    /// Reports a new state to the controller, before the pulses that play in it.
    #[inline]
    fn notify_state(&mut self, mail: &mut PulserMail<'_>) {
        let state = self.guard.state();
        if state != self.told && mail.notify(ControlEvent::State(state)).is_ok() {
            self.told = state;
        }
    }

    fn try_refill(
        &mut self,
        start: Micros,
        inputs: &Inputs,
        mail: &mut PulserMail<'_>,
        plan: &mut WindowPlan,
    ) -> Result<(), Fault> {
        if let Some(fault) = self.due.take() {
            return Err(fault);
        }
        self.guard.check_memory()?;
        self.expect_reading(inputs)?;
        self.accept_orders(start, inputs, mail);
        // Read in place: an order is long, and a copy of it takes as long as handling it.
        while let Some(order) = mail.control_orders.peek() {
            let taken = self.accept_control_order(order, start);
            let _ = mail.control_orders.dequeue();
            taken?;
        }
        if inputs.trigger.is_some() || !self.scheduler.is_gate_still(inputs.held) {
            self.accept_trigger(start, inputs, mail);
        }
        // By reference: a notice is large and mostly absent, and `?` copies it.
        match &self.guard.tick(start, inputs, &self.scheduler) {
            Ok(None) => {}
            Ok(Some(notice)) => self.announce(*notice, start, mail),
            Err(Fault::OverCurrent) => return Err(Fault::OverCurrent),
            // Three readings showed this fault. The painted window may play, so that a pulse that
            // ends in it is not truncated.
            Err(fault) => {
                self.due = Some(*fault);
                plan.reset(start, Levels::ISOLATED);
                return Ok(());
            }
        }
        if self.guard.is_order_due(start + us(WINDOW_US)) {
            self.carry_out_due(start + us(WINDOW_US - 1), start, mail);
        }
        self.notify_state(mail);
        self.scheduler
            .render(start, &mut self.guard, plan)
            .map_err(Fault::from)?;
        self.guard.check_no_mismatch()?;
        self.outputs.check_window(plan).map_err(Fault::from)?;
        plan.pump = self.guard.is_pump_on();
        if core::mem::take(&mut self.begins) {
            plan.trips = self.guard.setup().map(trip_levels);
        }
        self.report_pulses(plan, mail);
        Ok(())
    }

    /// Lets the trigger input start and end trains while stimulating, and reports its edge.
    #[inline(never)]
    fn accept_trigger(&mut self, start: Micros, inputs: &Inputs, mail: &mut PulserMail<'_>) {
        let plays = self.guard.state() == State::Stimulating;
        let gates = plays
            && self
                .scheduler
                .update_gate(inputs.held, inputs.trigger, start);
        let Some(at) = inputs.trigger else {
            return;
        };
        if !(plays && self.scheduler.trigger(at) != 0 || gates) {
            self.idle_triggers = self.idle_triggers.saturating_add(1);
        }
        if self.is_stimulating() {
            let _ = mail.report_edge(Edge { at, is_sync: false }); // counted
        }
    }

    /// Carries out an order that the controller posted before the window at `start`.
    ///
    /// # Errors
    /// Returns the fault that the controller found.
    #[inline(always)]
    fn accept_control_order(&mut self, order: &ControlOrder, start: Micros) -> Result<(), Fault> {
        match *order {
            ControlOrder::Amplitudes(ref list) => {
                for &(channel, amplitude) in list {
                    self.is_slowed |= self.guard.set_control_amplitude(channel, amplitude, start);
                }
            }
            ControlOrder::Amplitude { channel, amplitude } => {
                self.is_slowed |= self.guard.set_control_amplitude(channel, amplitude, start);
            }
            ControlOrder::Pulses {
                channel,
                amplitude,
                period_us,
            } => {
                self.is_slowed |= self.guard.set_control_amplitude(channel, amplitude, start);
                if let Some(period_us) = self.guard.clamp_period(channel, period_us) {
                    self.scheduler.set_period(channel, period_us, start);
                }
            }
            ControlOrder::Heard(at) => self.guard.keep_alive(at),
            ControlOrder::Fault(fault) if self.guard.state() == State::Stimulating => {
                return Err(fault);
            }
            // No controller is active any more: a host that stopped may fall silent.
            ControlOrder::Fault(_) => {}
        }
        Ok(())
    }

    /// Passes a notice of the guard to the parts of the device program that it concerns.
    fn announce(&mut self, notice: Notice, at: Micros, mail: &mut PulserMail<'_>) {
        let event = match notice {
            Notice::Checked(Ok(())) => Some(ControlEvent::Armed),
            Notice::Stopping(_) | Notice::Electrode { .. } => None,
            Notice::Checked(Err(_)) | Notice::Idle(_) | Notice::Faulted(_) | Notice::Recovered => {
                self.scheduler.clear();
                self.outputs.disarm(Levels::ISOLATED);
                // Nothing else can end while an electrode check is in progress.
                Some(if self.arming.is_some() {
                    ControlEvent::Refused
                } else {
                    ControlEvent::Ended
                })
            }
        };
        if let Notice::Faulted(record) = notice {
            self.last_fault = Some(record);
        }
        if let Some(event) = event {
            self.notify(event, mail);
        }
        let result = match notice {
            Notice::Checked(result) => Some(result),
            Notice::Faulted(record) => Some(Err(Denial::FaultLatched(record.fault))),
            _ => None,
        };
        if let Some(result) = result
            && let Some(seq) = self.arming.take()
        {
            self.answer_order(seq, at, result, AnsweredOrder::Other, mail);
        }
        let state = self.guard.state();
        let _ = mail.report(Report::Changed { at, state, notice }); // counted
    }

    /// Returns whether amplitudes are output, including during their fall.
    const fn is_stimulating(&self) -> bool {
        matches!(self.guard.state(), State::Stimulating | State::Stopping)
    }

    /// Reports this window's pulses to the controller, and the first pulse that drives the sync
    /// output to the session.
    fn report_pulses(&mut self, plan: &mut WindowPlan, mail: &mut PulserMail<'_>) {
        let mut sync = if self.is_stimulating() {
            self.guard.setup().and_then(|setup| setup.sync)
        } else {
            None
        };
        for pulse in &plan.pulses {
            if sync == Some(pulse.channel) {
                sync = None;
                let edge = Edge {
                    at: pulse.at,
                    is_sync: true,
                };
                let _ = mail.report_edge(edge); // counted
            }
            self.pulses = self.pulses.wrapping_add(1);
            let event = ControlEvent::Pulse {
                channel: pulse.channel,
                at: pulse.at,
                stimulus: self.guard.stimulus_in_force(pulse.channel),
                is_delayed: self.guard.is_delayed(pulse.channel),
            };
            let _ = mail.report_pulse(event); // counted
            // Reported with the next pulse, which is the one whose amplitude was reduced.
            if core::mem::take(&mut self.is_slowed) {
                let _ = mail.report_pulse(ControlEvent::Slowed); // counted
            }
        }
        self.schedule_sample(plan);
    }

    /// Answers an order. The session has left room for the answer.
    fn answer_order(
        &self,
        seq: u16,
        at: Micros,
        result: Result<(), Denial>,
        answered: AnsweredOrder,
        mail: &mut PulserMail<'_>,
    ) {
        let _ = mail.report(Report::Verdict {
            seq,
            at,
            result,
            answered,
            state: self.guard.state(),
        }); // counted
    }
}
