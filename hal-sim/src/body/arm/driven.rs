//! A stimulated muscle: recruitment, calcium, force and fatigue.

use super::anatomy::{ALL, ELECTRODES, Muscle};
use super::spec::ArmSpec;
use crate::body::muscle::tiring::{Fatigue, FatiguingMuscle};
use crate::body::wearer::{effective_voltage, recruitment};
use crate::body::{Drive, Load};
use crate::random;
use std::collections::VecDeque;

/// Refractory time of the fibres after a pulse, µs (Kopec 1978: 2.5 to 3.0 ms).
const REFRACTORY_US: u64 = 2_750;
/// Pause between pulses after which a new contraction begins, µs. Chosen here, without a source.
const PAUSE_US: u64 = 300_000;
/// Normalised force (1 at full recruitment) below which a muscle without pulses counts as resting.
/// For the strongest muscle that is about 0.03 N, less than the nominal noise of the sensor.
const RESTING: f64 = 1e-4;

/// State of one stimulated muscle: pending pulses, activation, force and fatigue.
#[derive(Debug, Clone)]
pub(super) struct StimulatedMuscle {
    muscle: FatiguingMuscle,
    /// Pending pulses: time at which each takes effect, µs, and recruited share, 0 to 1.
    under_way: VecDeque<(u64, f64)>,
    last_us: Option<u64>,
    last_part: f64,
    force_n: f64,
    noise: f64,
    strength: f64,
    contractions: u64,
    seed: u64,
    now_us: u64,
    rests: bool,
}

/// Returns the fatigue parameters with which sustained full recruitment reduces force to the spec's
/// `fatigue_floor`.
fn fatigue(spec: &ArmSpec) -> Fatigue {
    // Under sustained full recruitment, F ends at the floor: A₀ - A = α τ F.
    let lost = (1.0 - spec.fatigue_floor) / spec.fatigue_floor.max(1e-3);
    Fatigue {
        alpha_a_per_s2: lost * spec.dynamics.a_n_per_s / spec.fatigue_time_s,
        tau_fat_s: spec.fatigue_time_s,
        ..Fatigue::NEVER
    }
}

impl StimulatedMuscle {
    /// Creates a muscle at rest. `force_n` is its force at full recruitment, N; `longest_s` is the
    /// longest time step of its force, s.
    pub fn new(spec: &ArmSpec, force_n: f64, longest_s: f64, seed: u64) -> Self {
        Self {
            muscle: FatiguingMuscle::new(spec.dynamics, fatigue(spec)).in_steps_of(longest_s),
            under_way: VecDeque::new(),
            last_us: None,
            last_part: 0.0,
            force_n,
            noise: spec.force_noise,
            strength: 1.0,
            contractions: 0,
            seed,
            now_us: 0,
            rests: false,
        }
    }

    /// Schedules a pulse that recruits the share `part` (0 to 1) of the muscle and takes effect at
    /// `due_us`.
    pub fn excite(&mut self, due_us: u64, part: f64) {
        if part > 0.0 {
            self.under_way.push_back((due_us, part));
        }
    }

    /// Advances the muscle to `to_us` and applies all pulses that are due before that time.
    pub fn advance(&mut self, to_us: u64) {
        while let Some((due_us, part)) = self.under_way.front().copied() {
            if due_us >= to_us {
                break;
            }
            self.under_way.pop_front();
            self.wake(due_us);
            self.pulse(due_us, part);
        }
        self.flow(to_us);
    }

    fn flow(&mut self, to_us: u64) {
        let span_us = to_us.saturating_sub(self.now_us);
        // `wake` makes up for the time that a resting muscle skips.
        if span_us == 0 || self.rests {
            return;
        }
        self.now_us = to_us;
        // A muscle that never received a pulse has nothing to recover from either.
        if let Some(last_us) = self.last_us {
            self.muscle.pass(span_us as u32);
            let is_pulsed = to_us.saturating_sub(last_us) <= PAUSE_US;
            self.rests = !is_pulsed && self.muscle.force() < RESTING;
        }
    }

