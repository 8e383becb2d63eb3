//! Runs all contenders on the same random plants.

use super::TrackingError;
use super::contender::Contender;
use super::cost::Cycles;
use super::exercise::{Exercise, Outcome, Wearers};
use super::optimum::optimum;
use super::plant::Plant;
use super::statistics::{Interval, mean, paired, percentile};
use super::target::{Course, Kind};
use super::wearer::Points;
use rayon::prelude::*;

/// Part of the scored time below which the reference may be out of reach, for a plant that counts
/// as able to reach all of it.
const WHOLLY: f64 = 0.005;

/// Plan of a campaign: its random plants and their references.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// Seed from which the plants are generated.
    pub seed: u64,
    /// Number of plants that are generated.
    pub plants: u64,
    /// Population from which the plants come.
    pub wearers: Wearers,
    /// Reference that all earlier wearers and the nominal wearer follow.
    pub course: Course,
    /// Number of plants, from the first, for which the offline optimum is searched. This search
    /// takes most of the time.
    pub optimum_plants: u64,
}

/// Results of all contenders on one plant with one or two stimulation points. Angles are in
/// degrees.
#[derive(Clone, PartialEq, Debug)]
pub struct Case {
    /// Stimulation points that are in use.
    pub points: Points,
    /// Kind of the reference, which determines how attempts are judged.
    pub kind: Kind,
    /// Strength of the plant's muscles relative to the nominal wearer.
    pub strength: f64,
    /// Electromechanical delay of the plant, ms.
    pub delay_ms: f64,
    /// Part of the scored time at which the reference is out of the plant's reach, 0 to 1.
    pub unreachable: f64,
    /// RMSE of the offline optimum, °; `None` if it was not searched for this plant.
    pub optimum: Option<f64>,
    /// Outcome of each contender, in the order of [`Campaign::contenders`].
    pub outcomes: Vec<Outcome>,
}

/// Results of a campaign: every contender on every plant.
#[derive(Clone, PartialEq, Debug)]
pub struct Campaign {
    /// Plan by which the plants and references were generated.
    pub plan: Plan,
    /// Controllers that drove every plant; the index of a contender refers to this list.
    pub contenders: Vec<Contender>,
    /// Cycles that each contender takes in a tick in which its law runs; `None` if they were not
    /// measured ([`super::cost::Cost`]).
    pub cycles: Vec<Option<Cycles>>,
    /// Results on every plant with one stimulation point, then on every plant with two, by index.
    pub cases: Vec<Case>,
    /// Results on the nominal wearer, with one stimulation point and with two.
    pub nominal: Vec<Case>,
}

/// Score of one contender over all plants, with one stimulation point or with two.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Score {
    /// Mean RMSE over the plants on which it was not refused, °.
    pub mean: f64,
    /// 95th percentile of the RMSE over the plants on which it was not refused, °.
    pub p95: f64,
    /// Mean difference between the RMSE and that of the offline optimum on the same plant, °.
    pub regret: f64,
    /// 95th percentile of the difference between the RMSE and that of the offline optimum, °.
    pub regret_p95: f64,
    /// Mean RMSE over the plants that can reach the whole reference, °.
    pub reaching: f64,
    /// 95th percentile of the RMSE over the plants that can reach the whole reference, °.
    pub reaching_p95: f64,
    /// RMSE on the nominal wearer, °.
    pub nominal: f64,
    /// Mean difference between the RMSE and that of the best PID on the same plant, °, with its
    /// interval. Plants on which the contender was refused are left out.
    pub against_pid: Interval,
}

fn case(
    exercise: &Exercise,
    contenders: &[Contender],
    is_optimum_wanted: bool,
) -> Result<Case, TrackingError> {
    let outcomes = contenders.iter().map(|c| c.attempt(exercise));
    let outcomes: Vec<Outcome> = outcomes.collect::<Result<_, _>>()?;
    let finger = &exercise.plant.finger;
    Ok(Case {
        points: exercise.points,
        kind: exercise.kind,
        strength: finger.strength(),
        delay_ms: f64::from(finger.finger.electromechanical_delay_us) / 1000.0,
        unreachable: exercise.reachable.unreachable,
        optimum: is_optimum_wanted
            .then(|| best_possible(exercise, contenders, &outcomes))
            .transpose()?,
        outcomes,
    })
}

/// Searches the offline optimum, also starting from the efforts of the best contender, and returns
/// its RMSE, °.
fn best_possible(
    exercise: &Exercise,
    contenders: &[Contender],
    outcomes: &[Outcome],
) -> Result<f64, TrackingError> {
    let tracked = contenders.iter().zip(outcomes);
    let tracked = tracked.filter(|(_, outcome)| outcome.refused.is_none());
    let best = tracked.min_by(|a, b| a.1.rmse.total_cmp(&b.1.rmse));
    let known = best.map(|(law, _)| law.efforts(exercise)).transpose()?;
    let (plant, points) = (&exercise.plant, exercise.points);
    Ok(optimum(plant, points, &exercise.reachable.angles, known)?.rmse)
}

