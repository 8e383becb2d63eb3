//! A run that a signal ends.

use super::{Observer, Seen, Wish};
use crate::link::{Error, Interruption, Signal};

/// An observer whose run `interruption` ends.
pub fn heeding<O: Observer>(interruption: &Interruption, observer: O) -> impl Observer {
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

    fn interruption(&self) -> Option<Interruption> {
        Some(self.interruption.clone())
    }
}

/// What a signal did, in words: `t_s` after the start of the trains, if they
/// had started, with the link's error if the stop was not acknowledged.
pub(super) fn told(signal: Signal, t_s: Option<f64>, unanswered: Option<&Error>) -> String {
    let what = match t_s {
        Some(t_s) => format!("{signal} came at {t_s:.2} s"),
        None => format!("{signal} came before the stimulation had begun"),
    };
    match unanswered {
        None => format!("{what}: the device was stopped"),
        Some(error) => format!(
            "{what}: Stop was sent but not acknowledged ({error}), so the device stops by itself \
             after wearer.host_timeout_ms; see that it does"
        ),
    }
}
