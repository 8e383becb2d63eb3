//! Carries a signal that ends a program to the code that waits for a device.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Signal by which the operating system asks a program to end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Signal {
    /// SIGINT, sent by Ctrl-C.
    Interrupt,
    /// SIGTERM, sent by `kill` or by a system that shuts down.
    Terminate,
    /// SIGHUP, sent when the terminal has closed.
    HangUp,
}

impl Signal {
    /// All signals that end a run.
    pub const ALL: [Self; 3] = [Self::Interrupt, Self::Terminate, Self::HangUp];

    /// Returns the number of the signal, which is the same on every POSIX system.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::HangUp => 1,
            Self::Interrupt => 2,
            Self::Terminate => 15,
        }
    }

    /// Returns the exit code of a program that this signal ended: 128 plus the signal's number.
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

/// Flag that carries a signal from its handler to the code that waits for a device. Clones share
/// the same flag.
#[derive(Clone, Debug, Default)]
pub struct Interruption(Arc<AtomicUsize>);

impl Interruption {
    /// Returns the latest signal that arrived; `None` if none did.
    #[must_use]
    pub fn received_signal(&self) -> Option<Signal> {
        let number = self.0.load(Ordering::Acquire);
        let is = |signal: &Signal| usize::from(signal.number()) == number;
        Signal::ALL.into_iter().find(is)
    }

    /// Sets the flag as if `signal` had arrived.
    pub fn raise_signal(&self, signal: Signal) {
        self.0.store(signal.number().into(), Ordering::Release);
    }

    /// Returns the shared atomic variable that a signal handler sets to the number of the signal;
    /// it is 0 until then.
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
        assert_eq!(other.received_signal(), None);
        for signal in Signal::ALL {
            interruption.raise_signal(signal);
            assert_eq!(other.received_signal(), Some(signal));
            assert_eq!(other.received_signal(), Some(signal));
        }
        let codes = Signal::ALL.map(Signal::exit_code);
        assert_eq!(codes, [130, 143, 129]);
    }
}
