//! The search that gives every law its numbers: the same seed, the same plants,
//! the same number of evaluations for each.

use super::TrackingError;
use super::candidate::{Candidate, Equipment, Genome};
use super::default;
use super::driver::{Device, Driver};
use super::exercise::{Exercise, Wearers};
use super::plant::Plant;
use super::target::Course;
use super::trial::run;
use super::wearer::Points;
use hal_sim::body::random_finger::Draws;
use methods::control::Form;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Draws of the training plants and of the search itself. Campaigns refuse it.
pub const TRAINING_SEED: u64 = 0x7EAC;
/// Plants every evaluation runs on, one- and two-point: the nominal wearer and so
/// many of the earlier wearers, and so many of the widened.
pub const TRAINING_PLANTS: (u64, u64) = (7, 12);
/// An evaluation is broken off after this many exercises if it is worse than the
/// worst parent by [`HOPELESS`] by then; it counts as one all the same.
const GLANCE: usize = 14;
const HOPELESS: f64 = 1.3;
/// The best so many are the parents of what is tried next.
const PARENTS: usize = 6;
/// Tried at once, however many cores there are: what is tried next depends on them.
const BATCH: usize = 8;

/// What all laws are trained on.
#[derive(Debug)]
pub struct Training {
    exercises: Vec<(Wearers, Exercise)>,
}

/// The best numbers found for one law.
#[derive(Clone, PartialEq, Debug)]
pub struct Found<T> {
    /// The law with them.
    pub candidate: T,
    /// What [`Training::cost`] says of it, degrees.
    pub cost: f64,
}

/// Quadratic means of the RMSE on earlier and on widened wearers, degrees.
#[derive(Clone, Copy, Default)]
struct Sums([(f64, u32); 2]);

impl Sums {
    fn take(&mut self, wearers: Wearers, rmse: f64) {
        let [earlier, widened] = &mut self.0;
        let (sum, n) = match wearers {
            Wearers::Earlier => earlier,
            Wearers::Widened => widened,
        };
        *sum += rmse.powi(2);
        *n += 1;
    }

    /// Their geometric mean: a hundredth less of either counts the same.
    fn cost(&self) -> f64 {
        let mean = |(sum, n): (f64, u32)| sum / f64::from(n.max(1));
        let [earlier, widened] = self.0.map(mean);
        (earlier * widened).sqrt().sqrt()
    }
}

impl Training {
    /// The training plants, both kinds in turn.
    ///
    /// # Errors
    /// [`TrackingError`] if one cannot be.
    pub fn new() -> Result<Self, TrackingError> {
        let (earlier, widened) = TRAINING_PLANTS;
        let nominal = (
            Wearers::Earlier,
            Plant::nominal(TRAINING_SEED),
            Course::Sine,
        );
        let mut plants = vec![nominal];
        for i in 0..earlier.max(widened) {
            for (wearers, count) in [(Wearers::Widened, widened), (Wearers::Earlier, earlier)] {
                if i < count {
                    let course = wearers.course(Course::Sine, TRAINING_SEED, i);
                    plants.push((wearers, wearers.plant(TRAINING_SEED, i), course));
                }
            }
        }
        let mut exercises = Vec::new();
        for (wearers, plant, course) in plants {
            for points in Points::ALL {
                exercises.push((wearers, Exercise::new(plant.clone(), points, course)?));
            }
        }
        Ok(Self { exercises })
    }

    /// Geometric mean of two quadratic means of the RMSE, degrees: over the earlier
    /// and over the widened training plants, one- and two-point. Infinite once
    /// `is_hopeless` says so of the first exercises'.
    ///
    /// # Errors
    /// [`TrackingError`] if the candidate is no law.
    pub fn cost(
        &self,
        driver: impl Fn(Points) -> Result<Box<dyn Driver>, TrackingError>,
        is_hopeless: impl Fn(f64) -> bool,
    ) -> Result<f64, TrackingError> {
        let mut sums = Sums::default();
        for (n, (wearers, exercise)) in self.exercises.iter().enumerate() {
            let mut driver = driver(exercise.points)?;
            let attempt = run(&exercise.plant, &mut *driver, &exercise.wanted)?;
            sums.take(*wearers, exercise.rmse(&attempt.angles));
            if n + 1 == GLANCE && is_hopeless(sums.cost()) {
                return Ok(f64::INFINITY);
            }
        }
        Ok(sums.cost())
    }

    /// The best numbers of a law in floats, in exactly `evaluations`.
    ///
    /// # Errors
    /// [`TrackingError`] if a candidate is no law.
    pub fn search(
        &self,
        form: Form,
        equipment: Equipment,
        evaluations: usize,
        progress: impl FnMut(f64),
    ) -> Result<Option<Found<Candidate>>, TrackingError> {
        let names: Vec<_> = Genome::parameters().iter().map(|p| p.name).collect();
        let driver = |genome: &Genome, points| -> Result<Box<dyn Driver>, _> {
            Ok(Box::new(
                genome.candidate(form, equipment).driver::<f64>(points)?,
            ))
        };
        let first = Genome::of_default(form);
        let best = self.best(&names, first, driver, evaluations, progress)?;
        Ok(best.map(|(cost, genome)| Found {
            candidate: genome.candidate(form, equipment),
            cost,
        }))
    }

    /// The best numbers of the device's default in fixed point, by their names, in
    /// exactly `evaluations`.
    ///
    /// # Errors
    /// [`TrackingError`] if the device refuses numbers within the bounds.
    pub fn search_default(
        &self,
        evaluations: usize,
        progress: impl FnMut(f64),
    ) -> Result<Option<Found<BTreeMap<String, f64>>>, TrackingError> {
        let all = &default::PARAMETERS;
        let names = all.map(|p| p.name);
        let shipped = default::shipped();
        let first = Genome::at(|name| shipped.get(name).copied(), all);
        let driver = |genome: &Genome, points| -> Result<Box<dyn Driver>, _> {
            let spec = default::joint(&genome.values(all), points);
            Ok(Box::new(Device::new(&spec)?))
        };
        let best = self.best(&names, first, driver, evaluations, progress)?;
        Ok(best.map(|(cost, genome)| Found {
            candidate: genome.values(all),
            cost,
        }))
    }

    /// First `first`, the rest of the first third anywhere, then around the best,
    /// ever closer. A batch at a time; the result does not depend on which is done
    /// first.
    fn best(
        &self,
        names: &[&'static str],
        first: Genome,
        driver: impl Fn(&Genome, Points) -> Result<Box<dyn Driver>, TrackingError> + Sync,
        evaluations: usize,
        mut progress: impl FnMut(f64),
    ) -> Result<Option<(f64, Genome)>, TrackingError> {
        let mut draws = Draws::new(TRAINING_SEED, 0, 5);
        let mut best: Vec<(f64, Genome)> = Vec::new();
        let broad = evaluations / 3;
        let mut done = 0;
        while done < evaluations {
            let batch = (evaluations - done).min(BATCH);
            let tried: Vec<Genome> = (done..done + batch)
                .map(|n| {
                    if n == 0 {
                        first.clone()
                    } else if n < broad || best.is_empty() {
                        anywhere(names, &mut draws)
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
                let cost = self.cost(|points| driver(&genome, points), |glance| glance > bar)?;
                Ok((cost, genome))
            });
            best.extend(costs.collect::<Result<Vec<_>, TrackingError>>()?);
            best.sort_by(|a, b| a.0.total_cmp(&b.0));
            best.truncate(PARENTS);
            done += batch;
            progress(done as f64 / evaluations as f64);
        }
        Ok(best.into_iter().next())
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
