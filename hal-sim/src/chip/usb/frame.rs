//! Computes the times of frames, and where in a frame a transaction may begin.

use super::line;
use crate::chip::Cycle;

/// Interval of retries after NAK, µs, counted from the first slot of the frame. Host controllers
/// differ: OHCI repeats its list back to back, xHCI sets its own pace; none waits for the next
/// frame.
const RETRY_US: u64 = 25;

/// Division of time into USB frames of 1 ms, from `origin` on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Frames {
    /// Cycle at which frame `first` begins.
    origin: Cycle,
    first: u64,
    hz: u64,
    /// Length of a frame, cycles.
    period: Cycle,
}

impl Frames {
    /// Creates frames whose frame 0 begins at `origin`, for a clock of `hz`.
    pub fn new(origin: Cycle, hz: u64) -> Self {
        Self {
            origin,
            first: 0,
            hz,
            period: period(hz),
        }
    }

    /// Changes the frequency of the clock that counts cycles to `hz` from `at` on. The frames keep
    /// their length in real time.
    pub fn set_hz(&mut self, hz: u64, at: Cycle) {
        let next = self.index(at) + 1;
        let left = self.start(next).saturating_sub(at);
        self.origin = at + left * hz / self.hz.max(1);
        self.first = next;
        self.hz = hz;
        self.period = period(hz);
    }

    /// Returns the number of the frame that contains `at`.
    pub fn index(&self, at: Cycle) -> u64 {
        self.first + at.saturating_sub(self.origin) / self.period
    }

    /// Returns the first cycle of frame `index`.
    pub fn start(&self, index: u64) -> Cycle {
        self.origin + index.saturating_sub(self.first) * self.period
    }

    /// Returns the cycle at which the device has received the start of frame `index`.
    pub fn received(&self, index: u64) -> Cycle {
        self.start(index) + line::cycles(line::SOF, self.hz)
    }

    /// Returns the cycle at 80 % of frame `index`, the end of the part that the device gives to
    /// periodic transfers (RM0090, DCFG.PFIVL = 0).
    pub fn periodic_end(&self, index: u64) -> Cycle {
        self.start(index) + self.period * 4 / 5
    }

    /// Returns the earliest cycle at which a transaction can begin in frame `index`: after its
    /// start of frame.
    pub fn first_slot(&self, index: u64) -> Cycle {
        self.start(index) + line::cycles(line::SOF + line::BETWEEN, self.hz)
    }

    /// Returns the earliest cycle from `from` on at which a transaction of at most `budget` cycles
    /// may begin.
    pub fn fit(&self, from: Cycle, budget: Cycle) -> Cycle {
        let index = self.index(from);
        let start = from.max(self.first_slot(index));
        if start + budget <= self.start(index + 1) {
            start
        } else {
            self.first_slot(index + 1)
        }
    }

    /// Returns the earliest cycle from `from` on at which a transaction of at most `budget` cycles,
    /// to which the device answered NAK, is retried.
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
