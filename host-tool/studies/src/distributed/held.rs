//! How a held force is judged.

use super::declared::{Condition, DistributedDeclaration, Drive, Hold, Open};
use serde::{Deserialize, Serialize};

/// A window's readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// N.
    pub mean_n: f64,
    /// Standard deviation, N.
    pub deviation_n: f64,
    /// Whether the amplitude was the most that the wearer allows.
    pub is_most: bool,
    /// mA; of an electrode that a model steers, its threshold.
    pub amplitude_ma: f64,
}

/// A condition on a person, window by window.
#[derive(Clone, Debug)]
pub struct Series {
    /// Of each window, s.
    pub window_s: f64,
    /// The device refused the force as beyond what its model can give.
    pub is_refused: bool,
    /// From the start of the trains.
    pub windows: Vec<Window>,
    wanted_n: f64,
    drive: Drive,
    hold: Hold,
    open: Open,
}

/// How long a force was held.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Endurance {
    /// s; 0 of a force that was not reached.
    pub seconds: f64,
    /// Whether it was still held when the study ended.
    pub is_longer: bool,
}

impl Series {
    /// Nothing yet.
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

    /// The window in which the wanted force was reached first; of a force that is steered
    /// by a model, the first from which a moving mean is not below.
    fn first_reached_window(&self) -> Option<usize> {
        let within = self.count(self.hold.reach_within_s);
        let first = self.windows.iter().take(within);
        first
            .enumerate()
            .find(|(_, window)| window.mean_n >= self.reached_threshold_n())
            .map(|(nth, _)| nth)
    }

    /// Of the wanted force, from which on it counts as reached.
    fn reached_threshold_n(&self) -> f64 {
        match self.drive.model() {
            None => self.wanted_n,
            Some(_) => self.hold.below * self.wanted_n,
        }
    }

    /// The window at whose end it was held no more.
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

    /// Whether nothing is to be learnt of more than these windows, of which there are `nth`.
    #[must_use]
    pub fn is_over(&self, nth: u64) -> bool {
        let seconds = nth as f64 * self.window_s;
        match self.drive {
            Drive::Open => seconds >= self.open.settle_s + self.open.for_s,
            // Models are looked at for a minute at least.
            _ if self.drive.model().is_some() && seconds < 60.0 => false,
            _ => {
                let unreached =
                    seconds >= self.hold.reach_within_s && self.first_reached_window().is_none();
                unreached || self.end_window().is_some() || seconds >= self.hold.most_s
            }
        }
    }

    /// How long the wanted force was held, from when it was reached.
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

    /// Standard deviation within windows in parts of the mean, some time after the force was
    /// reached; of a constant amplitude, at its begin.
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

    /// Whether feedback found an amplitude for the wanted force: the mean of its last two
    /// windows.
    #[must_use]
    pub fn is_found(&self) -> bool {
        let end = self.count(self.open.settle_s);
        let mean = end.checked_sub(2).and_then(|from| self.mean(from, 2));
        mean >= Some(self.open.reached)
    }

    /// Mean force of a constant amplitude at first, in parts of the wanted force.
    #[must_use]
    pub fn initial_force(&self) -> Option<f64> {
        let from = self.count(self.open.settle_s);
        self.mean(from, self.count(self.open.first_s))
    }

    /// Mean force of a constant amplitude at last, in parts of that at first.
    #[must_use]
    pub fn remaining_force(&self) -> Option<f64> {
        let end = self.count(self.open.settle_s + self.open.for_s);
        let count = self.count(self.open.last_s);
        let last = self.mean(end.checked_sub(count)?, count)?;
        Some(last / self.initial_force()?)
    }

    /// Mean distance from the wanted force over a minute, from when a force that a model
    /// steers has risen for `ripple_from_s`, in parts of it.
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

    /// Time and mean force in parts of the wanted one, `every` windows.
    #[must_use]
    pub fn course(&self, every: usize) -> Vec<[f64; 2]> {
        let of = |(nth, own): (usize, &[Window])| {
            let mean_n = own.iter().map(|window| window.mean_n).sum::<f64>() / own.len() as f64;
            let at = (nth * every) as f64 + 0.5 * own.len() as f64;
            [at * self.window_s, mean_n / self.wanted_n]
        };
        let chunks = self.windows.chunks(every.max(1));
        chunks.enumerate().map(of).collect()
    }

    fn mean(&self, from: usize, count: usize) -> Option<f64> {
        let own = self.windows.get(from..from + count)?;
        let mean_n = own.iter().map(|window| window.mean_n).sum::<f64>() / count as f64;
        Some(mean_n / self.wanted_n)
    }
}
