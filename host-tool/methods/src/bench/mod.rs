//! Benchmarks: cycles per call of each method between two markers, as in `firmware::bench`.

mod laws;
mod methods;

pub use laws::{LawName, run_laws};
pub use methods::{MADE, OUTPUTS_US, RUN_US, run_methods};
