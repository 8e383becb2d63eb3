//! Models WFI, WFE and the event register (Arm ARM B1.5.17, B1.5.18).

use super::System;
use super::scb::scr;
use crate::chip::Cycle;
use crate::chip::cpu::Registers;

impl System {
    /// Sets the event register, as SEV and every other event does.
    pub fn send_event(&mut self) {
        self.event = true;
    }

    /// Executes WFE: clears the event register, and returns whether it was clear, so that the core
    /// sleeps until [`Self::should_wake`].
    pub fn wait_for_event(&mut self) -> bool {
        self.sleeps_for_event = !self.event;
        self.event = false;
        self.sleeps_for_event
    }

    /// Executes WFI: the core sleeps until [`Self::should_wake`].
    pub fn wait_for_interrupt(&mut self) {
        self.sleeps_for_event = false;
    }

    /// Notes that the core slept for `cycles` without its clock, so that the cycle counter did not
    /// count.
    pub(in crate::chip::cpu) fn sleep_unclocked(&mut self, cycles: Cycle) {
        self.trace.skip_cycles(cycles);
    }

    /// Returns SCR.SLEEPDEEP: whether sleep would stop the clocks, which is not modelled.
    pub const fn sleeps_deep(&self) -> bool {
        self.scb.scr & scr::SLEEP_DEEP != 0
    }

    /// Returns whether the core returned to thread mode and must sleep now (SCR.SLEEPONEXIT), as by
    /// WFI; clears this state.
    pub fn take_sleep_on_exit(&mut self) -> bool {
        std::mem::take(&mut self.sleeps_on_exit)
    }

    pub(in crate::chip::cpu) fn note_return_to_thread(&mut self) {
        self.sleeps_on_exit = self.scb.scr & scr::SLEEP_ON_EXIT != 0;
        self.sleeps_for_event &= !self.sleeps_on_exit;
    }

    /// Returns whether a sleeping core wakes, with the interrupt lines as last sampled. WFI ends
    /// with an exception that would pre-empt if PRIMASK were clear. WFE ends with an exception that
    /// does pre-empt, or with an event, which is then cleared.
    pub fn should_wake(&mut self, registers: &Registers) -> bool {
        if !self.sleeps_for_event {
            let priority = self.nvic.priority_without_primask(registers);
            return self.nvic.preempting(priority).is_some();
        }
        let priority = self.nvic.execution_priority(registers);
        self.nvic.preempting(priority).is_some() || std::mem::take(&mut self.event)
    }
}
