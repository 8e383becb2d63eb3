//! WFI, WFE and the event register (Arm ARM B1.5.17, B1.5.18).

use super::System;
use super::scb::scr;
use crate::chip::Cycle;
use crate::chip::cpu::Registers;

impl System {
    /// SEV, and every other event: sets the event register.
    pub fn send_event(&mut self) {
        self.event = true;
    }

    /// WFE: clears the event register; says whether it was clear, so that the
    /// core sleeps until [`Self::should_wake`].
    pub fn wait_for_event(&mut self) -> bool {
        self.sleeps_for_event = !self.event;
        self.event = false;
        self.sleeps_for_event
    }

    /// WFI: the core sleeps until [`Self::should_wake`].
    pub fn wait_for_interrupt(&mut self) {
        self.sleeps_for_event = false;
    }

    /// The core slept for so many cycles without its clock: the cycle counter stood.
    pub(in crate::chip::cpu) fn sleep_unclocked(&mut self, cycles: Cycle) {
        self.trace.skip_cycles(cycles);
    }

    /// SCR.SLEEPDEEP: sleep would stop the clocks, which nobody models.
    pub const fn sleeps_deep(&self) -> bool {
        self.scb.scr & scr::SLEEP_DEEP != 0
    }

    /// The core returned to thread mode and sleeps now (SCR.SLEEPONEXIT), as
    /// by WFI; asked once.
    pub fn take_sleep_on_exit(&mut self) -> bool {
        std::mem::take(&mut self.sleeps_on_exit)
    }

    pub(in crate::chip::cpu) fn note_return_to_thread(&mut self) {
        self.sleeps_on_exit = self.scb.scr & scr::SLEEP_ON_EXIT != 0;
        self.sleeps_for_event &= !self.sleeps_on_exit;
    }

    /// Whether a sleeping core wakes, as the lines were sampled last: WFI by
    /// an exception that would pre-empt if PRIMASK were clear, WFE by one that
    /// does pre-empt or by an event, which it consumes.
    pub fn should_wake(&mut self, registers: &Registers) -> bool {
        if !self.sleeps_for_event {
            let priority = self.nvic.priority_without_primask(registers);
            return self.nvic.preempting(priority).is_some();
        }
        let priority = self.nvic.execution_priority(registers);
        self.nvic.preempting(priority).is_some() || std::mem::take(&mut self.event)
    }
}
