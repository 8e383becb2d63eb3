//! Mean force of a motor unit whose spikes repeat with a period.

use crate::body::muscle::{Muscle, Parameters, Step};
use std::collections::BTreeMap;

/// Resolution of spike times, µs: forces within it differ by less than a thousandth.
const GRAIN_US: u32 = 250;
/// Time step of the muscle, µs.
const STEP_US: u32 = 250;
/// Time in which force settles, µs: more than ten of the slowest time constants.
const SETTLES_US: u32 = 2_000_000;

/// Mean forces of spike patterns, relative to that of one spike every 20 ms. Results are cached by
/// pattern.
#[derive(Debug, Clone)]
pub struct Forces {
    parameters: Parameters,
    period_us: u32,
    known: BTreeMap<Vec<u32>, f64>,
    /// Pattern that was asked for last, and its force: most units spike alike.
    latest: (Vec<u32>, f64),
}

impl Forces {
    /// Creates an empty cache for patterns that repeat every `period_us`. The muscle has the
    /// parameters of Lee 2020's mean subject.
    #[must_use]
    pub fn new(period_us: u32) -> Self {
        Self {
            parameters: Parameters::mean_subject_at_50_hz(),
            period_us,
            known: BTreeMap::new(),
            latest: (Vec::new(), 0.0),
        }
    }

    /// Returns the mean force of a motor unit that spikes at the times `at_us` (ascending) of each
    /// period, relative to one spike every 20 ms. Patterns that differ only in the start of the
    /// period have the same force.
    pub fn mean_force(&mut self, at_us: &[u32]) -> f64 {
        let Some(&first) = at_us.first() else {
            return 0.0;
        };
        let grains = at_us
            .iter()
            .map(|at| (at - first + GRAIN_US / 2) / GRAIN_US);
        if grains.clone().eq(self.latest.0.iter().copied()) {
            return self.latest.1;
        }
        let pattern: Vec<u32> = grains.collect();
        let known = self.known.get(&pattern).copied();
        let force = known.unwrap_or_else(|| self.settled_force(&pattern));
        if known.is_none() {
            self.known.insert(pattern.clone(), force);
        }
        self.latest = (pattern, force);
        force
    }

    fn settled_force(&self, pattern: &[u32]) -> f64 {
        let step = Step::new(&self.parameters, f64::from(STEP_US) * 1e-6);
        let mut muscle = Muscle::new(self.parameters);
        let steps = self.period_us / STEP_US;
        let mut mean = 0.0;
        for _ in 0..SETTLES_US.div_ceil(self.period_us) {
            mean = 0.0;
            for at in 0..steps {
                let spikes = pattern
                    .iter()
                    .filter(|&&grain| grain * GRAIN_US / STEP_US == at);
                spikes.for_each(|_| muscle.pulse(1.0));
                let before = muscle.force();
                muscle.step(&step);
                mean += 0.5 * (before + muscle.force()) / f64::from(steps);
            }
        }
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_spike_in_20_ms_is_the_unit() {
        let mut forces = Forces::new(40_000);
        assert!((forces.mean_force(&[0, 20_000]) - 1.0).abs() < 2e-3);
        assert!((forces.mean_force(&[7_000, 27_000]) - 1.0).abs() < 2e-3);
        assert_eq!(forces.mean_force(&[]), 0.0);
    }

    /// More spikes give more force, and two close together give less than two far apart.
    #[test]
    fn force_rises_with_spikes_and_with_their_distance() {
        let mut forces = Forces::new(40_000);
        let half = forces.mean_force(&[0]);
        let double = forces.mean_force(&[0, 10_000, 20_000, 30_000]);
        let close = forces.mean_force(&[0, 3_000, 20_000, 23_000]);
        assert!(half < 0.9 && double > 1.05, "{half} {double}");
        assert!((1.0..double).contains(&close), "{close} {double}");
    }
}
