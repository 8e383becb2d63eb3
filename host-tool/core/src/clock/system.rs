//! The operating system's clocks.

use super::Clock;
use std::time::{Duration, Instant};

/// Clock that never goes backwards; on Linux it stands still while the computer sleeps.
#[derive(Clone, Copy, Debug)]
pub struct SystemClock {
    begun: Instant,
}

impl SystemClock {
    /// Creates a clock that starts at 0 now.
    #[must_use]
    pub fn start() -> Self {
        let begun = Instant::now();
        Self { begun }
    }
}

impl Clock for SystemClock {
    fn now(&self) -> Duration {
        self.begun.elapsed()
    }
}

/// Clock that measures the processor time of all threads of this program, so that other programs do
/// not affect it. On systems that do not report processor time, it measures elapsed real time.
#[derive(Clone, Copy, Debug)]
pub struct ProcessorClock {
    wall: SystemClock,
    processor: Option<Duration>,
}

impl ProcessorClock {
    /// Creates a clock that starts at 0 now.
    #[must_use]
    pub fn start() -> Self {
        Self {
            wall: SystemClock::start(),
            processor: processor_time(),
        }
    }
}

impl Clock for ProcessorClock {
    fn now(&self) -> Duration {
        let spent = processor_time().zip(self.processor);
        spent.map_or_else(|| self.wall.now(), |(now, then)| now - then)
    }
}

#[cfg(unix)]
fn processor_time() -> Option<Duration> {
    use nix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).ok()?;
    Some(Duration::from(time))
}

#[cfg(not(unix))]
const fn processor_time() -> Option<Duration> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_clocks_go_on_and_never_back() {
        let clocks: [&dyn Clock; 2] = [&SystemClock::start(), &ProcessorClock::start()];
        for clock in clocks {
            let before = clock.now();
            while clock.now() == before {
                std::hint::spin_loop();
            }
            assert!(clock.now() > before);
        }
    }
}
