//! Handles exceptions (Arm ARM B1.5) with their cycles (TRM section 3.9): taking them, faults,
//! reset.
//!
//! `entry` stacks and finds the handler, `exit` returns, `floating` saves S0–S15 lazily, `special`
//! executes MRS, MSR and CPS. `system::nvic` decides about priorities.
//!
//! Exact: 12, 6, 12 and 29 cycles without wait states; each word on the bus. Approximate, because
//! the manual does not describe it: vector 2 + code 4 cycles, which overlap stacking; late arrival,
//! detected between two words; abandoning a pop, likewise; a lazy save of 17 cycles.

mod entry;
mod exit;
mod floating;
mod special;

#[cfg(test)]
mod tests;

use super::bus::{AccessError, Unmodelled};
use super::{Access, Bus, Cpu, Fault, Registers, Size, Stop, Trap, TrapResult};
use crate::chip::Cycle;

/// Cycles from taking an exception to the first instruction of its handler, without wait states
/// (TRM section 3.9.1: at most 12 from the rise of the interrupt line, if no instruction has to be
/// finished first).
pub const ENTRY: Cycle = 12;

/// Cycles from one handler to a tail-chained one, without wait states (TRM section 3.9.1).
pub const TAIL_CHAIN: Cycle = 6;

/// Cycles from the end of a branch that returns from an exception to the next instruction, without
/// wait states (TRM section 3.9.1: 12). The branch ends with its own cycle; its refill is part of
/// these cycles.
pub const RETURN: Cycle = 12;

/// Cycles that S0–S15 and FPSCR add to stacking, unstacking and lazy saving: one per word (TRM
/// section 3.9.1: 29 instead of 12).
pub const FP_WORDS: Cycle = 17;

impl Cpu {
    /// Resets the core: registers and private peripherals get their reset values; SP and PC come
    /// from the vector table at address 0.
    ///
    /// # Errors
    /// Returns [`Stop`] if there is no vector table.
    pub fn reset(&mut self, bus: &mut impl Bus) -> Result<(), Stop> {
        self.registers = Registers::default();
        self.system.reset();
        self.pipeline = super::timing::Pipeline::default();
        (self.asleep, self.exclusive, self.stands) = (false, false, false);
        let none = Stop::Outside {
            pc: 0,
            what: "no vector table at address 0",
        };
        let mut word = |address| bus.read(address, Size::Word, self.cycle).map_err(|_| none);
        let (sp, pc) = (word(0)?.value, word(4)?.value);
        if pc & 1 == 0 {
            return Err(none);
        }
        self.registers.r[13] = sp & !3;
        self.registers.r[14] = u32::MAX;
        self.registers.r[15] = pc & !1;
        self.system.update(&self.registers);
        Ok(())
    }

    /// Samples the interrupt lines, and takes the pending exception of highest priority if it
    /// pre-empts; returns whether one was taken. Called between instructions whenever an exception
    /// may have become pending. Processes the bus's events up to the present cycle, each at its own
    /// cycle, so that latency counts from the rise of the line.
    pub(super) fn take_pending(&mut self, bus: &mut impl Bus) -> Result<bool, Stop> {
        self.sample(bus)?;
        if self.preempting_exception().is_none() {
            return Ok(false);
        }
        self.enter_exception(bus)?;
        Ok(true)
    }

    /// Returns the pending exception that pre-empts the running context, if there is one.
    #[inline]
    fn preempting_exception(&self) -> Option<u16> {
        let first = self.system.nvic.first_pending()?;
        let priority = self.execution_priority();
        (self.system.nvic.group_priority(first) < priority).then_some(first)
    }

    fn execution_priority(&self) -> i16 {
        self.system.nvic.execution_priority(&self.registers)
    }

    /// Returns whether a core that sleeps by WFI or WFE wakes. Call after `take_pending`, which
    /// samples the lines.
    pub(super) fn should_wake(&mut self) -> bool {
        self.system.should_wake(&self.registers)
    }

    /// Processes all events up to the present cycle, and samples the interrupt lines.
    pub(super) fn sample(&mut self, bus: &mut impl Bus) -> Result<(), Stop> {
        if let Some(at) = self.system.scb.reset_request.take() {
            bus.request_reset(at);
        }
        while self.advance_to_now(bus)? {}
        self.system
            .sample(bus.interrupt_lines(), bus.nmi(), self.cycle);
        Ok(())
    }

