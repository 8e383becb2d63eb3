//! The grid of frames, and where in a frame a transaction may begin.

use super::line;
use crate::chip::Cycle;

/// A NAKed transaction is tried again this long after the last try, counted
/// from the first slot of its frame. Host controllers differ: OHCI goes round
/// its list back to back, xHCI paces itself; none waits for the next frame.
const RETRY_US: u64 = 25;

/// Frames of 1 ms from `origin` on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Frames {
    /// Start of frame `first`.
    origin: Cycle,
    first: u64,
    hz: u64,
    /// Cycles of a frame.
    period: Cycle,
}

impl Frames {
    /// Frame 0 begins at `origin`.
    pub fn new(origin: Cycle, hz: u64) -> Self {
        Self {
            origin,
            first: 0,
            hz,
            period: period(hz),
        }
    }

    /// The clock that counts cycles is `hz` from `at` on.
    pub fn set_hz(&mut self, hz: u64, at: Cycle) {
        let next = self.index(at) + 1;
        let left = self.start(next).saturating_sub(at);
        self.origin = at + left * hz / self.hz.max(1);
        self.first = next;
        self.hz = hz;
        self.period = period(hz);
    }

    /// Frame that `at` lies in.
    pub fn index(&self, at: Cycle) -> u64 {
        self.first + at.saturating_sub(self.origin) / self.period
    }

    /// Start of a frame.
    pub fn start(&self, index: u64) -> Cycle {
        self.origin + index.saturating_sub(self.first) * self.period
    }

    /// When the device has received the start of frame `index`.
    pub fn received(&self, index: u64) -> Cycle {
        self.start(index) + line::cycles(line::SOF, self.hz)
    }

    /// When 80 % of frame `index` are over, the part that the device gives to
    /// periodic transfers (RM0090, DCFG.PFIVL = 0).
    pub fn periodic_end(&self, index: u64) -> Cycle {
        self.start(index) + self.period * 4 / 5
    }

    /// First moment of frame `index` for a transaction.
    pub fn first_slot(&self, index: u64) -> Cycle {
        self.start(index) + line::cycles(line::SOF + line::BETWEEN, self.hz)
    }

    /// First moment from `from` on when a transaction of at most `budget`
    /// cycles may begin.
    pub fn fit(&self, from: Cycle, budget: Cycle) -> Cycle {
        let index = self.index(from);
        let start = from.max(self.first_slot(index));
        if start + budget <= self.start(index + 1) {
            start
        } else {
            self.first_slot(index + 1)
        }
    }

    /// First moment from `from` on when a NAKed transaction is tried again.
    pub fn retry(&self, from: Cycle, budget: Cycle) -> Cycle {
        let slot = self.first_slot(self.index(from));
        let step = RETRY_US * self.hz / 1_000_000;
        let tries = from.saturating_sub(slot).div_ceil(step.max(1));
        self.fit(slot + tries * step, budget)
    }
}

fn period(hz: u64) -> Cycle {
    (hz / 1_000).max(1)
}
