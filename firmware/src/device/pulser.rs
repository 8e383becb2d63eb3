//! The owner of time on the pins: renders each window, has the guard's word.

mod orders;

use super::mail::{Answered, ControlEvent, ControlOrder, Mailboxes, PulserMail, Report};
use crate::pulse::{Levels, MAX_PULSES, PulseStart, Sample, Scheduler, WINDOW_US, WindowPlan};
use crate::safety::trips;
use crate::safety::{
    Denied, Fault, FaultRecord, Found, Guard, Inputs, Notice, OutputCheck, Setup, State,
};
use crate::units::{Micros, us};
use heapless::Vec;

/// Slots of a window in which a sample can be asked for: the board's refill arms it in
/// the window's first microseconds, and the next has its reading.
const FIRST_SLOT: u32 = 12;
const LAST_SLOT: u32 = 240;
const _: () = assert!(LAST_SLOT + 10 <= WINDOW_US);

/// A phase's current is settled so long after its edge, µs (docs/hardware.md).
const SETTLED_US: u32 = 10;

/// A channel with a shorter period is fast, µs: 50 readings a second tell as much.
const SLOW_US: u32 = 20_000;

/// Samples asked for without a reading that are a fault. Two are under way at most.
const MISSING_TO_FAULT: u8 = 6;

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
            && self.owed < MISSING_TO_FAULT
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
            self.accept_trigger(start, inputs);
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
    fn accept_trigger(&mut self, start: Micros, inputs: &Inputs) {
        let plays = self.guard.state() == State::Stimulating;
        let gates = plays && self.scheduler.gate(inputs.held, inputs.trigger, start);
        if let Some(at) = inputs.trigger
            && !(plays && self.scheduler.trigger(at) != 0 || gates)
        {
            self.idle_triggers = self.idle_triggers.saturating_add(1);
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

    /// Tells the controller of this window's pulses.
    fn report_pulses(&mut self, plan: &mut WindowPlan, mail: &mut PulserMail<'_>) {
        for pulse in &plan.pulses {
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

    /// Picks the mid-phase to sample in this window. All stages share one sense resistor,
    /// whose currents add up: only a channel that pulses alone then can be judged.
    fn schedule_sample(&mut self, plan: &mut WindowPlan) {
        for pulse in &plan.pulses {
            self.note_middle(pulse, plan.start);
        }
        if !self.phases.is_empty() {
            self.pick_sample(plan);
        }
    }

    /// Notes a middle of `pulse`: in pulse after pulse of a channel the first phase and
    /// the second in turn; of a fast one two in four, for what a reading costs.
    fn note_middle(&mut self, pulse: &PulseStart, start: Micros) {
        let bit = 1u16.checked_shl(pulse.channel.into()).unwrap_or(0);
        let is_second = self.second & bit != 0;
        let pauses = self.pausing & bit != 0;
        self.second ^= bit;
        self.pausing ^= if is_second { bit } else { 0 };
        let Some(middle) = self.scheduler.middle(pulse.channel, is_second) else {
            return;
        };
        if pauses && middle.period_us < SLOW_US && self.arming.is_none() {
            return;
        }
        let slot = (pulse.at - start).us().cast_unsigned() + middle.after_us; // below 1500
        let (windows, slot) = (slot / WINDOW_US, slot % WINDOW_US);
        // Not further from the middle than leaves the current settled.
        let slack = middle.half_us.saturating_sub(SETTLED_US);
        let slot = if slot < FIRST_SLOT {
            FIRST_SLOT.min(slot + slack)
        } else {
            slot.min(LAST_SLOT.max(slot.saturating_sub(slack)))
        };
        if (FIRST_SLOT..=LAST_SLOT).contains(&slot) {
            let _ = self.phases.push(Sample {
                channel: pulse.channel,
                second: middle.second,
                at: start + us(windows * WINDOW_US + slot),
            }); // as many slots
        }
    }

    /// Of the mid-phases in this window that of the channel whose turn it is.
    fn pick_sample(&mut self, plan: &mut WindowPlan) {
        let last = self.sampled;
        let turn = |channel: u8| channel.wrapping_sub(last).wrapping_sub(1) % 16;
        self.phases.retain(|sample| {
            let slot = (sample.at - plan.start).us();
            let Some(slot) = u8::try_from(slot)
                .ok()
                .filter(|&s| u32::from(s) < WINDOW_US)
            else {
                return slot > 0;
            };
            let is_sooner = |best: Sample| turn(sample.channel) < turn(best.channel);
            if plan.drives_alone(sample.channel, slot) {
                let beaten = if plan.sample.is_none_or(is_sooner) {
                    plan.sample.replace(*sample)
                } else {
                    Some(*sample)
                };
                // It has not had its turn: the same phase again.
                let bit = beaten.map_or(0, |b| 1u16.checked_shl(b.channel.into()).unwrap_or(0));
                self.second ^= bit;
            }
            false
        });
        if let Some(sample) = plan.sample {
            self.sampled = sample.channel;
            self.owed = self.owed.saturating_add(1);
        }
    }

    /// Counts readings against samples that were asked for.
    ///
    /// # Errors
    /// [`Fault::ReadingMissing`].
    const fn expect_reading(&mut self, inputs: &Inputs) -> Result<(), Fault> {
        if inputs.reading.is_some() {
            self.owed = 0;
        }
        if self.owed < MISSING_TO_FAULT {
            return Ok(());
        }
        self.owed = 0;
        Err(Fault::ReadingMissing)
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
