//! Models everything around the core, as the core's bus: the chip, pins that nothing drives and
//! that are observed, and optionally a USB host.

use crate::chip::Cycle;
use crate::chip::cpu::bus::{AccessError, Bus, LINE_WORDS, Modelled, ReadResult, Size};
use crate::chip::soc::gpio::PORTS;
use crate::chip::soc::rcc::Cause;
use crate::chip::soc::{Pace, Soc, flash};
use crate::chip::time::Time;
use crate::chip::usb::Host;

/// ADC code of an analogue input that nothing drives.
const OPEN_INPUT: u16 = 0;

/// Simultaneous change of one or more pins of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PinEdge {
    /// Time of the change, ns after power-on.
    pub ns: u64,
    /// Number of the port; 0 is port A.
    pub port: usize,
    /// Pins that changed; bit n is pin n.
    pub changed: u16,
    /// Levels of all pins of the port after the change.
    pub levels: u16,
}

/// Everything on the chip except the core, and the connections of its pins.
#[derive(Clone, Debug)]
pub struct Wires {
    /// Peripherals and memories of the chip.
    pub soc: Soc,
    host: Option<Host>,
    time: Time,
    hz: u32,
    now: Cycle,
    /// Levels of the interrupt lines at `now`, by line number as in [`Bus::interrupt_lines`].
    lines: [u32; LINE_WORDS],
    edges: Vec<PinEdge>,
    toggles: [[u64; 16]; PORTS],
    serial: Vec<u8>,
}

impl Wires {
    pub(super) fn new(image: &[u8], is_host: bool) -> Self {
        let mut soc = Soc::new(Pace::Lazy);
        // `Image` has checked that the flash contents fit.
        let _ = soc.flash.load(flash::BASE, image);
        let hz = soc.hz();
        let host = is_host.then(|| {
            let mut host = Host::new(hz.into());
            host.plug(0, &mut soc.otg);
            host
        });
        Self {
            soc,
            host,
            time: Time::new(0, hz),
            hz,
            now: 0,
            lines: [0; LINE_WORDS],
            edges: Vec::new(),
            toggles: [[0; 16]; PORTS],
            serial: Vec::new(),
        }
    }

    /// Returns the conversion between cycles and time since power-on.
    pub const fn time(&self) -> &Time {
        &self.time
    }

    /// Takes the pin edges since the last call, in the order of time.
    pub fn edges(&mut self) -> impl Iterator<Item = PinEdge> + '_ {
        self.edges.drain(..)
    }

    /// Returns the present level of pin `pin` of `port` (0 is A); low beyond port I or pin 15.
    pub fn level(&self, port: usize, pin: usize) -> bool {
        self.soc.playback.gpio.level(port, pin)
    }

    /// Returns the number of changes of each pin since power-on, by port (0 is A) and pin.
    pub const fn toggles(&self) -> &[[u64; 16]; PORTS] {
        &self.toggles
    }

    /// Takes the bytes that USART2 sent since the last call.
    pub fn serial(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.serial)
    }

    /// Returns the USB host, if there is one.
    pub const fn host(&self) -> Option<&Host> {
        self.host.as_ref()
    }

    /// Takes the bytes that arrived over USB since the last call.
    pub fn received(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some((_, packet)) = self.host.as_mut().and_then(Host::received) {
            bytes.extend_from_slice(packet.bytes());
        }
        bytes
    }

    pub(super) fn send(&mut self, bytes: &[u8], at: Cycle) {
        if let Some(host) = &mut self.host {
            host.send(bytes, at);
            self.soc.reschedule();
        }
    }

    /// Resets the chip for the cause that it requested, and returns the cause.
    pub(super) fn reset(&mut self, at: Cycle) -> Modelled<Cause> {
        let cause = self.soc.reset.unwrap_or(Cause::Pin);
        self.soc.reset(cause, at)?;
        self.follow_clock(at);
        self.collect();
        Ok(cause)
    }

    fn follow_clock(&mut self, at: Cycle) {
        if self.hz != self.soc.hz() {
            self.hz = self.soc.hz();
            self.time.set_hz(self.hz, at);
            if let Some(host) = &mut self.host {
                host.set_hz(self.hz.into(), at);
            }
        }
    }

    /// Collects pin edges and bytes of USART2 that the chip has output up to now.
    fn collect(&mut self) {
        for edge in self.soc.playback.gpio.edges.drain(..) {
            let (ns, port) = (self.time.ns(edge.cycle), usize::from(edge.port));
            for (pin, count) in self.toggles[port].iter_mut().enumerate() {
                *count += u64::from(edge.changed >> pin & 1);
            }
            self.edges.push(PinEdge {
                ns,
                port,
                changed: edge.changed,
                levels: edge.levels,
            });
        }
        self.serial
            .extend(self.soc.usart2.sent().map(|(_, byte)| byte));
        self.soc.spi3.words().for_each(drop); // nothing receives them
    }

    /// Advances the USB host to `at` before an access to OTG_FS at `address`, so that the host's
    /// polls see the registers as they were before.
    #[inline]
    fn poll_cable(&mut self, address: u32, at: Cycle) {
        if address >> 16 == 0x5000
            && let Some(host) = &mut self.host
        {
            host.advance(at, &mut self.soc.otg);
        }
    }

    /// Advances to cycle `to`, at which at most the next event that must be observed happens.
    /// [`Bus::advance`] consists of such steps.
    fn advance_step(&mut self, to: Cycle) -> Modelled {
        self.soc.advance(to)?;
        self.follow_clock(to);
        if let Some(host) = &mut self.host {
            host.advance(to, &mut self.soc.otg);
        }
        self.collect();
        if self
            .soc
            .adc
            .next_sample()
            .is_some_and(|sample| sample.at <= to)
        {
            self.soc.adc.deliver_sample(OPEN_INPUT);
            self.soc.reschedule();
        }
        self.now = to;
        self.lines = self.soc.interrupt_lines();
        Ok(())
    }
}

impl Bus for Wires {
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
        self.soc.write(address, size, value, at)
    }

    #[inline(always)]
    fn read_without_wait(&self, address: u32, size: Size) -> Option<u32> {
        self.soc.read_without_wait(address, size)
    }

    #[inline(always)]
    fn write_without_wait(&mut self, address: u32, size: Size, value: u32) -> bool {
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
        let host = self.host.as_ref();
        let host = host.map_or(Cycle::MAX, |host| host.next_event(&self.soc.otg));
        self.soc.next_event().min(host)
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
