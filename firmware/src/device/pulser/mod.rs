//! The owner of time on the pins: renders each window, has the guard's word.

mod orders;
mod sampling;
mod timed;

use super::mail::{Answered, ControlEvent, ControlOrder, Edge, Mailboxes, PulserMail, Report};
use crate::pulse::{Levels, MAX_PULSES, Sample, Scheduler, WINDOW_US, WindowPlan};
use crate::safety::trips;
use crate::safety::{
    Denied, Fault, FaultRecord, Found, Guard, Inputs, Notice, OutputCheck, Setup, State,
};
use crate::units::{Micros, us};
use heapless::Vec;

/// Owns the guard and the scheduler. On a board it is one interrupt.
#[derive(Debug)]
pub struct Pulser {
    guard: Guard,
    scheduler: Scheduler,
    /// Reads what the scheduler rendered before it plays.
    outputs: OutputCheck,
    /// Number of the arm order whose electrode check is under way.
    arming: Option<u16>,
    /// It has just begun: comparators' levels are yet to be written.
    begins: bool,
    last_fault: Option<FaultRecord>,
    /// The state that the controller knows of.
    told: State,
    /// Stops carried out, and those that the session was told of.
    stops: u32,
    stops_told: u32,
    /// A law's amplitudes rose faster than the wearer allows; it is yet to be told.
    is_slowed: bool,
    /// What is latched with the next refill: found in this one, which lets the window
    /// that is painted play to its end.
    due: Option<Fault>,
    pulses: u32,
    idle_triggers: u32,
    late_setpoints: u32,
    /// The channel sampled last, so that all take turns.
    sampled: u8,
    /// Mid-phases behind the windows rendered so far, one of each pulse.
    phases: Vec<Sample, { 2 * MAX_PULSES }>,
    /// Channels whose next pulse is sampled in its second phase, bit i for channel i.
    second: u16,
    /// Channels that miss a first and a second phase, if their pulses follow fast.
    pausing: u16,
    /// Samples asked for since the latest reading.
    owed: u8,
}

