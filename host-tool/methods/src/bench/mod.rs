//! Each method once per call between two markers, as `firmware::bench` does it.

mod laws;
mod methods;

pub use laws::{LawName, run_laws};
pub use methods::{MADE, OUTPUTS_US, RUN_US, run_methods};
