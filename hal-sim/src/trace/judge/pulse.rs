//! Which phases at an electrode belong together.

use crate::trace::pulses::MAX_GAP_US;

/// Longest phase that may be commanded, µs (hardware.md, one-shot).
pub(super) const COMMANDED_US: u64 = 500;
/// Phases that differ by less than this part of the greater charge belong together.
const BALANCED: f64 = 0.05;
/// A phase that is alone after this long remains so, µs: the grounding of a
/// member of an isolated group may have to wait for others.
const ALONE_US: u64 = 5_000;

/// A stretch of current in one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phase {
    pub start_us: u64,
    pub sign: i64,
    /// Its own, C: without what the capacitor held before its pulse and gives back.
    pub charge: f64,
}

/// One or two phases that belong together, and what they left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulse {
    pub start_us: u64,
    pub end_us: u64,
    /// When its latest phase began, and in which direction.
    pub phase_us: u64,
    sign: i64,
    phases: u8,
    /// Of its phases, C: their sum and the greatest.
    pub net: f64,
    greatest: f64,
    /// A phase was longer than any that may be commanded.
    pub is_long: bool,
}

impl Pulse {
    /// Its first phase begins.
    pub const fn new(t_us: u64, sign: i64) -> Self {
        Self {
            start_us: t_us,
            end_us: t_us,
            phase_us: t_us,
            sign,
            phases: 1,
            net: 0.0,
            greatest: 0.0,
            is_long: false,
        }
    }

    /// Whether current of `sign` is its latest phase's, which high voltage, load or code had
    /// left for a while: the lines are since `lines_us` as they are.
    pub const fn is_interrupted(&self, sign: i64, lines_us: u64) -> bool {
        self.sign == sign && lines_us <= self.phase_us
    }

    /// It has no second phase yet.
    pub const fn is_lone(&self) -> bool {
        self.phases == 1
    }

    /// Whether a phase of `sign` could be its second.
    pub const fn lacks(&self, sign: i64) -> bool {
        self.is_lone() && self.sign != sign
    }

    /// Whether a second phase may begin as late as `t_us`, counted from its start: the first
    /// may have been cut. A fault that slows or stops a clock makes it later.
    pub const fn awaits(&self, t_us: u64) -> bool {
        t_us - self.start_us <= COMMANDED_US + MAX_GAP_US
    }

    /// Its second phase begins.
    pub const fn begin_second(&mut self, t_us: u64) {
        (self.phases, self.phase_us, self.sign) = (2, t_us, -self.sign);
    }

    /// Its latest phase, or a part of it, ends.
    pub fn end_phase(&mut self, t_us: u64, phase: Phase) {
        self.end_us = t_us;
        self.net += phase.charge;
        self.greatest = self.greatest.max(phase.charge.abs());
        self.is_long |= t_us - phase.start_us > COMMANDED_US;
    }

    /// It is whole, or never will be, when nothing has followed it for so long, µs.
    pub const fn max_wait_us(&self) -> u64 {
        match self.phases {
            1 => ALONE_US,
            _ => MAX_GAP_US + 1,
        }
    }

    /// Its phases do not give back what they take.
    pub const fn is_cut(&self) -> bool {
        self.net.abs() > BALANCED * self.greatest
    }
}
