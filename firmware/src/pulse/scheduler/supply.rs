//! What a scheduler has from `safety`: permission and amplitudes.

use crate::units::{DacCode, Micros};
use core::num::{NonZeroU16, NonZeroU32};

/// What the scheduler asks before it pulses. `safety` answers; a refusal means
/// silence, never a smaller pulse.
pub trait Supply {
    /// Amplitude and width of the whole burst on `channel` that starts at `time`.
    fn burst(&mut self, channel: u8, time: BurstTime) -> Burst;
    /// From that burst to the next, µs, played or left out; none is the period. Asked of
    /// trains that take lists, right after the burst.
    fn next_us(&self, _channel: u8) -> Option<NonZeroU32> {
        None
    }
    /// Whether a pulse may still start that has its last edge at `end`.
    fn may_pulse(&mut self, channel: u8, end: Micros) -> bool;
}

/// When a burst starts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BurstTime {
    /// Its first edge.
    pub at: Micros,
    /// The train's period in force, µs.
    pub period_us: u32,
    /// The train begins with it: at its start, and whenever the trigger input lets it.
    pub opens: bool,
}

/// A burst as its supply wants it: amplitude and width together, for all its pulses. Two
/// words, which are returned in registers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Burst {
    /// Of each pulse; none leaves the burst out.
    pub code: Option<DacCode>,
    /// Width of each phase, µs, at most the train's largest; none is the train's own.
    pub width_us: Option<NonZeroU16>,
}

impl Burst {
    /// No pulse.
    pub const SILENT: Self = Self {
        code: None,
        width_us: None,
    };

    /// Of this amplitude and the train's own width.
    #[must_use]
    pub const fn of(code: DacCode) -> Self {
        Self {
            code: Some(code),
            ..Self::SILENT
        }
    }
}
