//! A task for a control law: a plant with its points and its reference, the reachable part of the
//! reference, and how an attempt is judged.

use super::TrackingError;
use super::plant::Plant;
use super::reach::Reachable;
use super::target::{Course, Kind, scored};
use super::trial::{Attempt, RIPPLE_FROM_MS, TRIAL_MS};
use super::wearer::Points;
use hal_sim::body::RandomFingerSpec;

/// RMSE from the reachable reference above which a law counts as failed on a wearer, °.
pub const FAILS_DEG: f64 = 3.0;
/// Largest RMS ripple that is allowed while an angle is held, °.
pub const RIPPLE_DEG: f64 = 0.2;

/// Population from which a campaign's wearers come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wearers {
    /// Wearers of [`RandomFingerSpec::random`], who all follow the reference of the campaign.
    Earlier,
    /// Wearers of the wide ranges of [`RandomFingerSpec::random_wide_range`]. Wearer `n` follows
    /// the reference [`Course::widened`].
    Widened,
}

impl Wearers {
    /// Returns plant `index` of the campaign with this seed.
    pub fn plant(self, seed: u64, index: u64) -> Plant {
        let earlier = Plant::random(seed, index);
        match self {
            Self::Earlier => earlier,
            Self::Widened => Plant {
                finger: RandomFingerSpec::random_wide_range(seed, index),
                ..earlier
            },
        }
    }

    /// Returns the reference of plant `index`: `everyone` for the earlier wearers, an own one for a
    /// widened wearer.
    pub fn course(self, everyone: Course, seed: u64, index: u64) -> Course {
        match self {
            Self::Earlier => everyone,
            Self::Widened => Course::widened(seed, index),
        }
    }

    /// Returns the name of the population in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Earlier => "earlier",
            Self::Widened => "widened",
        }
    }
}

/// A task for a control law: a plant with its reference.
#[derive(Clone, PartialEq, Debug)]
pub struct Exercise {
    /// Finger and link that the law drives.
    pub plant: Plant,
    /// Stimulation points that are in use.
    pub points: Points,
    /// Kind of the reference, which determines how an attempt is judged.
    pub kind: Kind,
    /// Reference at each millisecond of the trial, °.
    pub wanted: Vec<f64>,
    /// Reference as far as this plant can follow it; attempts are judged against it.
    pub reachable: Reachable,
    scored: Vec<bool>,
}

/// Ripple of a held angle: deviation of the true angle from its own mean in the last 3 s, which
/// start 3 s after the last disturbance. It does not contain the noise of the sensor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ripple {
    /// Root mean square of the deviation, °; [`RIPPLE_DEG`] is the largest allowed.
    pub rms_deg: f64,
    /// Difference between the largest and the smallest angle, °.
    pub peak_to_peak_deg: f64,
}

/// Outcome of a control law's attempt at an exercise.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// RMSE from the reachable reference over the scored time, °, even if the device refused or
    /// stopped.
    pub rmse: f64,
    /// Ripple of the held angle; `None` if the reference is not a hold.
    pub ripple: Option<Ripple>,
    /// Reason why the device refused or stopped; `None` if it did not.
    pub refused: Option<String>,
}

impl Outcome {
    /// Returns whether the law failed on this wearer: its RMSE exceeds [`FAILS_DEG`] although it
    /// was not refused.
    pub fn has_failed(&self) -> bool {
        self.refused.is_none() && self.rmse > FAILS_DEG
    }
}

impl Exercise {
    /// Creates the exercise of a plant with these points and this reference.
    ///
    /// # Errors
    /// Returns [`TrackingError`] if the plant is invalid.
    pub fn new(plant: Plant, points: Points, course: Course) -> Result<Self, TrackingError> {
        let wanted = course.angles(TRIAL_MS);
        Ok(Self {
            reachable: Reachable::new(&plant, points, &wanted)?,
            scored: scored(&wanted),
            kind: course.kind(),
            plant,
            points,
            wanted,
        })
    }

    /// Returns the RMSE between these angles, one per millisecond, and the reachable reference over
    /// the scored time, °.
    pub fn rmse(&self, angles: &[f32]) -> f64 {
        let pairs = angles.iter().zip(&self.reachable.angles).zip(&self.scored);
        let (sum, n) = pairs
            .filter(|(_, scored)| **scored)
            .fold((0.0, 0u32), |(sum, n), ((a, t), _)| {
                (sum + (f64::from(*a) - t).powi(2), n + 1)
            });
        (sum / f64::from(n.max(1))).sqrt()
    }

    /// Judges an attempt at this exercise.
    pub fn judge(&self, attempt: Attempt) -> Outcome {
        Outcome {
            rmse: self.rmse(&attempt.angles),
            ripple: (self.kind == Kind::Hold).then(|| ripple(&attempt.angles)),
            refused: attempt.refused,
        }
    }
}

fn ripple(angles: &[f32]) -> Ripple {
    let settled = angles.get(RIPPLE_FROM_MS..).unwrap_or_default();
    let settled = || settled.iter().map(|a| f64::from(*a));
    let n = settled().count().max(1) as f64;
    let mean = settled().sum::<f64>() / n;
    let square = settled().map(|a| (a - mean).powi(2)).sum::<f64>() / n;
    let highest = settled().fold(f64::MIN, f64::max);
    let lowest = settled().fold(f64::MAX, f64::min);
    Ripple {
        rms_deg: square.sqrt(),
        peak_to_peak_deg: (highest - lowest).max(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ripple_is_what_is_left_about_the_mean_of_the_last_three_seconds() {
        let swing = |n: usize| libm::sin(n as f64 * std::f64::consts::TAU / 250.0);
        let at = |n: usize| {
            if n < RIPPLE_FROM_MS {
                99.0
            } else {
                40.0 + 0.5 * swing(n)
            }
        };
        let angles: Vec<f32> = (0..TRIAL_MS).map(|n| at(n) as f32).collect();
        let found = ripple(&angles);
        assert!(
            (found.rms_deg - 0.5 / 2f64.sqrt()).abs() < 1e-3,
            "{found:?}"
        );
        assert!((found.peak_to_peak_deg - 1.0).abs() < 1e-3, "{found:?}");
    }
}
