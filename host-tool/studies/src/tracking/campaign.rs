//! All contenders on the same random plants.

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

/// A plant of which less than this part of the target is out of reach counts as
/// one that can reach it.
const WHOLLY: f64 = 0.005;

/// Which plants, which target.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// Decides the plants.
    pub seed: u64,
    /// How many.
    pub plants: u64,
    /// From which population.
    pub wearers: Wearers,
    /// What the earlier wearers, and the nominal one, are to follow.
    pub course: Course,
    /// On how many of them, the first drawn, to look for the offline optimum: it
    /// takes most of the time.
    pub optimum_plants: u64,
}

/// One plant with its points: what each contender made of it. Degrees.
#[derive(Clone, PartialEq, Debug)]
pub struct Case {
    /// Its points.
    pub points: Points,
    /// How its course is judged.
    pub kind: Kind,
    /// Its strength over the nominal wearer's.
    pub strength: f64,
    /// Its electromechanical delay, ms.
    pub delay_ms: f64,
    /// Part of the scored time in which the target is out of reach.
    pub unreachable: f64,
    /// RMSE of the offline optimum, if it was looked for.
    pub optimum: Option<f64>,
    /// How it went for each contender.
    pub outcomes: Vec<Outcome>,
}

/// What a campaign found.
#[derive(Clone, PartialEq, Debug)]
pub struct Campaign {
    /// What was done.
    pub plan: Plan,
    /// Who took part.
    pub contenders: Vec<Contender>,
    /// Cycles of each one in a tick in which its law runs, where measured
    /// ([`super::cost::Cost`]).
    pub cycles: Vec<Option<Cycles>>,
    /// Every plant one-point, then every plant two-point, in order of drawing.
    pub cases: Vec<Case>,
    /// The nominal wearer, one- and two-point.
    pub nominal: Vec<Case>,
}

/// One contender with one number of points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Score {
    /// Mean RMSE over all plants it did not refuse, degrees.
    pub mean: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Mean of RMSE - the optimum's on the same plant, where it was looked for.
    pub regret: f64,
    /// 95th percentile of it.
    pub regret_p95: f64,
    /// Mean RMSE over the plants that can reach the target everywhere.
    pub reaching: f64,
    /// 95th percentile over these.
    pub reaching_p95: f64,
    /// RMSE on the nominal wearer.
    pub nominal: f64,
    /// RMSE - the best PID variant's on the same plant, over all plants.
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

/// RMSE of the offline optimum, which knows what the best contender did.
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
    /// Runs every contender on every plant, one- and two-point. No draw is
    /// dropped. The same plan gives the same numbers, to the bit.
    ///
    /// # Errors
    /// [`TrackingError`] if a plant or a contender cannot be.
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
        let all: Vec<_> = nominal.into_iter().chain(drawn).collect();
        let mut cases = Vec::with_capacity(all.len());
        for some in all.chunks(4 * rayon::current_num_threads()) {
            let done = some.par_iter().map(|(points, plant, course, is_first)| {
                let exercise = Exercise::new(plant.clone(), *points, *course)?;
                case(&exercise, &contenders, *is_first)
            });
            cases.extend(done.collect::<Result<Vec<_>, _>>()?);
            progress(cases.len() as f64 / all.len() as f64);
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

    /// The cases with these points.
    pub fn cases_with(&self, points: Points) -> Vec<&Case> {
        self.cases.iter().filter(|c| c.points == points).collect()
    }

    /// Mean part of the scored time in which the target is out of reach, and the
    /// part of the plants that can reach all of it.
    pub fn reach(&self, points: Points) -> (f64, f64) {
        let shares: Vec<f64> = self
            .cases_with(points)
            .iter()
            .map(|c| c.unreachable)
            .collect();
        let reaching = shares.iter().filter(|s| **s < WHOLLY).count();
        (mean(&shares), reaching as f64 / shares.len().max(1) as f64)
    }

    /// Mean RMSE of the optimum where it was looked for, and its 95th percentile.
    pub fn optimum(&self, points: Points) -> (f64, f64) {
        let cases = self.cases_with(points).into_iter();
        let all: Vec<f64> = cases.filter_map(|c| c.optimum).collect();
        (mean(&all), percentile(&all, 0.95))
    }

    /// By how much a contender beats the optimum at most, degrees; what is above
    /// zero is how far the optimum is from one.
    pub fn margin_below_optimum(&self) -> f64 {
        let by = |c: &Case| {
            let tracked = c.outcomes.iter().filter(|o| o.refused.is_none());
            let optimum = c.optimum.unwrap_or(f64::MIN);
            tracked.map(|o| optimum - o.rmse).fold(f64::MIN, f64::max)
        };
        self.cases.iter().map(by).fold(f64::MIN, f64::max)
    }

    /// The cases with these points that a contender did not refuse.
    fn tracked(&self, points: Points, contender: usize) -> Vec<&Case> {
        let mut cases = self.cases_with(points);
        cases.retain(|c| c.outcomes[contender].refused.is_none());
        cases
    }

    fn rmse(&self, points: Points, contender: usize) -> Vec<f64> {
        let cases = self.tracked(points, contender).into_iter();
        cases.map(|c| c.outcomes[contender].rmse).collect()
    }

    /// The device's default, if it takes part.
    pub fn shipped(&self) -> Option<usize> {
        let is = |c: &Contender| matches!(c, Contender::Shipped);
        self.contenders.iter().position(is)
    }

    /// The PID variant with the least mean RMSE; the first contender if there is
    /// no PID.
    pub fn best_pid(&self, points: Points) -> usize {
        self.best(points, Contender::is_pid)
    }

    /// The contender with the least mean RMSE among some.
    pub fn best(&self, points: Points, among: impl Fn(&Contender) -> bool) -> usize {
        let of = |n: &usize| mean(&self.rmse(points, *n));
        let some = (0..self.contenders.len()).filter(|n| among(&self.contenders[*n]));
        some.min_by(|a, b| of(a).total_cmp(&of(b))).unwrap_or(0)
    }

    /// A contender's score.
    pub fn score(&self, points: Points, contender: usize) -> Score {
        let cases = self.tracked(points, contender);
        let rmse = |c: &Case| c.outcomes[contender].rmse;
        let all: Vec<f64> = cases.iter().map(|c| rmse(c)).collect();
        let regrets = cases.iter().filter_map(|c| Some(rmse(c) - c.optimum?));
        let regrets: Vec<f64> = regrets.collect();
        let reaching = cases.iter().filter(|c| c.unreachable < WHOLLY);
        let reaching: Vec<f64> = reaching.map(|c| rmse(c)).collect();
        let nominal = self.nominal.iter().find(|c| c.points == points);
        // Paired over those that neither refused: a float never does.
        let pid = self.best_pid(points);
        let theirs: Vec<f64> = cases.iter().map(|c| c.outcomes[pid].rmse).collect();
        Score {
            mean: mean(&all),
            p95: percentile(&all, 0.95),
            regret: mean(&regrets),
            regret_p95: percentile(&regrets, 0.95),
            reaching: mean(&reaching),
            reaching_p95: percentile(&reaching, 0.95),
            nominal: nominal.map_or(f64::NAN, rmse),
            against_pid: paired(&all, &theirs),
        }
    }
}