    /// Advances the muscle to `at_us`, the time of a pulse. If the muscle was resting, its recovery
    /// during the skipped time is computed first.
    fn wake(&mut self, at_us: u64) {
        self.flow(at_us);
        if self.rests {
            self.muscle.relax(at_us.saturating_sub(self.now_us));
            (self.now_us, self.rests) = (self.now_us.max(at_us), false);
        }
    }

    /// Applies a pulse. Within the refractory time of an earlier pulse, only the larger of the two
    /// recruited shares counts.
    fn pulse(&mut self, at_us: u64, part: f64) {
        let since = self.last_us.map(|last| at_us.saturating_sub(last));
        if since.is_none_or(|since| since > PAUSE_US) {
            let deviate = random::standard_normal(self.seed, self.contractions);
            self.strength = (1.0 + self.noise * deviate).max(0.0);
            self.contractions += 1;
        }
        if since.is_some_and(|since| since < REFRACTORY_US) {
            if part > self.last_part {
                self.last_part = part;
                self.muscle.regain(part);
            }
            return;
        }
        (self.last_us, self.last_part) = (Some(at_us), part);
        self.muscle.pulse(part);
    }

    /// Returns the present force of the muscle, N. A normalised force below [`RESTING`] counts as
    /// 0.
    pub fn force_n(&self) -> f64 {
        let force = self.muscle.force();
        if force < RESTING {
            return 0.0;
        }
        self.force_n * self.strength * force
    }

    /// Returns the share of the force that fatigue leaves at `now_us`, 0 to 1.
    pub fn freshness(&self, spec: &ArmSpec, now_us: u64) -> f64 {
        let mut muscle = self.muscle;
        if self.rests {
            muscle.relax(now_us.saturating_sub(self.now_us));
        }
        muscle.parameters().a_n_per_s / spec.dynamics.a_n_per_s
    }
}

/// Returns the muscle under `electrode` and its neighbours, with the share of each that a current in
/// the electrode recruits, 0 to 1.
pub(super) fn recruited_muscles(
    spec: &ArmSpec,
    electrode: usize,
    current_ma: f64,
    width_us: u32,
) -> impl Iterator<Item = (Muscle, f64)> {
    let stimulated = ALL[electrode];
    let share = move |of: usize, ma: f64| recruited_share(spec, of, ma, width_us);
    let neighbours = stimulated.neighbours().iter().map(move |neighbour| {
        // A muscle without an electrode has the thresholds of the stimulated one, which lies above
        // it.
        let of = match *neighbour as usize {
            muscle if muscle < ELECTRODES => muscle,
            _ => electrode,
        };
        (
            *neighbour,
            share(of, spec.crosstalk[electrode] * current_ma),
        )
    });
    std::iter::once((stimulated, share(electrode, current_ma))).chain(neighbours)
}

/// Returns the muscles that a pulse of this drive and width in `electrode` recruits, in part or in
/// full.
#[must_use]
pub fn reached_muscles(
    spec: &ArmSpec,
    electrode: usize,
    drive: Drive,
    width_us: u32,
) -> Vec<Muscle> {
    if electrode >= ELECTRODES {
        return Vec::new();
    }
    let current_ma = Load::Ohms(spec.load_ohm).current_ma(drive);
    let shares = recruited_muscles(spec, electrode, current_ma, width_us);
    let reached = shares.filter(|(_, share)| *share > 0.0);
    reached.map(|(muscle, _)| muscle).collect()
}

/// Returns the share of a muscle that a current in `electrode` recruits, 0 to 1. It rises from the
/// electrode's threshold current to its current of full recruitment.
pub(super) fn recruited_share(
    spec: &ArmSpec,
    electrode: usize,
    current_ma: f64,
    width_us: u32,
) -> f64 {
    if electrode >= ELECTRODES {
        return 0.0;
    }
    let nominal = |ma: f64| effective_voltage(ma, 200);
    recruitment(
        effective_voltage(current_ma, width_us),
        nominal(spec.threshold_ma[electrode]),
        nominal(spec.max_ma[electrode]),
        spec.curvature,
    )
}
