//! Private peripherals, 0xE000_0000–0xE00F_FFFF: NVIC, SCB, SysTick, MPU, DWT,
//! FPU control as far as the images touch them (Arm ARM B3).
//!
//! Not here: what an exception does to the core's registers (`exception`). In:
//! accesses with their cycle, sampled interrupt lines. Out: which exception
//! goes first, what memory may be used for, when SysTick wants attention.

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

/// State of the private peripherals and of exceptions.
#[derive(Clone, Debug, Default)]
pub struct System {
    pub(super) nvic: Nvic,
    pub(super) scb: scb::Scb,
    pub(super) floating: floating::Floating,
    systick: systick::SysTick,
    mpu: mpu::Mpu,
    trace: trace::Trace,
    /// Floating-point instructions need no preparation: CPACR allows them,
    /// CONTROL.FPCA is set, no save is owed. Cleared by whatever may change
    /// that.
    pub(super) fp_is_ready: bool,
    /// The event register (Arm ARM B1.5.18).
    pub event: bool,
    sleeps_for_event: bool,
    sleeps_on_exit: bool,
    /// Cycle at which the lines were sampled last.
    pub(crate) sampled: Cycle,
    /// Number in IPSR, for ICSR.
    running: u16,
    /// Semihosting, if it is on; a reset leaves it alone.
    pub semihosting: Option<Semihosting>,
    /// A debugger is attached, and a comparator watches data.
    is_watching: bool,
    /// How long interrupts waited, since power-on.
    pub latencies: Latencies,
    /// Lowest main stack pointer after an exception's entry, since power-on.
    pub deepest_msp: Option<u32>,
}

impl System {
    /// Back to the state after a reset; statistics go on, and so does an
    /// attached debugger.
    pub(super) fn reset(&mut self) {
        let old = std::mem::take(self);
        self.sampled = old.sampled;
        self.semihosting = old.semihosting;
        self.latencies = old.latencies;
        self.deepest_msp = old.deepest_msp;
        self.trace = old.trace.reset();
        self.is_watching = old.is_watching;
    }

    /// Whether both do the same from now on: all but what is counted for people is equal.
    pub(super) fn is_equivalent_to(&self, other: &Self) -> bool {
        self.nvic.is_equivalent_to(&other.nvic)
            && (&self.scb, &self.floating) == (&other.scb, &other.floating)
            && (&self.systick, &self.mpu) == (&other.systick, &other.mpu)
            && (&self.trace, self.event) == (&other.trace, other.event)
            && (self.fp_is_ready, self.running) == (other.fp_is_ready, other.running)
            && (self.sleeps_for_event, self.sleeps_on_exit)
                == (other.sleeps_for_event, other.sleeps_on_exit)
    }

    /// Whether the MPU lets data at `address` be accessed. Hot: one compare
    /// while no region denies anything nearby.
    #[inline]
    pub fn may_access(&self, address: u32, write: bool, privileged: bool) -> bool {
        self.mpu.may_access(address, write, privileged)
    }

    /// Whether MPU and memory map let code at `address` be executed.
    pub fn may_execute(&self, address: u32, privileged: bool) -> bool {
        self.mpu.may_execute(address, privileged)
    }

    /// As [`mpu::Mpu::denied`].
    pub fn denied_range(&self) -> Option<Range<u64>> {
        self.mpu.denied_range()
    }

    /// Whether unprivileged code may write the private register at `address`
    /// (only STIR, if CCR.USERSETMPEND is set); everything else is a bus error
    /// to it (Arm ARM B3.1.1).
    pub const fn may_write_unprivileged(&self, address: u32) -> bool {
        address == 0xE000_EF00 && self.is_configured(ccr::USER_SET_PENDING)
    }

    /// Earliest cycle at which SysTick pends its exception.
    #[inline]
    pub fn next_event(&self) -> Cycle {
        self.systick.next_event()
    }

    /// A debugger was attached or let go: DHCSR.C_DEBUGEN.
    pub fn set_debugger(&mut self, attached: bool) {
        self.trace.debugger = attached;
        self.follow_comparators();
    }

    /// Whether a debugger is attached.
    pub const fn has_debugger(&self) -> bool {
        self.trace.debugger
    }

    /// Comparators of data that a debugger has.
    pub const COMPARATORS: usize = compare::COMPARATORS;

