//! The most that data can determine: Fisher's information and the bound that follows from it.

use super::model::{Constants, NAMES, PARAMETERS};
use super::problem::{Problem, Weighting};
use super::record::ForceRecord;
use nalgebra::SMatrix;

type Square = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Largest half width of a constant's 95 % interval at which the constant counts as determined by
/// the data, as a share of the constant.
pub const UNTOLD: f64 = 0.5;
/// Smallest ratio of an eigenvalue of the information to the largest one, after scaling to a
/// diagonal of 1. Smaller eigenvalues are raised to this ratio. They belong to combinations of
/// constants on which the data practically do not depend.
const SINGULAR: f64 = 1e-10;
/// Half width of a 95 % interval, in standard errors.
const HALF_95: f64 = 1.959_963_984_540_054;

/// Cramér–Rao bound: the smallest uncertainty that any unbiased estimator of the constants can
/// have.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Covariance matrix of the logarithms of the constants at the bound.
    pub covariance: [[f64; PARAMETERS]; PARAMETERS],
    /// Names of the constants that even the best estimator cannot determine from such data.
    pub untold: Vec<&'static str>,
}

impl Bound {
    /// Returns the smallest possible standard deviation of each constant, as a share of the
    /// constant.
    #[must_use]
    pub fn errors(&self) -> [f64; PARAMETERS] {
        std::array::from_fn(|i| self.covariance[i][i].max(0.0).sqrt())
    }
}

/// Returns the bound for records of a muscle with these constants. The noise is white, with a
/// standard deviation of `noise_n` newtons per sample, and the offset and drift of each record are
/// unknown. Only the times of the pulses and the number of samples in `records` matter; the
/// readings are ignored. Returns `None` if the force does not depend on one of the constants.
#[must_use]
pub fn cramer_rao_bound(
    constants: Constants,
    records: &[ForceRecord],
    noise_n: f64,
) -> Option<Bound> {
    let problem = Problem::new(records, Weighting::Whitened, constants);
    let covariance = inverse(&problem.information())? * (noise_n * noise_n);
    Some(Bound {
        untold: undetermined_constants(&covariance),
        covariance: rows(&covariance),
    })
}

/// Inverts Fisher's information matrix, which is first scaled to a diagonal of 1 so that the units
/// of the constants do not matter. Returns `None` if the data do not depend on one of the
/// constants.
pub(super) fn inverse(information: &Square) -> Option<Square> {
    let scale = information.diagonal().map(|value| 1.0 / value.sqrt());
    if !scale.iter().all(|scale| scale.is_finite() && *scale > 0.0) {
        return None;
    }
    let scaled = Square::from_fn(|i, j| information[(i, j)] * scale[i] * scale[j]);
    let parts = scaled.symmetric_eigen();
    let largest = parts.eigenvalues.max();
    // A direction without information keeps a variance that is finite and enormous.
    let least = largest * SINGULAR;
    let inverse = parts
        .eigenvalues
        .map(|eigenvalue| 1.0 / eigenvalue.max(least));
    let own = parts.eigenvectors * Square::from_diagonal(&inverse) * parts.eigenvectors.transpose();
    Some(Square::from_fn(|i, j| own[(i, j)] * scale[i] * scale[j]))
}

/// Returns the names of the constants whose 95 % intervals are too wide ([`UNTOLD`]). `covariance`
/// is that of the logarithms of the constants.
#[must_use]
pub fn undetermined_constants(covariance: &Square) -> Vec<&'static str> {
    let is_untold = |i: &usize| {
        let half = HALF_95 * covariance[(*i, *i)].max(0.0).sqrt();
        half.is_nan() || half > UNTOLD
    };
    let indices = (0..PARAMETERS).filter(is_untold);
    indices.filter_map(|i| NAMES.get(i).copied()).collect()
}

pub(super) fn rows(
    matrix: &SMatrix<f64, PARAMETERS, PARAMETERS>,
) -> [[f64; PARAMETERS]; PARAMETERS] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}
