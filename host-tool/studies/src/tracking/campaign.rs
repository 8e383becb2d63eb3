//! All contenders on the same random plants.

use super::TrackingError;
use super::contender::Contender;
use super::optimum::optimum;
use super::plant::Plant;
use super::reach::Reachable;
use super::statistics::{Interval, mean, paired, percentile};
use super::target::Course;
use super::trial::{TRIAL_MS, rmse};
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
    /// What is to be followed.
    pub course: Course,
}

/// One plant with its points: what each contender made of it. Degrees.
#[derive(Clone, PartialEq, Debug)]
pub struct Case {
    /// Its points.
    pub points: Points,
    /// Part of the scored time in which the target is out of reach.
    pub unreachable: f64,
    /// RMSE of the offline optimum.
    pub optimum: f64,
    /// RMSE of each contender.
    pub rmse: Vec<f64>,
}

/// What a campaign found.
#[derive(Clone, PartialEq, Debug)]
pub struct Campaign {
    /// What was done.
    pub plan: Plan,
    /// Who took part.
    pub contenders: Vec<Contender>,
    /// Cycles of each one's law in a tick in which it runs, where measured
    /// ([`super::cost::Cost`]).
    pub cycles: Vec<Option<u64>>,
    /// Every plant one-point, then every plant two-point, in order of drawing.
    pub cases: Vec<Case>,
    /// The nominal wearer, one- and two-point.
    pub nominal: Vec<Case>,
}

/// One contender with one number of points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Score {
    /// Mean RMSE over all plants, degrees.
    pub mean: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Mean of RMSE - the optimum's on the same plant.
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
    plant: &Plant,
    points: Points,
    wanted: &[f64],
    contenders: &[Contender],
) -> Result<Case, TrackingError> {
    let reachable = Reachable::new(plant, points, wanted)?;
    let score = |contender: &Contender| {
        let angles = contender.track(plant, points, wanted)?;
        Ok::<_, TrackingError>(rmse(&angles, &reachable.angles))
    };
    let rmse: Vec<f64> = contenders.iter().map(score).collect::<Result<_, _>>()?;
    let best = contenders
        .iter()
        .zip(&rmse)
        .min_by(|a, b| a.1.total_cmp(b.1));
    let known = best.map(|(law, _)| law.efforts(plant, points, wanted));
    Ok(Case {
        points,
        unreachable: reachable.unreachable,
        optimum: optimum(plant, points, &reachable.angles, known.transpose()?)?.rmse,
        rmse,
    })
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
        let wanted = plan.course.angles(TRIAL_MS);
        let both = |plant: &Plant| Points::ALL.map(|points| (points, plant.clone()));
        let nominal = both(&Plant::nominal(plan.seed));
        let drawn = Points::ALL
            .into_iter()
            .flat_map(|points| (0..plan.plants).map(move |i| (points, Plant::drawn(plan.seed, i))));
        let all: Vec<_> = nominal.into_iter().chain(drawn).collect();
        let mut cases = Vec::with_capacity(all.len());
        for some in all.chunks(4 * rayon::current_num_threads()) {
            let each = some.par_iter();
            let done = each.map(|(points, plant)| case(plant, *points, &wanted, &contenders));
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
    fn with(&self, points: Points) -> Vec<&Case> {
        self.cases.iter().filter(|c| c.points == points).collect()
    }

    /// Mean part of the scored time in which the target is out of reach, and the
    /// part of the plants that can reach all of it.
    pub fn reach(&self, points: Points) -> (f64, f64) {
        let shares: Vec<f64> = self.with(points).iter().map(|c| c.unreachable).collect();
        let reaching = shares.iter().filter(|s| **s < WHOLLY).count();
        (mean(&shares), reaching as f64 / shares.len().max(1) as f64)
    }

    /// Mean RMSE of the optimum over all plants, and its 95th percentile.
    pub fn optimum(&self, points: Points) -> (f64, f64) {
        let all: Vec<f64> = self.with(points).iter().map(|c| c.optimum).collect();
        (mean(&all), percentile(&all, 0.95))
    }

    /// By how much a contender beats the optimum at most, degrees; what is above
    /// zero is how far the optimum is from one.
    pub fn beaten_by(&self) -> f64 {
        let by = |c: &Case| {
            c.rmse
                .iter()
                .map(|r| c.optimum - r)
                .fold(f64::MIN, f64::max)
        };
        self.cases.iter().map(by).fold(f64::MIN, f64::max)
    }

    fn rmse(&self, points: Points, contender: usize) -> Vec<f64> {
        self.with(points)
            .iter()
            .map(|c| c.rmse[contender])
            .collect()
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
        let cases = self.with(points);
        let all = self.rmse(points, contender);
        let regrets: Vec<f64> = cases
            .iter()
            .map(|c| c.rmse[contender] - c.optimum)
            .collect();
        let reaching = cases.iter().filter(|c| c.unreachable < WHOLLY);
        let reaching: Vec<f64> = reaching.map(|c| c.rmse[contender]).collect();
        let nominal = self.nominal.iter().find(|c| c.points == points);
        Score {
            mean: mean(&all),
            p95: percentile(&all, 0.95),
            regret: mean(&regrets),
            regret_p95: percentile(&regrets, 0.95),
            reaching: mean(&reaching),
            reaching_p95: percentile(&reaching, 0.95),
            nominal: nominal.map_or(f64::NAN, |c| c.rmse[contender]),
            against_pid: paired(&all, &self.rmse(points, self.best_pid(points))),
        }
    }
}
