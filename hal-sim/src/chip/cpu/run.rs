//! Runs the core: instructions, events, exceptions, sleep.

use super::decode::{Cache, Entry};
use super::instruction::Op;
use super::timing::PipelineState;
use super::{Bus, Cpu, Open, Stop, Trap, TrapResult};
use crate::chip::Cycle;

/// Thread mode or exception that the core executes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Context {
    /// Exception number; 0 is thread mode.
    pub number: u16,
    /// Number of active exceptions, including this one.
    pub depth: u32,
    /// Whether the handler begins. Otherwise an exception has returned to this context.
    pub entered: bool,
}

/// Observer of a running core. Methods that an observer does not implement cost no time.
pub trait Observer {
    /// Reports that the instruction at `pc` took `cycles`, up to cycle `at`, and left `sp` as the
    /// stack pointer in use.
    fn instruction(&mut self, _pc: u32, _cycles: Cycle, _at: Cycle, _sp: u32) {}

    /// Reports that the core executes `context` from `at` on, after an exception's entry or return.
    fn context(&mut self, _context: Context, _at: Cycle) {}

    /// Reports that the core slept, in WFI or WFE, from cycle `from` to cycle `to`.
    fn asleep(&mut self, _from: Cycle, _to: Cycle) {}

    /// Returns whether to stop before the instruction at `pc` ([`Stop::Breakpoint`]).
    fn stops_before(&mut self, _pc: u32) -> bool {
        false
    }
}

impl Observer for () {}

impl Cpu {
    /// Runs until cycle `until` is reached, which one instruction or exception entry may exceed.
    /// Sleep is skipped to the next event.
    pub fn run(&mut self, bus: &mut impl Bus, until: Cycle) -> Result<(), Stop> {
        self.run_observed(bus, until, &mut ())
    }

    /// Runs like [`Self::run`], and reports to `observer`.
    ///
    /// # Errors
    /// Returns [`Stop`]; after a breakpoint, `step` continues.
    pub fn run_observed(
        &mut self,
        bus: &mut impl Bus,
        until: Cycle,
        observer: &mut impl Observer,
    ) -> Result<(), Stop> {
        loop {
            let done =
                self.with_decoded(|cpu, decoded| cpu.run_decoded(bus, decoded, until, observer));
            match done {
                Err(Stop::LockUp { .. }) if self.open != Open::Stops => self.stands = true,
                done => return done,
            }
        }
    }

    /// Calls `run` with the core and its decoded code, which is taken out of the core meanwhile, so
    /// that instructions can be executed without copying them.
    fn with_decoded<T>(&mut self, run: impl FnOnce(&mut Self, &mut Cache) -> T) -> T {
        let mut decoded = std::mem::take(&mut self.decoded);
        let done = run(self, &mut decoded);
        self.decoded = decoded;
        done
    }

    fn run_decoded(
        &mut self,
        bus: &mut impl Bus,
        decoded: &mut Cache,
        until: Cycle,
        observer: &mut impl Observer,
    ) -> Result<(), Stop> {
        loop {
            self.stop_if_watched()?;
            if self.stands {
                return self.advance_halted(bus, until);
            }
            self.service(bus, until, observer)?;
            decoded.check(bus.code_version());
            if self.cycle >= until {
                return Ok(());
            }
            loop {
                if observer.stops_before(self.registers.r[15]) {
                    let pc = self.registers.r[15];
                    return Err(Stop::Breakpoint { pc });
                }
                self.execute_next(bus, decoded, observer)?;
                if self.cycle >= self.deadline {
                    break;
                }
            }
        }
    }

    /// Executes exactly one instruction or takes one exception; during sleep, advances to the next
    /// event.
    pub fn step(&mut self, bus: &mut impl Bus) -> Result<(), Stop> {
        if self.stands {
            return self.advance_halted(bus, self.cycle + 1);
        }
        let until = match self.next_event(bus) {
            Cycle::MAX => 0, // nothing will ever wake the core
            event if self.asleep => event,
            _ => 0,
        };
        let before = self.registers.exception;
        let entered = self.service(bus, until, &mut ())?;
        if self.asleep || entered || self.registers.exception != before {
            return Ok(());
        }
        self.with_decoded(|cpu, decoded| {
            decoded.check(bus.code_version());
            cpu.execute_next(bus, decoded, &mut ())
        })?;
        self.stop_if_watched()
    }

    /// Stops the core after an instruction whose access matched a watchpoint.
    fn stop_if_watched(&mut self) -> Result<(), Stop> {
        let pc = self.registers.r[15];
        let hit = self.system.take_hit();
        hit.map_or(Ok(()), |hit| Err(Stop::Watchpoint { pc, hit }))
    }

    /// Halts the core or lets it continue; time passes in either case. SysTick does not count
    /// meanwhile (Arm ARM B3.3.1).
    pub fn set_halted(&mut self, halted: bool) {
        self.stands = halted;
        self.system.hold_systick(halted, self.cycle);
    }

    /// Branches to `target` as BX does: returns from an exception if `target` is an EXC_RETURN
    /// value, and faults if bit 0 is clear.
    ///
    /// # Errors
    /// Fails like [`Self::step`].
    pub fn jump(&mut self, bus: &mut impl Bus, target: u32) -> Result<(), Stop> {
        match self.branch_exchange(bus, target) {
            Ok(next) => {
                self.registers.r[15] = next;
                Ok(())
            }
            Err(trap) => self.handle_trap(bus, trap),
        }
    }

