//! Models everything around the core, as the core's bus: the chip, and the parts wired to it.

mod bus;

use super::dac_line::received_bits;
use super::front_end::{current_ma, sense};
use super::hardware::{Hardware, PinLog, SharedPinLog};
use super::loss::Loss;
use super::margin::Margins;
use super::outputs::{Outputs, Phases};
use super::stages;
use super::wiring::{self, Pin, Wiring};
use crate::chip::Cycle;
use crate::chip::ad5668::Ad5668;
use crate::chip::cpu::bus::{AccessError, Bus, LINE_WORDS, Modelled, Unmodelled};
use crate::chip::cpu::{Cpu, Stop};
use crate::chip::soc::gpio::Level;
use crate::chip::soc::rcc::Cause;
use crate::chip::soc::{Pace, Soc, playback};
use crate::chip::usb::Host;
use crate::lockstep::Output;
use crate::trace::judge::Pump;
use crate::trace::{CHANNELS, Levels};
use firmware::lockstep::{Sensors, Sink};
use std::collections::VecDeque;

/// Largest number of changes of the diode that are kept.
const LED_CHANGES: usize = 256;

impl Unmodelled {
    /// Adds the core's program counter to the error, which gives a [`Stop`].
    pub(super) const fn to_stop(self, cpu: &Cpu) -> Stop {
        Stop::Outside {
            pc: cpu.registers.r[15],
            what: self.0,
        }
    }
}

/// Everything on the chip except the core, and the board around the chip: DACs, output stages,
/// sensors, USB host.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// Peripherals and memories of the chip.
    pub soc: Soc,
    /// USB host at the other end of the cable.
    pub host: Host,
    dacs: [Ad5668; 2],
    outputs: Outputs,
    stages: [Option<Output>; CHANNELS],
    /// Whether a wire connects the strap to 3.3 V; without effect on the reference board.
    pub is_strapped: bool,
    /// Latest changes of the diode: cycle and whether it is lit.
    led: VecDeque<(Cycle, bool)>,
    /// Number of writes to the mode register of the pump's port that left the pump not an input.
    pump_drives: u64,
    pins: Option<SharedPinLog>,
    load_ohm: [u32; CHANNELS],
    joint: u16,
    /// Output lines that are broken between the chip and a stage, as an injected fault; the stage
    /// sees them low.
    pub broken: Levels,
    /// Selection of the SPI words that never arrive at the DACs, as an injected fault; by default
    /// none.
    pub loss: Loss,
    /// Refill margins of the tape's windows since device time 0 or [`Self::restart_counts`].
    pub(crate) margins: Margins,
    hz: u32,
    now: Cycle,
    /// Levels of the interrupt lines at `now`, by line number as in [`Bus::interrupt_lines`].
    lines: [u32; LINE_WORDS],
}

impl Surroundings {
    pub(super) fn new(
        hardware: &Hardware,
        flash: &[u8],
        outputs: [Option<Output>; CHANNELS],
        pace: Pace,
    ) -> Self {
        let wiring = hardware.wiring;
        let mut soc = Soc::with_crystal(pace, hardware.crystal);
        // `Image` has checked that the flash contents fit.
        let _ = soc.flash.load(super::super::soc::flash::BASE, flash);
        if !wiring.is_breadboard() {
            let words = stages::table(&outputs).to_words(soc.signature.uid);
            for copy in stages::COPIES {
                let _ = stages::write(&mut soc.flash, copy, &words); // both lie in flash
            }
        }
        soc.otg.set_sensed(wiring.vbus);
        soc.flash.set_options(stages::OPTIONS);
        let hz = soc.hz();
        let mut host = Host::new(hz.into());
        host.plug(0, &mut soc.otg);
        Self {
            soc,
            host,
            dacs: [Ad5668::default(), Ad5668::default()],
            outputs: Outputs::new(wiring),
            stages: outputs,
            is_strapped: hardware.is_strapped,
            led: VecDeque::new(),
            pump_drives: 0,
            pins: None,
            load_ohm: [2_000; CHANNELS],
            joint: 0,
            broken: Levels::ISOLATED,
            loss: Loss::default(),
            margins: Margins::default(),
            hz,
            now: 0,
            lines: [0; LINE_WORDS],
        }
    }

