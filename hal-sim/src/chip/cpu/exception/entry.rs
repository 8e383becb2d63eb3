//! Enters exceptions: stacks the frame and, at the same time on the other bus, fetches the vector
//! and the handler's first code.

use super::{ENTRY, FP_WORDS, TAIL_CHAIN};
use crate::chip::Cycle;
use crate::chip::cpu::bus::AccessError;
use crate::chip::cpu::registers::control;
use crate::chip::cpu::system::{PreemptedContext, ccr, hfsr, number, nvic};
use crate::chip::cpu::{Access, Bus, Cpu, Fault, Size, Stop, Trap};

/// Cycles of reading a vector without wait states. The other cycles of [`TAIL_CHAIN`] are the fetch
/// and the pipeline; the manual gives only the sum.
const VECTOR: Cycle = 2;

/// Faults for an MPU violation and a bus error while stacking.
const STACKING: (Fault, Fault) = (Fault::StackingAccess, Fault::StackingBus);

/// Progress of the entry to an exception handler.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ExceptionEntry {
    number: u16,
    /// Handler address from the vector table; bit 0 is the Thumb bit.
    vector: u32,
    /// Cycle from which on the handler's code can be fetched.
    fetch_at: Cycle,
    /// Cycle at which the first instruction can execute; `None` until it is fetched.
    ready: Option<Cycle>,
}

/// EXC_RETURN without its lower five bits.
const EXC_RETURN: u32 = 0xFFFF_FFE0;

impl Cpu {
    /// Enters the pending exception of highest priority, if it pre-empts. A late arrival, an
    /// exception of higher priority that becomes pending during the entry, may replace it.
    pub(super) fn enter_exception(&mut self, bus: &mut impl Bus) -> Result<(), Stop> {
        let Some(number) = self.preempting_exception() else {
            return Ok(());
        };
        let behind = self.registers.exception;
        let exc_return = self.exc_return();
        let mut approach = self.approach(bus, number, self.cycle)?;
        let stacked = self.stack(bus, &mut approach)?;
        self.arrive(bus, approach, stacked, exc_return, behind)
    }

    /// Returns the EXC_RETURN value for LR (Arm ARM table B1-8).
    const fn exc_return(&self) -> u32 {
        let no_fp = self.registers.control & control::FPCA == 0;
        let mode = match (self.registers.exception, self.registers.uses_psp()) {
            (0, true) => 0b1101,
            (0, false) => 0b1001,
            _ => 0b0001,
        };
        EXC_RETURN | (no_fp as u32) << 4 | mode
    }

    /// Reads the vector of exception `number` at cycle `at`. A vector in code memory is read over a
    /// bus of its own, which overlaps stacking. A vector that cannot be read causes a hard fault.
    pub(super) fn approach(
        &mut self,
        bus: &mut impl Bus,
        number: u16,
        at: Cycle,
    ) -> Result<ExceptionEntry, Stop> {
        let address = self.system.scb.vtor.wrapping_add(4 * u32::from(number));
        let read = if address < 0x2000_0000 {
            let wait = bus.fetch(address >> 4, at);
            let halves = bus
                .read_code(address)
                .and_then(|low| Ok((low, bus.read_code(address + 2)?)));
            halves.map(|(low, high)| (u32::from(high) << 16 | u32::from(low), wait))
        } else {
            bus.read(address, Size::Word, at)
                .map(|read| (read.value, read.wait))
        };
        match read {
            Ok((vector, wait)) => Ok(ExceptionEntry {
                number,
                vector,
                fetch_at: at + VECTOR + Cycle::from(wait),
                ready: None,
            }),
            Err(AccessError::Error) if number > number::HARD_FAULT => {
                self.system.scb.note_hard_fault(hfsr::VECTTBL);
                self.system.pend(nvic::bit(number::HARD_FAULT), at);
                self.approach(bus, number::HARD_FAULT, at)
            }
            Err(AccessError::Error) => Err(self.lock_up()),
            Err(AccessError::Unmodelled(what)) => Err(Stop::Access {
                access: Access {
                    address,
                    size: Size::Word,
                    written: None,
                },
                pc: self.registers.r[15],
                what: what.0,
            }),
        }
    }

    /// Fetches the line of code with the handler's first instruction, and returns the cycle at
    /// which that instruction can execute.
    fn fetch_handler(&mut self, bus: &mut impl Bus, approach: &mut ExceptionEntry) -> Cycle {
        if let Some(ready) = approach.ready {
            return ready;
        }
        let wait = bus.fetch(approach.vector >> 4, approach.fetch_at);
        let ready = approach.fetch_at + (TAIL_CHAIN - VECTOR) + Cycle::from(wait);
        approach.ready = Some(ready);
        ready
    }

