//! Equations 5, 6 and 8 of Lee 2020: peak force as a function of amplitude, and A from it.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DVector, Dyn, OMatrix, U2, Vector2};
use serde::{Deserialize, Serialize};

/// Peak force of a muscle as an exponential function of amplitude: F_PK(I) = a·e^(bI).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Exponential {
    /// Factor a, N: the extrapolated peak force at 0 mA.
    pub a_n: f64,
    /// Coefficient b in the exponent, 1/mA.
    pub b_per_ma: f64,
}

impl Exponential {
    /// Fits the exponential by least squares to points of amplitude, mA, and peak force, N. Returns
    /// `None` if fewer than two points have a force above 0, if the first and the last of these
    /// have the same amplitude, or if the fit does not give finite numbers.
    #[must_use]
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let above: Vec<_> = points.iter().filter(|(_, n)| *n > 0.0).collect();
        let (first, last) = (above.first()?, above.last()?);
        if above.len() < 2 || first.0 == last.0 {
            return None;
        }
        let b = libm::log(last.1 / first.1) / (last.0 - first.0);
        let problem = Problem {
            points,
            now: Vector2::new(libm::log(first.1) - b * first.0, b),
        };
        let (found, _) = LevenbergMarquardt::new().minimize(problem);
        let own = Self {
            a_n: libm::exp(found.now[0]),
            b_per_ma: found.now[1],
        };
        [own.a_n, own.b_per_ma]
            .iter()
            .all(|value| value.is_finite())
            .then_some(own)
    }

    /// Returns the peak force at the amplitude `ma`, N.
    #[must_use]
    pub fn at(&self, ma: f64) -> f64 {
        self.a_n * libm::exp(self.b_per_ma * ma)
    }

    /// Returns the ratio of the force scale A at the amplitude `ma` to A at `reference_ma`
    /// (equation 6).
    #[must_use]
    pub fn gain(&self, ma: f64, reference_ma: f64) -> f64 {
        libm::exp(self.b_per_ma * (ma - reference_ma))
    }
}

struct Problem<'a> {
    points: &'a [(f64, f64)],
    /// Values of ln a and b at the present iteration of the solver.
    now: Vector2<f64>,
}

impl LeastSquaresProblem<f64, Dyn, U2> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U2>;
    type ParameterStorage = Owned<f64, U2>;

    fn set_params(&mut self, x: &Vector2<f64>) {
        self.now = *x;
    }

    fn params(&self) -> Vector2<f64> {
        self.now
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let residual = |(ma, n): &(f64, f64)| libm::exp(self.now[0] + self.now[1] * ma) - n;
        Some(DVector::from_iterator(
            self.points.len(),
            self.points.iter().map(residual),
        ))
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, U2>> {
        Some(OMatrix::<f64, Dyn, U2>::from_fn(
            self.points.len(),
            |row, column| {
                let ma = self.points[row].0;
                let force = libm::exp(self.now[0] + self.now[1] * ma);
                if column == 0 { force } else { ma * force }
            },
        ))
    }
}

/// Agreement between an estimate and a measurement, in the three measures of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Coefficient of determination R²; 1 if estimate and measurement are equal.
    pub r2: f64,
    /// Root mean square error, N.
    pub rmse_n: f64,
    /// Root mean square error as a percentage of the largest measured force.
    pub nrmse_percent: f64,
}

/// Returns the agreement of estimated forces with measured ones, N. Both slices have the same
/// length.
#[must_use]
pub fn agreement(estimated: &[f64], measured: &[f64]) -> Agreement {
    let n = measured.len().max(1) as f64;
    let mean = measured.iter().sum::<f64>() / n;
    let pairs = estimated.iter().zip(measured);
    let off: f64 = pairs
        .map(|(estimated, measured)| (estimated - measured).powi(2))
        .sum();
    let total: f64 = measured.iter().map(|value| (value - mean).powi(2)).sum();
    let peak = measured.iter().copied().fold(f64::MIN, f64::max);
    let rmse_n = (off / n).sqrt();
    Agreement {
        r2: 1.0 - off / total,
        rmse_n,
        nrmse_percent: 100.0 * rmse_n / peak,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_is_found_again() {
        let truth = Exponential {
            a_n: 0.3,
            b_per_ma: 0.4,
        };
        let points: Vec<_> = (8..13)
            .map(f64::from)
            .map(|ma| (ma, truth.at(ma)))
            .collect();
        let found = Exponential::fit(&points).unwrap();
        assert!((found.a_n - 0.3).abs() < 1e-9 && (found.b_per_ma - 0.4).abs() < 1e-9);
        assert!((found.gain(8.0, 12.0) - truth.at(8.0) / truth.at(12.0)).abs() < 1e-9);
        assert_eq!(Exponential::fit(&points[..1]), None);
    }

    #[test]
    fn agreement_is_the_paper_s() {
        let result = agreement(&[1.0, 2.0, 3.0], &[1.0, 2.0, 4.0]);
        assert!((result.rmse_n - (1.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((result.nrmse_percent - 100.0 * result.rmse_n / 4.0).abs() < 1e-12);
        assert!((result.r2 - (1.0 - 1.0 / (14.0 / 3.0))).abs() < 1e-12);
    }
}
