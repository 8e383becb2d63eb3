//! Fits the five constants of a muscle to records, each with its 95 % interval.

use super::error::IdentifyError;
use super::information::{inverse, rows, undetermined_constants};
use super::model::{Constants, PARAMETERS};
use super::problem::{Problem, Weighting};
use super::record::ForceRecord;
use hal_sim::random::Random;
use levenberg_marquardt::LevenbergMarquardt;
use serde::{Deserialize, Serialize};

/// Seeds of the random start values. A fit tries them in this order until [`AGREE`] of its starts
/// end at the same minimum.
pub const START_SEEDS: [u64; 6] = [1, 2, 3, 4, 5, 6];
/// Number of starts that must end at the same minimum before a fit stops trying further ones.
const AGREE: usize = 2;
/// Largest difference between two sums of squares that count as the same minimum, as a share of the
/// smaller sum.
const ALIKE: f64 = 1e-6;
/// Half width of a 95 % interval, in standard errors.
const HALF_95: f64 = 1.959_963_984_540_054;
/// Ranges of the random start values of K, τc, τ1 and τ2 (s), which are uniform in the logarithm.
/// They are wider than the ranges over the subjects of Lee 2020, table 4. The start value of A
/// follows from the other constants and the record.
const STARTS: [[f64; 2]; 4] = [[0.01, 0.6], [8e-3, 40e-3], [4e-3, 100e-3], [20e-3, 300e-3]];
/// Relative tolerance at which the Levenberg–Marquardt solver stops.
const TOLERANCE: f64 = 1e-10;

/// Estimate of one constant with its 95 % interval, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Most likely value of the constant.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
}

impl Estimate {
    /// Returns whether the 95 % interval contains `truth`, the true value in a simulation.
    #[must_use]
    pub fn covers(&self, truth: f64) -> bool {
        (self.low..=self.high).contains(&truth)
    }
}

/// Method by which constants are fitted to records.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fit {
    /// Form in which measured force and model are compared.
    pub weighting: Weighting,
}

/// Constants of a muscle that were fitted to force, with their uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ForceFit {
    /// Fitted constants: A in N/s, K, τc, τ1, τ2 in s.
    pub constants: Constants,
    /// Covariance matrix of the logarithms of the constants, in the order of [`super::NAMES`].
    pub covariance: [[f64; PARAMETERS]; PARAMETERS],
    /// Standard deviation of the white noise in one sample, N, estimated from the residuals.
    pub noise_n: f64,
    /// Number of sets of start values that were tried.
    pub starts: usize,
    /// Names of the constants that the records do not determine, because their intervals are too
    /// wide.
    pub untold: Vec<String>,
}

impl ForceFit {
    /// Returns each constant with its 95 % interval, in the order of [`super::NAMES`].
    #[must_use]
    pub fn estimates(&self) -> [Estimate; PARAMETERS] {
        std::array::from_fn(|i| {
            let (value, error) = (self.constants[i], self.covariance[i][i].max(0.0).sqrt());
            Estimate {
                value,
                low: value * libm::exp(-HALF_95 * error),
                high: value * libm::exp(HALF_95 * error),
            }
        })
    }
}

impl Fit {
    /// Fits one set of constants to all `records`, which must come from the same muscle.
    ///
    /// # Errors
    /// E640, E641 or E643 if a record is not usable; E644 if the fit fails.
    pub fn fit_records(self, records: &[ForceRecord]) -> Result<ForceFit, IdentifyError> {
        self.fit_from_starts(records, &START_SEEDS.map(start))
    }

    /// Fits the constants from a single set of start values, for example the result of an earlier
    /// fit of the same records.
    ///
    /// # Errors
    /// The errors of [`Self::fit_records`].
    pub fn fit_from(
        self,
        records: &[ForceRecord],
        start: Constants,
    ) -> Result<ForceFit, IdentifyError> {
        self.fit_from_starts(records, &[start])
    }

    fn fit_from_starts(
        self,
        records: &[ForceRecord],
        candidates: &[Constants],
    ) -> Result<ForceFit, IdentifyError> {
        if records.is_empty() {
            let reason = "there is no record".to_owned();
            return Err(IdentifyError::TooShort { what: reason });
        }
        for record in records {
            record.check_quality()?;
        }
        let mut best: Option<Problem<'_>> = None;
        let (mut agreeing, mut starts, mut why) = (0, 0, "no start".to_owned());
        for start in candidates {
            starts += 1;
            let mut problem = Problem::new(records, self.weighting, *start);
            problem.scale();
            let solver = LevenbergMarquardt::new()
                .with_ftol(TOLERANCE)
                .with_xtol(TOLERANCE)
                .with_gtol(TOLERANCE);
            let (found, report) = solver.minimize(problem);
            if !found.sum_of_squares().is_finite() {
                why = format!("{:?}", report.termination);
                continue;
            }
            let before = best.as_ref().map_or(f64::INFINITY, Problem::sum_of_squares);
            let now = found.sum_of_squares();
            agreeing = match () {
                () if (now - before).abs() <= ALIKE * before.min(now) => agreeing + 1,
                () if now < before => 1,
                () => agreeing,
            };
            if now < before {
                best = Some(found);
            }
            if agreeing >= AGREE {
                break;
            }
        }
        let best = best.ok_or(IdentifyError::NoFit { starts, why })?;
        self.finish_fit(&best, starts)
    }

    fn finish_fit(self, best: &Problem<'_>, starts: usize) -> Result<ForceFit, IdentifyError> {
        let information = best.information();
        let no_fit = |why: &str| IdentifyError::NoFit {
            starts,
            why: why.to_owned(),
        };
        let why = "the force does not depend on all parameters";
        let bread = inverse(&information).ok_or_else(|| no_fit(why))?;
        let (covariance, variance) = match self.weighting {
            Weighting::Whitened => {
                let straight = 2 * best.records();
                let freedom = best.count().saturating_sub(PARAMETERS + straight).max(1);
                let variance = best.sum_of_squares() / freedom as f64;
                (bread * variance, variance)
            }
            Weighting::Averaged => {
                let (meat, trace) = best.averaged_noise();
                let taken = (bread * meat).trace();
                let variance = best.sum_of_squares() / (trace - taken).max(1.0);
                (bread * meat * bread * variance, variance)
            }
        };
        Ok(ForceFit {
            constants: best.constants(),
            untold: undetermined_constants(&covariance)
                .into_iter()
                .map(str::to_owned)
                .collect(),
            covariance: rows(&covariance),
            noise_n: variance.sqrt(),
            starts,
        })
    }
}

fn start(seed: u64) -> Constants {
    let mut random = Random::new(seed);
    let [k, tau_c, tau1, tau2] = STARTS.map(|[low, high]| random.log_between(low, high));
    [100.0, k, tau_c, tau1, tau2]
}