    /// Pushes the frame in the order PC, xPSR, R0–R3, R12, LR, then S0–S15 and FPSCR. Returns the
    /// cycle at which the handler can begin if its code is fetched.
    fn stack(&mut self, bus: &mut impl Bus, approach: &mut ExceptionEntry) -> Result<Cycle, Stop> {
        let began = self.cycle;
        let with_fp = self.registers.control & control::FPCA != 0;
        let aligns = with_fp || self.system.is_configured(ccr::STACK_ALIGN);
        let bytes = if with_fp { 0x68 } else { 0x20 };
        let sp = self.registers.r[13];
        let moved = aligns && sp & 4 != 0;
        let frame = sp.wrapping_sub(bytes) & if aligns { !4 } else { u32::MAX };
        let r = self.registers.r;
        let xpsr = self.xpsr() | u32::from(moved) << 9;
        let words = [
            (0x18, r[15]),
            (0x1C, xpsr),
            (0x00, r[0]),
            (0x04, r[1]),
            (0x08, r[2]),
            (0x0C, r[3]),
            (0x10, r[12]),
            (0x14, r[14]),
        ];
        self.registers.r[13] = frame;
        self.cycle = self.cycle.max(self.pipeline.buffer) + 1;
        let mut failed = false;
        for (offset, value) in words {
            self.push(
                bus,
                frame.wrapping_add(offset),
                value,
                approach,
                &mut failed,
            )?;
        }
        let mut more = 0;
        if with_fp {
            if self.system.floating.is_lazy() {
                let preempted = self.preempted_context();
                self.system
                    .floating
                    .defer_save(frame.wrapping_add(0x20), preempted);
            } else {
                self.push_fp(bus, frame, approach, &mut failed)?;
                more = FP_WORDS;
            }
        }
        let without_waits = 1 + words.len() as Cycle + more;
        let waits = self.cycle - began - without_waits;
        Ok(began + ENTRY + more + waits)
    }

    fn push_fp(
        &mut self,
        bus: &mut impl Bus,
        frame: u32,
        approach: &mut ExceptionEntry,
        failed: &mut bool,
    ) -> Result<(), Stop> {
        if !self
            .system
            .floating
            .is_allowed(self.registers.is_privileged())
        {
            return Err(Stop::Outside {
                pc: self.registers.r[15],
                what: "stacking of floating-point registers that CPACR denies",
            });
        }
        let s = self.registers.s;
        for (offset, value) in (0x20..0x60).step_by(4).zip(s) {
            self.push(bus, frame.wrapping_add(offset), value, approach, failed)?;
        }
        let fpscr = self.registers.fpscr;
        self.push(bus, frame.wrapping_add(0x60), fpscr, approach, failed)
    }

    /// Pushes one word. After a fault no more words are written, but their time passes.
    fn push(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        value: u32,
        approach: &mut ExceptionEntry,
        failed: &mut bool,
    ) -> Result<(), Stop> {
        self.look_for_late_arrival(bus, approach)?;
        if approach.ready.is_none() && approach.fetch_at <= self.cycle {
            self.fetch_handler(bus, approach);
        }
        if *failed {
            self.cycle += 1;
            return Ok(());
        }
        let privileged = self.registers.is_privileged();
        match self.stack_access(bus, address, Some(value), STACKING, privileged) {
            Ok(_) => Ok(()),
            Err(Trap::Fault(fault)) => {
                *failed = true;
                self.pend_fault(fault)
            }
            Err(Trap::Stop(stop)) => Err(stop),
        }
    }

    /// Returns the privilege of the pre-empted context, and which faults it could have taken.
    fn preempted_context(&self) -> PreemptedContext {
        let priority = self.execution_priority();
        PreemptedContext {
            privileged: self.registers.is_privileged(),
            thread: self.registers.exception == 0,
            hard_fault: priority > -1,
            mem_manage: self.system.may_preempt(number::MEM_MANAGE, priority),
            bus_fault: self.system.may_preempt(number::BUS_FAULT, priority),
        }
    }

    /// Switches the entry to an exception of higher priority, if one has become pending since it
    /// began.
    fn look_for_late_arrival(
        &mut self,
        bus: &mut impl Bus,
        approach: &mut ExceptionEntry,
    ) -> Result<(), Stop> {
        self.advance_to_now(bus)?;
        match self.preempting_exception() {
            Some(first) if first != approach.number => {
                let at = self.system.nvic.raised_at(first).max(approach.fetch_at);
                *approach = self.approach(bus, first, at)?;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Waits until stacking ends at `stacked` and the handler's code is fetched, then begins the
    /// handler, or that of a late arrival.
    pub(super) fn arrive(
        &mut self,
        bus: &mut impl Bus,
        mut approach: ExceptionEntry,
        stacked: Cycle,
        exc_return: u32,
        behind: u16,
    ) -> Result<(), Stop> {
        loop {
            let ready = self.fetch_handler(bus, &mut approach).max(stacked);
            self.cycle = self.cycle.max(ready);
            let before = approach.number;
            self.look_for_late_arrival(bus, &mut approach)?;
            if approach.number == before {
                break;
            }
        }
        self.begin_handler(bus, approach, exc_return, behind)
    }

    fn begin_handler(
        &mut self,
        bus: &mut impl Bus,
        approach: ExceptionEntry,
        exc_return: u32,
        behind: u16,
    ) -> Result<(), Stop> {
        let registers = &mut self.registers;
        if registers.uses_psp() {
            std::mem::swap(&mut registers.r[13], &mut registers.other_sp);
        }
        registers.control &= !(control::SPSEL | control::FPCA);
        registers.exception = approach.number;
        self.entered = true;
        registers.it = 0;
        registers.r[14] = exc_return;
        registers.r[15] = approach.vector & !1;
        let raised = self.system.nvic.raised_at(approach.number);
        self.system.nvic.activate(approach.number);
        self.system.event = true;
        self.system.update(&self.registers);
        self.system
            .latencies
            .record(approach.number, raised, self.cycle, behind);
        let msp = self.registers.r[13];
        let deepest = self.system.deepest_msp.get_or_insert(msp);
        *deepest = msp.min(*deepest);
        self.pipeline.begin_at(approach.vector);
        if approach.vector & 1 == 0 {
            return self.take_fault(bus, Fault::InvalidState);
        }
        Ok(())
    }
}
