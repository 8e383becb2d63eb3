//! What data can tell at best: Fisher's information and the bound that follows from it.

use super::model::{Constants, NAMES, PARAMETERS};
use super::problem::{Problem, Weighting};
use super::record::ForceRecord;
use nalgebra::SMatrix;

type Square = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// A constant whose 95 % interval reaches further than this part of it to a side is not
/// told by the data.
pub const UNTOLD: f64 = 0.5;
/// Of the smallest eigenvalue over the largest, of information scaled to a diagonal of 1:
/// below, some direction is as good as unseen.
const SINGULAR: f64 = 1e-10;
/// Standard errors to either end of a 95 % interval.
const HALF_95: f64 = 1.959_963_984_540_054;

/// The Cramér-Rao bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Least covariance of the logarithms of the constants that an unbiased estimator has.
    pub covariance: [[f64; PARAMETERS]; PARAMETERS],
    /// Names of the constants that such data cannot tell.
    pub untold: Vec<&'static str>,
}

impl Bound {
    /// Least standard deviation of each constant, as a part of it.
    #[must_use]
    pub fn errors(&self) -> [f64; PARAMETERS] {
        std::array::from_fn(|i| self.covariance[i][i].max(0.0).sqrt())
    }
}

/// The bound for `records` (when pulses came, how many samples; what was read is not
/// looked at) of a muscle with these constants, under white noise of `noise_n` a sample,
/// offset and drift of each record unknown. `None`: nothing of it depends on a constant.
#[must_use]
pub fn bound(constants: Constants, records: &[ForceRecord], noise_n: f64) -> Option<Bound> {
    let problem = Problem::new(records, Weighting::Whitened, constants);
    let covariance = inverse(&problem.information())? * (noise_n * noise_n);
    Some(Bound {
        untold: untold(&covariance),
        covariance: rows(&covariance),
    })
}

/// Scaled to a diagonal of 1 before, so that units do not matter.
pub(super) fn inverse(information: &Square) -> Option<Square> {
    let scale = information.diagonal().map(|value| 1.0 / value.sqrt());
    if !scale.iter().all(|scale| scale.is_finite() && *scale > 0.0) {
        return None;
    }
    let scaled = Square::from_fn(|i, j| information[(i, j)] * scale[i] * scale[j]);
    let parts = scaled.symmetric_eigen();
    let largest = parts.eigenvalues.max();
    // A direction that is not seen keeps a variance that is finite and enormous.
    let least = largest * SINGULAR;
    let inverse = parts
        .eigenvalues
        .map(|eigenvalue| 1.0 / eigenvalue.max(least));
    let own = parts.eigenvectors * Square::from_diagonal(&inverse) * parts.eigenvectors.transpose();
    Some(Square::from_fn(|i, j| own[(i, j)] * scale[i] * scale[j]))
}

/// Names of the constants whose logarithms' covariance says that they are not told.
#[must_use]
pub fn untold(covariance: &Square) -> Vec<&'static str> {
    let is_untold = |i: &usize| {
        let half = HALF_95 * covariance[(*i, *i)].max(0.0).sqrt();
        half.is_nan() || half > UNTOLD
    };
    let all = (0..PARAMETERS).filter(is_untold);
    all.filter_map(|i| NAMES.get(i).copied()).collect()
}

pub(super) fn rows(
    matrix: &SMatrix<f64, PARAMETERS, PARAMETERS>,
) -> [[f64; PARAMETERS]; PARAMETERS] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}
