//! Models everything around the core, as the core's bus: the chip, and the parts wired to it.

use super::dac_line::received_bits;
use super::front_end::{current_ma, sense};
use super::loss::Loss;
use super::margin::Margins;
use super::outputs::{Outputs, Phases};
use super::stages;
use super::wiring::{self, Pin};
use crate::chip::Cycle;
use crate::chip::ad5668::Ad5668;
use crate::chip::cpu::bus::{AccessError, Bus, LINE_WORDS, Modelled, ReadResult, Size, Unmodelled};
use crate::chip::cpu::{Cpu, Stop};
use crate::chip::soc::gpio::Level;
use crate::chip::soc::rcc::Cause;
use crate::chip::soc::{Pace, Soc, playback};
use crate::chip::usb::Host;
use crate::lockstep::Output;
use crate::trace::judge::Pump;
use crate::trace::{CHANNELS, Levels};
use firmware::lockstep::{Sensors, Sink};

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
    pub(super) fn new(flash: &[u8], outputs: [Option<Output>; CHANNELS], pace: Pace) -> Self {
        let mut soc = Soc::new(pace);
        // `Image` has checked that the flash contents fit.
        let _ = soc.flash.load(super::super::soc::flash::BASE, flash);
        let words = stages::table(&outputs).to_words(soc.signature.uid);
        for copy in stages::COPIES {
            let _ = stages::write(&mut soc.flash, copy, &words); // both lie in flash
        }
        soc.flash.set_options(stages::OPTIONS);
        let hz = soc.hz();
        let mut host = Host::new(hz.into());
        host.plug(0, &mut soc.otg);
        Self {
            soc,
            host,
            dacs: [Ad5668::default(), Ad5668::default()],
            outputs: Outputs::default(),
            stages: outputs,
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
        self.drive(wiring::ARM, sensors.arm, at)?;
        self.drive(wiring::HAND_STOP, sensors.hand_stop, at)?;
        self.drive(wiring::OVER_CURRENT, !sensors.over_current, at)
    }

    /// Sets the level of the trigger input from cycle `at` on.
    pub(super) fn trigger(&mut self, high: bool, at: Cycle) -> Modelled {
        self.drive(wiring::TRIGGER, high, at)
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

    pub(super) fn begin(&mut self, origin: Cycle) {
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
        match channel {
            wiring::JOINT => self.joint,
            wiring::CURRENT => sense(self.current_ma()),
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

impl Bus for Surroundings {
    #[inline]
    fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<ReadResult, AccessError> {
        self.poll_cable(address, at);
        self.soc.read(address, size, at)
    }

    #[inline]
    fn write(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, AccessError> {
        self.poll_cable(address, at);
        self.margins
            .record_write(address, at.saturating_sub(self.outputs.origin()));
        self.soc.write(address, size, value, at)
    }

    #[inline(always)]
    fn read_without_wait(&self, address: u32, size: Size) -> Option<u32> {
        self.soc.read_without_wait(address, size)
    }

    #[inline(always)]
    fn write_without_wait(&mut self, address: u32, size: Size, value: u32) -> bool {
        // Only for SRAM1, where nothing is observed.
        self.soc.write_without_wait(address, size, value)
    }

    fn read_code(&mut self, address: u32) -> Result<u16, AccessError> {
        self.soc.read_code(address)
    }

    #[inline]
    fn fetch(&mut self, line: u32, at: Cycle) -> u32 {
        self.soc.fetch(line, at)
    }

    fn is_writable_code(&self, address: u32) -> bool {
        self.soc.is_writable_code(address)
    }

    fn code_version(&self) -> u32 {
        self.soc.code_version()
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        loop {
            let next = self.next_event().max(self.now);
            if next >= to {
                break;
            }
            self.advance_step(next)?;
        }
        self.advance_step(to)
    }

    fn next_event(&self) -> Cycle {
        self.soc
            .next_event()
            .min(self.host.next_event(&self.soc.otg))
    }

    #[inline]
    fn interrupt_lines(&self) -> [u32; LINE_WORDS] {
        self.lines
    }

    fn nmi(&self) -> bool {
        self.soc.rcc.cssf
    }

    fn request_reset(&mut self, at: Cycle) {
        self.soc.request_reset(at);
    }

    fn clocks_sleeping_core(&self) -> bool {
        self.soc.clocks_sleeping_core()
    }

    fn is_reset_requested(&self) -> bool {
        self.soc.is_reset_requested()
    }
}
