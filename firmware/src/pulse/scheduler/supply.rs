//! The interface through which the scheduler gets permission and amplitudes from `safety`.

use crate::units::{DacCode, Micros};
use core::num::{NonZeroU16, NonZeroU32};

/// Permission and amplitudes for the scheduler, implemented by `safety`. A refused pulse is left
/// out, never made smaller.
pub trait Supply {
    /// Returns amplitude and width of the whole burst on `channel` that starts at `time`.
    fn burst(&mut self, channel: u8, time: BurstTime) -> Burst;
    /// Returns the time from the burst that [`Self::burst`] supplied last to the next, µs, whether
    /// it is played or left out; `None` means the train's period. Called for trains that take
    /// lists, directly after [`Self::burst`].
    fn burst_interval_us(&self, _channel: u8) -> Option<NonZeroU32> {
        None
    }
    /// Returns whether a pulse whose last edge is at `end` may still start.
    fn may_pulse(&mut self, channel: u8, end: Micros) -> bool;
}

/// The time at which a burst starts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BurstTime {
    /// Time of the burst's first edge.
    pub at: Micros,
    /// Present period of the train, µs.
    pub period_us: u32,
    /// Whether the train begins with this burst: at its start, and whenever the trigger input
    /// starts it.
    pub opens: bool,
}

/// Amplitude and width of all pulses of a burst, as the supply wants them. The size is two words,
/// so that it is returned in registers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Burst {
    /// DAC code of each pulse; `None` leaves the burst out.
    pub code: Option<DacCode>,
    /// Width of each phase, µs, at most the train's largest; `None` means the train's own.
    pub width_us: Option<NonZeroU16>,
}

impl Burst {
    /// A burst that is left out.
    pub const SILENT: Self = Self {
        code: None,
        width_us: None,
    };

    /// Returns a burst of this DAC code and the train's own width.
    #[must_use]
    pub const fn with_own_width(code: DacCode) -> Self {
        Self {
            code: Some(code),
            ..Self::SILENT
        }
    }
}
