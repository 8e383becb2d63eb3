//! A motor unit of a shared muscle: its response to electrodes, and its fatigue.

use super::spec::SharedSpec;
use crate::body::CHANNELS;
use crate::body::muscle::tiring::FatiguingMuscle;
use crate::random::{unit_from_word, word};

/// Refractory time of a unit, µs: the absolute refractory time of distal motor branches and muscle
/// fibres (Kopec 1978, 2.5 to 3.0 ms).
const REFRACTORY_US: u64 = 3_000;

/// Longest time step of the muscle, s, equal to the interval between readings of the frame.
const STEP_S: f64 = 5e-3;

/// A motor unit; its force is normalised.
pub(super) struct Unit {
    muscle: FatiguingMuscle,
    /// Force scale A of the rested unit.
    fresh: f64,
    /// Smallest strength of each channel's electrode at which the unit fires; infinite if the
    /// electrode does not reach the unit.
    answers: [f64; CHANNELS],
    pulse_takes: f64,
    now_us: u64,
    fired_us: Option<u64>,
}

impl Unit {
    /// Applies a pulse of this strength from the electrode of `channel`.
    pub fn pulse(&mut self, t_us: u64, channel: usize, strength: f64) {
        // `channel` has an electrode, so it is below CHANNELS.
        let is_spent = self.fired_us.is_some_and(|at| t_us < at + REFRACTORY_US);
        if strength < self.answers[channel] || is_spent {
            return;
        }
        self.pass(t_us);
        self.muscle.pulse(1.0);
        self.muscle.tire(self.pulse_takes);
        self.fired_us = Some(t_us);
    }

    /// Advances to `t_us` and returns the normalised force.
    pub fn force_at(&mut self, t_us: u64) -> f64 {
        if self.fired_us.is_none() || self.muscle.is_idle() {
            return 0.0;
        }
        self.pass(t_us);
        self.muscle.force()
    }

    /// Returns the share of the force scale A that fatigue leaves, 0 to 1.
    pub fn remaining_strength(&self) -> f64 {
        self.muscle.parameters().a_n_per_s / self.fresh
    }

    fn pass(&mut self, to_us: u64) {
        let us = to_us.saturating_sub(self.now_us);
        if self.muscle.is_idle() {
            self.muscle.relax(us);
        } else {
            self.muscle.pass(us as u32); // time since the last reading or pulse
        }
        self.now_us += us;
    }
}

/// Returns the rested units of `spec`, group by group.
pub(super) fn rested_units(spec: &SharedSpec) -> Vec<Unit> {
    let muscle = FatiguingMuscle::new(spec.dynamics, spec.fatigue).in_steps_of(STEP_S);
    let mut units = Vec::with_capacity(spec.units());
    for group in 0..spec.groups {
        let orders = std::array::from_fn::<_, CHANNELS, _>(|channel| {
            recruitment_thresholds(spec, channel, group)
        });
        units.extend((0..spec.units_per_group).map(|place| Unit {
            muscle,
            fresh: spec.dynamics.a_n_per_s,
            answers: std::array::from_fn(|channel| orders[channel][place]),
            pulse_takes: spec.pulse_takes,
            now_us: 0,
            fired_us: None,
        }));
    }
    units
}

/// Returns the smallest strength of the electrode of `channel` at which each unit of `group`
/// responds. The reachable units have evenly spaced thresholds, with an order and a start that are
/// random for this channel and group; the others have infinity.
fn recruitment_thresholds(spec: &SharedSpec, channel: usize, group: usize) -> Vec<f64> {
    let count = spec.units_per_group;
    let electrode = spec.electrodes.get(channel).and_then(Option::as_ref);
    // `check` guarantees one entry per group
    let reach = electrode.map_or(0.0, |electrode| electrode.reach[group]);
    let stream = word(spec.seed, (channel * CHANNELS + group) as u64);
    let mut places: Vec<usize> = (0..count).collect();
    // Fisher-Yates shuffle.
    for last in (1..count).rev() {
        let other = (unit_from_word(word(stream, last as u64)) * (last + 1) as f64) as usize;
        places.swap(last, other);
    }
    let begin = unit_from_word(word(stream, 0));
    let answers = |place: usize| {
        let answers = (place as f64 + begin) / (count as f64 * reach);
        if answers <= 1.0 {
            answers
        } else {
            f64::INFINITY
        }
    };
    places.into_iter().map(answers).collect()
}
