//! Computes alignment, correlations and errors from reference and measured forces.

use super::error::EndpointError;
use host_core::statistics;
use host_core::statistics::{StatisticsError, student_t_p};
use serde::{Deserialize, Serialize};

/// One contraction: the reference force, the measured wrench and the currents.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Number of the command among twelve: direction times the number of magnitudes, plus
    /// magnitude.
    pub command: usize,
    /// Reference force at the hand, N.
    pub wanted_n: [f64; 3],
    /// Measured wrench after subtraction of the baseline, N and N·m.
    pub measured: [f64; 6],
    /// Current of each muscle, mA.
    pub currents_ma: [f64; 9],
    /// Whether a muscle was at its largest current and would have needed more.
    pub is_beyond: bool,
}

/// Pearson's correlation and its right-tailed p.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correlation {
    /// Correlation coefficient, −1 to 1.
    pub r: f64,
    /// Probability of at least this coefficient without a correlation (right-tailed p), 0 to 1.
    pub p: f64,
}

/// Returns Pearson's correlation of pairs and the right tail of its t with n - 2 degrees of freedom
/// (Student 1908). Both slices must have the same length.
///
/// # Errors
/// Fails if there are fewer than three pairs, or the values do not vary.
pub fn pearson(first: &[f64], second: &[f64]) -> Result<Correlation, StatisticsError> {
    let n = first.len();
    if n < 3 {
        return Err(StatisticsError::TooFew {
            what: "pairs",
            given: n,
            least: 3,
        });
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n as f64;
    let (a, b) = (mean(first), mean(second));
    let pairs = first.iter().zip(second).map(|(x, y)| (x - a, y - b));
    let [xy, xx, yy] = pairs.fold([0.0; 3], |[xy, xx, yy], (x, y)| {
        [xy + x * y, xx + x * x, yy + y * y]
    });
    if xx <= 0.0 || yy <= 0.0 {
        return Err(StatisticsError::NoVariance { what: "pairs" });
    }
    let r = (xy / (xx * yy).sqrt()).clamp(-1.0, 1.0);
    let df = n as f64 - 2.0;
    let t = r * (df / (1.0 - r * r).max(f64::MIN_POSITIVE)).sqrt();
    let half = 0.5 * student_t_p(t.clamp(-1e100, 1e100), df)?;
    let p = if r > 0.0 { half } else { 1.0 - half };
    Ok(Correlation { r, p })
}

/// Rotates the measured wrenches about the vertical so that their forces lie nearest to the
/// reference forces, and returns the angle, rad. This is Kabsch's problem with a given axis; its
/// only angle has a closed form.
pub fn align(targets: &mut [Target]) -> f64 {
    let (mut across, mut along) = (0.0, 0.0);
    for target in &*targets {
        let ([wx, wy, _], [mx, my, ..]) = (target.wanted_n, target.measured);
        across += wy * mx - wx * my;
        along += wx * mx + wy * my;
    }
    let angle = libm::atan2(across, along);
    let (sine, cosine) = libm::sincos(angle);
    for target in targets {
        for first in [0, 3] {
            let (x, y) = (target.measured[first], target.measured[first + 1]);
            target.measured[first] = cosine * x - sine * y;
            target.measured[first + 1] = sine * x + cosine * y;
        }
    }
    angle
}

/// Correlations and errors of the targets of one condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Correlation of each reference component (row) with each measured component (column). The
    /// components are those of unit vectors, so they describe directions.
    pub correlations: [[Correlation; 3]; 3],
    /// Root mean square error of each component, and root mean square of the error vector's size,
    /// N.
    pub rmse_n: [f64; 4],
    /// Size of each target's error, N.
    pub errors_n: Vec<f64>,
    /// Angle between the reference and the measured force of each target, °.
    pub angles_deg: Vec<f64>,
    /// Largest absolute reference component of each axis, and largest magnitude of a reference
    /// force, N.
    pub range_n: [f64; 4],
}

/// Returns the unit vector along `vector`, or 0 for a vector of size 0.
fn unit(vector: [f64; 3]) -> [f64; 3] {
    let size = size(vector);
    vector.map(|component| if size > 0.0 { component / size } else { 0.0 })
}

/// Returns the Euclidean norm.
#[must_use]
pub fn size(vector: [f64; 3]) -> f64 {
    vector
        .iter()
        .map(|component| component * component)
        .sum::<f64>()
        .sqrt()
}

/// Returns the force of a wrench, its first three components.
#[must_use]
pub const fn force([x, y, z, ..]: [f64; 6]) -> [f64; 3] {
    [x, y, z]
}

/// Computes correlations and errors of targets that [`align`] has rotated.
///
/// # Errors
/// Returns E721 if there are too few targets, or if a component does not vary.
pub fn measures(targets: &[Target]) -> Result<Measures, EndpointError> {
    let wrong = |error| EndpointError::Statistics("a condition's targets", error);
    let component = |of: &dyn Fn(&Target) -> [f64; 3], axis: usize| -> Vec<f64> {
        targets
            .iter()
            .map(|target| unit(of(target))[axis])
            .collect()
    };
    let mut correlations = [[Correlation { r: 0.0, p: 1.0 }; 3]; 3];
    for (wanted, row) in correlations.iter_mut().enumerate() {
        for (measured, cell) in row.iter_mut().enumerate() {
            let first = component(&|target| target.wanted_n, wanted);
            let second = component(&|target| force(target.measured), measured);
            *cell = pearson(&first, &second).map_err(wrong)?;
        }
    }
    let error_n = |target: &Target| -> [f64; 3] {
        std::array::from_fn(|axis| target.measured[axis] - target.wanted_n[axis])
    };
    let root_mean_square = |of: &dyn Fn(&Target) -> f64| {
        let sum: f64 = targets.iter().map(|target| of(target).powi(2)).sum();
        (sum / targets.len() as f64).sqrt()
    };
    let greatest = |of: &dyn Fn(&Target) -> f64| targets.iter().map(of).fold(0.0, f64::max);
    let angle_deg = |target: &Target| {
        let (wanted, measured) = (unit(target.wanted_n), unit(force(target.measured)));
        let dot: f64 = wanted.iter().zip(measured).map(|(a, b)| a * b).sum();
        libm::acos(dot.clamp(-1.0, 1.0)).to_degrees()
    };
    Ok(Measures {
        correlations,
        rmse_n: std::array::from_fn(|axis| match axis {
            0..3 => root_mean_square(&|target| error_n(target)[axis]),
            _ => root_mean_square(&|target| size(error_n(target))),
        }),
        errors_n: targets.iter().map(|target| size(error_n(target))).collect(),
        angles_deg: targets.iter().map(angle_deg).collect(),
        range_n: std::array::from_fn(|axis| match axis {
            0..3 => greatest(&|target| target.wanted_n[axis].abs()),
            _ => greatest(&|target| size(target.wanted_n)),
        }),
    })
}

impl Measures {
    /// Returns the coefficients on the diagonal of the correlation matrix.
    #[must_use]
    pub fn diagonal(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.correlations[axis][axis].r)
    }

    /// Returns the median size of the error, N.
    #[must_use]
    pub fn median_n(&self) -> f64 {
        median(&self.errors_n)
    }
}

/// Returns the median, or NaN if there are no values. This is the statistic that
/// [`host_core::statistics::bootstrap_bca`] resamples.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    statistics::median(values).unwrap_or(f64::NAN)
}
