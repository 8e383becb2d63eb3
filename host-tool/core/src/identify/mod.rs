//! From measured force to a muscle's numbers.
//!
//! Lives here: the experimenter's filter (`average`), what is wrong with a record
//! (`record`), the calcium-force model with its sensitivities (`model`), fits and their
//! intervals (`fit`), what data can tell at best (`information`), peaks and times
//! (`response`), equations 5 and 6 (`exponential`), the motor threshold (`threshold`). Not
//! here: who is stimulated and how (studies, calibration), bodies (`hal_sim`), what a
//! device computes (`firmware`). In: samples at 1 kHz and when pulses came. Out: numbers
//! with 95 % intervals, the names of those that the data cannot tell, or what is wrong.

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

pub use average::{WINDOW, averaged};
pub use error::IdentifyError;
pub use exponential::{Agreement, Exponential, agreement};
pub use fit::{Estimate, Fit, Fitted, START_SEEDS};
pub use information::{Bound, UNTOLD, bound, untold};
pub use model::{Constants, NAMES, PARAMETERS, Sensitive, UNITS, simulated};
pub use problem::Weighting;
pub use record::{ForceRecord, SAMPLE_US, Sound};
pub use response::{Response, response, responses};
pub use threshold::{Detector, Found, Layout, Shown, bare_rule, in_order};
