//! The chip on a bare board: its crystal, pins that are looked at, a USB socket. Runs any
//! image, and says how it ended.
//!
//! Lives here: the run and its end; all around the core (`wires`); faults that the program
//! takes (`fault`). Not here: the stimulator's board (`board`); the image's peripherals
//! (`soc`). In: an image, bytes of a USB host, how far time goes. Out: edges of pins, bytes of
//! USART2, USB and semihosting's console, the [`EarlyEnd`].

mod fault;
#[cfg(test)]
mod tests;
mod wires;

pub use fault::Fault;
pub use wires::{PinEdge, Wires};

use super::Cycle;
use super::cpu::run::Context;
use super::cpu::semihosting::Semihosting;
use super::cpu::{Bus, Cpu, Observer, Stop};
use super::image::Image;
use super::soc::rcc::Cause;
use fault::is_fault;

/// A fault handler that has run for longer will not return: it may have printed what
/// happened, and waits for somebody. Nanoseconds.
const HANDLER_NS: u64 = 100_000_000;

/// Cycles for which the core's clock is taken as it is: time ends within so many of its end.
const SAME_CLOCK: Cycle = 3_360;

/// How a program ended before its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EarlyEnd {
    /// It ended itself through semihosting, with this status.
    Exit(u32),
    /// It took a fault and has been in its handler for 100 ms: [`Bare::faults`] has it.
    InHandler,
    /// The core stopped: what nobody models, or a lock-up.
    Stopped(Stop),
}

/// The chip, running an image.
pub struct Bare {
    cpu: Cpu,
    /// All around the core.
    pub wires: Wires,
    image: Image,
    watcher: FaultWatcher,
    faults: Vec<Fault>,
    resets: Vec<(u64, Cause)>,
}

impl Bare {
    /// Power comes on at a chip with `image` in its flash, a host at its USB socket if there
    /// `is_host`. Nothing has run yet.
    ///
    /// # Errors
    /// No vector table.
    pub fn power_on(image: Image, is_host: bool) -> Result<Self, Stop> {
        let mut cpu = Cpu::default();
        let mut wires = Wires::new(&image.flash, is_host);
        cpu.reset(&mut wires)?;
        cpu.system.semihosting = Some(Semihosting::default());
        Ok(Self {
            cpu,
            wires,
            image,
            watcher: FaultWatcher::default(),
            faults: Vec::new(),
            resets: Vec::new(),
        })
    }

    /// Lets time go on to `ns` nanoseconds after power-on, through resets.
    ///
    /// # Errors
    /// [`EarlyEnd`]: the program ended before.
    pub fn run_to(&mut self, ns: u64) -> Result<(), EarlyEnd> {
        loop {
            let end = self.wires.time().cycle_of_ns(ns);
            if end <= self.cpu.cycle {
                return Ok(());
            }
            let until = end.min(self.cpu.cycle + SAME_CLOCK);
            let Self {
                cpu,
                wires,
                watcher,
                ..
            } = self;
            match cpu.run_observed(wires, until, watcher) {
                Ok(()) => {}
                // The watcher alone stops it so.
                Err(Stop::Breakpoint { .. }) => self.note_fault(),
                Err(Stop::Reset { .. }) => self.reset()?,
                Err(Stop::Exit(status)) => return Err(EarlyEnd::Exit(status)),
                Err(stop) => {
                    self.note_lock_up(stop);
                    return Err(EarlyEnd::Stopped(stop));
                }
            }
            let since = self.watcher.since.map(|at| self.wires.time().ns(at));
            if since.is_some_and(|since| self.now_ns() >= since + HANDLER_NS) {
                return Err(EarlyEnd::InHandler);
            }
        }
    }

    /// Time since power-on, ns.
    pub fn now_ns(&self) -> u64 {
        self.wires.time().ns(self.cpu.cycle)
    }

    /// Core cycles since power-on.
    pub const fn cycles(&self) -> Cycle {
        self.cpu.cycle
    }

    /// Instructions completed since power-on.
    pub const fn instructions(&self) -> u64 {
        self.cpu.instructions
    }

    /// Address of the next instruction, and its function by the image's symbols.
    pub fn location(&self) -> (u32, String) {
        let pc = self.cpu.registers.r[15];
        (pc, self.image.symbols.describe(pc))
    }

    /// Whether the core sleeps and nothing will wake it.
    pub fn sleeps_for_good(&self) -> bool {
        let next = self.wires.next_event().min(self.cpu.system.next_event());
        self.cpu.is_asleep() && next == Cycle::MAX
    }

    /// Whether the core is in the handler of a fault.
    pub const fn is_in_handler(&self) -> bool {
        self.watcher.since.is_some()
    }

    /// Faults that the program took, in their order.
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// Resets since power-on: when (ns), and why.
    pub fn resets(&self) -> &[(u64, Cause)] {
        &self.resets
    }

    /// The image that runs.
    pub const fn image(&self) -> &Image {
        &self.image
    }

    /// What the program printed over semihosting since the last call.
    pub fn console(&mut self) -> Vec<u8> {
        let host = self.cpu.system.semihosting.as_mut();
        host.map(|host| std::mem::take(&mut host.console))
            .unwrap_or_default()
    }

    /// Bytes of a USB host's program, to the device.
    pub fn send(&mut self, bytes: &[u8]) {
        self.wires.send(bytes, self.cpu.cycle);
    }

    /// A core that locks up where it enters a handler was not seen to take the fault.
    fn note_lock_up(&mut self, stop: Stop) {
        let number = self.cpu.registers.exception;
        let was_seen = self.watcher.since.is_some();
        if matches!(stop, Stop::LockUp { .. }) && is_fault(number) && !was_seen {
            self.watcher.entered = Some((number, self.cpu.cycle));
            self.note_fault();
        }
    }

    fn note_fault(&mut self) {
        if let Some((number, at)) = self.watcher.entered.take() {
            let ns = self.wires.time().ns(at);
            let fault = Fault::at_entry(number, ns, &mut self.cpu, &self.wires.soc);
            self.faults.push(fault);
        }
    }

    fn reset(&mut self) -> Result<(), EarlyEnd> {
        let at = self.cpu.cycle;
        let stopped = |what: super::cpu::bus::Unmodelled, cpu: &Cpu| {
            EarlyEnd::Stopped(Stop::Outside {
                pc: cpu.registers.r[15],
                what: what.0,
            })
        };
        let cause = self.wires.reset(at);
        let cause = cause.map_err(|what| stopped(what, &self.cpu))?;
        self.resets.push((self.wires.time().ns(at), cause));
        self.watcher = FaultWatcher::default();
        let done = self.cpu.reset(&mut self.wires);
        done.map_err(EarlyEnd::Stopped)
    }
}

/// Sees the program take faults.
#[derive(Debug, Default)]
struct FaultWatcher {
    /// A fault's handler was entered, and has not run yet.
    entered: Option<(u16, Cycle)>,
    /// Since when the handler of a fault has not returned.
    since: Option<Cycle>,
}

impl Observer for FaultWatcher {
    fn context(&mut self, context: Context, at: Cycle) {
        if context.entered && is_fault(context.number) {
            self.entered = Some((context.number, at));
            self.since = Some(at);
        } else if !context.entered && !is_fault(context.number) {
            self.since = None;
        }
    }

    fn stops_before(&mut self, _pc: u32) -> bool {
        self.entered.is_some()
    }
}
