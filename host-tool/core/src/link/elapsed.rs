//! Measures the time since a port was opened, on a clock that also runs while the computer sleeps:
//! the device kept running meanwhile, and a host that sent nothing was silent for that time.

use std::time::{Duration, Instant};

/// Clock that counts from its creation, also while the computer sleeps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elapsed {
    awake: Instant,
    /// Time since the computer started, at the creation of this value. `None` where the system does
    /// not report it, or where `Instant` itself continues during sleep.
    all: Option<Duration>,
}

impl Elapsed {
    /// Creates a clock that starts at 0 now.
    pub(super) fn begin() -> Self {
        Self {
            awake: Instant::now(),
            all: since_boot(),
        }
    }

    /// Returns the time since this clock was created, µs.
    pub(super) fn us(&self) -> u64 {
        let elapsed = match (self.all, since_boot()) {
            (Some(begin), Some(now)) => now.saturating_sub(begin),
            _ => self.awake.elapsed(),
        };
        u64::try_from(elapsed.as_micros()).unwrap_or(u64::MAX)
    }
}

/// Returns the time since the computer started, including sleep. Linux has a separate clock for it;
/// on Apple's systems, the monotonic clock includes sleep.
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
