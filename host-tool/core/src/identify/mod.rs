//! Identifies a muscle's constants from measured force.
//!
//! The submodules are the experimenter's filter (`average`), checks of a record (`record`), the
//! calcium-force model with its sensitivities (`model`), fits and their intervals (`fit`), the most
//! that data can determine (`information`), peaks and times (`response`), equations 5 and 6
//! (`exponential`), and the motor threshold (`threshold`). The inputs are samples at 1 kHz and the
//! times of the pulses. The outputs are constants with 95 % intervals, the names of constants that
//! the data cannot determine, or the mistakes in a record. Studies and calibration decide who is
//! stimulated and how; bodies are in `hal_sim`, and the device's computations are in `firmware`.

mod average;
mod error;
mod exponential;
mod fit;
mod information;
mod model;
mod problem;
mod record;
mod response;
mod threshold;

pub use average::{WINDOW, moving_average};
pub use error::IdentifyError;
pub use exponential::{Agreement, Exponential, agreement};
pub use fit::{Estimate, Fit, ForceFit, START_SEEDS};
pub use information::{Bound, UNTOLD, cramer_rao_bound, undetermined_constants};
pub use model::{Constants, NAMES, PARAMETERS, Sensitive, UNITS, simulate_record};
pub use problem::Weighting;
pub use record::{ForceRecord, SAMPLE_US, Sound};
pub use response::{Response, response, responses};
pub use threshold::{Detector, Layout, ThresholdEstimate, TryResult, bare_rule, check_rising};
