//! What plays the tape: TIM1–5, DMA, GPIO and the bus matrix, in one clockwork.
//!
//! In: the core's accesses, pins, time. Out: pin edges with their cycle,
//! interrupt lines, TIM2's trigger to the ADC. Lazy: nothing happens until
//! `advance` or an access, and then everything up to it in the order of cycles,
//! so how often one asks changes nothing. `transfers` moves the items, `access`
//! is the core's side. `docs` of `matrix` and `timer` say what is approximate;
//! TIM1's event asks DMA2 at its own cycle (the handshake's delay is unknown).

mod access;
mod fast_forward;
mod idle;
mod requests;
mod slips;
mod transfers;

pub use access::Block;
pub use slips::Slip;

use super::Ram;
use super::dma::{Dma, EVENTS, NEVER, STREAMS};
use super::gpio::{Gpio, Level};
use super::matrix::{Matrix, Slave};
use super::timer::Timer;
use crate::chip::Cycle;
use crate::chip::cpu::bus::{LINE_WORDS, Modelled};
use crate::chip::soc::clock::Oscillator;
use requests::Requests;

/// When the core must let time pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// When somebody can see a difference: interrupts, armed triggers.
    #[default]
    Lazy,
    /// At every DMA request too: slow, with identical results.
    PerRequest,
}

/// The ports of DMA2, as indices.
const PERIPHERAL: usize = 0;
const MEMORY: usize = 1;

/// A bus access that was granted its port.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Access {
    stream: usize,
    slave: Slave,
    want: Cycle,
}

/// One port of DMA2.
#[derive(Clone, PartialEq, Debug, Default)]
struct Port {
    access: Option<Access>,
    /// From when on it can be granted again.
    free: Cycle,
    /// Streams that want it, bit n is stream n.
    waiting: u8,
}

/// Timers, DMA, ports and matrix.
#[derive(Clone, PartialEq, Debug)]
pub struct Playback {
    timers: [Timer; 5],
    /// Earliest of their next events.
    timer_event: Cycle,
    dma: [Dma; 2],
    /// The ports, for levels.
    pub(crate) gpio: Gpio,
    matrix: Matrix,
    pace: Pace,
    ports: [Port; 2],
    /// When TIM1 asks.
    requests: Requests,
    /// When a preload of TIM1 comes into force, and all that follows from its lap changes.
    update: Cycle,
    /// Events that have asked and were not yet served, one bit each.
    requested: u8,
    /// Streams that will not see the next request made to them, bit n is stream n.
    unseen: u8,
    /// DMA2 does nothing before this.
    quiet_until: Cycle,
    /// Streams that listen to each event, bit n is stream n.
    listeners: [u8; EVENTS],
    /// Whether an enabled stream uses SRAM1, SRAM2.
    shared: [bool; 2],
    /// Level at TIM2's channel 1.
    capture_input: bool,
    /// DMA items moved to or from a peripheral since power-on.
    pub(crate) transfers: u64,
}

impl Default for Playback {
    fn default() -> Self {
        Self::new(Pace::Lazy)
    }
}

impl Playback {
    /// All as after reset, with all clocks equal to HCLK.
    pub fn new(pace: Pace) -> Self {
        Self {
            timers: std::array::from_fn(|n| Timer::new(n as u8 + 1)),
            timer_event: NEVER,
            dma: [Dma::new(1), Dma::new(2)],
            gpio: Gpio::default(),
            matrix: Matrix::default(),
            pace,
            ports: Default::default(),
            requests: Requests::NONE,
            update: NEVER,
            requested: 0,
            unseen: 0,
            quiet_until: 0,
            listeners: [0; EVENTS],
            shared: [false; 2],
            capture_input: false,
            transfers: 0,
        }
    }

    /// Whether both do the same from `at` on: all but what is counted and foreseen is equal.
    pub fn is_equivalent_to(&self, other: &Self, at: Cycle) -> bool {
        let bare = |item: &Self| {
            let mut item = item.clone();
            (item.quiet_until, item.timer_event, item.transfers) = (0, 0, 0);
            item.matrix.forget(at);
            for port in &mut item.ports {
                port.free = port.free.max(at);
            }
            item
        };
        bare(self) == bare(other)
    }

    /// [`Dma::upset`] of DMA2 at `at`.
    pub fn upset_stream(
        &mut self,
        offset: u32,
        bits: u32,
        at: Cycle,
        ram: &mut Ram,
    ) -> Modelled<bool> {
        self.advance(at, ram)?;
        let is_upset = self.dma[1].upset(offset, bits, at)?;
        if is_upset {
            self.copy_rest(at, ram)?;
            self.rewire_streams(at);
        }
        Ok(is_upset)
    }

    /// A stream that began to copy from memory to memory does so without a request, all that
    /// is left of its items. Taken as done at once: it takes some microseconds.
    fn copy_rest(&mut self, at: Cycle, ram: &mut Ram) -> Modelled {
        for index in 0..STREAMS {
            if !self.dma[1].stream(index).is_memory_to_memory() {
                continue;
            }
            for _ in 0..self.dma[1].stream(index).count_left() {
                self.move_item(index, at, ram)?;
                self.move_word(index, at, ram)?;
            }
            self.dma[1].switch_off(index);
        }
        Ok(())
    }

