//! Why a study of endpoint forces does not come about.

use hal_sim::body::arm::InvalidArm;
use host_core::limb::RecruitmentError;
use host_core::statistics::StatisticsError;

/// Why.
#[derive(Debug, thiserror::Error)]
pub enum EndpointError {
    /// Its declaration; all that is wrong with it.
    #[error("E715 the endpoint study's declaration: {0}")]
    Declaration(String),
    /// A drawn arm.
    #[error("E716 a drawn arm cannot be: {0}; change its range")]
    Arm(InvalidArm),
    /// IMUs do not read as they should; all of them.
    #[error("E717 {0}; the calibration needs each of them in its segment's axes")]
    Imus(String),
    /// A channel's twitches turn nothing.
    #[error(
        "E718 {0}: its twitches turn nothing about its joint; move its electrodes, or leave the \
         channel out"
    )]
    NoTwitch(&'static str),
    /// A channel's gain is none.
    #[error("E719 {0}: its gain is {1}, which must be a finite number above zero")]
    Gain(&'static str, f64),
    /// Features do not make a regression.
    #[error("E720 the regression: {0}")]
    Regression(String),
    /// A device does not play a condition.
    #[error("E730 --device {0} does not play C3: {1}; choose another --device, or --seed")]
    NotPlayed(String, String),
    /// It does not put out what the native device does.
    #[error("E731 --device {0} puts out {1} where --device native puts out {2}")]
    OtherEdges(String, String, String),
    /// The declaration of the choice of electrodes; all that is wrong with it.
    #[error("E732 the electrode choice's declaration: {0}")]
    Electrodes(String),
    /// The device's own arm, or what is wanted of it.
    #[error(transparent)]
    Limb(#[from] RecruitmentError),
    /// A sample.
    #[error("E721 statistics of {0}: {1}")]
    Statistics(&'static str, StatisticsError),
}

impl From<InvalidArm> for EndpointError {
    fn from(error: InvalidArm) -> Self {
        Self::Arm(error)
    }
}
