//! The search that gives every law its numbers: the same seed, the same plants,
//! the same number of evaluations for each.

use super::TrackingError;
use super::candidate::{Candidate, Equipment, Genome};
use super::exercise::Exercise;
use super::plant::Plant;
use super::target::Course;
use super::trial::run;
use super::wearer::Points;
use hal_sim::body::random_finger::Draws;
use methods::control::Form;
use rayon::prelude::*;

/// Draws of the training plants and of the search itself. Campaigns refuse it.
pub const TRAINING_SEED: u64 = 0x7EAC;
/// Plants every evaluation runs on, one- and two-point: the nominal wearer and
/// so many others.
pub const TRAINING_PLANTS: u64 = 15;
/// An evaluation is broken off after this many plants if it is worse than the
/// worst parent by [`HOPELESS`] by then; it counts as one all the same.
const GLANCE: usize = 5;
const HOPELESS: f64 = 1.3;
/// The best so many are the parents of what is tried next.
const PARENTS: usize = 6;
/// Tried at once, however many cores there are: what is tried next depends on them.
const BATCH: usize = 8;

/// What all laws are trained on.
#[derive(Debug)]
pub struct Training {
    /// In groups of one- and two-point for each plant.
    exercises: Vec<Exercise>,
}

/// The best numbers found for one law.
#[derive(Clone, PartialEq, Debug)]
pub struct Found {
    /// The law with them.
    pub candidate: Candidate,
    /// Quadratic mean of the RMSE over the training plants, one- and two-point,
    /// degrees.
    pub cost: f64,
}

impl Training {
    /// The training plants.
    ///
    /// # Errors
    /// [`TrackingError`] if one cannot be.
    pub fn new() -> Result<Self, TrackingError> {
        let drawn = (0..TRAINING_PLANTS).map(|i| Plant::drawn(TRAINING_SEED, i));
        let mut exercises = Vec::new();
        for plant in std::iter::once(Plant::nominal(TRAINING_SEED)).chain(drawn) {
            for points in Points::ALL {
                exercises.push(Exercise::new(plant.clone(), points, Course::Sine)?);
            }
        }
        Ok(Self { exercises })
    }

    /// Quadratic mean of the RMSE, degrees; given up once `is_hopeless` says so
    /// of the mean of the first plants.
    ///
    /// # Errors
    /// [`TrackingError`] if the candidate is no law.
    pub fn cost(
        &self,
        candidate: &Candidate,
        is_hopeless: impl Fn(f64) -> bool,
    ) -> Result<f64, TrackingError> {
        let mut sum = 0.0;
        for (n, exercise) in self.exercises.iter().enumerate() {
            let mut driver = candidate.driver::<f64>(exercise.points)?;
            let attempt = run(&exercise.plant, &mut driver, &exercise.wanted)?;
            sum += exercise.rmse(&attempt.angles).powi(2);
            if n + 1 == GLANCE * Points::ALL.len() && is_hopeless((sum / (n + 1) as f64).sqrt()) {
                return Ok(f64::INFINITY);
            }
        }
        Ok((sum / self.exercises.len() as f64).sqrt())
    }

    /// Looks for a law's best numbers in exactly `evaluations`: first with the
    /// device's default, the rest of the first third anywhere, then around the best, ever closer. Two at a time; the result
    /// does not depend on which is done first.
    ///
    /// # Errors
    /// [`TrackingError`] if a candidate is no law.
    pub fn search(
        &self,
        form: Form,
        equipment: Equipment,
        evaluations: usize,
        mut progress: impl FnMut(f64),
    ) -> Result<Option<Found>, TrackingError> {
        let mut draws = Draws::new(TRAINING_SEED, 0, 5);
        let names: Vec<_> = Genome::parameters().iter().map(|p| p.name).collect();
        let mut best: Vec<(f64, Genome)> = Vec::new();
        let broad = evaluations / 3;
        let mut done = 0;
        while done < evaluations {
            let batch = (evaluations - done).min(BATCH);
            let tried: Vec<Genome> = (done..done + batch)
                .map(|n| {
                    if n == 0 {
                        Genome::of_default(form)
                    } else if n < broad || best.is_empty() {
                        anywhere(&names, &mut draws)
                    } else {
                        let rest = (n - broad) as f64 / (evaluations - broad) as f64;
                        near(&best, 0.25 * (1.0 - rest) + 0.03, &mut draws)
                    }
                })
                .collect();
            let bar = match best.last() {
                Some((worst, _)) if best.len() == PARENTS => worst * HOPELESS,
                _ => f64::INFINITY,
            };
            let costs = tried.into_par_iter().map(|genome| {
                let candidate = genome.candidate(form, equipment);
                Ok((self.cost(&candidate, |glance| glance > bar)?, genome))
            });
            best.extend(costs.collect::<Result<Vec<_>, TrackingError>>()?);
            best.sort_by(|a, b| a.0.total_cmp(&b.0));
            best.truncate(PARENTS);
            done += batch;
            progress(done as f64 / evaluations as f64);
        }
        Ok(best.into_iter().next().map(|(cost, genome)| Found {
            candidate: genome.candidate(form, equipment),
            cost,
        }))
    }
}

fn anywhere(names: &[&'static str], draws: &mut Draws) -> Genome {
    Genome {
        places: names.iter().map(|n| (*n, draws.even(0.0, 1.0))).collect(),
        choices: [(); 6].map(|()| draws.even(0.0, 1.0)),
    }
}

/// Near one of the parents, the best of them most often.
fn near(parents: &[(f64, Genome)], spread: f64, draws: &mut Draws) -> Genome {
    let which = draws.even(0.0, 1.0).powi(2) * parents.len() as f64;
    let (_, parent) = &parents[(which as usize).min(parents.len() - 1)];
    let mut child = parent.clone();
    for place in child.places.values_mut() {
        *place = (*place + draws.even(-spread, spread)).clamp(0.0, 1.0);
    }
    for choice in &mut child.choices {
        if draws.even(0.0, 1.0) < 0.1 {
            *choice = draws.even(0.0, 1.0);
        }
    }
    child
}