    /// Makes the chip look for its next event again, after a change that no bus access made.
    pub(super) fn reschedule(&mut self) {
        self.soc.reschedule();
    }

    /// Plugs the USB cable in (`is_in`) or pulls it out at `at`, which must be the present cycle.
    pub fn plug(&mut self, is_in: bool, at: Cycle) {
        self.host.advance(at, &mut self.soc.otg);
        if is_in {
            self.host.plug(at, &mut self.soc.otg);
        } else {
            self.host.unplug(at, &mut self.soc.otg);
        }
        self.reschedule();
    }

    /// Sets the levels and analogue values of all sensors from `at` on.
    pub(super) fn set_sensors(&mut self, sensors: &Sensors, at: Cycle) -> Modelled {
        self.load_ohm = sensors.load_ohm;
        // A sensor that is not connected is pulled down by the front end.
        self.joint = sensors.joint.unwrap_or(0);
        let board = *self.board();
        self.drive(board.hand_stop, sensors.hand_stop, at)?;
        if let Some(strap) = board.strap {
            // A breadboard has neither key nor latch: their pins are open, and pulled down.
            return self.drive(strap, self.is_strapped, at);
        }
        self.drive(board.arm, sensors.arm, at)?;
        self.drive(board.over_current, !sensors.over_current, at)
    }

