//! Simulates a stimulator board: the chip that runs an image, its DACs, loads, buttons, and a USB
//! host at the other end of the cable.
//!
//! In: an image, sensors, bytes from the host, the time to run to. Out: levels, DAC codes and bytes
//! at their microsecond; pin edges at their cycle. World time is device time: it is 0 when the
//! image's microsecond counter is first 0.

mod around;
mod dac_line;
pub mod front_end;
mod hardware;
mod loss;
mod margin;
mod outputs;
pub mod stages;
pub mod wiring;

pub use around::Surroundings;
pub use hardware::{Hardware, PinLog, SharedPinLog};
pub use loss::{Half, Loss};
pub use margin::Margins;
pub use outputs::Phases;
pub use wiring::CYCLES_PER_US;

use super::Cycle;
use super::cpu::{Cpu, Stop, run::Observer};
use super::image::Image;
use super::soc::{Pace, rcc::Cause};
use crate::lockstep::{Device, Output};
use crate::trace::CHANNELS;
use firmware::link::message::ResetCause;
use firmware::lockstep::{Sensors, Sink};
use firmware::units::{Micros, us};
use std::io;
use std::sync::Arc;

/// Longest time that an image may take from power-on or the last reset to open its USB port, s.
const BOOT_LIMIT_S: u64 = 3;
/// Limit `BOOT_LIMIT_S` in cycles of the core at its fastest clock.
pub(super) const BOOT_LIMIT: Cycle = BOOT_LIMIT_S * wiring::CORE_HZ as Cycle;

/// Reason why a simulated board cannot run on.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// The core stopped.
    #[error("E540 the simulated chip stopped: {stop} (in {function})")]
    Stopped {
        /// Reason for the stop.
        stop: Stop,
        /// Function that was running, by its symbol, with the distance from its start.
        function: String,
    },
    /// The image did not open its USB port within 3 s of simulated time.
    #[error(
        "E541 the image did not open its USB port within {BOOT_LIMIT_S} s of simulated time{why}; \
         use an image that works as a USB device"
    )]
    NoPort {
        /// Last failure that the host observed; empty if there was none.
        why: String,
    },
    /// The user ended the run with `kill` in the debugger.
    #[error("E549 gdb ended the run with its command `kill` or `run`; start flexor again")]
    Killed,
    /// The image does not run a microsecond counter.
    #[error(
        "E542 the image opened its port without starting TIM1 and TIM2, the time base that the \
         simulator reads; start both first"
    )]
    NoTime,
}

impl From<BoardError> for io::Error {
    fn from(error: BoardError) -> Self {
        Self::other(error)
    }
}

/// A simulated board that runs an image. A clone continues independently from the same state.
#[derive(Clone, Debug)]
pub struct Board<O = ()> {
    /// The processor core.
    pub cpu: Cpu,
    /// Everything around the core: the rest of the chip, and the board.
    pub around: Surroundings,
    /// Observer of the core's instructions and exceptions.
    pub observer: O,
    /// Image in the flash; clones of the board share it.
    image: Arc<Image>,
    now_us: u64,
    last_reset: Option<Cycle>,
}

impl<O: Observer> Board<O> {
    /// Powers on a board with `image` in its flash and `outputs` as its stages; the USB cable is
    /// plugged in. Nothing has run yet.
    pub fn power_on(
        image: Image,
        outputs: [Option<Output>; CHANNELS],
        pace: Pace,
        observer: O,
    ) -> Result<Self, BoardError> {
        let hardware = Hardware::new(&wiring::REFERENCE);
        Self::power_on_as(&hardware, image, outputs, pace, observer)
    }

    /// Powers on a board like [`Self::power_on`], with other hardware.
    pub fn power_on_as(
        hardware: &Hardware,
        image: Image,
        outputs: [Option<Output>; CHANNELS],
        pace: Pace,
        observer: O,
    ) -> Result<Self, BoardError> {
        let mut board = Self {
            cpu: Cpu::default(),
            around: Surroundings::new(hardware, &image.flash, outputs, pace),
            observer,
            image: Arc::new(image),
            now_us: 0,
            last_reset: None,
        };
        let reset = board.cpu.reset(&mut board.around);
        reset.map_err(|stop| board.explain(stop))?;
        Ok(board)
    }

    /// Runs until the USB host has opened the device's port: the image has set up clocks and tape,
    /// and has been enumerated. Time as seen by the session begins then.
    pub fn boot(&mut self, sensors: &Sensors) -> Result<(), BoardError> {
        while !self.boot_on(sensors, Some(self.last_reset.unwrap_or(0) + BOOT_LIMIT))? {}
        Ok(())
    }

