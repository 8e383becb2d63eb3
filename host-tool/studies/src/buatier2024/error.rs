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
    /// No quartic describes the activation as a function of the angle.
    #[error(transparent)]
    Quartic(#[from] NoQuartic),
    /// A lift cannot be judged, because its recording cannot be filtered or has no smoothness.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A randomly generated arm is invalid.
    #[error(
        "E769 a randomly generated wearer is impossible: {0}; change the range of this field in \
         buatier.toml"
    )]
    Arm(InvalidSagittal),
    /// The device refuses the modulation of a joint.
    #[error(
        "E767 the device refuses the modulation of joint {0}: {1}; change the ranges in \
         buatier.toml that lead to this value"
    )]
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
    #[error(
        "E580 the study was interrupted (Ctrl-C, SIGTERM or SIGHUP) before it was complete; run the same command again"
    )]
    Asked,
    /// The statistics of a sample cannot be computed.
    #[error("E768 no statistics of {0} can be computed: {1}")]
    Statistics(String, StatisticsError),
}

// There is no `#[from]`: the message contains this error in full, so the error must not be listed
// again as its cause.
impl From<InvalidSagittal> for LiftError {
    fn from(error: InvalidSagittal) -> Self {
        Self::Arm(error)
    }
}

impl LiftError {
    /// Creates the error for a modulation that the device refuses.
    pub(super) fn refused(joint: u8, why: ModulationError) -> Self {
        let why = match why {
            ModulationError::Range(field) => field.to_string(),
            ModulationError::ChannelTwice { channel } => {
                format!("both of its muscles use channel {}", channel + 1)
            }
            ModulationError::Share { channel, phase, .. } => format!(
                "`{}` of channel {} leaves 0 to 1 at some angle",
                phase.field(),
                channel + 1
            ),
        };
        Self::Refused(joint, why)
    }
}
