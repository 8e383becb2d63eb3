//! Models everything that plays the pulse tape: TIM1–5, DMA, GPIO and the bus matrix, with a common
//! time.
//!
//! In: the core's accesses, pins, time. Out: pin edges with their cycle, interrupt lines, TIM2's
//! trigger to the ADC. Evaluation is lazy: `advance` or an access executes all earlier events in
//! the order of cycles, so the results do not depend on how often these are called. `transfers`
//! moves the items, `access` handles the core's accesses. The documentation of `matrix` and `timer`
//! says what is approximate; TIM1's event requests DMA2 in the same cycle (the delay of the
//! handshake is unknown).

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

/// Events at which the core must advance [`Playback`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// Only events with a visible effect: interrupts, enabled triggers.
    #[default]
    Lazy,
    /// Every DMA request as well: slow, with identical results.
    PerRequest,
}

/// Index of DMA2's peripheral port.
const PERIPHERAL: usize = 0;
/// Index of DMA2's memory port.
const MEMORY: usize = 1;

/// Bus access of a stream for which the arbiter of DMA2 has granted a port.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Access {
    stream: usize,
    slave: Slave,
    /// Cycle from which the port requests the slave.
    want: Cycle,
}

/// One port of DMA2.
#[derive(Clone, PartialEq, Debug, Default)]
struct Port {
    access: Option<Access>,
    /// Cycle from which the port can be granted again.
    free: Cycle,
    /// Streams that wait for the port, bit n is stream n.
    waiting: u8,
}

/// TIM1–5, DMA1 and DMA2, GPIO ports and bus matrix, which together play the pulse tape.
#[derive(Clone, PartialEq, Debug)]
pub struct Playback {
    timers: [Timer; 5],
    /// Earliest of the timers' next events.
    timer_event: Cycle,
    dma: [Dma; 2],
    /// GPIO ports with the levels of their pins.
    pub(crate) gpio: Gpio,
    matrix: Matrix,
    pace: Pace,
    ports: [Port; 2],
    /// Times of TIM1's DMA requests.
    requests: Requests,
    /// Cycle at which a preload of TIM1 takes effect, which changes the period and the times of its
    /// requests.
    update: Cycle,
    /// TIM1 events whose requests have not been served yet, one bit each.
    requested: u8,
    /// Streams that will miss their next request, bit n is stream n.
    unseen: u8,
    /// Cycle before which DMA2 does nothing.
    quiet_until: Cycle,
    /// Streams that each event requests, bit n is stream n.
    listeners: [u8; EVENTS],
    /// Whether an enabled stream uses SRAM1 (index 0) and SRAM2 (index 1).
    shared: [bool; 2],
    /// Level at TIM2's channel 1.
    capture_input: bool,
    /// Number of DMA items moved to or from a peripheral since power-on.
    pub(crate) transfers: u64,
}

impl Default for Playback {
    fn default() -> Self {
        Self::new(Pace::Lazy)
    }
}

impl Playback {
    /// Creates all blocks in their reset state, with all clocks equal to HCLK.
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

    /// Returns whether both behave identically from `at` on: everything except statistics and
    /// predicted times must be equal.
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

    /// Applies [`Dma::upset`] to DMA2 at `at`.
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

    /// Executes a stream that has switched to memory-to-memory mode: it needs no request, and
    /// copies the rest of its items. Assumed to happen at once; it takes some microseconds.
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

    /// Executes all events up to `to`. `ram` is SRAM2 alone, or SRAM1 and SRAM2 in one block.
    pub fn advance(&mut self, to: Cycle, ram: &mut Ram) -> Modelled {
        // Bus accesses in cycle `to` itself wait: the core may also request one at `to`.
        self.run(to, to.saturating_add(1), ram)?;
        if self.timer_event <= to {
            for timer in &mut self.timers {
                timer.advance(to)?;
            }
            self.update_timer_event();
        }
        Ok(())
    }

    /// Recomputes the earliest event after a timer has changed.
    fn update_timer_event(&mut self) {
        let events = self.timers.iter().map(Timer::next_event);
        self.timer_event = events.min().unwrap_or(NEVER);
    }

    /// Returns the earliest cycle, after the last `advance`, at which `advance` must be called if
    /// no access comes first.
    pub fn next_event(&self) -> Cycle {
        match self.pace {
            Pace::Lazy => self.timer_event,
            Pace::PerRequest => self.timer_event.min(self.requests.next().0),
        }
    }

    /// Returns the interrupt lines of the timers and of DMA2, line n in bit n % 32 of word n / 32
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

    /// Returns the cycles at which TIM2's TRGO (OC3REF) rose, the injected trigger of the ADC. The
    /// caller drains the list.
    pub fn triggers_mut(&mut self) -> &mut Vec<Cycle> {
        &mut self.timers[1].rises
    }

    /// Connects `level` to a pin (port 0 is A) at `at`; returns the pin's level if it changed.
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

    /// Sets the HCLK cycles of an APB1 and an APB2 clock (RCC_CFGR PPRE): the timers run at twice
    /// that clock unless it equals HCLK (RM0090 7.2).
    pub fn set_clocks(&mut self, apb1: u32, apb2: u32, done: Cycle, ram: &mut Ram) -> Modelled {
        self.run(done, done, ram)?;
        self.matrix.set_apb(apb1, apb2);
        for (n, timer) in self.timers.iter_mut().enumerate() {
            let apb = if n == 0 { apb2 } else { apb1 };
            timer.set_divider((apb / 2).max(1), done)?;
        }
        self.link(done)
    }

    /// Sets the LSI that TIM5 can capture; `None` if it does not oscillate.
    pub fn set_lsi(&mut self, lsi: Option<Oscillator>) {
        self.timers[4].set_lsi(lsi);
    }

    /// Sets the frequency of the LSI at TIM5 to `hz` from cycle `at` on.
    pub fn set_lsi_hz(&mut self, hz: u32, at: Cycle) {
        self.timers[4].set_lsi_hz(hz, at);
    }

    /// Sets the core clock to `hz` from cycle `at` on.
    pub fn set_core_hz(&mut self, hz: u32, at: Cycle) {
        self.timers[4].set_core_hz(hz, at);
    }

    /// Resets one block (RCC_AHB1RSTR, RCC_APBxRSTR), complete from `done` on. A DMA2 access in
    /// progress is discarded.
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

    /// Resets all blocks, as a system reset does; the clocks and the external connections of pins
    /// stay.
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