    /// Continues [`Self::boot`] by at most a millisecond at the fastest clock, and returns whether
    /// the port is open. Stops with an error if the port is not open at cycle `end`.
    pub(super) fn boot_on(
        &mut self,
        sensors: &Sensors,
        end: Option<Cycle>,
    ) -> Result<bool, BoardError> {
        self.set_sensors(sensors)?;
        if !self.around.host.open {
            if end.is_some_and(|end| self.cpu.cycle > end) {
                let failure = self.around.host.failure;
                let why = failure.map_or_else(String::new, |f| format!(": {f}"));
                return Err(BoardError::NoPort { why });
            }
            self.run_to(self.cpu.cycle + 1_000 * CYCLES_PER_US)?;
            return Ok(false);
        }
        let origin = self.around.find_origin(self.cpu.cycle);
        let origin = origin.ok_or(BoardError::NoTime)?;
        let now_us = (self.cpu.cycle - origin) / CYCLES_PER_US + 1;
        self.run_to(origin + now_us * CYCLES_PER_US)?;
        self.now_us = now_us;
        self.around.begin(origin);
        Ok(true)
    }

    /// Sets the sensors to `sensors` from now on, without running.
    ///
    /// # Errors
    /// Returns [`BoardError`] if an input cannot be driven.
    pub fn set_sensors(&mut self, sensors: &Sensors) -> Result<(), BoardError> {
        self.around
            .set_sensors(sensors, self.cpu.cycle)
            .map_err(|feature| self.explain(feature.to_stop(&self.cpu)))
    }

    /// Returns the board in its present state with another observer.
    pub fn with_observer<P>(self, observer: P) -> Board<P> {
        Board {
            cpu: self.cpu,
            around: self.around,
            observer,
            image: self.image,
            now_us: self.now_us,
            last_reset: self.last_reset,
        }
    }

