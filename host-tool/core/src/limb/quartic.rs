//! Activation as a polynomial of a joint's angle.

use nalgebra::{DMatrix, DVector};

/// Number of terms of a quartic.
pub const TERMS: usize = 5;

/// Quartic polynomial of a joint angle, with its residuals at the points to which it was fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quartic {
    /// Smallest and largest angle of the fitted points, °.
    pub range_deg: [f64; 2],
    /// Coefficients of u⁰ to u⁴, with u = −1 at the smallest angle and 1 at the largest.
    pub coefficients: [f64; TERMS],
    /// Root mean square of the residuals, in the unit of the fitted values.
    pub rms: f64,
    /// Largest absolute residual, in the unit of the fitted values.
    pub most: f64,
}

/// Error for points to which no quartic can be fitted (E762). The value is the number of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "E762 a quartic needs finite values at five or more different angles; {0} points were given"
)]
pub struct NoQuartic(pub usize);

impl Quartic {
    /// Quartic that is zero at every angle.
    pub const NONE: Self = Self {
        range_deg: [0.0, 1.0],
        coefficients: [0.0; TERMS],
        rms: 0.0,
        most: 0.0,
    };

    /// Fits a quartic by least squares to `points`, each an angle in ° and a value. This is
    /// equation 3 of Buatier de Mongeot, but in a scaled variable that avoids rounding errors.
    ///
    /// # Errors
    /// [`NoQuartic`] if there are fewer than five points, a number is not finite, or all angles are
    /// equal.
    pub fn fit(points: &[(f64, f64)]) -> Result<Self, NoQuartic> {
        let refused = NoQuartic(points.len());
        let finite = |pair: &(f64, f64)| pair.0.is_finite() && pair.1.is_finite();
        if points.len() < TERMS || !points.iter().all(finite) {
            return Err(refused);
        }
        let angles = || points.iter().map(|point| point.0);
        let range_deg = [
            angles().fold(f64::INFINITY, f64::min),
            angles().fold(f64::NEG_INFINITY, f64::max),
        ];
        if range_deg[1] - range_deg[0] < 1e-6 {
            return Err(refused);
        }
        let powers = DMatrix::from_fn(points.len(), TERMS, |row, power| {
            scaled(range_deg, points[row].0).powi(power as i32)
        });
        let values = DVector::from_iterator(points.len(), points.iter().map(|point| point.1));
        let solved = powers
            .svd(true, true)
            .solve(&values, 1e-10)
            .map_err(|_| refused)?;
        let mut found = Self {
            range_deg,
            coefficients: std::array::from_fn(|power| solved[power]),
            ..Self::NONE
        };
        let left = |(deg, value): &(f64, f64)| (found.at(*deg) - value).abs();
        let left: Vec<f64> = points.iter().map(left).collect();
        let squares: f64 = left.iter().map(|value| value * value).sum();
        found.rms = (squares / points.len() as f64).sqrt();
        found.most = left.into_iter().fold(0.0, f64::max);
        Ok(found)
    }

    /// Returns the value at an angle in °. Outside the range of the fitted angles, this is the
    /// value at the nearer end of the range.
    #[must_use]
    pub fn at(&self, deg: f64) -> f64 {
        let u = scaled(self.range_deg, deg).clamp(-1.0, 1.0);
        self.coefficients
            .iter()
            .rev()
            .fold(0.0, |sum, a| sum * u + a)
    }

    /// Returns the coefficients a₀ to a₄ of the powers of the angle in °, as equation 3 of Buatier
    /// de Mongeot is printed.
    #[must_use]
    pub fn degree_coefficients(&self) -> [f64; TERMS] {
        let [low, high] = self.range_deg;
        let (slope, offset) = (2.0 / (high - low), -(high + low) / (high - low));
        let mut sum = [0.0; TERMS];
        for coefficient in self.coefficients.iter().rev() {
            // sum ← sum·(slope·q + offset) + coefficient
            let before = sum;
            for (power, value) in sum.iter_mut().enumerate() {
                let lower = if power == 0 { 0.0 } else { before[power - 1] };
                *value = before[power] * offset + lower * slope;
            }
            sum[0] += coefficient;
        }
        sum
    }
}

fn scaled([low, high]: [f64; 2], deg: f64) -> f64 {
    (2.0 * deg - low - high) / (high - low)
}
