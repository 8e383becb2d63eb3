//! Why a study of lifts does not come about.

use firmware::haptics::ModulationError;
use hal_sim::body::sagittal::InvalidSagittal;
use host_core::analysis::MotionError;
use host_core::limb::{NoQuartic, OutOfReach};
use host_core::statistics::StatisticsError;

/// Why.
#[derive(Debug, thiserror::Error)]
pub enum LiftError {
    /// Its declaration; all that is wrong with it.
    #[error("E760 the declaration of buatier: {0}")]
    Declaration(String),
    /// The way needs more than the muscles have.
    #[error(transparent)]
    Reach(#[from] OutOfReach),
    /// Activation is no function of the angle.
    #[error(transparent)]
    Quartic(#[from] NoQuartic),
    /// A lift that cannot be judged.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A drawn arm.
    #[error("E769 a drawn person cannot be; change that field's range in the declaration")]
    Arm(#[from] InvalidSagittal),
    /// The device refuses what it is told of a joint.
    #[error("E767 joint {0}: the device refuses its modulation: {1}")]
    Refused(u8, String),
    /// The whole device refuses, or is lost.
    #[error(transparent)]
    Link(#[from] host_core::link::Error),
    /// The whole device stops.
    #[error("E759 the whole device stops with fault {0} in the lift that the fast way has")]
    Faulted(String),
    /// Whoever waits for it was asked to end.
    #[error("E580 a signal came before it was computed")]
    Asked,
    /// A sample.
    #[error("E768 statistics of {0}: {1}")]
    Statistics(String, StatisticsError),
}

impl LiftError {
    /// Of joint `joint`.
    pub(super) fn refused(joint: u8, why: ModulationError) -> Self {
        Self::Refused(joint, format!("{why:?}"))
    }
}