    /// Processes the events before `end`, each at its cycle, until an exception pre-empts; returns
    /// the cycle of the event that caused this exception. `end` may lie ahead of the present cycle,
    /// for instructions that can be interrupted: time has then advanced to the returned cycle.
    pub(super) fn advance_until_preempted(
        &mut self,
        bus: &mut impl Bus,
        end: Cycle,
    ) -> Result<Option<Cycle>, Stop> {
        loop {
            let event = bus.next_event().min(self.system.next_event());
            if event >= end {
                return Ok(None);
            }
            let event = self.advance_bus(bus, event)?;
            if self.preempting_exception().is_some() {
                return Ok(Some(event));
            }
            if bus.next_event() <= event {
                // The bus requests a call at the present cycle.
                self.advance_bus(bus, end.saturating_sub(1))?;
                return Ok(None);
            }
        }
    }

    /// Processes events up to the present cycle until an exception pre-empts; returns whether one
    /// did.
    fn advance_to_now(&mut self, bus: &mut impl Bus) -> Result<bool, Stop> {
        let end = self.cycle.saturating_add(1);
        Ok(self.advance_until_preempted(bus, end)?.is_some())
    }

    /// Advances the bus, and returns the cycle reached. Time never goes backwards.
    fn advance_bus(&mut self, bus: &mut impl Bus, to: Cycle) -> Result<Cycle, Stop> {
        let to = to.max(self.system.sampled);
        bus.advance(to)
            .map_err(|Unmodelled(feature)| Stop::Outside {
                pc: self.registers.r[15],
                what: feature,
            })?;
        self.system.sample(bus.interrupt_lines(), bus.nmi(), to);
        Ok(to)
    }

    /// Takes `fault`, caused by the instruction at R15. Escalates it to a hard fault if its own
    /// exception is disabled or does not pre-empt.
    pub(super) fn take_fault(&mut self, bus: &mut impl Bus, fault: Fault) -> Result<(), Stop> {
        let pended = match fault {
            Fault::LazyStackingAccess | Fault::LazyStackingBus => self.pend_lazy_fault(fault),
            _ => self.pend_fault(fault),
        };
        pended?;
        if self.preempting_exception().is_none() {
            return Err(Stop::Outside {
                pc: self.registers.r[15],
                what: "a lazy stacking fault that the priority of the running handler blocks",
            });
        }
        self.enter_exception(bus)
    }

    fn pend_fault(&mut self, fault: Fault) -> Result<(), Stop> {
        let priority = self.execution_priority();
        self.system
            .pend_fault(fault, priority, self.cycle)
            .ok_or(self.lock_up())
    }

    /// Handles the bus error of a store in the write buffer (TRM section 3.5), whose instruction is
    /// over. The caller takes pending exceptions afterwards.
    pub(super) fn imprecise_fault(&mut self) -> Result<(), Stop> {
        let priority = self.execution_priority();
        self.system
            .pend_imprecise_fault(priority, self.cycle)
            .ok_or(self.lock_up())
    }

    const fn lock_up(&self) -> Stop {
        Stop::LockUp {
            pc: self.registers.r[15],
        }
    }

    /// Performs a load or store that the core itself makes for stacking, at the present cycle. The
    /// cycle advances by one and by the wait states. Fails with the fault `access` (the MPU denies
    /// it) or `bus_error`.
    fn stack_access(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        store: Option<u32>,
        (access, bus_error): (Fault, Fault),
        privileged: bool,
    ) -> TrapResult<u32> {
        if address >> 20 == 0xE00 {
            return Err(bus_error.into());
        }
        if !self.system.may_access(address, store.is_some(), privileged) {
            self.cycle += 1;
            return Err(access.into());
        }
        let answer = match store {
            Some(value) => bus
                .write(address, Size::Word, value, self.cycle)
                .map(|wait| (value, wait)),
            None => bus
                .read(address, Size::Word, self.cycle)
                .map(|read| (read.value, read.wait)),
        };
        match answer {
            Ok((value, wait)) => {
                self.cycle += 1 + Cycle::from(wait);
                Ok(value)
            }
            Err(AccessError::Error) => {
                self.cycle += 1;
                Err(bus_error.into())
            }
            Err(denied) => {
                let access = Access {
                    address,
                    size: Size::Word,
                    written: store,
                };
                Err(Trap::from_data_access(denied, access, self.registers.r[15]))
            }
        }
    }

    /// Executes SVC, which makes its exception pending. The caller takes the exception after
    /// advancing to the next instruction. If SVC cannot pre-empt, a hard fault takes its place.
    pub(super) fn supervisor_call(&mut self) -> Result<(), Stop> {
        use super::system::{number, nvic};
        let priority = self.execution_priority();
        if self.system.may_preempt(number::SV_CALL, priority) {
            self.system.pend(nvic::bit(number::SV_CALL), self.cycle);
            return Ok(());
        }
        self.system
            .escalate(priority, self.cycle)
            .ok_or(self.lock_up())
    }
}
