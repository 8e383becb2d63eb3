//! Judges a held force: its endurance, its ripple and what remains of it.

use super::declared::{Condition, DistributedDeclaration, Drive, Hold, Open};
use serde::{Deserialize, Serialize};

/// Measured force and amplitude of one feedback window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Mean force in the window, N.
    pub mean_n: f64,
    /// Standard deviation of the force in the window, N.
    pub deviation_n: f64,
    /// Whether the amplitude was the largest possible, at which the electrode recruits everything
    /// it reaches.
    pub is_most: bool,
    /// Amplitude in the window, mA. If a muscle model determines the amplitudes, this is the
    /// electrode's threshold and has no meaning.
    pub amplitude_ma: f64,
}

/// All windows of one condition on one wearer, and the settings by which they are judged.
#[derive(Clone, Debug)]
pub struct Series {
    /// Duration of each window, s.
    pub window_s: f64,
    /// Whether the device refused the reference force because its muscle model cannot produce it.
    pub is_refused: bool,
    /// Windows from the start of the trains on.
    pub windows: Vec<Window>,
    wanted_n: f64,
    drive: Drive,
    hold: Hold,
    open: Open,
}

/// Time for which a wearer held the reference force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Endurance {
    /// Time from reaching the force until it was no longer held, s; 0 if the force was never
    /// reached.
    pub seconds: f64,
    /// Whether the force was still held when the study ended, so that `seconds` is a lower bound.
    pub is_longer: bool,
}

impl Series {
    /// Creates an empty series for one condition and the reference force `wanted_n`.
    #[must_use]
    pub fn new(declared: &DistributedDeclaration, condition: &Condition, wanted_n: f64) -> Self {
        let (hold, open) = (declared.hold, declared.open);
        Self {
            window_s: match condition.drive {
                Drive::Open => open.window_s,
                _ => hold.window_s,
            },
            is_refused: false,
            windows: Vec::new(),
            wanted_n,
            drive: condition.drive,
            hold,
            open,
        }
    }

    fn count(&self, seconds: f64) -> usize {
        (seconds / self.window_s).round() as usize
    }

    /// Returns the index of the first window that reaches the reference force, or `None` if no
    /// window does within the allowed time.
    fn first_reached_window(&self) -> Option<usize> {
        let within = self.count(self.hold.reach_within_s);
        let first = self.windows.iter().take(within);
        first
            .enumerate()
            .find(|(_, window)| window.mean_n >= self.reached_threshold_n())
            .map(|(nth, _)| nth)
    }

    /// Returns the force at which the reference counts as reached, N. This is the reference force
    /// itself, or `below` times the reference if a muscle model determines the amplitudes.
    fn reached_threshold_n(&self) -> f64 {
        match self.drive.model() {
            None => self.wanted_n,
            Some(_) => self.hold.below * self.wanted_n,
        }
    }

    /// Returns the index of the window at whose end the force counted as no longer held, or `None`
    /// if it was held to the last window.
    fn end_window(&self) -> Option<usize> {
        let from = self.first_reached_window()?;
        let average = self.hold.average_windows.max(1);
        let (mut sum, mut at_most) = (0.0, 0);
        for (nth, item) in self.windows.iter().enumerate().skip(from) {
            sum += item.mean_n;
            if nth >= from + average {
                sum -= self
                    .windows
                    .get(nth - average)
                    .map_or(0.0, |window| window.mean_n);
            }
            at_most = if item.is_most { at_most + 1 } else { 0 };
            let is_weak = sum < self.hold.below * self.wanted_n * average as f64;
            let is_at_most = self.drive.model().is_some() || at_most >= average;
            if nth + 1 >= from + average && is_weak && is_at_most {
                return Some(nth);
            }
        }
        None
    }

    /// Returns whether the condition is decided after `nth` windows, so that no further window is
    /// needed.
    #[must_use]
    pub fn is_over(&self, nth: u64) -> bool {
        let seconds = nth as f64 * self.window_s;
        match self.drive {
            Drive::Open => seconds >= self.open.settle_s + self.open.for_s,
            // Conditions that a model drives are observed for at least a minute.
            _ if self.drive.model().is_some() && seconds < 60.0 => false,
            _ => {
                let unreached =
                    seconds >= self.hold.reach_within_s && self.first_reached_window().is_none();
                unreached || self.end_window().is_some() || seconds >= self.hold.most_s
            }
        }
    }

