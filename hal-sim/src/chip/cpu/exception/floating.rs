//! Prepares floating-point instructions (Arm ARM B1.5.7, ExecuteFPCheck).

use super::FP_WORDS;
use crate::chip::cpu::registers::control;
use crate::chip::cpu::system::{actlr, hfsr, number, nvic};
use crate::chip::cpu::{Bus, Cpu, Fault, Stop, TrapResult};

/// Faults for an MPU violation and a bus error during a lazy save.
const LAZY: (Fault, Fault) = (Fault::LazyStackingAccess, Fault::LazyStackingBus);

impl Cpu {
    /// Prepares the core for a floating-point instruction: checks that CPACR allows it, completes a
    /// pending lazy save, sets FPCA.
    #[inline]
    pub(in crate::chip::cpu) fn prepare_fp(&mut self, bus: &mut impl Bus) -> TrapResult {
        if self.system.fp_is_ready {
            return Ok(());
        }
        self.prepare_fp_in_full(bus)
    }

    #[cold]
    fn prepare_fp_in_full(&mut self, bus: &mut impl Bus) -> TrapResult {
        let floating = &self.system.floating;
        if !floating.is_allowed(self.registers.is_privileged()) {
            return Err(Fault::NoCoprocessor.into());
        }
        if floating.is_save_pending() {
            self.save_fp(bus)?;
        }
        let floating = &self.system.floating;
        let sets_fpca = floating.is_saved_automatically() && !self.system.disables(actlr::FPCA);
        if sets_fpca && self.registers.control & control::FPCA == 0 {
            self.registers.fpscr = floating.fresh_status(self.registers.fpscr);
            self.registers.control |= control::FPCA;
        }
        self.system.fp_is_ready = true;
        Ok(())
    }

    /// Saves S0–S15 and FPSCR in the space that was reserved in the exception's frame, with the
    /// rights of the pre-empted context.
    fn save_fp(&mut self, bus: &mut impl Bus) -> TrapResult {
        let address = self.system.floating.fpcar;
        let privileged = self.system.floating.preempted().privileged;
        let words = self.registers.s;
        let words = words.into_iter().take(16).chain([self.registers.fpscr]);
        for (index, value) in (0..FP_WORDS as u32).zip(words) {
            let address = address.wrapping_add(4 * index);
            self.stack_access(bus, address, Some(value), LAZY, privileged)?;
        }
        self.system.floating.complete_save();
        Ok(())
    }

    /// Makes the fault of a lazy save pending. Which exception it is depends on those that the
    /// pre-empted context could have taken (FPCCR.HFRDY, MMRDY, BFRDY).
    pub(super) fn pend_lazy_fault(&mut self, fault: Fault) -> Result<(), Stop> {
        let could = self.system.floating.preempted();
        let (own, ready) = match fault {
            Fault::LazyStackingAccess => (number::MEM_MANAGE, could.mem_manage),
            _ => (number::BUS_FAULT, could.bus_fault),
        };
        self.system.scb.note_fault(fault);
        if ready {
            self.system.pend(nvic::bit(own), self.cycle);
        } else if could.hard_fault {
            self.system.scb.note_hard_fault(hfsr::FORCED);
            self.system.pend(nvic::bit(number::HARD_FAULT), self.cycle);
        } else {
            return Err(self.lock_up());
        }
        Ok(())
    }
}
