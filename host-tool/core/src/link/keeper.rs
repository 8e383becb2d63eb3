//! Sends keep-alives from a separate thread.
//!
//! The thread sends a keep-alive every period, even while display, disk or input delay the host's
//! own loop. A program that hangs must not seem alive: if the loop does not look at its device for
//! [`UNATTENDED`], no more keep-alives are sent, and the device ends stimulation by its host
//! timeout.

use crate::clock::Clock;
use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Longest time for which the thread sends keep-alives while the program does not read from its
/// device.
pub const UNATTENDED: Duration = Duration::from_millis(200);

/// Time after which the thread forgets a pause between two keep-alives.
const REMEMBERED: Duration = Duration::from_secs(3);

/// Longest time for which the drop of a [`Keeper`] waits for the end of its thread.
const FAREWELL: Duration = Duration::from_millis(200);

/// Distribution of how late keep-alives were: for each, the time from the moment at which it was
/// due until the thread ran.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Lateness {
    /// Lateness of each keep-alive in ascending order, µs.
    late_us: Vec<u32>,
}

impl Lateness {
    /// Creates the distribution from the lateness of each keep-alive in any order, µs.
    #[must_use]
    pub fn from_values(mut late_us: Vec<u32>) -> Self {
        late_us.sort_unstable();
        Self { late_us }
    }

    /// Returns how many keep-alives were due.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.late_us.len()
    }

    /// Returns the lateness that the given share of all keep-alives (0 to 1) does not exceed, µs; a
    /// share of 1 gives the largest. Returns `None` before the first keep-alive.
    #[must_use]
    pub fn quantile_us(&self, share: f64) -> Option<u32> {
        let last = self.late_us.len().checked_sub(1)?;
        let place = (self.late_us.len() as f64 * share).ceil() as usize; // 0 and more
        self.late_us.get(place.saturating_sub(1).min(last)).copied()
    }
}

/// Record of the keep-alives that the thread has sent.
#[derive(Debug, Default)]
struct Beats {
    late_us: Vec<u32>,
    /// Time of the latest keep-alive that was sent, by the keeper's clock.
    last: Option<Duration>,
    /// Pauses between consecutive keep-alives: the time at which each pause ended, and its length.
    pauses: VecDeque<(Duration, Duration)>,
}

impl Beats {
    fn record_sent(&mut self, now: Duration) {
        if let Some(last) = self.last {
            self.pauses.push_back((now, now.saturating_sub(last)));
        }
        self.last = Some(now);
        while (self.pauses.front()).is_some_and(|(end, _)| now.saturating_sub(*end) > REMEMBERED) {
            self.pauses.pop_front();
        }
    }
}

struct Shared {
    clock: Box<dyn Clock>,
    /// Time at which the program last read from its device, by the keeper's clock, µs.
    attended_us: AtomicU64,
    is_over: AtomicBool,
    beats: Mutex<Beats>,
}

impl Shared {
    fn beats(&self) -> MutexGuard<'_, Beats> {
        self.beats.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now_us(&self) -> u64 {
        micros(self.clock.now())
    }

    fn is_attended(&self) -> bool {
        let attended_us = self.attended_us.load(Ordering::Acquire);
        is_attended(self.now_us(), attended_us)
    }

    /// Sends keep-alives while the program attends to its device, until the keeper is dropped or a
    /// frame cannot be sent. An error of sending is not reported here, because the program gets it
    /// when it reads from the device.
    fn send_keep_alives(&self, period: Duration, mut send: impl FnMut() -> io::Result<()>) {
        let mut due = self.clock.now() + period;
        loop {
            while let Some(left) = due.checked_sub(self.clock.now()) {
                if self.is_over.load(Ordering::Acquire) {
                    return;
                }
                std::thread::park_timeout(left);
            }
            let late = self.clock.now().saturating_sub(due);
            if self.is_over.load(Ordering::Acquire) {
                return;
            }
            let is_attended = self.is_attended();
            if is_attended && send().is_err() {
                return;
            }
            let now = self.clock.now();
            let mut beats = self.beats();
            let late_us = u32::try_from(late.as_micros()).unwrap_or(u32::MAX);
            beats.late_us.push(late_us);
            if is_attended {
                beats.record_sent(now);
            }
            due = now + period;
        }
    }
}

fn micros(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}

/// Returns whether the program attends to its device at `now_us`, if it last read from it at
/// `attended_us`.
fn is_attended(now_us: u64, attended_us: u64) -> bool {
    u128::from(now_us.saturating_sub(attended_us)) <= UNATTENDED.as_micros()
}

