//! Fits the model to simulated wrists with another structure, and determines the remaining
//! agreement.

use super::alone::ExactWrist;
use super::analysis::run_analysis;
use super::declaration::Declaration;
use super::error::LeeError;
use super::protocol::{Amplitudes, run_fifteen_trains};
use super::truth::Truth;
use hal_sim::body::bench::{Foreign, Generator, Kind, WristSpec};
use hal_sim::random::word;
use serde::{Deserialize, Serialize};

/// Result of one model mismatch in one subject.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mismatch {
    /// Index of the subject, from 0.
    pub subject: usize,
    /// Kind and size of the mismatch.
    pub foreign: Foreign,
    /// NRMSE at I1 to I5, %.
    pub nrmse_percent: Vec<f64>,
    /// Ratio of estimate to true value for A, K, τc, τ1 and τ2.
    pub ratios: [f64; 5],
    /// Whether the 95 % interval contains the true value, for A, K, τc, τ1 and τ2.
    pub covers: [bool; 5],
}

/// Simulates fifteen trains at the printed amplitudes on a wrist with the mismatch `foreign`, and
/// fits the model to them.
///
/// # Errors
/// Fails if the test rig is invalid or the records cannot be fitted.
pub fn mismatch(
    (subject, truth): (usize, &Truth),
    foreign: Foreign,
    seed: u64,
    declared: &Declaration,
) -> Result<Mismatch, LeeError> {
    let generator = Generator {
        foreign: Some(foreign),
        ..truth.spec.generator
    };
    let spec = WristSpec {
        generator,
        ..truth.spec
    };
    let place = Kind::ALL.iter().position(|kind| *kind == foreign.kind);
    let seed = word(
        word(seed, place.unwrap_or_default() as u64),
        (1e6 * foreign.size) as u64,
    );
    let mut alone = ExactWrist::new(spec, seed)?;
    let amplitudes = Amplitudes::from_threshold(truth.printed_ma, declared)?;
    let most_ma = amplitudes.0.last().copied().unwrap_or_default();
    let found = run_analysis(
        &run_fifteen_trains(&mut alone, amplitudes, declared)?,
        declared,
    )?;
    let constants = truth.constants(most_ma, declared.trains.width_us);
    let fit = &found.fits[0];
    let estimates = fit.estimates();
    Ok(Mismatch {
        subject,
        foreign,
        nrmse_percent: found
            .agreements
            .iter()
            .map(|agreement| agreement.nrmse_percent)
            .collect(),
        ratios: std::array::from_fn(|i| fit.constants[i] / constants[i]),
        covers: std::array::from_fn(|i| estimates[i].covers(constants[i])),
    })
}
