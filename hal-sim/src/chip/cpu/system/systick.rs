//! Models the system timer (Arm ARM B3.3), which counts down at HCLK or HCLK/8 (RM0090 figure 21).
//! Its value is computed only when it is needed.

use crate::chip::Cycle;

const ENABLE: u32 = 1;
const TICKINT: u32 = 1 << 1;
const CLKSOURCE: u32 = 1 << 2;
const COUNTFLAG: u32 = 1 << 16;
const COUNTER_BITS: u32 = 0x00FF_FFFF;

/// SYST_CALIB of the STM32F405: 18750, 1 ms at 150 MHz/8 (RM0090 section 12.1.2).
const CALIBRATION: u32 = 0x0000_493E;

/// State of SysTick, the system timer of the core.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SysTick {
    control: u32,
    reload: u32,
    counter: u32,
    /// Cycle up to which `counter` has been computed.
    brought_to: Cycle,
    /// Whether the timer is stopped because the core is halted.
    pub held: bool,
}

impl SysTick {
    const fn period(&self) -> u64 {
        if self.control & CLKSOURCE != 0 { 1 } else { 8 }
    }

    /// Returns the number of clock edges from cycle `from`, exclusive, to `to`, inclusive. The
    /// divided clock has its edges at multiples of 8.
    const fn edges(&self, from: Cycle, to: Cycle) -> u64 {
        to / self.period() - from / self.period()
    }

    /// Advances the counter to `at`; returns the cycle at which it last reached zero on the way, if
    /// its exception is enabled.
    pub fn advance(&mut self, at: Cycle) -> Option<Cycle> {
        let from = self.brought_to;
        if at <= from {
            return None;
        }
        self.brought_to = at;
        if self.control & ENABLE == 0 || self.held {
            return None;
        }
        let edges = self.edges(from, at);
        let first = self.edges_to_zero()?;
        if edges < first {
            self.counter = self.counter_after(edges);
            return None;
        }
        self.control |= COUNTFLAG;
        let since = (edges - first) % (u64::from(self.reload) + 1);
        let last = if self.reload == 0 {
            first
        } else {
            edges - since
        };
        self.counter = if since == 0 || self.reload == 0 {
            0
        } else {
            self.reload - (since - 1) as u32
        };
        let reached = (from / self.period() + last) * self.period();
        (self.control & TICKINT != 0).then_some(reached)
    }

    /// Returns the value of the counter after `edges` clock edges that do not take it to zero. An
    /// edge at zero loads the reload value.
    const fn counter_after(&self, edges: u64) -> u32 {
        match (edges, self.counter) {
            (0, counter) => counter,
            (_, 0) => self.reload.wrapping_sub((edges - 1) as u32),
            (_, counter) => counter.wrapping_sub(edges as u32),
        }
    }

    /// Returns the number of clock edges until the counter reaches zero by counting down; `None` if
    /// it never does.
    fn edges_to_zero(&self) -> Option<u64> {
        match (self.counter, self.reload) {
            (0, 0) => None,
            (0, reload) => Some(u64::from(reload) + 1),
            (counter, _) => Some(u64::from(counter)),
        }
    }

    /// Returns the cycle at which the timer next makes its exception pending; MAX if it never does.
    pub fn next_event(&self) -> Cycle {
        if self.control & (ENABLE | TICKINT) != ENABLE | TICKINT || self.held {
            return Cycle::MAX;
        }
        let period = self.period();
        self.edges_to_zero().map_or(Cycle::MAX, |edges| {
            (self.brought_to / period + edges) * period
        })
    }

    /// Reads the register at `offset` from 0xE000_E010; call [`Self::advance`] first.
    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            0x0 => {
                let value = self.control;
                self.control &= !COUNTFLAG;
                value
            }
            0x4 => self.reload,
            0x8 => self.counter,
            _ => CALIBRATION,
        }
    }

    /// Writes the register at `offset` from 0xE000_E010. Any write to the counter clears the
    /// counter and COUNTFLAG.
    pub fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0x0 => {
                let flag = self.control & COUNTFLAG;
                self.control = value & (ENABLE | TICKINT | CLKSOURCE) | flag;
            }
            0x4 => self.reload = value & COUNTER_BITS,
            0x8 => {
                self.counter = 0;
                self.control &= !COUNTFLAG;
            }
            _ => {}
        }
    }
}