    /// Lets time pass up to `until` without executing instructions; pending exceptions stay
    /// pending.
    fn advance_halted(&mut self, bus: &mut impl Bus, until: Cycle) -> Result<(), Stop> {
        while self.cycle < until && !bus.is_reset_requested() {
            self.cycle = bus.next_event().max(self.cycle + 1).min(until);
            self.sample(bus)?;
        }
        if bus.is_reset_requested() {
            let pc = self.registers.r[15];
            return Err(Stop::Reset { pc });
        }
        Ok(())
    }

    /// Returns whether the core sleeps after WFI, WFE or sleep-on-exit.
    pub const fn is_asleep(&self) -> bool {
        self.asleep
    }

    /// Returns the cycle of the earliest event inside or outside the core.
    fn next_event(&self, bus: &impl Bus) -> Cycle {
        bus.next_event().min(self.system.next_event())
    }

    /// Processes due events, takes pending exceptions, passes the time of sleep up to `until`, and
    /// sets the next deadline. Returns whether an exception was taken.
    #[inline(never)]
    fn service(
        &mut self,
        bus: &mut impl Bus,
        until: Cycle,
        observer: &mut impl Observer,
    ) -> Result<bool, Stop> {
        self.asleep |= self.system.take_sleep_on_exit();
        let mut entered = self.enter_pending(bus)?;
        // A reset ends sleep regardless of masks: the watchdog needs no interrupt.
        while self.asleep && self.cycle < until && !bus.is_reset_requested() {
            let (from, next) = (self.cycle, self.next_event(bus).max(self.cycle + 1));
            self.cycle = next.min(until);
            if !bus.clocks_sleeping_core() {
                self.system.sleep_unclocked(self.cycle - from);
            }
            observer.asleep(from, self.cycle);
            entered |= self.enter_pending(bus)?;
        }
        if bus.is_reset_requested() {
            let pc = self.registers.r[15];
            return Err(Stop::Reset { pc });
        }
        let number = self.registers.exception;
        if self.entered || self.context != number {
            let context = Context {
                number,
                depth: self.system.nvic.active.count_ones(),
                entered: std::mem::take(&mut self.entered),
            };
            self.context = number;
            observer.context(context, self.cycle);
        }
        self.deadline = self.next_event(bus).min(until);
        Ok(entered)
    }

    /// Takes the pending exception if it pre-empts, and wakes a sleeping core if it should wake.
    /// Returns whether an exception was taken.
    fn enter_pending(&mut self, bus: &mut impl Bus) -> Result<bool, Stop> {
        if self.take_pending(bus)? {
            self.asleep = false;
            self.exclusive = false;
            return Ok(true);
        }
        if self.asleep && self.should_wake() {
            self.asleep = false;
        }
        Ok(false)
    }

    /// Executes the instruction at R15, and reports it to `observer`, or takes the fault that it
    /// causes.
    #[inline(always)]
    fn execute_next(
        &mut self,
        bus: &mut impl Bus,
        decoded: &mut Cache,
        observer: &mut impl Observer,
    ) -> Result<(), Stop> {
        let pc = self.registers.r[15];
        let start = self.cycle;
        let fresh;
        let mut entry = decoded.lookup(pc);
        if matches!(entry.op, Op::Missing) {
            fresh = match self.decode_missing(bus, decoded, pc) {
                Ok(entry) => entry,
                Err(trap) => return self.handle_trap(bus, trap),
            };
            entry = &fresh;
        }
        self.fetch_ahead(bus, pc, entry.trail.length());
        let done = if self.registers.it == 0 {
            self.execute(bus, entry)
        } else {
            self.execute_in_it_block(bus, *entry)
        };
        match done {
            Ok(next) => {
                self.registers.r[15] = next;
                self.instructions = self.instructions.wrapping_add(1);
                let sp = self.registers.r[13];
                observer.instruction(pc, self.cycle.wrapping_sub(start), self.cycle, sp);
                Ok(())
            }
            Err(trap) => self.handle_trap(bus, trap),
        }
    }

    /// Executes an instruction in an IT block with its condition; 16-bit instructions leave the
    /// flags unchanged there (Arm ARM A7.3.2).
    #[inline(never)]
    fn execute_in_it_block(&mut self, bus: &mut impl Bus, entry: Entry) -> TrapResult<u32> {
        let value = self.registers.it;
        // An exception return restores an IT state of its own.
        self.registers.it = if value & 7 == 0 {
            0
        } else {
            value & 0xE0 | value << 1 & 0x1F
        };
        if !self.is_condition_met(value >> 4) {
            self.advance_by(1);
            self.pipeline.last = PipelineState::idle(entry.trail.length());
            let length = u32::from(entry.trail.length());
            return Ok(self.registers.r[15].wrapping_add(length));
        }
        let mut entry = entry;
        if entry.trail.length() == 2 {
            entry.op = entry.op.without_flags();
        }
        let done = self.execute(bus, &entry);
        if let Err(Trap::Fault(_)) = done {
            self.registers.it = value;
        }
        done
    }

    #[cold]
    #[inline(never)]
    fn handle_trap(&mut self, bus: &mut impl Bus, trap: Trap) -> Result<(), Stop> {
        self.deadline = 0;
        match trap {
            Trap::Fault(fault) => {
                self.exclusive = false;
                self.take_fault(bus, fault)
            }
            Trap::Stop(stop) => Err(stop),
        }
    }
}
