//! Ends runs when a signal arrives.

use super::{Control, Observation, Observer, ObserverRequest};
use crate::link::{Error, Interruption, Signal};

/// Returns an observer that behaves like `observer` and also ends the run as soon as a signal has
/// set `interruption`.
pub fn interruptible<O: Observer>(interruption: &Interruption, observer: O) -> impl Observer {
    InterruptibleObserver {
        interruption: interruption.clone(),
        observer,
    }
}

struct InterruptibleObserver<O> {
    interruption: Interruption,
    observer: O,
}

impl<O: Observer> Observer for InterruptibleObserver<O> {
    fn observe(&mut self, seen: Observation<'_>) {
        self.observer.observe(seen);
    }

    fn next_request(&mut self) -> ObserverRequest {
        self.observer.next_request()
    }

    fn next_control(&mut self, now_us: u64) -> Option<Control> {
        self.observer.next_control(now_us)
    }

    fn interruption(&self) -> Option<Interruption> {
        Some(self.interruption.clone())
    }
}

/// What became of the stop that was sent to the device because of a signal.
#[derive(Debug)]
pub enum Stopped {
    /// No stop was sent, because no session with the device was open.
    NotOpen,
    /// The device acknowledged the stop.
    Acknowledged,
    /// The stop was sent, but this error came instead of an acknowledgement.
    Unanswered(Error),
}

/// Describes in words which signal arrived and what it caused. `t_s` is the time since the start of
/// the trains, s; `None` if they had not started.
pub(super) fn describe_signal(signal: Signal, t_s: Option<f64>, stopped: &Stopped) -> String {
    let cause = match t_s {
        Some(t_s) => format!("{signal} came at {t_s:.2} s"),
        None => format!("{signal} came before stimulation began"),
    };
    match stopped {
        Stopped::NotOpen => {
            format!("{cause}: no session was open on the device, so no Stop was sent")
        }
        Stopped::Acknowledged => format!("{cause}: the device was stopped"),
        Stopped::Unanswered(error) => format!(
            "{cause}: the device did not acknowledge Stop ({error}); it stops by itself after \
             wearer.host_timeout_ms; check that it does"
        ),
    }
}
