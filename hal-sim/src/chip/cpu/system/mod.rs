//! Models the private peripherals, 0xE000_0000–0xE00F_FFFF: NVIC, SCB, SysTick, MPU, DWT and FPU
//! control, as far as the images use them (Arm ARM B3).
//!
//! The effect of exceptions on the core's registers is in `exception`. In: accesses with their
//! cycle, sampled interrupt lines. Out: the exception to take next, the memory that may be
//! accessed, the next event of SysTick.

mod compare;
mod floating;
pub mod latency;
pub mod mpu;
pub mod nvic;
mod registers;
mod scb;
mod sleep;
mod systick;
mod trace;

#[cfg(test)]
mod tests;

pub use compare::{WatchedAccess, WatchpointHit};
pub use floating::PreemptedContext;
pub use latency::{Latencies, Latency};
pub(crate) use nvic::number;
pub(crate) use scb::{actlr, ccr, hfsr};

use super::bus::LINE_WORDS;
use super::semihosting::Semihosting;
use super::{Fault, Registers, Size};
use crate::chip::Cycle;
use nvic::{Nvic, bit};
use std::ops::Range;

/// State of the core's private peripherals (NVIC, SCB, SysTick, MPU, debug) and of exceptions.
#[derive(Clone, Debug, Default)]
pub struct System {
    pub(super) nvic: Nvic,
    pub(super) scb: scb::Scb,
    pub(super) floating: floating::Floating,
    systick: systick::SysTick,
    mpu: mpu::Mpu,
    trace: trace::Trace,
    /// Whether floating-point instructions need no preparation: CPACR allows them, CONTROL.FPCA is
    /// set, no save is pending. Cleared by anything that may change that.
    pub(super) fp_is_ready: bool,
    /// Event register: set by an event, which the next WFE consumes instead of sleeping (Arm ARM
    /// B1.5.18).
    pub event: bool,
    sleeps_for_event: bool,
    sleeps_on_exit: bool,
    /// Cycle at which the interrupt lines were last sampled.
    pub(crate) sampled: Cycle,
    /// Number of the running exception as in IPSR, which ICSR shows.
    running: u16,
    /// Semihosting, if it is on; a reset does not change it.
    pub semihosting: Option<Semihosting>,
    /// Whether a debugger is attached and a comparator watches data.
    is_watching: bool,
    /// Interrupt latencies since power-on.
    pub latencies: Latencies,
    /// Lowest main stack pointer after an exception entry since power-on.
    pub deepest_msp: Option<u32>,
}

impl System {
    /// Restores the state after a reset; statistics and an attached debugger stay.
    pub(super) fn reset(&mut self) {
        let old = std::mem::take(self);
        self.sampled = old.sampled;
        self.semihosting = old.semihosting;
        self.latencies = old.latencies;
        self.deepest_msp = old.deepest_msp;
        self.trace = old.trace.reset();
        self.is_watching = old.is_watching;
    }

    /// Returns whether both behave the same from now on: everything except statistics is equal.
    pub(super) fn is_equivalent_to(&self, other: &Self) -> bool {
        self.nvic.is_equivalent_to(&other.nvic)
            && (&self.scb, &self.floating) == (&other.scb, &other.floating)
            && (&self.systick, &self.mpu) == (&other.systick, &other.mpu)
            && (&self.trace, self.event) == (&other.trace, other.event)
            && (self.fp_is_ready, self.running) == (other.fp_is_ready, other.running)
            && (self.sleeps_for_event, self.sleeps_on_exit)
                == (other.sleeps_for_event, other.sleeps_on_exit)
    }

    /// Returns whether the MPU allows a data access at `address`. Called for each access: one
    /// comparison unless a region nearby denies something.
    #[inline]
    pub fn may_access(&self, address: u32, write: bool, privileged: bool) -> bool {
        self.mpu.may_access(address, write, privileged)
    }

    /// Returns whether the MPU and the memory map allow executing code at `address`.
    pub fn may_execute(&self, address: u32, privileged: bool) -> bool {
        self.mpu.may_execute(address, privileged)
    }

    /// Returns the range of addresses of the MPU region with the highest number, among the regions
    /// that deny all access; `None` if no region does.
    pub fn denied_range(&self) -> Option<Range<u64>> {
        self.mpu.denied_range()
    }

    /// Returns whether unprivileged code may write the private register at `address`: only STIR, if
    /// CCR.USERSETMPEND is set. Every other access is a bus error (Arm ARM B3.1.1).
    pub const fn may_write_unprivileged(&self, address: u32) -> bool {
        address == 0xE000_EF00 && self.is_configured(ccr::USER_SET_PENDING)
    }

    /// Returns the earliest cycle at which SysTick makes its exception pending.
    #[inline]
    pub fn next_event(&self) -> Cycle {
        self.systick.next_event()
    }

    /// Notes that a debugger was attached or detached: DHCSR.C_DEBUGEN.
    pub fn set_debugger(&mut self, attached: bool) {
        self.trace.debugger = attached;
        self.follow_comparators();
    }

    /// Returns whether a debugger is attached.
    pub const fn has_debugger(&self) -> bool {
        self.trace.debugger
    }

    /// Number of comparators that a debugger can use to watch data.
    pub const COMPARATORS: usize = compare::COMPARATORS;

