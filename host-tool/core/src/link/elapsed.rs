//! Time since a port was opened, on a clock that also runs while the computer sleeps: what
//! the device did meanwhile took its time, and whoever sent nothing was silent for it.

use std::time::{Duration, Instant};

/// A beginning, and the time since.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elapsed {
    awake: Instant,
    /// Since the computer started; `None` where the system does not say, or where `Instant`
    /// goes on in sleep by itself.
    all: Option<Duration>,
}

impl Elapsed {
    /// From now on.
    pub(super) fn begin() -> Self {
        Self {
            awake: Instant::now(),
            all: since_boot(),
        }
    }

    /// The time since the beginning, µs.
    pub(super) fn us(&self) -> u64 {
        let elapsed = match (self.all, since_boot()) {
            (Some(begin), Some(now)) => now.saturating_sub(begin),
            _ => self.awake.elapsed(),
        };
        u64::try_from(elapsed.as_micros()).unwrap_or(u64::MAX)
    }
}

/// Linux has a clock for it, Apple's monotonic clock is one.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn since_boot() -> Option<Duration> {
    use nix::time::{ClockId, clock_gettime};
    #[cfg(target_vendor = "apple")]
    let clock = ClockId::CLOCK_MONOTONIC;
    #[cfg(not(target_vendor = "apple"))]
    let clock = ClockId::CLOCK_BOOTTIME;
    clock_gettime(clock).ok().map(Duration::from)
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
const fn since_boot() -> Option<Duration> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_on_as_any_clock_while_nobody_sleeps() {
        let (begin, instant) = (Elapsed::begin(), Instant::now());
        std::thread::sleep(Duration::from_millis(20));
        let us = begin.us();
        assert!(us >= 20_000, "{us}");
        assert!(us <= instant.elapsed().as_micros() as u64 + 10_000, "{us}");
        assert!(begin.us() >= us);
    }
}
