//! Compares what the default controller does without a wearer file, with a true one, and with the
//! one that `flexor calibrate` writes.
//!
//! Takes a population and a seed; returns the tracking errors of the default controller with each
//! file. `procedure` calibrates a simulated body with the program's own procedure, `operator`
//! answers in it, `outcome` lists the files, `fingers` and `hands` make them and drive the wearers, `campaign` runs
//! all of them, and `table` formats the result. Bodies are in `hal_sim::body`, the procedure in
//! `host_core::calibration`. Everything is simulated: this is no evidence about people.

mod campaign;
mod fingers;
mod hands;
mod operator;
mod outcome;
mod procedure;
pub mod table;

pub use campaign::{Case, Comparison, Population, Score};
pub use operator::ByEye;
pub use outcome::{Files, Outcome};
pub use procedure::{CalibratedPoints, PlannedPoint, calibrate_body};

use crate::hamana2022::TwoPointsError;
use crate::hands::HandsError;
use crate::tracking::TrackingError;
use host_core::calibration::CalibrationError;

/// Reason why the files cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// A hand is invalid, or its searches failed.
    #[error(transparent)]
    Hands(#[from] HandsError),
    /// A wearer or a joint is invalid.
    #[error(transparent)]
    Wearer(#[from] TrackingError),
    /// A calibration could not be carried out.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

impl From<TwoPointsError> for FilesError {
    fn from(error: TwoPointsError) -> Self {
        Self::Hands(error.into())
    }
}