    /// Returns how long the reference force was held after it was reached.
    #[must_use]
    pub fn endurance(&self) -> Endurance {
        let none = Endurance {
            seconds: 0.0,
            is_longer: false,
        };
        let Some(reached) = self.first_reached_window().filter(|_| !self.is_refused) else {
            return none;
        };
        let ended = self.end_window();
        let end = ended.map_or(self.windows.len(), |index| index + 1);
        Endurance {
            seconds: (end - reached) as f64 * self.window_s,
            is_longer: ended.is_none(),
        }
    }

    /// Returns the ripple: the standard deviation of the force within windows, as a fraction of the
    /// mean force. It is measured `ripple_from_s` after the force was reached, or at the start of
    /// the constant amplitude. `None` without enough windows.
    #[must_use]
    pub fn ripple(&self) -> Option<f64> {
        let (from, count) = match self.drive {
            Drive::Open => (
                self.count(self.open.settle_s),
                self.count(self.open.first_s),
            ),
            _ => {
                let from = self.count(self.hold.ripple_from_s);
                (
                    self.first_reached_window()? + from,
                    self.count(self.hold.ripple_for_s),
                )
            }
        };
        let own = self.windows.get(from..from + count)?;
        let mean_n = own.iter().map(|window| window.mean_n).sum::<f64>();
        let square = own
            .iter()
            .map(|window| window.deviation_n.powi(2))
            .sum::<f64>();
        let deviation_n = (square / count as f64).sqrt();
        (mean_n > 0.0).then(|| deviation_n / (mean_n / count as f64))
    }

    /// Returns whether the search found an amplitude for the reference force, judged by the mean
    /// force of its last two windows.
    #[must_use]
    pub fn is_found(&self) -> bool {
        let end = self.count(self.open.settle_s);
        let mean = end.checked_sub(2).and_then(|from| self.mean(from, 2));
        mean >= Some(self.open.reached)
    }

    /// Returns the mean force at the start of the constant amplitude, as a fraction of the
    /// reference force; `None` without enough windows.
    #[must_use]
    pub fn initial_force(&self) -> Option<f64> {
        let from = self.count(self.open.settle_s);
        self.mean(from, self.count(self.open.first_s))
    }

    /// Returns the mean force at the end of the constant amplitude, as a fraction of the mean force
    /// at its start; `None` without enough windows.
    #[must_use]
    pub fn remaining_force(&self) -> Option<f64> {
        let end = self.count(self.open.settle_s + self.open.for_s);
        let count = self.count(self.open.last_s);
        let last = self.mean(end.checked_sub(count)?, count)?;
        Some(last / self.initial_force()?)
    }

    /// Returns the mean absolute difference between force and reference, as a fraction of the
    /// reference, from `ripple_from_s` to 60 s after the start. It is meant for conditions in which
    /// a muscle model determines the amplitudes.
    #[must_use]
    pub fn distance(&self) -> Option<f64> {
        let own = self
            .windows
            .get(self.count(self.hold.ripple_from_s)..self.count(60.0))?;
        let off = own
            .iter()
            .map(|window| (window.mean_n / self.wanted_n - 1.0).abs());
        Some(off.sum::<f64>() / own.len() as f64)
    }

    /// Returns the course of the force as pairs of time, s, and mean force as a fraction of the
    /// reference. Each pair averages `every` windows.
    #[must_use]
    pub fn course(&self, every: usize) -> Vec<[f64; 2]> {
        let point = |(nth, own): (usize, &[Window])| {
            let mean_n = own.iter().map(|window| window.mean_n).sum::<f64>() / own.len() as f64;
            let at = (nth * every) as f64 + 0.5 * own.len() as f64;
            [at * self.window_s, mean_n / self.wanted_n]
        };
        let chunks = self.windows.chunks(every.max(1));
        chunks.enumerate().map(point).collect()
    }

    fn mean(&self, from: usize, count: usize) -> Option<f64> {
        let own = self.windows.get(from..from + count)?;
        let mean_n = own.iter().map(|window| window.mean_n).sum::<f64>() / count as f64;
        Some(mean_n / self.wanted_n)
    }
}
