//! The stimulus by which the device would give a force.

use crate::session::Channel;
use firmware::muscle::{Inverse, Recruitment};
use firmware::range::OutOfRange;
use firmware::units::Force;

/// Stimulus for a force, of the rested muscle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ForceStimulus {
    /// Amplitude in the channel's unit, mA or V.
    pub amplitude: f64,
    /// Pulse rate, Hz.
    pub rate_hz: f64,
    /// Mean force that this stimulus gives, N.
    pub force_n: f64,
    /// Whether the limits do not allow the wanted force, so that `force_n` differs from it.
    pub is_limited: bool,
}

/// Returns the stimulus by which the device would give `force_n` (0 to 4000 N) with the muscle of
/// `channel`; `None` if the channel has no muscle. The pulse rate may vary if the channel has
/// force control that allows it.
///
/// # Errors
/// A parameter of the muscle or of the train is outside of the inverse model's range.
pub fn stimulus_for_force(
    channel: &Channel,
    force_n: f64,
) -> Result<Option<ForceStimulus>, OutOfRange> {
    let Some(muscle) = &channel.muscle else {
        return Ok(None);
    };
    let recruitment = Recruitment::new(muscle.recruitment)?;
    let train_us = channel.spec.train.period_us;
    let fastest_us = channel.force.map_or(train_us, |force| force.min_period_us);
    let slowest_us = channel.force.and_then(|force| force.max_period_us);
    let slowest_us = slowest_us.unwrap_or(train_us);
    let inverse = Inverse::new(muscle.force, &recruitment, train_us, fastest_us, slowest_us)?;
    let millinewton = (force_n.clamp(0.0, 4e3) * 1e3).round() as u32; // at most 4e6
    let drive = inverse.drive(&recruitment, Force::from_millinewton(millinewton));
    Ok(Some(ForceStimulus {
        amplitude: f64::from(drive.amplitude.get()) / 1e3,
        rate_hz: 1e6 / f64::from(drive.period_us),
        force_n: drive.force.get().to_num(),
        is_limited: drive.limiting.is_some(),
    }))
}
