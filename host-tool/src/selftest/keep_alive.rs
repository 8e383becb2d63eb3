//! Measures how late keep-alives from a separate thread are on this computer.

use host_core::clock::SystemClock;
use host_core::link::{Keeper, Lateness};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two passes of the host's loop, each of which checks the device, as in a
/// calibration.
const LOOK: Duration = Duration::from_millis(5);

/// Lateness of keep-alives and of the host's loop.
#[derive(Clone, Debug)]
pub struct KeepAlives {
    /// Lateness of the thread that sends keep-alives.
    pub keep_alives: Lateness,
    /// Lateness of a loop that wakes every 5 ms, as if it sent keep-alives itself.
    pub looks: Lateness,
}

/// Threads that compute endlessly during the measurement.
struct BusyThreads {
    is_over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl BusyThreads {
    fn start(count: u32) -> io::Result<Self> {
        let is_over = Arc::new(AtomicBool::new(false));
        let spin = || {
            let is_over = Arc::clone(&is_over);
            std::thread::Builder::new().spawn(move || {
                while !is_over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            })
        };
        let threads = (0..count).map(|_| spin()).collect::<io::Result<Vec<_>>>();
        Ok(Self {
            threads: threads?,
            is_over,
        })
    }
}

impl Drop for BusyThreads {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join(); // the thread cannot fail
        }
    }
}

/// Sends keep-alives without a device, every `period` for `length`, with `busy` computing threads
/// at the same time.
///
/// # Errors
/// Fails if the system gives no thread.
pub fn keep_alives(
    period: Duration,
    length: Duration,
    busy: u32,
    mut progress: impl FnMut(f64),
) -> io::Result<KeepAlives> {
    let busy = BusyThreads::start(busy)?;
    let keeper = Keeper::start(period, Box::new(SystemClock::start()), || Ok(()))?;
    let begin = Instant::now();
    let mut late_us = Vec::new();
    while begin.elapsed() < length {
        let due = Instant::now() + LOOK;
        std::thread::sleep(LOOK);
        late_us.push(u32::try_from(due.elapsed().as_micros()).unwrap_or(u32::MAX));
        keeper.mark_attended();
        progress(begin.elapsed().as_secs_f64() / length.as_secs_f64());
    }
    let keep_alives = keeper.lateness();
    drop((keeper, busy));
    Ok(KeepAlives {
        keep_alives,
        looks: Lateness::from_values(late_us),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_that_was_due_is_counted() {
        let period = Duration::from_millis(2);
        let found = keep_alives(period, Duration::from_millis(200), 2, |_| ()).unwrap();
        let count = found.keep_alives.count();
        assert!((1..=100).contains(&count), "{count}");
        let [median, worst] = [0.5, 1.0].map(|value| found.keep_alives.quantile_us(value));
        assert!(median <= worst && worst.is_some());
        assert!((1..=40).contains(&found.looks.count()));
    }
}
