//! How many motor units of each pool a simulated hand needs: found by playing the session with each
//! number.

use super::deviation::largest_deviations;
use super::effect::Effect;
use super::play::PlayError;
use crate::session::{BodySpec, Session};

/// Numbers of simulated motor units per pool that are tried besides every unit of the wearer, the
/// largest first.
pub const UNITS: [usize; 7] = [64, 32, 16, 8, 4, 2, 1];

/// Plays `session` with each number of motor units and each of these seeds of the sensor's noise.
/// Returns the largest error of each number over all seeds: the root mean square difference between
/// the true angle with this number and with every unit, as a share of the range of the reference
/// angle; without a reference, of the true angle's range with every unit. The first number is that
/// of the wearer, whose error is 0. The list is empty without a simulated hand.
///
/// # Errors
/// Returns [`PlayError`] if the session cannot be played.
pub fn try_units(session: &Session, seeds: &[u64]) -> Result<Vec<Effect>, PlayError> {
    let Some(BodySpec::Hand(hand)) = &session.body else {
        return Ok(Vec::new());
    };
    let every = hand.spec.units;
    let fewer = UNITS.into_iter().filter(|units| *units < every);
    let numbers: Vec<usize> = std::iter::once(every).chain(fewer).collect();
    let levels: Vec<Session> = numbers
        .iter()
        .map(|&units| with_units(session, units))
        .collect();
    let errors = largest_deviations(&levels, seeds)?;
    let pairs = numbers.into_iter().zip(errors);
    Ok(pairs
        .map(|(units, error)| Effect {
            setting: units as u32, // at most 256
            error,
        })
        .collect())
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
