//! From wanted and measured forces to numbers: alignment, correlations, errors.

use super::error::EndpointError;
use host_core::statistics;
use host_core::statistics::{StatisticsError, student_t_p};
use serde::{Deserialize, Serialize};

/// A target: what was wanted and what was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Number of its command among twelve: direction times magnitudes, then magnitude.
    pub command: usize,
    /// Wanted force, N.
    pub wanted_n: [f64; 3],
    /// Measured wrench, baseline subtracted, N and N m.
    pub measured: [f64; 6],
    /// Currents, mA.
    pub currents_ma: [f64; 9],
    /// Whether a muscle was at its greatest current and would have to be stronger.
    pub is_beyond: bool,
}

/// Pearson's correlation with its right-tailed p.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correlation {
    /// Coefficient.
    pub r: f64,
    /// Upper tail.
    pub p: f64,
}

/// Pearson's correlation of pairs and the right tail of its t with n - 2 degrees of
/// freedom (Student 1908).
///
/// # Errors
/// Fewer than three pairs, unequal lengths, values that do not vary.
pub fn pearson(first: &[f64], second: &[f64]) -> Result<Correlation, StatisticsError> {
    let n = first.len();
    if n < 3 {
        return Err(StatisticsError::TooFew {
            what: "pairs",
            given: n,
            least: 3,
        });
    }
    let mean = |all: &[f64]| all.iter().sum::<f64>() / n as f64;
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

/// Turns measured wrenches about the vertical so that forces lie nearest to the wanted
/// ones (Kabsch's problem with its axis given: one angle, in closed form). The angle, rad.
pub fn align(targets: &mut [Target]) -> f64 {
    let (mut across, mut along) = (0.0, 0.0);
    for target in &*targets {
        let ([wx, wy, _], [mx, my, ..]) = (target.wanted_n, target.measured);
        across += wy * mx - wx * my;
        along += wx * mx + wy * my;
    }
    let angle = across.atan2(along);
    let (sine, cosine) = angle.sin_cos();
    for target in targets {
        for at in [0, 3] {
            let (x, y) = (target.measured[at], target.measured[at + 1]);
            target.measured[at] = cosine * x - sine * y;
            target.measured[at + 1] = sine * x + cosine * y;
        }
    }
    angle
}

/// What a condition comes to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Correlation of wanted component (row) with measured component (column), of
    /// directions (unit vectors).
    pub correlations: [[Correlation; 3]; 3],
    /// Root mean square error of each component and of the vector's size, N.
    pub rmse_n: [f64; 4],
    /// Size of each target's error, N.
    pub errors_n: Vec<f64>,
    /// Angle between wanted and measured force of each target, degrees.
    pub angles_deg: Vec<f64>,
    /// Greatest wanted component of each axis and greatest size, N.
    pub range_n: [f64; 4],
}

fn unit(of: [f64; 3]) -> [f64; 3] {
    let size = size(of);
    of.map(|value| if size > 0.0 { value / size } else { 0.0 })
}

/// Euclidean norm.
#[must_use]
pub fn size(of: [f64; 3]) -> f64 {
    of.iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// Force of a wrench.
#[must_use]
pub const fn force([x, y, z, ..]: [f64; 6]) -> [f64; 3] {
    [x, y, z]
}

/// What these targets, aligned, come to.
///
/// # Errors
/// E721: too few, or nothing varies.
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
    let off = |target: &Target| -> [f64; 3] {
        std::array::from_fn(|axis| target.measured[axis] - target.wanted_n[axis])
    };
    let mean_square = |of: &dyn Fn(&Target) -> f64| {
        let sum: f64 = targets.iter().map(|target| of(target).powi(2)).sum();
        (sum / targets.len() as f64).sqrt()
    };
    let greatest = |of: &dyn Fn(&Target) -> f64| targets.iter().map(of).fold(0.0, f64::max);
    let angle = |target: &Target| {
        let (w, m) = (unit(target.wanted_n), unit(force(target.measured)));
        let dot: f64 = w.iter().zip(m).map(|(a, b)| a * b).sum();
        dot.clamp(-1.0, 1.0).acos().to_degrees()
    };
    Ok(Measures {
        correlations,
        rmse_n: std::array::from_fn(|axis| match axis {
            0..3 => mean_square(&|target| off(target)[axis]),
            _ => mean_square(&|target| size(off(target))),
        }),
        errors_n: targets.iter().map(|target| size(off(target))).collect(),
        angles_deg: targets.iter().map(angle).collect(),
        range_n: std::array::from_fn(|axis| match axis {
            0..3 => greatest(&|target| target.wanted_n[axis].abs()),
            _ => greatest(&|target| size(target.wanted_n)),
        }),
    })
}

impl Measures {
    /// Coefficients of its matrix's diagonal.
    #[must_use]
    pub fn diagonal(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.correlations[axis][axis].r)
    }

    /// Median size of the error, N.
    #[must_use]
    pub fn median_n(&self) -> f64 {
        median(&self.errors_n)
    }
}

/// The middle value, NaN of none: what [`host_core::statistics::bootstrap_bca`] resamples.
#[must_use]
pub fn median(all: &[f64]) -> f64 {
    statistics::median(all).unwrap_or(f64::NAN)
}
