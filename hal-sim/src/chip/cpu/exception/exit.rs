//! Returns from exceptions: integrity checks, tail-chaining, unstacking.

use super::{FP_WORDS, RETURN, TAIL_CHAIN};
use crate::chip::Cycle;
use crate::chip::cpu::registers::control;
use crate::chip::cpu::system::{ccr, number, nvic};
use crate::chip::cpu::{Bus, Cpu, Fault, Registers, Stop, Trap, TrapResult};

/// Faults for an MPU violation and a bus error while unstacking.
const UNSTACKING: (Fault, Fault) = (Fault::UnstackingAccess, Fault::UnstackingBus);

/// Cycles from the arrival of the first line of code to its execution: decoding, as after the fetch
/// of a vector.
const REFILL: Cycle = 2;

impl Cpu {
    /// Returns from an exception: a branch to `exc_return` (0xFxxx_xxxx) in handler mode.
    /// Tail-chains if another exception is pending. `cycle` is the end of the branch without its
    /// refill.
    pub(in crate::chip::cpu) fn return_from_exception(
        &mut self,
        bus: &mut impl Bus,
        exc_return: u32,
    ) -> TrapResult {
        let returning = self.registers.exception;
        let active = self.system.nvic.active;
        let legal = active & nvic::bit(returning) != 0
            && self.is_legal_return(exc_return, active.count_ones());
        self.system.nvic.deactivate(returning);
        if returning != number::NMI {
            self.registers.faultmask = false;
        }
        self.system.update(&self.registers);
        if !legal {
            self.pend_fault(Fault::InvalidPc)?;
            return Ok(self.tail_chain(bus, exc_return | 0xF000_0000)?);
        }
        self.sample(bus)?;
        if self.preempting_exception().is_some() {
            return Ok(self.tail_chain(bus, exc_return)?);
        }
        match self.unstack(bus, exc_return) {
            Ok(Some(registers)) => Ok(self.resume(bus, registers)?),
            Ok(None) => Ok(self.tail_chain(bus, exc_return)?),
            Err(Trap::Fault(fault)) => {
                self.pend_fault(fault)?;
                Ok(self.tail_chain(bus, exc_return)?)
            }
            Err(stop) => Err(stop),
        }
    }

    /// Returns whether the EXC_RETURN value is allowed (Arm ARM B1.5.8) while `nested` exceptions
    /// are active: it must be a known value, return to thread mode only from the last active
    /// exception, and to handler mode only from one of several.
    fn is_legal_return(&self, exc_return: u32, nested: u32) -> bool {
        let reserved = exc_return & 0x0FFF_FFE0 == 0x0FFF_FFE0;
        reserved
            && match exc_return & 0xF {
                0b0001 => nested > 1,
                0b1001 | 0b1101 => nested == 1 || self.system.is_configured(ccr::NON_BASE_THREAD),
                _ => false,
            }
    }

    /// Continues with the handler of the pending exception, without unstacking and stacking in
    /// between.
    fn tail_chain(&mut self, bus: &mut impl Bus, exc_return: u32) -> Result<(), Stop> {
        let Some(first) = self.preempting_exception() else {
            return Err(self.lock_up());
        };
        let behind = self.registers.exception;
        let approach = self.approach(bus, first, self.cycle)?;
        let ready = self.cycle + TAIL_CHAIN;
        self.arrive(bus, approach, ready, exc_return, behind)
    }

    /// Pops the frame of a returning exception, and returns the registers in it. Returns `None`,
    /// with nothing changed, if an exception pre-empts meanwhile.
    fn unstack(&mut self, bus: &mut impl Bus, exc_return: u32) -> TrapResult<Option<Registers>> {
        let began = self.cycle;
        let to_thread = exc_return & 1 << 3 != 0;
        let from_psp = exc_return & 0b1111 == 0b1101;
        let with_fp = exc_return & 1 << 4 == 0;
        let mut new = self.registers.clone();
        let frame = if from_psp { new.other_sp } else { new.r[13] };
        let privileged = !to_thread || new.control & control::NPRIV == 0;
        let Some((xpsr, fetched)) = self.unstack_core(bus, frame, privileged, &mut new)? else {
            return Ok(None);
        };
        let mut more = 0;
        if with_fp && self.system.floating.is_save_pending() {
            self.system.floating.complete_save();
        } else if with_fp {
            more = FP_WORDS;
            if !self.unstack_fp(bus, frame, privileged, &mut new)? {
                return Ok(None);
            }
        }
        let waits = self.cycle - began - (1 + 8 + more);
        let popped = began + RETURN + more + waits;
        self.cycle = popped.max(fetched + REFILL);
        let bytes = if with_fp { 0x68 } else { 0x20 };
        let aligned = with_fp || self.system.is_configured(ccr::STACK_ALIGN);
        let moved = if aligned { xpsr >> 7 & 4 } else { 0 };
        let sp = frame.wrapping_add(bytes) | moved;
        restore(&mut new, exc_return, xpsr, sp);
        if to_thread != (new.exception == 0) {
            return Err(Fault::InvalidPc.into());
        }
        if xpsr & 1 << 24 == 0 {
            new.r[15] |= 1;
        }
        Ok(Some(new))
    }