impl Campaign {
    /// Runs every contender on every plant, with one stimulation point and with two. No plant is
    /// excluded. The same plan gives bit-identical numbers.
    ///
    /// # Errors
    /// Returns [`TrackingError`] if a plant or a contender is invalid.
    pub fn run(
        plan: Plan,
        contenders: Vec<Contender>,
        mut progress: impl FnMut(f64),
    ) -> Result<Self, TrackingError> {
        let is_first = |i| i < plan.optimum_plants;
        let nominal = || Plant::nominal(plan.seed);
        let nominal = Points::ALL.map(|p| (p, nominal(), plan.course, is_first(0)));
        let drawn = Points::ALL.into_iter().flat_map(|points| {
            (0..plan.plants).map(move |i| {
                let plant = plan.wearers.plant(plan.seed, i);
                let course = plan.wearers.course(plan.course, plan.seed, i);
                (points, plant, course, is_first(i))
            })
        });
        let tasks: Vec<_> = nominal.into_iter().chain(drawn).collect();
        let mut cases = Vec::with_capacity(tasks.len());
        for some in tasks.chunks(4 * rayon::current_num_threads()) {
            let done = some.par_iter().map(|(points, plant, course, is_first)| {
                let exercise = Exercise::new(plant.clone(), *points, *course)?;
                case(&exercise, &contenders, *is_first)
            });
            cases.extend(done.collect::<Result<Vec<_>, _>>()?);
            progress(cases.len() as f64 / tasks.len() as f64);
        }
        let drawn = cases.split_off(Points::ALL.len());
        Ok(Self {
            plan,
            cycles: vec![None; contenders.len()],
            contenders,
            cases: drawn,
            nominal: cases,
        })
    }

    /// Returns the cases with these stimulation points.
    pub fn cases_with(&self, points: Points) -> Vec<&Case> {
        self.cases.iter().filter(|c| c.points == points).collect()
    }

    /// Returns the mean part of the scored time at which the reference is out of reach, and the
    /// part of the plants that can reach the whole reference.
    pub fn reach(&self, points: Points) -> (f64, f64) {
        let shares: Vec<f64> = self
            .cases_with(points)
            .iter()
            .map(|c| c.unreachable)
            .collect();
        let reaching = shares.iter().filter(|s| **s < WHOLLY).count();
        (mean(&shares), reaching as f64 / shares.len().max(1) as f64)
    }

    /// Returns mean and 95th percentile of the optimum's RMSE over the plants for which it was
    /// searched, °.
    pub fn optimum(&self, points: Points) -> (f64, f64) {
        let cases = self.cases_with(points).into_iter();
        let optima: Vec<f64> = cases.filter_map(|c| c.optimum).collect();
        (mean(&optima), percentile(&optima, 0.95))
    }

    /// Returns by how much a contender is better than the optimum at most, °. A positive result
    /// shows that the search did not find the true optimum.
    pub fn margin_below_optimum(&self) -> f64 {
        let by = |c: &Case| {
            let tracked = c.outcomes.iter().filter(|o| o.refused.is_none());
            let optimum = c.optimum.unwrap_or(f64::MIN);
            tracked.map(|o| optimum - o.rmse).fold(f64::MIN, f64::max)
        };
        self.cases.iter().map(by).fold(f64::MIN, f64::max)
    }

    /// Returns the cases with these stimulation points in which a contender was not refused.
    fn tracked(&self, points: Points, contender: usize) -> Vec<&Case> {
        let mut cases = self.cases_with(points);
        cases.retain(|c| c.outcomes[contender].refused.is_none());
        cases
    }

    fn rmse(&self, points: Points, contender: usize) -> Vec<f64> {
        let cases = self.tracked(points, contender).into_iter();
        cases.map(|c| c.outcomes[contender].rmse).collect()
    }

    /// Returns the index of the default controller among the contenders, or `None` if it does not
    /// take part.
    pub fn shipped(&self) -> Option<usize> {
        let is = |c: &Contender| matches!(c, Contender::Shipped);
        self.contenders.iter().position(is)
    }

    /// Returns the index of the PID contender with the smallest mean RMSE; 0 if there is no PID.
    pub fn best_pid(&self, points: Points) -> usize {
        self.best(points, Contender::is_pid)
    }

    /// Returns the index of the contender with the smallest mean RMSE among those for which `among`
    /// holds; 0 if there is none.
    pub fn best(&self, points: Points, among: impl Fn(&Contender) -> bool) -> usize {
        let mean_rmse = |n: &usize| mean(&self.rmse(points, *n));
        let some = (0..self.contenders.len()).filter(|n| among(&self.contenders[*n]));
        some.min_by(|a, b| mean_rmse(a).total_cmp(&mean_rmse(b)))
            .unwrap_or(0)
    }

    pub fn score(&self, points: Points, contender: usize) -> Score {
        let cases = self.tracked(points, contender);
        let rmse = |c: &Case| c.outcomes[contender].rmse;
        let errors: Vec<f64> = cases.iter().map(|c| rmse(c)).collect();
        let regrets = cases.iter().filter_map(|c| Some(rmse(c) - c.optimum?));
        let regrets: Vec<f64> = regrets.collect();
        let reaching = cases.iter().filter(|c| c.unreachable < WHOLLY);
        let reaching: Vec<f64> = reaching.map(|c| rmse(c)).collect();
        let nominal = self.nominal.iter().find(|c| c.points == points);
        // Pairs the cases that neither refused; a law in floats never refuses.
        let pid = self.best_pid(points);
        let theirs: Vec<f64> = cases.iter().map(|c| c.outcomes[pid].rmse).collect();
        Score {
            mean: mean(&errors),
            p95: percentile(&errors, 0.95),
            regret: mean(&regrets),
            regret_p95: percentile(&regrets, 0.95),
            reaching: mean(&reaching),
            reaching_p95: percentile(&reaching, 0.95),
            nominal: nominal.map_or(f64::NAN, rmse),
            against_pid: paired(&errors, &theirs),
        }
    }
}
