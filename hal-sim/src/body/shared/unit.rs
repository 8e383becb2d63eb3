//! A motor unit of a shared muscle: whom it answers, and what it has left.

use super::spec::SharedSpec;
use crate::body::CHANNELS;
use crate::body::muscle::tiring::FatiguingMuscle;
use crate::random::{unit_from_word, word};

/// A unit that has fired does not fire again for so long, µs: the absolute refractoriness
/// of distal motor branches and muscle fibres (Kopec 1978, 2.5 to 3.0 ms).
const REFRACTORY_US: u64 = 3_000;

/// Longest step of its muscle, s: the frame's readings are as far apart.
const STEP_S: f64 = 5e-3;

/// A motor unit, its force in parts of its own most.
pub(super) struct Unit {
    muscle: FatiguingMuscle,
    /// A when rested.
    fresh: f64,
    /// From what strength of each channel's electrode on it fires.
    answers: [f64; CHANNELS],
    pulse_takes: f64,
    now_us: u64,
    fired_us: Option<u64>,
}

impl Unit {
    /// A pulse of this strength by the electrode of `channel`.
    pub fn pulse(&mut self, t_us: u64, channel: usize, strength: f64) {
        // `channel` is one of an electrode, so below CHANNELS.
        let is_spent = self.fired_us.is_some_and(|at| t_us < at + REFRACTORY_US);
        if strength < self.answers[channel] || is_spent {
            return;
        }
        self.pass(t_us);
        self.muscle.pulse(1.0);
        self.muscle.tire(self.pulse_takes);
        self.fired_us = Some(t_us);
    }

    /// Its force at `t_us`.
    pub fn force_at(&mut self, t_us: u64) -> f64 {
        if self.fired_us.is_none() || self.muscle.is_idle() {
            return 0.0;
        }
        self.pass(t_us);
        self.muscle.force()
    }

    /// What is left of its A.
    pub fn remaining_strength(&self) -> f64 {
        self.muscle.parameters().a_n_per_s / self.fresh
    }

    fn pass(&mut self, to_us: u64) {
        let us = to_us.saturating_sub(self.now_us);
        if self.muscle.is_idle() {
            self.muscle.relax(us);
        } else {
            self.muscle.pass(us as u32); // a reading or a pulse ago
        }
        self.now_us += us;
    }
}

/// The units of `spec`, group by group, rested.
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

/// From what strength of the electrode of `channel` on each unit of `group` answers: as many
/// as it reaches, at even strengths, in an order and from a begin drawn for the two;
/// infinity for the others.
fn recruitment_thresholds(spec: &SharedSpec, channel: usize, group: usize) -> Vec<f64> {
    let count = spec.units_per_group;
    let electrode = spec.electrodes.get(channel).and_then(Option::as_ref);
    let reach = electrode.map_or(0.0, |electrode| electrode.reach[group]); // one for each group: checked
    let stream = word(spec.seed, (channel * CHANNELS + group) as u64);
    let mut places: Vec<usize> = (0..count).collect();
    // Fisher and Yates.
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