    /// Has one comparator watch each of `parts`, an address and log2 of its bytes (0–15). If
    /// not enough are free, it says so, and all stays as it was.
    pub fn add_watchpoint(&mut self, parts: &[(u32, u32)], what: WatchedAccess) -> bool {
        let done = self.trace.comparators.add(parts, what);
        self.follow_comparators();
        done
    }

    /// Frees the comparators of `parts`.
    pub fn remove_watchpoint(&mut self, parts: &[(u32, u32)], what: WatchedAccess) {
        self.trace.comparators.remove(parts, what);
        self.follow_comparators();
    }

    /// Frees all comparators.
    pub fn clear_watchpoints(&mut self) {
        self.trace.comparators.clear();
        self.follow_comparators();
    }

    fn follow_comparators(&mut self) {
        self.is_watching = self.trace.debugger && self.trace.comparators.has_watchpoints();
    }

    /// Whether [`Self::check_access`] must be told of instructions' accesses to data.
    #[inline]
    pub(super) const fn is_watching(&self) -> bool {
        self.is_watching
    }

    /// An instruction accesses data; whether that is watched.
    pub(super) fn check_access(&mut self, address: u32, size: Size, is_write: bool) -> bool {
        self.trace.comparators.check_access(address, size, is_write)
    }

    /// The first access that was watched since this was asked.
    pub(super) const fn take_hit(&mut self) -> Option<WatchpointHit> {
        self.trace.comparators.take_hit()
    }

    /// Whether CCR has any of `bits`.
    #[inline]
    pub const fn is_configured(&self, bits: u32) -> bool {
        self.scb.ccr & bits != 0
    }

    /// Whether ACTLR has any of `bits`.
    #[inline]
    pub const fn disables(&self, bits: u32) -> bool {
        self.scb.actlr & bits != 0
    }

    /// Brings the timer to `at` and samples the lines as they are then.
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

    /// SysTick stands from `at` on, or goes on.
    pub(super) fn hold_systick(&mut self, held: bool, at: Cycle) {
        self.advance_systick(at);
        self.systick.held = held;
    }

    /// Makes exceptions pending at `at`.
    pub(super) fn pend(&mut self, exceptions: u128, at: Cycle) {
        let new = self.nvic.pend(exceptions, at);
        self.note_pending(new);
    }

    fn note_pending(&mut self, new: u128) {
        if new != 0 && self.scb.scr & scb::scr::SEV_ON_PEND != 0 {
            self.event = true;
        }
    }

    /// Notes the cause of `fault`, and makes its exception, or a hard fault,
    /// pending at `at`. `None`: the core locks up, because not even a hard
    /// fault pre-empts `priority`.
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

    /// A buffered store met a bus error after its instruction: the bus fault
    /// waits until it pre-empts; disabled, it is a hard fault. `None`: which
    /// does not pre-empt `priority`, so that the core locks up.
    pub(super) fn pend_imprecise_fault(&mut self, priority: i16, at: Cycle) -> Option<()> {
        self.scb.note_imprecise_fault();
        if self.nvic.enabled & bit(number::BUS_FAULT) != 0 {
            self.pend(bit(number::BUS_FAULT), at);
            return Some(());
        }
        self.escalate(priority, at)
    }

    /// `exception` is enabled and pre-empts `priority`.
    pub(super) fn may_preempt(&self, exception: u16, priority: i16) -> bool {
        self.nvic.enabled & bit(exception) != 0 && self.nvic.group_priority(exception) < priority
    }

    /// Makes a hard fault pending in the place of an exception that does not
    /// pre-empt `priority`. `None`: nor does a hard fault.
    pub(super) fn escalate(&mut self, priority: i16, at: Cycle) -> Option<()> {
        if priority <= -1 {
            return None;
        }
        self.scb.note_hard_fault(hfsr::FORCED);
        self.pend(bit(number::HARD_FAULT), at);
        Some(())
    }

    /// What depends on IPSR, masks and active exceptions is up to date again.
    pub(super) fn update(&mut self, registers: &Registers) {
        self.running = registers.exception;
        self.fp_is_ready = false;
        let negative = self.nvic.priority_without_primask(registers) < 0;
        self.mpu.set_negative_priority(negative);
    }
}