    /// Uses one comparator for each of `parts`, an address and the log2 of a number of bytes
    /// (0–15). Returns `false` and changes nothing if too few are free.
    pub fn add_watchpoint(&mut self, parts: &[(u32, u32)], access: WatchedAccess) -> bool {
        let done = self.trace.comparators.add(parts, access);
        self.follow_comparators();
        done
    }

    /// Frees the comparators that watch accesses of kind `access` to `parts`.
    pub fn remove_watchpoint(&mut self, parts: &[(u32, u32)], access: WatchedAccess) {
        self.trace.comparators.remove(parts, access);
        self.follow_comparators();
    }

    /// Frees all comparators, so that no data are watched.
    pub fn clear_watchpoints(&mut self) {
        self.trace.comparators.clear();
        self.follow_comparators();
    }

    fn follow_comparators(&mut self) {
        self.is_watching = self.trace.debugger && self.trace.comparators.has_watchpoints();
    }

    /// Returns whether data accesses must be passed to [`Self::check_access`].
    #[inline]
    pub(super) const fn is_watching(&self) -> bool {
        self.is_watching
    }

    /// Checks an instruction's data access; returns whether it is watched.
    pub(super) fn check_access(&mut self, address: u32, size: Size, is_write: bool) -> bool {
        self.trace.comparators.check_access(address, size, is_write)
    }

    /// Takes the first match of a watchpoint since the last call.
    pub(super) const fn take_hit(&mut self) -> Option<WatchpointHit> {
        self.trace.comparators.take_hit()
    }

    /// Returns whether any of `bits` is set in CCR.
    #[inline]
    pub const fn is_configured(&self, bits: u32) -> bool {
        self.scb.ccr & bits != 0
    }

    /// Returns whether any of `bits` is set in ACTLR.
    #[inline]
    pub const fn disables(&self, bits: u32) -> bool {
        self.scb.actlr & bits != 0
    }

    /// Advances SysTick to `at`, and samples the interrupt lines and the NMI line, whose levels at
    /// that cycle are given.
    pub(super) fn sample(&mut self, lines: [u32; LINE_WORDS], nmi: bool, at: Cycle) {
        self.sampled = at;
        self.advance_systick(at);
        let new = self.nvic.sample(lines, nmi, at);
        self.note_pending(new);
    }

    fn advance_systick(&mut self, at: Cycle) {
        if let Some(reached) = self.systick.advance(at) {
            self.pend(bit(number::SYS_TICK), reached);
        }
    }

    /// Stops SysTick from `at` on, or lets it continue.
    pub(super) fn hold_systick(&mut self, held: bool, at: Cycle) {
        self.advance_systick(at);
        self.systick.held = held;
    }

    /// Makes `exceptions`, a mask with bit n for exception n, pending at `at`.
    pub(super) fn pend(&mut self, exceptions: u128, at: Cycle) {
        let new = self.nvic.pend(exceptions, at);
        self.note_pending(new);
    }

    fn note_pending(&mut self, new: u128) {
        if new != 0 && self.scb.scr & scb::scr::SEV_ON_PEND != 0 {
            self.event = true;
        }
    }

    /// Records the cause of `fault`, and makes its exception, or a hard fault, pending at `at`.
    /// Returns `None` if the core locks up, because not even a hard fault pre-empts `priority`.
    pub(super) fn pend_fault(&mut self, fault: Fault, priority: i16, at: Cycle) -> Option<()> {
        self.scb.note_fault(fault);
        let own = match scb::cfsr_bit(fault) {
            0 => number::HARD_FAULT,
            bits if bits <= 0xFF => number::MEM_MANAGE,
            bits if bits <= 0xFFFF => number::BUS_FAULT,
            _ => number::USAGE_FAULT,
        };
        if self.may_preempt(own, priority) {
            self.pend(bit(own), at);
            return Some(());
        }
        self.escalate(priority, at)
    }

    /// Handles the bus error of a buffered store after its instruction. The bus fault waits until
    /// it pre-empts; if it is disabled, it becomes a hard fault. Returns `None` if that does not
    /// pre-empt `priority`, so that the core locks up.
    pub(super) fn pend_imprecise_fault(&mut self, priority: i16, at: Cycle) -> Option<()> {
        self.scb.note_imprecise_fault();
        if self.nvic.enabled & bit(number::BUS_FAULT) != 0 {
            self.pend(bit(number::BUS_FAULT), at);
            return Some(());
        }
        self.escalate(priority, at)
    }

    /// Returns whether `exception` is enabled and pre-empts `priority`.
    pub(super) fn may_preempt(&self, exception: u16, priority: i16) -> bool {
        self.nvic.enabled & bit(exception) != 0 && self.nvic.group_priority(exception) < priority
    }

    /// Makes a hard fault pending instead of an exception that does not pre-empt `priority`.
    /// Returns `None` if a hard fault does not pre-empt it either.
    pub(super) fn escalate(&mut self, priority: i16, at: Cycle) -> Option<()> {
        if priority <= -1 {
            return None;
        }
        self.scb.note_hard_fault(hfsr::FORCED);
        self.pend(bit(number::HARD_FAULT), at);
        Some(())
    }

    /// Updates all state that depends on IPSR, the exception masks and the active exceptions.
    pub(super) fn update(&mut self, registers: &Registers) {
        self.running = registers.exception;
        self.fp_is_ready = false;
        let negative = self.nvic.priority_without_primask(registers) < 0;
        self.mpu.set_negative_priority(negative);
    }
}
