//! How much a coarser simulated limb moves or pushes differently from the most detailed one.

use super::play::{PlayError, play_trial};
use crate::record::Samples;
use crate::session::Session;
use crate::statistics::range;
use rayon::prelude::*;

/// Plays each of `levels`, the most detailed first, with each of these seeds of the wearer's noise.
/// Returns for each level the largest root mean square difference from the first, over all seeds: of
/// the true force at an arm's hand where a support holds it, as a share of the largest true force,
/// and else of the true angle, as a share of the reference's range. That of the first level is 0.
///
/// # Errors
/// Returns [`PlayError`] if a session cannot be played.
pub(super) fn largest_deviations(levels: &[Session], seeds: &[u64]) -> Result<Vec<f64>, PlayError> {
    let mut largest = vec![0.0; levels.len()];
    for seed in seeds {
        let played = levels.par_iter().map(|level| {
            let trial = play_trial(level, *seed)?;
            Ok(trial.samples)
        });
        let played: Vec<Samples> = played.collect::<Result<_, PlayError>>()?;
        for (largest, own) in largest.iter_mut().zip(&played) {
            let deviation = force_deviation(&played[0], own)
                .unwrap_or_else(|| angle_deviation(&played[0], own));
            *largest = f64::max(*largest, deviation);
        }
    }
    Ok(largest)
}

/// Returns the root mean square length of the difference between the true forces at the hand in two
/// plays, as a share of the largest true force in `full`. Returns `None` if no true force is
/// recorded.
fn force_deviation(full: &Samples, own: &Samples) -> Option<f64> {
    let forces = |samples: &Samples| -> Vec<[f64; 3]> {
        samples
            .map_each(|sample| vector(&sample.hand_true_n))
            .flatten()
            .collect()
    };
    let (full_n, own_n) = (forces(full), forces(own));
    let pairs = full_n.iter().zip(&own_n);
    let rms = rms(pairs.map(|(a, b)| length([a[0] - b[0], a[1] - b[1], a[2] - b[2]])));
    let largest = full_n.iter().map(|force| length(*force)).reduce(f64::max)?;
    Some(share(rms, largest))
}

/// Returns the root mean square difference between the true angles of two plays, as a share of the
/// range of the reference angle; without a reference, of the true angle's range in `full`.
fn angle_deviation(full: &Samples, own: &Samples) -> f64 {
    let angles =
        |samples: &Samples| -> Vec<f64> { samples.map_each(|s| s.true_deg).flatten().collect() };
    let (full_deg, own_deg) = (angles(full), angles(own));
    let rms = rms(full_deg.iter().zip(&own_deg).map(|(a, b)| a - b));
    let reference = range(full.map_each(|s| s.target_deg).flatten());
    let (low, high) = reference
        .or(range(full_deg.into_iter()))
        .unwrap_or_default();
    share(rms, high - low)
}

fn rms(differences: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0u32);
    for difference in differences {
        sum += difference * difference;
        count += 1;
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// Returns `rms` as a share of `scale`. If that is 0, returns 1 for any difference and 0 for none.
fn share(rms: f64, scale: f64) -> f64 {
    match scale > 0.0 {
        true => rms / scale,
        false => f64::from(u8::from(rms > 0.0)),
    }
}

/// Returns the force as a vector; `None` if a component is missing.
fn vector(force_n: &[Option<f64>]) -> Option<[f64; 3]> {
    match force_n {
        [Some(x), Some(y), Some(z)] => Some([*x, *y, *z]),
        _ => None,
    }
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}
