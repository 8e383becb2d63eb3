//! Errors of the studies of endpoint forces.

use hal_sim::body::arm::InvalidArm;
use host_core::limb::RecruitmentError;
use host_core::statistics::StatisticsError;

/// The reason why a study of endpoint forces cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum EndpointError {
    /// The declaration is invalid: all its mistakes.
    #[error("E715 the declaration of the endpoint study is wrong: {0}")]
    Declaration(String),
    /// The random parameters of an arm are impossible: the reason.
    #[error("E716 a randomly generated arm is impossible: {0}; change the range of that number")]
    Arm(InvalidArm),
    /// IMUs are missing or have swapped axes: a description of each.
    #[error("E717 {0}; attach each IMU along the axes of its segment")]
    Imus(String),
    /// The twitches of a channel do not turn the limb.
    #[error(
        "E718 {0}: its twitches do not turn its joint; move its electrodes, or leave the channel \
         out"
    )]
    NoTwitch(&'static str),
    /// The gain of a channel is not a positive finite number.
    #[error("E719 {0}: the gain found from its twitches is {1}; allowed: a finite number above 0")]
    Gain(&'static str, f64),
    /// The features do not allow a regression.
    #[error("E720 the regression cannot be computed: {0}")]
    Regression(String),
    /// A device does not play condition C3: the device, and the reason.
    #[error("E730 --device {0} does not play condition C3: {1}; choose another --device or --seed")]
    NotPlayed(String, String),
    /// A device emits other edges than the native device: the device, its edge and the native edge.
    #[error(
        "E731 the outputs differ: --device {0} has {1}, and --device native has {2}; report this \
         with the --seed"
    )]
    OtherEdges(String, String, String),
    /// The declaration of the choice of electrodes is invalid: all its mistakes.
    #[error("E732 the declaration of the electrode study is wrong: {0}")]
    Electrodes(String),
    /// The device refuses its model of the arm, or a force.
    #[error(transparent)]
    Limb(#[from] RecruitmentError),
    /// A statistic cannot be computed from its sample.
    #[error("E721 statistics of {0} cannot be computed: {1}")]
    Statistics(&'static str, StatisticsError),
}

impl From<InvalidArm> for EndpointError {
    fn from(error: InvalidArm) -> Self {
        Self::Arm(error)
    }
}