    /// Pops the eight words of the frame in the order in which they were pushed, and meanwhile
    /// fetches the code at the popped PC. Returns xPSR and the cycle at which the code has arrived;
    /// `None` if an exception pre-empts.
    fn unstack_core(
        &mut self,
        bus: &mut impl Bus,
        frame: u32,
        privileged: bool,
        new: &mut Registers,
    ) -> TrapResult<Option<(u32, Cycle)>> {
        let mut xpsr = 0;
        let mut fetched = self.cycle;
        self.cycle = self.cycle.max(self.pipeline.buffer) + 1;
        for (offset, register) in [
            (0x18, 15),
            (0x1C, 16),
            (0x00, 0),
            (0x04, 1),
            (0x08, 2),
            (0x0C, 3),
            (0x10, 12),
            (0x14, 14),
        ] {
            if self.advance_to_now(bus)? {
                return Ok(None);
            }
            let address = frame.wrapping_add(offset);
            let value = self.stack_access(bus, address, None, UNSTACKING, privileged)?;
            match new.r.get_mut(register) {
                Some(place) => *place = value,
                None => xpsr = value,
            }
            if register == 15 {
                let wait = bus.fetch(value >> 4, self.cycle);
                fetched = self.cycle + Cycle::from(wait);
            }
        }
        Ok(Some((xpsr, fetched)))
    }

    /// Pops S0–S15 and FPSCR; returns `false` if an exception pre-empts meanwhile.
    fn unstack_fp(
        &mut self,
        bus: &mut impl Bus,
        frame: u32,
        privileged: bool,
        new: &mut Registers,
    ) -> TrapResult<bool> {
        if !self.system.floating.is_allowed(privileged) {
            return Err(Fault::NoCoprocessor.into());
        }
        for index in 0..17 {
            if self.advance_to_now(bus)? {
                return Ok(false);
            }
            let address = frame.wrapping_add(0x20 + 4 * index);
            let value = self.stack_access(bus, address, None, UNSTACKING, privileged)?;
            match new.s.get_mut(..16).and_then(|s| s.get_mut(index as usize)) {
                Some(place) => *place = value,
                None => new.fpscr = value,
            }
        }
        Ok(true)
    }

    /// Continues with the registers `new` at the instruction where the exception interrupted the
    /// code.
    fn resume(&mut self, bus: &mut impl Bus, new: Registers) -> Result<(), Stop> {
        let to_thread = new.exception == 0;
        let thumb = new.r[15] & 1 == 0;
        self.registers = new;
        self.registers.r[15] &= !1;
        self.system.event = true;
        self.system.update(&self.registers);
        self.pipeline.begin_at(self.registers.r[15]);
        if to_thread {
            self.system.note_return_to_thread();
        }
        if !thumb {
            return self.take_fault(bus, Fault::InvalidState);
        }
        Ok(())
    }
}

/// Restores flags, mode and stack pointers from the frame.
fn restore(new: &mut Registers, exc_return: u32, xpsr: u32, sp: u32) {
    new.r[15] &= !1;
    new.exception = (xpsr & 0x1FF) as u16;
    new.apsr = xpsr & 0xF80F_0000;
    new.it = (xpsr >> 25 & 3 | xpsr >> 8 & 0xFC) as u8;
    new.control &= !(control::SPSEL | control::FPCA);
    if exc_return & 1 << 4 == 0 {
        new.control |= control::FPCA;
    }
    if exc_return & 0b1111 == 0b1101 {
        new.control |= control::SPSEL;
        new.other_sp = new.r[13];
    }
    new.r[13] = sp;
}
