//! Time of the computer that runs the program, given to the modules that need it.
//!
//! Lives here: [`Clock`], which measures durations, and [`Moment`], a date and time of day.
//! No module reads a clock by itself, so that sessions on a simulator also run where the
//! standard library has no clock, as in a browser. With the feature `realtime` the clocks of
//! the operating system are here too. Not here: device time (`link`).

mod moment;
#[cfg(feature = "realtime")]
mod system;

pub use moment::Moment;
#[cfg(feature = "realtime")]
pub use system::{ProcessorClock, SystemClock};

use std::time::Duration;

/// Measures durations.
pub trait Clock: Send + Sync {
    /// Time since a moment that stays the same as long as this clock exists; never less than
    /// it was before.
    fn now(&self) -> Duration;
}
