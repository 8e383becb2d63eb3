//! Chooses models that need no trial. Where a muscle neither tires nor steers, only one model
//! reports its force, and only a muscle without pulses needs none.

use super::play::{PlayError, PlayedSession};
use crate::session::{Channel, Model, Session};
use firmware::muscle::MuscleLevel;

/// Lengths of the session that are played, one after the other, until every muscle has received a
/// pulse, µs. Most sessions need only the shortest.
const LOOKS_US: [u64; 3] = [1_000_000, 5_000_000, u64::MAX];

/// Returns whether the choice depends only on which muscles receive pulses: no muscle tires, no
/// channel is under force control, no live client streams, the session has no `[fidelity]`, and the
/// tolerance is below 100 %. Then only one model level reports a force. A lower level reports none,
/// which is an error of 100 %, and there is no higher level.
pub(super) fn is_decided_by_pulses(session: &Session) -> bool {
    let tires = |c: &Channel| {
        c.muscle
            .as_ref()
            .is_some_and(|muscle| muscle.fatigue.is_some())
    };
    let mut channels = session.channels.iter();
    !session.has_fidelity
        && session.tolerance.fraction() < 1.0
        && session.setpoints.bounds.is_empty()
        && !channels.any(|c| c.force.is_some() || tires(c))
}

/// Returns the model levels that [`super::choose`] would choose if [`is_decided_by_pulses`] is
/// true, by index in [`Session::channels`]. It plays at most the first `length_us`.
///
/// # Errors
/// Returns [`PlayError`] if the session cannot be played.
pub(super) fn choose_levels(
    session: &Session,
    length_us: u64,
    seed: u64,
) -> Result<Vec<(usize, MuscleLevel)>, PlayError> {
    let mut levels = Vec::new();
    for (place, channel) in session.channels.iter().enumerate() {
        let muscle = channel.muscle.as_ref();
        if let Some(muscle) = muscle.filter(|muscle| muscle.model == Model::Auto) {
            levels.push((place, MuscleLevel::None, muscle.report));
        }
    }
    let mut look = session.clone();
    for muscle in look.channels.iter_mut().filter_map(|c| c.muscle.as_mut()) {
        muscle.model = Model::Fixed(MuscleLevel::None);
    }
    for look_us in LOOKS_US {
        if levels
            .iter()
            .all(|pair| !pair.2 || pair.1 != MuscleLevel::None)
        {
            break;
        }
        look.duration_us = length_us.min(look_us);
        let played = PlayedSession::play(&look, seed)?;
        for (place, level, is_read) in &mut levels {
            if *is_read && !played.pulses[*place].is_empty() {
                *level = MuscleLevel::CalciumForce;
            }
        }
        if look.duration_us == length_us {
            break;
        }
    }
    Ok(levels.into_iter().map(|pair| (pair.0, pair.1)).collect())
}
