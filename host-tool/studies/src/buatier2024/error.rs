//! Errors of the study of lifts.

use firmware::haptics::ModulationError;
use hal_sim::body::sagittal::InvalidSagittal;
use host_core::analysis::MotionError;
use host_core::limb::{NoQuartic, OutOfReach};
use host_core::statistics::StatisticsError;

/// Reason why the study cannot run or continue.
#[derive(Debug, thiserror::Error)]
pub enum LiftError {
    /// The declaration is invalid; lists every mistake.
    #[error("E760 the declaration of buatier: {0}")]
    Declaration(String),
    /// The trajectory needs more torque than the muscles have.
    #[error(transparent)]
    Reach(#[from] OutOfReach),
    /// Activation is not a function of the angle.
    #[error(transparent)]
    Quartic(#[from] NoQuartic),
    /// A lift cannot be judged.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A randomly generated arm is invalid.
    #[error("E769 a drawn person cannot be; change that field's range in the declaration")]
    Arm(#[from] InvalidSagittal),
    /// The device refuses the modulation of a joint.
    #[error("E767 joint {0}: the device refuses its modulation: {1}")]
    Refused(u8, String),
    /// The whole device refuses a request, or its link fails.
    #[error(transparent)]
    Link(#[from] host_core::link::Error),
    /// The whole device stops with a fault.
    #[error("E759 the whole device stops with fault {0} in the lift that the fast way has")]
    Faulted(String),
    /// The caller asked to end.
    #[error("E580 a signal came before it was computed")]
    Asked,
    /// The statistics of a sample cannot be computed.
    #[error("E768 statistics of {0}: {1}")]
    Statistics(String, StatisticsError),
}

impl LiftError {
    /// Creates the error for a modulation that the device refuses.
    pub(super) fn refused(joint: u8, why: ModulationError) -> Self {
        Self::Refused(joint, format!("{why:?}"))
    }
}