/// Thread that sends keep-alives until this value is dropped.
pub struct Keeper {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Keeper {
    /// Starts a thread that calls `send` every `period`, as `clock` measures it.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(
        period: Duration,
        clock: Box<dyn Clock>,
        send: impl FnMut() -> io::Result<()> + Send + 'static,
    ) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            attended_us: AtomicU64::new(micros(clock.now())),
            clock,
            is_over: AtomicBool::new(false),
            beats: Mutex::new(Beats::default()),
        });
        let own = Arc::clone(&shared);
        let named = std::thread::Builder::new().name("keep-alive".to_owned());
        let thread = Some(named.spawn(move || own.send_keep_alives(period, send))?);
        Ok(Self { shared, thread })
    }

    /// Notes that the program reads from its device now.
    pub fn mark_attended(&self) {
        let now_us = self.shared.now_us();
        self.shared.attended_us.store(now_us, Ordering::Release);
    }

    /// Returns the longest pause between two keep-alives in the last 3 s. The time since the latest
    /// keep-alive counts as a pause too.
    #[must_use]
    pub fn longest_pause(&self) -> Duration {
        let now = self.shared.clock.now();
        let beats = self.shared.beats();
        let open = beats
            .last
            .map_or(Duration::ZERO, |last| now.saturating_sub(last));
        let recent = beats.pauses.iter();
        let recent = recent.filter(|(end, _)| now.saturating_sub(*end) <= REMEMBERED);
        recent.map(|(_, pause)| *pause).fold(open, Duration::max)
    }

    /// Returns the recent pause in keep-alives that explains why a device received nothing from its
    /// host for `host_timeout`; `None` if there is no such pause. A pause of half the timeout is
    /// enough, because the period of the keep-alives and the transmission add to it.
    #[must_use]
    pub fn explaining_pause(&self, host_timeout: Duration) -> Option<Duration> {
        let pause = self.longest_pause();
        (pause >= host_timeout / 2).then_some(pause)
    }

    /// Returns how late all keep-alives so far were.
    #[must_use]
    pub fn lateness(&self) -> Lateness {
        Lateness::from_values(self.shared.beats().late_us.clone())
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Release);
        let Some(thread) = self.thread.take() else {
            return;
        };
        thread.thread().unpark();
        // The thread holds a second end of the port, which must be free again; but the drop does
        // not wait for a thread that hangs in a write.
        let until = self.shared.clock.now() + FAREWELL;
        while !thread.is_finished() && self.shared.clock.now() < until {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;
    use std::time::Instant;

    const PERIOD: Duration = Duration::from_millis(2);

    struct Wall(Instant);

    impl Clock for Wall {
        fn now(&self) -> Duration {
            self.0.elapsed()
        }
    }

    fn started() -> (Keeper, mpsc::Receiver<()>) {
        let (sender, receiver) = mpsc::channel();
        let send = move || {
            sender
                .send(())
                .map_err(|_| io::ErrorKind::BrokenPipe.into())
        };
        let clock = Box::new(Wall(Instant::now()));
        (Keeper::start(PERIOD, clock, send).unwrap(), receiver)
    }

    /// Time that nothing in these tests takes unless it hangs.
    const PATIENCE: Duration = Duration::from_secs(600);

    /// Attends until a keep-alive arrives, however seldom this computer runs the thread.
    fn hears(keeper: &Keeper, heard: &mpsc::Receiver<()>) {
        let begin = Instant::now();
        while heard.recv_timeout(PERIOD).is_err() {
            keeper.mark_attended();
            assert!(begin.elapsed() < PATIENCE, "it never speaks");
        }
    }

    #[test]
    fn a_loop_that_is_busy_for_a_while_is_spoken_for_and_one_that_hangs_is_not() {
        let (attended_us, limit_us) = (5_000, UNATTENDED.as_micros() as u64);
        for (since_us, is_spoken_for) in [(0, true), (limit_us, true), (limit_us + 1, false)] {
            let now_us = attended_us + since_us;
            assert_eq!(
                is_attended(now_us, attended_us),
                is_spoken_for,
                "{since_us}"
            );
        }
        let (keeper, heard) = started();
        hears(&keeper, &heard);
        // The loop no longer attends: the test ends when no keep-alive arrives for 200 periods.
        let begin = Instant::now();
        while heard.recv_timeout(200 * PERIOD).is_ok() {
            assert!(begin.elapsed() < PATIENCE, "it never ends");
        }
        assert!(keeper.explaining_pause(100 * PERIOD).is_some());
        assert_eq!(keeper.explaining_pause(100 * PATIENCE), None);
        // The loop attends again.
        hears(&keeper, &heard);
    }

    #[test]
    fn it_ends_with_its_owner_and_with_its_device() {
        let (keeper, heard) = started();
        hears(&keeper, &heard);
        drop(keeper);
        // A keep-alive may be under way.
        let ended = loop {
            if let Err(ended) = heard.recv_timeout(PATIENCE) {
                break ended;
            }
        };
        assert_eq!(ended, mpsc::RecvTimeoutError::Disconnected);
        let (keeper, heard) = started();
        drop(heard);
        let thread = keeper.thread.as_ref().unwrap();
        while !thread.is_finished() {
            keeper.mark_attended();
            std::thread::yield_now();
        }
    }

    #[test]
    fn quantiles_are_of_what_there_is() {
        let lateness = Lateness::from_values((1..=1000).rev().collect());
        let at = |share| lateness.quantile_us(share).unwrap();
        assert_eq!([at(0.0), at(0.5), at(0.999), at(1.0)], [1, 500, 999, 1000]);
        assert_eq!(Lateness::default().quantile_us(0.5), None);
        assert_eq!(Lateness::from_values(vec![7]).quantile_us(0.999), Some(7));
    }
}
