//! Simulates one participant in all conditions.

use super::calibration::{ARMS, Curves, curves};
use super::control::LearntTorque;
use super::declaration::{Condition, HEIGHTS, Metric, Study};
use super::device::Device;
use super::error::LiftError;
use super::person::LiftWearer;
use super::trial::{LiftResult, Worker};
use hal_sim::random;
use serde::{Deserialize, Serialize};

/// Results of a participant in one condition: means over the lifts of the judged sets.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConditionResult {
    pub condition: Condition,
    /// Metabolic proxy, W/kg.
    pub power_w_per_kg: f64,
    /// Matching error at each height, m.
    pub error_m: [f64; HEIGHTS],
    /// SPARC, dimensionless, at each height.
    pub sparc: [f64; HEIGHTS],
    /// Duration of lifting and of dropping in a lift, s.
    pub phases_s: [f64; 2],
    /// Largest torque of stimulated fibres about elbow and shoulder, N m.
    pub stimulated_nm: [f64; 2],
    /// Share of steps in which no drives could produce the required torque.
    pub weak: f64,
}

impl ConditionResult {
    /// Returns a metric at a height, or its mean over all heights; power has no height.
    #[must_use]
    pub fn value(&self, metric: Metric, height: Option<usize>) -> f64 {
        let height_value = |values: &[f64; HEIGHTS]| match height {
            Some(height) => values[height],
            None => values.iter().sum::<f64>() / HEIGHTS as f64,
        };
        match metric {
            Metric::Power => self.power_w_per_kg,
            Metric::Error => height_value(&self.error_m),
            Metric::Smoothness => height_value(&self.sparc),
        }
    }
}

/// Results of one participant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Participant {
    /// Random parameters, in the order of the ranges.
    pub values: Vec<f64>,
    /// Results in the order of [`Condition::ALL`].
    pub conditions: Vec<ConditionResult>,
    /// Activation functions that the device was configured with.
    pub curves: Curves,
}

impl Participant {
    /// Returns the result in this condition, or `None` if it was not simulated.
    #[must_use]
    pub fn condition_result(&self, condition: Condition) -> Option<&ConditionResult> {
        self.conditions
            .iter()
            .find(|result| result.condition == condition)
    }
}

/// Simulates a participant in all conditions, each with this number of target sets, of which the
/// first is not judged. All conditions have the same noise, but each is on another day with other
/// errors in the perceived target positions.
///
/// # Errors
/// Fails if the device refuses its settings, or if a lift cannot be judged.
pub fn participant(
    study: &Study,
    person: &LiftWearer,
    target_sets: usize,
) -> Result<Participant, LiftError> {
    let spec = &person.arms[0];
    let curves = curves(study, spec.stature_m, spec.mass_kg)?;
    let mut worker = Worker::new(study, person)?;
    let result = |condition| {
        simulate_condition(
            study,
            person,
            (&mut worker, &curves),
            condition,
            target_sets,
        )
    };
    let conditions = Condition::ALL.into_iter().map(result);
    let conditions = conditions.collect::<Result<Vec<ConditionResult>, LiftError>>()?;
    Ok(Participant {
        values: person.values.clone(),
        conditions,
        curves,
    })
}

/// Returns the seed of a participant's lift `nth`, for aim, drives and encoders.
#[must_use]
pub(super) const fn lift_seed(person: &LiftWearer, nth: usize) -> u64 {
    random::word(random::word(person.seed, 3), nth as u64)
}

/// Returns the height of repetition `nth` of a set; the heights alternate.
#[must_use]
pub(super) const fn lift_height(nth: usize) -> usize {
    nth % HEIGHTS
}

fn simulate_condition(
    study: &Study,
    person: &LiftWearer,
    (worker, curves): (&mut Worker, &Curves),
    condition: Condition,
    target_sets: usize,
) -> Result<ConditionResult, LiftError> {
    let mut device = Device::new(study, curves, condition, &person.told)?;
    let mut learnt = [[LearntTorque::NOTHING; ARMS]; HEIGHTS];
    let day = person.aim_of_day_m(condition as u64);
    let mut sums = [(LiftResult::default(), 0.0); HEIGHTS];
    let (mut stimulated_nm, mut weak, mut steps) = ([0.0_f64; 2], 0, 0.0);
    let lifts = study.protocol.repetitions;
    for nth in 0..target_sets * lifts {
        let height = lift_height(nth);
        let seed = lift_seed(person, nth);
        let found = worker.lift(
            &mut device,
            (height, seed),
            day[height],
            &mut learnt[height],
            None,
        )?;
        if nth < lifts {
            continue;
        }
        let (sum, count) = &mut sums[height];
        *count += 1.0;
        sum.error_m += found.error_m;
        sum.sparc += found.sparc;
        sum.used_j += found.used_j;
        sum.duration_s += found.duration_s;
        for (own, phase_s) in sum.phases_s.iter_mut().zip(found.phases_s) {
            *own += phase_s;
        }
        for (own, most) in stimulated_nm.iter_mut().zip(found.stimulated_nm) {
            *own = own.max(most);
        }
        weak += found.weak;
        steps += found.duration_s * super::way::RATE_HZ * ARMS as f64;
    }
    let (mut used_j, mut time_s, mut total) = (0.0, 0.0, 0.0);
    let mut phases_s = [0.0; 2];
    for (height, (sum, count)) in sums.iter().enumerate() {
        let (back_j, back_s) = worker.return_cost(height);
        used_j += sum.used_j + count * back_j;
        time_s += sum.duration_s + count * back_s;
        total += count;
        for (own, sum) in phases_s.iter_mut().zip(sum.phases_s) {
            *own += sum;
        }
    }
    Ok(ConditionResult {
        condition,
        power_w_per_kg: used_j / time_s / person.arms[0].mass_kg,
        error_m: sums.map(|(sum, count)| sum.error_m / count),
        sparc: sums.map(|(sum, count)| sum.sparc / count),
        phases_s: phases_s.map(|phase_s| phase_s / total),
        stimulated_nm,
        weak: weak as f64 / steps,
    })
}