    /// Returns the wiring of the board.
    pub const fn board(&self) -> &'static Wiring {
        self.outputs.board()
    }

    /// Returns whether the pump's pin is an input, and no write to its mode ever made it anything
    /// else.
    pub fn has_pump_stayed_input(&self) -> bool {
        let (port, pin) = wiring::PUMP;
        let gpio = &self.soc.playback.gpio;
        self.pump_drives == 0 && gpio.is_input(port.index(), pin.into())
    }

    /// Returns the latest changes of the board's diode, at most [`LED_CHANGES`]: cycle, and whether
    /// it is lit from then on.
    pub const fn led(&self) -> &VecDeque<(Cycle, bool)> {
        &self.led
    }

    /// Sets the level of the trigger input from cycle `at` on.
    pub(super) fn trigger(&mut self, high: bool, at: Cycle) -> Modelled {
        self.drive(self.board().trigger, high, at)
    }

    /// Returns the name of the first part whose state differs from that in `other` at `at`; `None`
    /// if all parts are equal.
    pub(super) fn first_difference(&self, other: &Self, at: Cycle) -> Option<&'static str> {
        let world = (self.load_ohm, self.joint, self.broken, self.hz, self.lines);
        let parts = [
            (
                "DACs",
                (&self.dacs, &self.loss) == (&other.dacs, &other.loss),
            ),
            ("outputs", self.outputs.is_equivalent_to(&other.outputs)),
            (
                "world",
                world
                    == (
                        other.load_ohm,
                        other.joint,
                        other.broken,
                        other.hz,
                        other.lines,
                    ),
            ),
            ("USB host", self.host.is_equivalent_to(&other.host)),
        ];
        let unlike = parts.into_iter().find(|part| !part.1).map(|part| part.0);
        unlike.or_else(|| self.soc.first_difference(&other.soc, at))
    }

    fn drive(&mut self, (port, pin): Pin, high: bool, at: Cycle) -> Modelled {
        if self.soc.playback.gpio.level(port.index(), pin.into()) == high {
            return Ok(());
        }
        let level = if high { Level::High } else { Level::Low };
        self.soc.drive(port.index(), pin.into(), level, at)
    }

    /// Resets the chip for the cause that the chip requested; without a request, as by its reset
    /// pin.
    pub(super) fn reset(&mut self, at: Cycle) -> Modelled {
        let cause = self.soc.reset.unwrap_or(Cause::Pin);
        self.soc.reset(cause, at)?;
        self.follow_clock(at);
        self.collect()
    }

    /// Returns the cycle at which the image's microsecond counter was 0, or would have been. TIM1
    /// counts the cycles of a microsecond, TIM2 the microseconds. Returns `None` if neither has
    /// counted.
    pub(super) fn find_origin(&self, at: Cycle) -> Option<Cycle> {
        let mut copy = self.soc.clone();
        let mut count = |timer, at| {
            let block = playback::Block::Timer(timer);
            let read = copy.playback.read(block, 0x24, at, &mut copy.ram);
            read.ok()
                .map(|read| (read.value, at + Cycle::from(read.wait) + 1))
        };
        // TIM2 follows TIM1's overflow by some cycles, so read it in mid-microsecond.
        let (ticks, done) = count(1, at)?;
        let begin = done - Cycle::from(ticks);
        let (us, _) = count(2, begin + super::CYCLES_PER_US / 2 + super::CYCLES_PER_US)?;
        (ticks > 0 || us > 0)
            .then(|| begin + super::CYCLES_PER_US - Cycle::from(us) * super::CYCLES_PER_US)
    }

    /// Writes every change of a pin into `log` from now on; its times count from the next boot.
    pub fn log_pins(&mut self, log: SharedPinLog) {
        self.pins = Some(log);
    }

    pub(super) fn begin(&mut self, origin: Cycle) {
        if let Some(mut log) = self.pins.as_ref().and_then(|log| log.lock().ok()) {
            *log = PinLog {
                origin,
                edges: Vec::new(),
            };
        }
        self.outputs.begin(origin);
        self.restart_counts();
    }

    /// Returns the cycle of device time 0.
    pub const fn origin(&self) -> Cycle {
        self.outputs.origin()
    }

    /// Returns the time at `cycle` in µs since device time 0, taking all changes of the core's
    /// clock into account.
    #[must_use]
    pub fn us_of(&self, cycle: Cycle) -> u64 {
        self.outputs.clock().us(cycle)
    }

    /// Returns the first cycle at or after `us` microseconds since device time 0, if the core's
    /// clock does not change until then.
    #[must_use]
    pub fn cycle_of(&self, us: u64) -> Cycle {
        self.outputs.clock().cycle(us)
    }

    /// Restarts the statistics of refill margins and of the phases of pin edges.
    pub fn restart_counts(&mut self) {
        self.margins = Margins::default();
        self.outputs.restart_counts();
    }

    /// Returns statistics of the cycle within its microsecond at which each pin edge came.
    pub const fn phases(&self) -> &Phases {
        self.outputs.phases()
    }

    /// Returns the edges of the pump pin since device time 0. Without edges, the supply of the
    /// output stages goes off.
    pub const fn pump(&self) -> &Pump {
        self.outputs.pump()
    }

    /// Passes all output before `to_us`, µs since device time 0, to `sink`.
    pub(super) fn emit(&mut self, to_us: u64, sink: &mut dyn Sink) {
        while let Some((cycle, packet)) = self.host.received() {
            self.outputs.bytes(cycle, packet.bytes());
        }
        self.outputs.emit(to_us, sink);
    }

    /// Collects pin edges, DAC words and USB packets up to now, in their order.
    fn collect(&mut self) -> Modelled {
        for word in self.soc.spi3.words() {
            if self.loss.is_lost(word.value, &self.dacs) {
                continue;
            }
            let Some(value) = received_bits(&word, &self.soc.playback.gpio) else {
                continue;
            };
            for dac in &mut self.dacs {
                dac.shift(value, word.bits, word.end)?;
            }
        }
        for (chip, dac) in self.dacs.iter_mut().enumerate() {
            for change in dac.changes() {
                self.outputs.dac(chip, change);
            }
        }
        let edges = &mut self.soc.playback.gpio.edges;
        for edge in edges.drain(..) {
            self.outputs.edge(edge);
            if let Some(mut log) = self.pins.as_ref().and_then(|log| log.lock().ok()) {
                log.edges.push(edge);
            }
            if let Some((port, pin)) = self.outputs.board().led
                && usize::from(edge.port) == port.index()
                && edge.changed >> pin & 1 == 1
            {
                self.led
                    .push_back((edge.cycle, edge.levels >> pin & 1 == 1));
                if self.led.len() > LED_CHANGES {
                    self.led.pop_front();
                }
            }
            for (dac, (port, pin)) in self.dacs.iter_mut().zip(wiring::DAC_SYNC) {
                if usize::from(edge.port) == port.index() && edge.changed >> pin & 1 == 1 {
                    dac.select(edge.levels >> pin & 1 == 0);
                    self.loss.begin();
                }
            }
        }
        Ok(())
    }

    /// Returns the ADC code that a conversion of `channel` gives at present.
    fn convert(&self, channel: u8) -> u16 {
        let board = self.board();
        match channel {
            joint if joint == board.joint => self.joint,
            current if Some(current) == board.current => sense(self.current_ma()),
            _ => 0,
        }
    }

    /// Returns the current through the sense resistor, mA. All stages share this resistor, so their
    /// currents add up.
    fn current_ma(&self) -> f64 {
        let levels = Levels(self.outputs.levels().0 & !self.broken.0);
        let driven = (0..CHANNELS).filter(|&n| levels.state(n as u8).is_driven());
        driven
            .filter_map(|n| {
                let (dac, output) = wiring::AMPLITUDES[n];
                let code = self.dacs[dac].output(output);
                Some(current_ma(
                    self.stages[n]?.full_scale,
                    code,
                    self.load_ohm[n],
                ))
            })
            .sum()
    }

    pub(super) fn debug_halt(&mut self, halted: bool, at: Cycle) -> Modelled {
        self.advance(at)?;
        self.soc.debug_halt(halted, at)
    }

    pub(super) fn set_pll_hz(&mut self, hz: u32, at: Cycle) -> Modelled {
        self.advance(at)?;
        self.soc.set_pll_hz(hz, at)?;
        self.follow_clock(at);
        Ok(())
    }

    pub(super) fn stop_crystal(&mut self, at: Cycle) -> Modelled {
        self.advance(at)?;
        self.soc.rcc.stop_hse(at)?;
        self.soc.reschedule();
        self.advance(at)?;
        self.follow_clock(at);
        Ok(())
    }

    /// Inverts register bits like [`Soc::upset`]. If that changes a clock, time follows the new
    /// clock at once, not only after the next step, which may be the end of a sleep.
    ///
    /// # Errors
    /// Fails like [`Soc::upset`].
    pub fn upset(&mut self, address: u32, bits: u32, at: Cycle) -> Result<(), AccessError> {
        self.advance(at)?;
        self.soc.upset(address, bits, at)?;
        self.follow_clock(at);
        Ok(())
    }

    fn follow_clock(&mut self, at: Cycle) {
        if self.hz != self.soc.hz() {
            self.hz = self.soc.hz();
            self.host.set_hz(self.hz.into(), at);
            self.outputs.set_hz(self.hz, at);
        }
    }

    /// Advances the USB host to `at` before an access to OTG_FS at `address`, so that the host's
    /// polls see the registers as they were before.
    #[inline]
    fn poll_cable(&mut self, address: u32, at: Cycle) {
        if address >> 16 == 0x5000 {
            self.host.advance(at, &mut self.soc.otg);
        }
    }

    /// Advances to cycle `to`, at which at most the next event that must be observed happens.
    /// [`Bus::advance`] consists of such steps.
    fn advance_step(&mut self, to: Cycle) -> Modelled {
        self.soc.advance(to)?;
        self.follow_clock(to);
        self.host.advance(to, &mut self.soc.otg);
        self.collect()?;
        if let Some(sample) = self.soc.adc.next_sample()
            && sample.at <= to
        {
            let code = self.convert(sample.channel);
            self.soc.adc.deliver_sample(code);
            self.soc.reschedule();
        }
        self.now = to;
        self.lines = self.soc.interrupt_lines();
        Ok(())
    }
}
