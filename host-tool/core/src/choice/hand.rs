//! How many motor units of each pool a simulated hand needs: found by playing the session with each
//! number.

use super::play::{PlayError, play_trial};
use crate::record::Samples;
use crate::session::{BodySpec, Session};
use crate::statistics::range;
use rayon::prelude::*;

/// Numbers of simulated motor units per pool that are tried besides every unit of the wearer, the
/// largest first.
pub const UNITS: [usize; 7] = [64, 32, 16, 8, 4, 2, 1];

/// Error that a number of motor units causes in a simulated hand.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UnitsEffect {
    /// Number of motor units that are simulated for each pool of the index finger.
    pub units: usize,
    /// Root mean square difference between the true angle with this number and with every unit, as
    /// a share of the range of the reference angle; without a reference, of the true angle's range
    /// with every unit.
    pub error: f64,
}

/// Returns the smallest number for which it and all larger numbers have an error of at most
/// `tolerance`; `None` if no number was tried.
#[must_use]
pub fn fewest_units(tried: &[UnitsEffect], tolerance: f64) -> Option<UnitsEffect> {
    let within = tried.iter().take_while(|effect| effect.error <= tolerance);
    within.last().or(tried.first()).copied()
}

/// Plays `session` with each number of motor units and each of these seeds of the sensor's noise.
/// Returns the largest error of each number over all seeds. The first number is that of the wearer,
/// whose error is 0. The list is empty without a simulated hand.
///
/// # Errors
/// Returns [`PlayError`] if the session cannot be played.
pub fn try_units(session: &Session, seeds: &[u64]) -> Result<Vec<UnitsEffect>, PlayError> {
    let Some(BodySpec::Hand(hand)) = &session.body else {
        return Ok(Vec::new());
    };
    let every = hand.spec.units;
    let fewer = UNITS.into_iter().filter(|units| *units < every);
    let numbers: Vec<usize> = std::iter::once(every).chain(fewer).collect();
    let mut effects: Vec<UnitsEffect> = numbers
        .iter()
        .map(|&units| UnitsEffect { units, error: 0.0 })
        .collect();
    for seed in seeds {
        let played = numbers.par_iter().map(|&units| {
            let trial = play_trial(&with_units(session, units), *seed)?;
            Ok(trial.samples)
        });
        let played: Vec<Samples> = played.collect::<Result<_, PlayError>>()?;
        for (effect, own) in effects.iter_mut().zip(&played) {
            effect.error = effect.error.max(relative_rms(&played[0], own));
        }
    }
    Ok(effects)
}

/// Returns `session` with a simulated hand that simulates at most `units` motor units for each pool.
#[must_use]
pub fn with_units(session: &Session, units: usize) -> Session {
    let mut session = session.clone();
    if let Some(BodySpec::Hand(hand)) = &mut session.body {
        hand.simulated_units = (units < hand.spec.units).then_some(units);
    }
    session
}

/// Returns the root mean square difference between the true angles of two plays, as a share of the
/// range of the reference angle, or of the angle in `full` if there is no reference. If that does
/// not vary, returns 1 for any difference and 0 for none.
fn relative_rms(full: &Samples, own: &Samples) -> f64 {
    let angles =
        |samples: &Samples| -> Vec<f64> { samples.map_each(|s| s.true_deg).flatten().collect() };
    let (full_deg, own_deg) = (angles(full), angles(own));
    let squares = full_deg.iter().zip(&own_deg).map(|(a, b)| (a - b).powi(2));
    let rms = (squares.sum::<f64>() / full_deg.len().max(1) as f64).sqrt();
    let reference = range(full.map_each(|s| s.target_deg).flatten());
    let (low, high) = reference
        .or(range(full_deg.into_iter()))
        .unwrap_or_default();
    match high > low {
        true => rms / (high - low),
        false => f64::from(u8::from(rms > 0.0)),
    }
}
