//! A task for a control law: a plant with its points and its reference, the reachable part of the
//! reference, and how an attempt is judged.

use super::TrackingError;
use super::plant::Plant;
use super::reach::Reachable;
use super::target::{Course, Kind, scored};
use super::trial::{Attempt, RIPPLE_FROM_MS, TRIAL_MS};
use super::wearer::Points;
use hal_sim::body::RandomFingerSpec;

/// RMSE to the reachable reference above which a law fails a wearer, degrees.
pub const FAILS_DEG: f64 = 3.0;
/// Largest allowed ripple of a hold, RMS, degrees.
pub const RIPPLE_DEG: f64 = 0.2;

/// Population of a campaign's wearers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wearers {
    /// [`RandomFingerSpec::random`]; all follow the campaign's reference.
    Earlier,
    /// [`RandomFingerSpec::random_wide_range`]; wearer `n` follows [`Course::widened`].
    Widened,
}

impl Wearers {
    /// Returns plant `index` of campaign `seed`.
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

    /// Returns the reference of plant `index`; `everyone`, if all follow the same.
    pub fn course(self, everyone: Course, seed: u64, index: u64) -> Course {
        match self {
            Self::Earlier => everyone,
            Self::Widened => Course::widened(seed, index),
        }
    }

    /// Returns the name for tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Earlier => "earlier",
            Self::Widened => "widened",
        }
    }
}

/// A task for a law.
#[derive(Clone, PartialEq, Debug)]
pub struct Exercise {
    /// Plant to drive.
    pub plant: Plant,
    /// Stimulated points.
    pub points: Points,
    /// Kind of the reference.
    pub kind: Kind,
    /// Reference at each millisecond, degrees.
    pub wanted: Vec<f64>,
    /// Part of the reference that this plant can hold.
    pub reachable: Reachable,
    scored: Vec<bool>,
}

/// Deviation of the true angle from its own mean in the last 3 s of a hold, after the last
/// disturbance, without the sensor's noise.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ripple {
    /// Root mean square, degrees; [`RIPPLE_DEG`] is its bound.
    pub rms_deg: f64,
    /// Maximum minus minimum, degrees.
    pub peak_to_peak_deg: f64,
}

/// Outcome of an attempt.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// RMSE to the reachable reference over the scored part, degrees, also after a refusal.
    pub rmse: f64,
    /// Ripple, of a hold only.
    pub ripple: Option<Ripple>,
    /// The reason why the device refused or stopped, if it did.
    pub refused: Option<String>,
}

impl Outcome {
    /// Returns whether the RMSE exceeds [`FAILS_DEG`] without a refusal.
    pub fn has_failed(&self) -> bool {
        self.refused.is_none() && self.rmse > FAILS_DEG
    }
}

impl Exercise {
    /// Builds a plant's exercise for a reference.
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

    /// Returns the RMSE of these angles over the scored part, degrees.
    pub fn rmse(&self, angles: &[f32]) -> f64 {
        let pairs = angles.iter().zip(&self.reachable.angles).zip(&self.scored);
        let (sum, n) = pairs
            .filter(|(_, scored)| **scored)
            .fold((0.0, 0u32), |(sum, n), ((a, t), _)| {
                (sum + (f64::from(*a) - t).powi(2), n + 1)
            });
        (sum / f64::from(n.max(1))).sqrt()
    }

    /// Computes the outcome of an attempt.
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
        let swing = |n: usize| (n as f64 * std::f64::consts::TAU / 250.0).sin();
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
