//! A wish from outside to end at once.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A signal by which the system asks a program to end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Signal {
    /// SIGINT: Ctrl-C.
    Interrupt,
    /// SIGTERM: `kill`, a system that shuts down.
    Terminate,
    /// SIGHUP: the terminal has gone.
    HangUp,
}

impl Signal {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Interrupt, Self::Terminate, Self::HangUp];

    /// Its number, the same on every POSIX system.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::HangUp => 1,
            Self::Interrupt => 2,
            Self::Terminate => 15,
        }
    }

    /// What a program that it ended exits with: 128 and its number.
    #[must_use]
    pub const fn exit_code(self) -> u8 {
        128 + self.number()
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Interrupt => "SIGINT",
            Self::Terminate => "SIGTERM",
            Self::HangUp => "SIGHUP",
        })
    }
}

/// Carries a signal to whoever waits for a device. Clones are one and the same.
#[derive(Clone, Debug, Default)]
pub struct Interruption(Arc<AtomicUsize>);

impl Interruption {
    /// The signal that came, if one did. The latest of several.
    #[must_use]
    pub fn asked(&self) -> Option<Signal> {
        let number = self.0.load(Ordering::Acquire);
        let is = |signal: &Signal| usize::from(signal.number()) == number;
        Signal::ALL.into_iter().find(is)
    }

    /// As if `signal` had come.
    pub fn ask(&self, signal: Signal) {
        self.0.store(signal.number().into(), Ordering::Release);
    }

    /// The number of the signal that came, or 0, for a signal handler to set.
    #[must_use]
    pub fn number(&self) -> Arc<AtomicUsize> {
        Arc::clone(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_reaches_every_clone_and_stays() {
        let interruption = Interruption::default();
        let other = interruption.clone();
        assert_eq!(other.asked(), None);
        for signal in Signal::ALL {
            interruption.ask(signal);
            assert_eq!(other.asked(), Some(signal));
            assert_eq!(other.asked(), Some(signal));
        }
        let codes = Signal::ALL.map(Signal::exit_code);
        assert_eq!(codes, [130, 143, 129]);
    }
}
