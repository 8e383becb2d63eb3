//! The time of the computer that runs the program, passed to the modules that need it.
//!
//! This module holds [`Clock`], which measures durations, and [`Moment`], a date and time of day.
//! No module reads a clock by itself, so that sessions on a simulator also run where the standard
//! library has no clock, as in a browser. With the feature `realtime`, the clocks of the operating
//! system are here too. Device time is in `link`.

mod moment;
#[cfg(feature = "realtime")]
mod system;

pub use moment::Moment;
#[cfg(feature = "realtime")]
pub use system::{ProcessorClock, SystemClock};

use std::time::Duration;

/// Clock that measures durations.
pub trait Clock: Send + Sync {
    /// Returns the time since a fixed moment, which is the same as long as this clock exists. The
    /// result never decreases.
    fn now(&self) -> Duration;
}
