//! Runs any image on the chip on a bare board, which has a crystal, observed pins and a USB socket,
//! and reports how the run ended.
//!
//! Contains the run and its end, everything around the core (`wires`), and the faults that the
//! program takes (`fault`). The stimulator's board is in `board`, the peripherals in `soc`. In: an
//! image, bytes of a USB host, the time to run to. Out: edges of pins, bytes of USART2, USB and
//! semihosting's console, the [`EarlyEnd`].

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

/// Time in a fault handler after which the handler counts as never returning, ns. Until then it may
/// print a message.
const HANDLER_NS: u64 = 100_000_000;

/// Number of cycles for which the core's clock is assumed to be constant. A run ends at most so
/// many cycles after the requested time.
const SAME_CLOCK: Cycle = 3_360;

/// Reason why a program ended before the requested time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EarlyEnd {
    /// The program ended itself through semihosting, with this status.
    Exit(u32),
    /// The program took a fault and has been in the handler for 100 ms; [`Bare::faults`] describes
    /// the fault.
    InHandler,
    /// The core stopped: at a feature that is not modelled, or in a lock-up.
    Stopped(Stop),
}

/// A chip on a board without further circuits, which runs an image.
pub struct Bare {
    cpu: Cpu,
    /// Everything around the core: the rest of the chip, its pins and its USB socket.
    pub wires: Wires,
    image: Image,
    watcher: FaultWatcher,
    faults: Vec<Fault>,
    resets: Vec<(u64, Cause)>,
}

impl Bare {
    /// Powers on a chip with `image` in its flash, and with a USB host at its socket if `is_host`.
    /// Nothing has run yet.
    ///
    /// # Errors
    /// Fails if there is no vector table.
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

    /// Runs until `ns` nanoseconds after power-on. Resets of the chip do not end the run.
    ///
    /// # Errors
    /// Returns [`EarlyEnd`] if the program ended before.
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
                // Only the watcher causes this stop.
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

    /// Returns the time since power-on, ns.
    pub fn now_ns(&self) -> u64 {
        self.wires.time().ns(self.cpu.cycle)
    }

    /// Returns the core cycles since power-on.
    pub const fn cycles(&self) -> Cycle {
        self.cpu.cycle
    }

    /// Returns the instructions completed since power-on.
    pub const fn instructions(&self) -> u64 {
        self.cpu.instructions
    }

    /// Returns the address of the next instruction, and the function that contains it, by the
    /// image's symbols.
    pub fn location(&self) -> (u32, String) {
        let pc = self.cpu.registers.r[15];
        (pc, self.image.symbols.describe(pc))
    }

    /// Returns whether the core sleeps and nothing will wake it.
    pub fn sleeps_for_good(&self) -> bool {
        let next = self.wires.next_event().min(self.cpu.system.next_event());
        self.cpu.is_asleep() && next == Cycle::MAX
    }

    /// Returns whether the core is in the handler of a fault.
    pub const fn is_in_handler(&self) -> bool {
        self.watcher.since.is_some()
    }

    /// Returns the faults that the program took, in the order of time.
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// Returns the resets since power-on, each with its time (ns) and cause.
    pub fn resets(&self) -> &[(u64, Cause)] {
        &self.resets
    }

    /// Returns the image in the flash of the chip.
    pub const fn image(&self) -> &Image {
        &self.image
    }

    /// Takes the text that the program printed over semihosting since the last call.
    pub fn console(&mut self) -> Vec<u8> {
        let host = self.cpu.system.semihosting.as_mut();
        host.map(|host| std::mem::take(&mut host.console))
            .unwrap_or_default()
    }

    /// Sends `bytes` over USB to the device, as a program on the host does; without a host, they
    /// are lost.
    pub fn send(&mut self, bytes: &[u8]) {
        self.wires.send(bytes, self.cpu.cycle);
    }

    /// Records a fault that the watcher did not see because the core locked up on entry to the
    /// handler.
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
        let stopped = |feature: super::cpu::bus::Unmodelled, cpu: &Cpu| {
            EarlyEnd::Stopped(Stop::Outside {
                pc: cpu.registers.r[15],
                what: feature.0,
            })
        };
        let cause = self.wires.reset(at);
        let cause = cause.map_err(|feature| stopped(feature, &self.cpu))?;
        self.resets.push((self.wires.time().ns(at), cause));
        self.watcher = FaultWatcher::default();
        let done = self.cpu.reset(&mut self.wires);
        done.map_err(EarlyEnd::Stopped)
    }
}

/// Observer that detects when the program takes faults.
#[derive(Debug, Default)]
struct FaultWatcher {
    /// Exception number of a fault, and the cycle at which its handler was entered, if the handler
    /// has not run yet.
    entered: Option<(u16, Cycle)>,
    /// Cycle at which the handler of a fault was entered, if it has not returned.
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