    /// Returns the name of the first part whose state differs from that of `other`, a clone of this
    /// board at the same time. `None` means that both behave the same from now on if they get the
    /// same inputs.
    pub fn first_difference(&self, other: &Self) -> Option<&'static str> {
        if self.now_us != other.now_us || self.last_reset != other.last_reset {
            return Some("time");
        }
        match self.cpu.is_equivalent_to(&other.cpu) {
            true => self.around.first_difference(&other.around, self.cpu.cycle),
            false => Some("core"),
        }
    }

    /// Returns the device time up to which the board has run, µs. It is also the time of the
    /// simulated world.
    pub const fn now_us(&self) -> u64 {
        self.now_us
    }

    /// Returns the cycle of the last reset since power-on, if there was one.
    pub const fn last_reset(&self) -> Option<Cycle> {
        self.last_reset
    }

    /// Returns the image in the flash of the board.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Runs the core up to `cycle`. Resets of the chip do not end the run.
    pub fn run_to(&mut self, cycle: Cycle) -> Result<(), BoardError> {
        while self.cpu.cycle < cycle {
            let run = self
                .cpu
                .run_observed(&mut self.around, cycle, &mut self.observer);
            match run {
                Ok(()) => {}
                Err(Stop::Reset { .. }) => self.reset()?,
                Err(stop) => return Err(self.explain(stop)),
            }
        }
        Ok(())
    }

    /// Executes one instruction or takes one exception; carries out a reset of the chip.
    #[cfg(feature = "gdb")]
    pub(super) fn step(&mut self) -> Result<(), BoardError> {
        match self.cpu.step(&mut self.around) {
            Err(Stop::Reset { .. }) => self.reset(),
            done => done.map_err(|stop| self.explain(stop)),
        }
    }

    /// Returns the address of the next instruction.
    #[cfg(feature = "gdb")]
    pub(super) const fn pc(&self) -> u32 {
        self.cpu.registers.r[15]
    }

    fn reset(&mut self) -> Result<(), BoardError> {
        let at = self.cpu.cycle;
        self.last_reset = Some(at);
        let done = self.around.reset(at);
        done.map_err(|feature| self.explain(feature.to_stop(&self.cpu)))?;
        let done = self.cpu.reset(&mut self.around);
        done.map_err(|stop| self.explain(stop))
    }

    /// Resets the chip with `cause`, as if the chip had requested it.
    ///
    /// # Errors
    /// Returns [`BoardError`] if there is no vector table.
    pub fn reset_with_cause(&mut self, cause: ResetCause) -> Result<(), BoardError> {
        self.around.soc.request_reset_for(match cause {
            ResetCause::PowerOn => Cause::PowerOn,
            ResetCause::Pin => Cause::Pin,
            ResetCause::BrownOut => Cause::BrownOut,
            ResetCause::Watchdog => Cause::Watchdog,
            ResetCause::Software => Cause::Software,
        });
        self.reset()
    }

    /// Sets the supply voltage to `mv`. Below the chip's minimum, the chip is held in reset with
    /// all pins as inputs; it starts again when the voltage suffices.
    ///
    /// # Errors
    /// Returns [`BoardError`] if there is no vector table.
    pub fn supply(&mut self, mv: u32) -> Result<(), BoardError> {
        let had = self.around.soc.is_powered();
        self.around.soc.supply(mv);
        let has = self.around.soc.is_powered();
        if had && !has {
            self.reset()?;
            self.cpu.set_halted(true);
        } else if has && !had {
            self.cpu.set_halted(false);
        }
        Ok(())
    }

    /// Halts the core as a debugger does, or lets it continue; time goes on meanwhile.
    ///
    /// # Errors
    /// Returns [`BoardError`] if timers would stop in a way that is not modelled.
    pub fn debug_halt(&mut self, halted: bool) -> Result<(), BoardError> {
        let at = self.cpu.cycle;
        let done = self.around.debug_halt(halted, at);
        done.map_err(|feature| self.explain(feature.to_stop(&self.cpu)))?;
        self.cpu.set_halted(halted);
        Ok(())
    }

    /// Makes the PLL output `hz` instead of the frequency that its registers set.
    ///
    /// # Errors
    /// Returns [`BoardError`] if the prescalers are not modelled.
    pub fn set_pll_hz(&mut self, hz: u32) -> Result<(), BoardError> {
        let at = self.cpu.cycle;
        let done = self.around.set_pll_hz(hz, at);
        done.map_err(|feature| self.explain(feature.to_stop(&self.cpu)))
    }

    /// Stops the crystal permanently, as a broken crystal does.
    ///
    /// # Errors
    /// Returns [`BoardError`] if core or PLL depend on the crystal and clock security does not
    /// monitor it.
    pub fn stop_crystal(&mut self) -> Result<(), BoardError> {
        let at = self.cpu.cycle;
        let done = self.around.stop_crystal(at);
        done.map_err(|feature| self.explain(feature.to_stop(&self.cpu)))
    }

    fn explain(&self, stop: Stop) -> BoardError {
        let pc = self.cpu.registers.r[15];
        let function = self.image.symbols.describe(pc);
        BoardError::Stopped { stop, function }
    }

    /// Runs the core to `to` while the sensors have the values `sensors`. If an earlier call was
    /// stopped on the way, continues from there.
    pub(super) fn resume(&mut self, to: Micros, sensors: &Sensors) -> Result<(), BoardError> {
        self.set_sensors(sensors)?;
        if sensors.trigger.is_none() {
            let done = self.around.trigger(sensors.held, self.cpu.cycle);
            done.map_err(|feature| self.explain(feature.to_stop(&self.cpu)))?;
        }
        if let Some(at) = sensors.trigger.filter(|at| at.is_before(to)) {
            // The trigger edge comes at its microsecond; the level falls again 2 µs later unless
            // held.
            for (high, at) in [(true, at), (sensors.held, at + us(2))] {
                if (at - Micros::new(self.now_us as u32)).us() < 0 {
                    continue; // done before a stop
                }
                self.advance_to(at)?;
                let done = self.around.trigger(high, self.cpu.cycle);
                done.map_err(|feature| self.explain(feature.to_stop(&self.cpu)))?;
            }
        }
        self.advance_to(to)
    }

    /// Passes the board's output so far to `sink`.
    pub(super) fn emit(&mut self, sink: &mut dyn Sink) {
        self.around.emit(self.now_us, sink);
    }

    fn advance_to(&mut self, to: Micros) -> Result<(), BoardError> {
        let ahead = (to - Micros::new(self.now_us as u32)).us();
        let Ok(ahead) = u64::try_from(ahead) else {
            return Ok(()); // already there
        };
        let now_us = self.now_us + ahead;
        // The clock may fail, or a reset may slow it, on the way.
        loop {
            let end = self.around.cycle_of(now_us);
            if end <= self.cpu.cycle {
                break;
            }
            self.run_to(end.min(self.cpu.cycle + SAME_CLOCK))?;
        }
        self.now_us = now_us;
        Ok(())
    }
}

/// Number of cycles for which the core's clock is assumed to be constant, 20 µs. If the clock
/// becomes ten times slower within them, the board overruns the requested time by 0.2 ms at most.
const SAME_CLOCK: Cycle = 20 * CYCLES_PER_US;

impl<O: Observer + Clone + Send + 'static> Device for Board<O> {
    fn fork(&self) -> Option<Box<dyn Device>> {
        Some(Box::new(self.clone()))
    }

    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        self.advance(at, sensors, sink)?;
        self.around.host.send(bytes, self.cpu.cycle);
        self.around.reschedule();
        Ok(())
    }

    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()> {
        self.resume(to, sensors)?;
        self.emit(sink);
        Ok(())
    }
}

impl<O> AsMut<Surroundings> for Board<O> {
    fn as_mut(&mut self) -> &mut Surroundings {
        &mut self.around
    }
}