    /// Lets everything happen up to `to`. `ram` holds SRAM2, or SRAM1 and
    /// SRAM2 in one block.
    pub fn advance(&mut self, to: Cycle, ram: &mut Ram) -> Modelled {
        // Bus accesses of `to` itself wait: the core may ask at `to`, too.
        self.run(to, to.saturating_add(1), ram)?;
        if self.timer_event <= to {
            for timer in &mut self.timers {
                timer.advance(to)?;
            }
            self.update_timer_event();
        }
        Ok(())
    }

    /// A timer changed: when does one of them need to be looked at again?
    fn update_timer_event(&mut self) {
        let events = self.timers.iter().map(Timer::next_event);
        self.timer_event = events.min().unwrap_or(NEVER);
    }

    /// Earliest cycle at which `advance` must be called, later than the last
    /// `advance`, should no access come first.
    pub fn next_event(&self) -> Cycle {
        match self.pace {
            Pace::Lazy => self.timer_event,
            Pace::PerRequest => self.timer_event.min(self.requests.next().0),
        }
    }

    /// Interrupt lines of the timers and of DMA2, line n in bit n % 32 of word n / 32
    /// (RM0090 table 61).
    pub fn interrupt_lines(&self) -> [u32; LINE_WORDS] {
        let [tim1, tim2, tim3, tim4, tim5] = &self.timers;
        let line = |timer: &Timer, n: u32| u32::from(timer.interrupt()) << (n % 32);
        let [update, compare] = tim1.interrupt_parts().map(u32::from);
        let word_0 =
            update << 25 | compare << 27 | line(tim2, 28) | line(tim3, 29) | line(tim4, 30);
        let dma2 = u32::from(self.dma[1].interrupts());
        // Streams 0 to 4 are lines 56 to 60, 5 to 7 are 68 to 70.
        let word_1 = line(tim5, 50) | (dma2 & 0x1F) << 24;
        [word_0, word_1, dma2 >> 5 << 4]
    }

    /// Cycles at which TIM2's TRGO (OC3REF) rose since the last drain: the
    /// ADC's injected trigger.
    pub fn triggers_mut(&mut self) -> &mut Vec<Cycle> {
        &mut self.timers[1].rises
    }

    /// Connects `level` to a pin (port 0 is A) at `at`; gives the level that
    /// the pin now has if that changed.
    pub fn drive(
        &mut self,
        port: usize,
        pin: usize,
        level: Level,
        at: Cycle,
        ram: &mut Ram,
    ) -> Modelled<Option<bool>> {
        self.run(at, at, ram)?;
        let change = self.gpio.drive(port, pin, level);
        self.feed_capture(at)?;
        Ok(change)
    }

    /// Sets the HCLK cycles of an APB1 and an APB2 clock (RCC_CFGR PPRE): the
    /// timers run at twice that clock unless it equals HCLK (RM0090 7.2).
    pub fn set_clocks(&mut self, apb1: u32, apb2: u32, done: Cycle, ram: &mut Ram) -> Modelled {
        self.run(done, done, ram)?;
        self.matrix.set_apb(apb1, apb2);
        for (n, timer) in self.timers.iter_mut().enumerate() {
            let apb = if n == 0 { apb2 } else { apb1 };
            timer.set_divider((apb / 2).max(1), done)?;
        }
        self.link(done)
    }

    /// The LSI oscillates as `lsi`, or not: TIM5 can capture it.
    pub fn set_lsi(&mut self, lsi: Option<Oscillator>) {
        self.timers[4].set_lsi(lsi);
    }

    /// The LSI that TIM5 is told of has `hz` from cycle `at` on.
    pub fn set_lsi_hz(&mut self, hz: u32, at: Cycle) {
        self.timers[4].set_lsi_hz(hz, at);
    }

    /// From cycle `at` on the core runs at `hz`.
    pub fn set_core_hz(&mut self, hz: u32, at: Cycle) {
        self.timers[4].set_core_hz(hz, at);
    }

    /// Resets one block (RCC_AHB1RSTR, RCC_APBxRSTR), complete from `done` on.
    /// An access of DMA2 that is under way is dropped.
    pub fn reset(&mut self, block: Block, done: Cycle, ram: &mut Ram) -> Modelled {
        self.run(done, done, ram)?;
        match block {
            Block::Timer(number) => {
                let timer = &mut self.timers[Block::timer_index(number)];
                timer.advance(done.saturating_sub(1))?;
                timer.reset(done);
                self.link(done)?;
            }
            Block::Dma1 => self.dma[0] = Dma::new(1),
            Block::Dma2 => {
                self.dma[1] = Dma::new(2);
                self.ports = Default::default();
                self.rewire_streams(done);
            }
            Block::Gpio(port) => {
                self.gpio.reset_port(port, done);
                self.feed_capture(done)?;
            }
        }
        Ok(())
    }

    /// Resets everything (system reset); the clocks and what is connected to
    /// pins stay.
    pub fn reset_all(&mut self, done: Cycle, ram: &mut Ram) -> Modelled {
        for number in 1..=5 {
            self.reset(Block::Timer(number), done, ram)?;
        }
        self.reset(Block::Dma1, done, ram)?;
        self.reset(Block::Dma2, done, ram)?;
        (0..super::gpio::PORTS).try_for_each(|port| self.reset(Block::Gpio(port), done, ram))
    }
}

#[cfg(test)]
mod tests;
