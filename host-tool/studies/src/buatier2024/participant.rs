//! One person through all conditions.

use super::calibration::{ARMS, Curves, curves};
use super::control::LearntTorque;
use super::declaration::{Condition, HEIGHTS, Metric, Study};
use super::device::Device;
use super::error::LiftError;
use super::person::LiftWearer;
use super::trial::{LiftResult, Worker};
use hal_sim::random;
use serde::{Deserialize, Serialize};

/// What one condition of a person came to: means over the lifts of the sets that are judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConditionResult {
    /// Which.
    pub condition: Condition,
    /// Metabolic proxy, W/kg.
    pub power_w_per_kg: f64,
    /// Matching error at each height, m.
    pub error_m: [f64; HEIGHTS],
    /// SPARC at each height.
    pub sparc: [f64; HEIGHTS],
    /// Time of lifting and of dropping of a lift, s.
    pub phases_s: [f64; 2],
    /// Largest torque of stimulated fibres about elbow and shoulder, N m.
    pub stimulated_nm: [f64; 2],
    /// Share of the steps at which no drives gave what was wanted.
    pub weak: f64,
}

impl ConditionResult {
    /// A metric at a height, or its mean over all; power has none.
    #[must_use]
    pub fn value(&self, metric: Metric, height: Option<usize>) -> f64 {
        let of = |all: &[f64; HEIGHTS]| match height {
            Some(height) => all[height],
            None => all.iter().sum::<f64>() / HEIGHTS as f64,
        };
        match metric {
            Metric::Power => self.power_w_per_kg,
            Metric::Error => of(&self.error_m),
            Metric::Smoothness => of(&self.sparc),
        }
    }
}

/// What a person came to.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Participant {
    /// Drawn numbers, in the order of the ranges.
    pub values: Vec<f64>,
    /// In the order of [`Condition::ALL`].
    pub conditions: Vec<ConditionResult>,
    /// What the device was told.
    pub curves: Curves,
}

impl Participant {
    /// Of a condition.
    #[must_use]
    pub fn condition_result(&self, condition: Condition) -> Option<&ConditionResult> {
        self.conditions
            .iter()
            .find(|result| result.condition == condition)
    }
}

/// A person through all conditions, each of so many target sets, the first of which is not
/// judged. The same noise in each condition; targets are believed elsewhere every day.
///
/// # Errors
/// A device that refuses what it is told, a lift that cannot be judged.
pub fn participant(
    study: &Study,
    person: &LiftWearer,
    target_sets: usize,
) -> Result<Participant, LiftError> {
    let spec = &person.arms[0];
    let curves = curves(study, spec.stature_m, spec.mass_kg)?;
    let mut worker = Worker::new(study, person)?;
    let one = |condition| {
        simulate_condition(
            study,
            person,
            (&mut worker, &curves),
            condition,
            target_sets,
        )
    };
    let conditions = Condition::ALL.into_iter().map(one);
    let conditions = conditions.collect::<Result<Vec<ConditionResult>, LiftError>>()?;
    Ok(Participant {
        values: person.values.clone(),
        conditions,
        curves,
    })
}

/// Seed of lift `nth` of a person: of its aim, its drives and its encoders.
#[must_use]
pub(super) const fn lift_seed(person: &LiftWearer, nth: usize) -> u64 {
    random::word(random::word(person.seed, 3), nth as u64)
}

/// The height of repetition `nth` of a set: each in turn.
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
    let (mut used_j, mut time_s, mut all) = (0.0, 0.0, 0.0);
    let mut phases_s = [0.0; 2];
    for (height, (sum, count)) in sums.iter().enumerate() {
        let (back_j, back_s) = worker.return_cost(height);
        used_j += sum.used_j + count * back_j;
        time_s += sum.duration_s + count * back_s;
        all += count;
        for (own, sum) in phases_s.iter_mut().zip(sum.phases_s) {
            *own += sum;
        }
    }
    Ok(ConditionResult {
        condition,
        power_w_per_kg: used_j / time_s / person.arms[0].mass_kg,
        error_m: sums.map(|(sum, count)| sum.error_m / count),
        sparc: sums.map(|(sum, count)| sum.sparc / count),
        phases_s: phases_s.map(|phase_s| phase_s / all),
        stimulated_nm,
        weak: weak as f64 / steps,
    })
}