impl Pulser {
    /// A pulser at reset; `latched` is the fault that the reset found, `found` what it found
    /// spent of time and charge.
    #[must_use]
    pub fn new(latched: Option<FaultRecord>, found: Found) -> Self {
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

    /// The device's state.
    #[must_use]
    pub const fn state(&self) -> State {
        self.guard.state()
    }

    /// Whether a fault waits to be acknowledged.
    #[must_use]
    pub const fn is_latched(&self) -> bool {
        self.guard.is_latched()
    }

    /// The latched or last fault, for the board to keep through a reset.
    #[must_use]
    pub const fn last_fault(&self) -> Option<FaultRecord> {
        self.last_fault
    }

    /// The armed or last armed setup.
    #[must_use]
    pub const fn setup(&self) -> Option<&Setup> {
        self.guard.setup()
    }

    /// Renders the window at `start`; called once per window, 248 µs before it
    /// plays. After `Err` the plan is isolated, the fault is latched, and the
    /// caller must isolate the outputs at once.
    ///
    /// # Errors
    /// The fault that was latched.
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
            self.fault(fault, now, mail);
        }
        if self.guard.owes_entry() {
            self.keep_entry(mail);
        }
        self.guard.seal();
        result
    }

    /// Does what [`Self::refill`] of the window at `start` would, if that is no more
    /// than to carry out amplitudes that wait and to reset `plan` to the levels that
    /// it ends with; returns whether it is. So it is if nobody posted anything else,
    /// the guard rests, and no edge or mid-phase lies in the window. For simulators,
    /// which may then leave the refill out.
    #[must_use]
    pub fn rest(&mut self, start: Micros, inputs: &Inputs, mail: &mut Mailboxes) -> bool {
        let rests = self.scheduler.is_idle(start)
            && self.phases.is_empty()
            && !self.misses_readings()
            && !self.guard.is_order_due(start + us(WINDOW_US))
            && inputs.trigger.is_none()
            && self.scheduler.is_gate_still(inputs.held)
            && self.due.is_none()
            && self.told == self.guard.state()
            && !self.guard.owes_entry()
            && mail.is_empty_for_pulser(self.stops_told)
            && self.guard.is_at_rest(start, inputs, &self.scheduler);
        while rests && let Some(order) = mail.next_control_order() {
            let _ = self.accept_control_order(&order, start); // no fault among them
        }
        if rests {
            self.guard.seal();
        }
        rests
    }

    /// Latches a fault found elsewhere at `now`; the caller isolates.
    #[cold]
    pub fn fault(&mut self, fault: Fault, now: Micros, mail: &mut PulserMail<'_>) {
        let is_later = self.guard.is_latched();
        let notice = self.guard.fault(fault, now, self.scheduler.residual(now));
        if let (true, Notice::Faulted(first)) = (is_later, notice) {
            self.last_fault = Some(first); // told already; what came later is in Status
            self.guard.seal();
            return;
        }
        self.announce(notice, now, mail);
        self.notify_state(mail);
        self.guard.seal();
    }

    /// Tells the controller of a new state, ahead of the pulses played in it.
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
        // Where it lies: an order is long, and a copy of it costs as much as taking it.
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
            // Three readings told it: what is painted may play, so that a pulse which ends
            // in it is not cut.
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
        self.guard.check_seen()?;
        self.outputs.read(plan).map_err(Fault::from)?;
        plan.pump = self.guard.pump();
        if core::mem::take(&mut self.begins) {
            plan.trips = self.guard.setup().map(trips);
        }
        self.report_pulses(plan, mail);
        Ok(())
    }

    /// Lets the trigger input start and end trains, while they may play.
    #[inline(never)]
    fn accept_trigger(&mut self, start: Micros, inputs: &Inputs, mail: &mut PulserMail<'_>) {
        let plays = self.guard.state() == State::Stimulating;
        let gates = plays && self.scheduler.gate(inputs.held, inputs.trigger, start);
        let Some(at) = inputs.trigger else {
            return;
        };
        if !(plays && self.scheduler.trigger(at) != 0 || gates) {
            self.idle_triggers = self.idle_triggers.saturating_add(1);
        }
        if self.is_stimulating() {
            let _ = mail.tell_edge(Edge { at, is_sync: false }); // counted
        }
    }

    /// Carries out what the controller ordered before the window at `start`.
    ///
    /// # Errors
    /// The fault that it found.
    #[inline(always)]
    fn accept_control_order(&mut self, order: &ControlOrder, start: Micros) -> Result<(), Fault> {
        match *order {
            ControlOrder::Amplitudes(ref list) => {
                for &(channel, amplitude) in list {
                    self.is_slowed |= self.guard.command(channel, amplitude, start);
                }
            }
            ControlOrder::Amplitude { channel, amplitude } => {
                self.is_slowed |= self.guard.command(channel, amplitude, start);
            }
            ControlOrder::Pulses {
                channel,
                amplitude,
                period_us,
            } => {
                self.is_slowed |= self.guard.command(channel, amplitude, start);
                if let Some(period_us) = self.guard.clamp_period(channel, period_us) {
                    self.scheduler.set_period(channel, period_us, start);
                }
            }
            ControlOrder::Heard(at) => self.guard.keep_alive(at),
            ControlOrder::Fault(fault) if self.guard.state() == State::Stimulating => {
                return Err(fault);
            }
            // Nobody controls any more: a host that stopped may fall silent.
            ControlOrder::Fault(_) => {}
        }
        Ok(())
    }

    /// Carries a notice of the guard to whom it concerns.
    fn announce(&mut self, notice: Notice, at: Micros, mail: &mut PulserMail<'_>) {
        let event = match notice {
            Notice::Checked(Ok(())) => Some(ControlEvent::Armed),
            Notice::Stopping(_) | Notice::Electrode { .. } => None,
            Notice::Checked(Err(_)) | Notice::Idle(_) | Notice::Faulted(_) | Notice::Recovered => {
                self.scheduler.clear();
                self.outputs.disarm(Levels::ISOLATED);
                // Nothing else can end while an electrode check is under way.
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
            Notice::Faulted(record) => Some(Err(Denied::FaultLatched(record.fault))),
            _ => None,
        };
        if let Some(result) = result
            && let Some(seq) = self.arming.take()
        {
            self.verdict(seq, at, result, Answered::Other, mail);
        }
        let state = self.guard.state();
        let _ = mail.report(Report::Changed { at, state, notice }); // counted
    }

    /// Whether amplitudes are put out, at full or on their fall.
    const fn is_stimulating(&self) -> bool {
        matches!(self.guard.state(), State::Stimulating | State::Stopping)
    }

    /// Tells the controller of this window's pulses, and the session of the first that drives
    /// sync out.
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
                let _ = mail.tell_edge(edge); // counted
            }
            self.pulses = self.pulses.wrapping_add(1);
            let event = ControlEvent::Pulse {
                channel: pulse.channel,
                at: pulse.at,
                stimulus: self.guard.in_force(pulse.channel),
                is_delayed: self.guard.is_delayed(pulse.channel),
            };
            let _ = mail.tell_pulse(event); // counted
            // With the next pulse, which is what was slowed.
            if core::mem::take(&mut self.is_slowed) {
                let _ = mail.tell_pulse(ControlEvent::Slowed); // counted
            }
        }
        self.schedule_sample(plan);
    }

    /// Answers an order. The session has left room.
    fn verdict(
        &self,
        seq: u16,
        at: Micros,
        result: Result<(), Denied>,
        answered: Answered,
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
