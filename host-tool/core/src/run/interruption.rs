//! A run that a signal ends.

use super::{Control, Observer, Seen, Wish};
use crate::link::{Error, Interruption, Signal};

/// An observer whose run `interruption` ends.
pub fn interruptible<O: Observer>(interruption: &Interruption, observer: O) -> impl Observer {
    Heeding {
        interruption: interruption.clone(),
        observer,
    }
}

struct Heeding<O> {
    interruption: Interruption,
    observer: O,
}

impl<O: Observer> Observer for Heeding<O> {
    fn see(&mut self, seen: Seen<'_>) {
        self.observer.see(seen);
    }

    fn wish(&mut self) -> Wish {
        self.observer.wish()
    }

    fn control(&mut self, now_us: u64) -> Option<Control> {
        self.observer.control(now_us)
    }

    fn interruption(&self) -> Option<Interruption> {
        Some(self.interruption.clone())
    }
}

/// What is known of the stop that a signal caused.
#[derive(Debug)]
pub enum Stopped {
    /// None was asked for: no session was open.
    NotOpen,
    /// The device acknowledged it.
    Acknowledged,
    /// It was sent, and this came instead of an acknowledgement.
    Unanswered(Error),
}

/// What a signal did, in words: `t_s` after the start of the trains, if they
/// had started.
pub(super) fn told(signal: Signal, t_s: Option<f64>, stopped: &Stopped) -> String {
    let what = match t_s {
        Some(t_s) => format!("{signal} came at {t_s:.2} s"),
        None => format!("{signal} came before the stimulation had begun"),
    };
    match stopped {
        Stopped::NotOpen => format!("{what}: nothing was asked of the device"),
        Stopped::Acknowledged => format!("{what}: the device was stopped"),
        Stopped::Unanswered(error) => format!(
            "{what}: Stop was sent but not acknowledged ({error}), so the device stops by itself \
             after wearer.host_timeout_ms; see that it does"
        ),
    }
}
