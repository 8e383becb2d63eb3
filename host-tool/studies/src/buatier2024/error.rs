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
    #[error("E760 the declaration buatier.toml is invalid: {0}")]
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
    #[error("E769 a random wearer is impossible; change the range of this field in buatier.toml")]
    Arm(#[from] InvalidSagittal),
    /// The device refuses the modulation of a joint.
    #[error("E767 the device refuses the modulation of joint {0}: {1}")]
    Refused(u8, String),
    /// The whole device refuses a request, or its link fails.
    #[error(transparent)]
    Link(#[from] host_core::link::Error),
    /// The whole device stops with a fault.
    #[error(
        "E759 the whole device stopped with fault {0} in a lift that the fast simulation \
         completes; report this with the --seed"
    )]
    Faulted(String),
    /// The caller asked to end.
    #[error("E580 a signal came before the computation was complete")]
    Asked,
    /// The statistics of a sample cannot be computed.
    #[error("E768 no statistics of {0} can be computed: {1}")]
    Statistics(String, StatisticsError),
}

impl LiftError {
    /// Creates the error for a modulation that the device refuses.
    pub(super) fn refused(joint: u8, why: ModulationError) -> Self {
        Self::Refused(joint, format!("{why:?}"))
    }
}
