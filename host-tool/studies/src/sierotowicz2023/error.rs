//! Errors of the studies of endpoint forces.

use hal_sim::body::arm::InvalidArm;
use host_core::limb::RecruitmentError;
use host_core::statistics::StatisticsError;

/// The reason why a study of endpoint forces cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum EndpointError {
    /// The declaration is invalid: all its mistakes.
    #[error("E715 the endpoint study's declaration: {0}")]
    Declaration(String),
    /// A random arm is invalid.
    #[error("E716 a drawn arm cannot be: {0}; change its range")]
    Arm(InvalidArm),
    /// IMUs are missing or have swapped axes: all of them.
    #[error("E717 {0}; the calibration needs each of them in its segment's axes")]
    Imus(String),
    /// The twitches of a channel do not turn the limb.
    #[error(
        "E718 {0}: its twitches turn nothing about its joint; move its electrodes, or leave the \
         channel out"
    )]
    NoTwitch(&'static str),
    /// The gain of a channel is not a positive finite number.
    #[error("E719 {0}: its gain is {1}, which must be a finite number above zero")]
    Gain(&'static str, f64),
    /// The features do not allow a regression.
    #[error("E720 the regression: {0}")]
    Regression(String),
    /// A device does not play C3.
    #[error("E730 --device {0} does not play C3: {1}; choose another --device, or --seed")]
    NotPlayed(String, String),
    /// A device emits other edges than the native device.
    #[error("E731 --device {0} puts out {1} where --device native puts out {2}")]
    OtherEdges(String, String, String),
    /// The declaration of the choice of electrodes is invalid: all its mistakes.
    #[error("E732 the electrode choice's declaration: {0}")]
    Electrodes(String),
    /// The device refuses its model of the arm, or a force.
    #[error(transparent)]
    Limb(#[from] RecruitmentError),
    /// A statistic cannot be computed from its sample.
    #[error("E721 statistics of {0}: {1}")]
    Statistics(&'static str, StatisticsError),
}

impl From<InvalidArm> for EndpointError {
    fn from(error: InvalidArm) -> Self {
        Self::Arm(error)
    }
}
