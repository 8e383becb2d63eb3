//! Ridge regression on random Fourier features (Gijsberts 2014, as in section 2.6 of the paper),
//! with cross-validated R² and normalised error.

use super::declaration::Regression;
use super::error::EndpointError;
use super::metrics::pearson;
use hal_sim::random::{self, Random};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Features √(2/D)·cos(ωx + b), with ω normally distributed with standard deviation 1/length, and b
/// uniform over a full turn (Rahimi and Recht 2007).
#[derive(Clone, Debug)]
pub struct Features {
    frequencies: DMatrix<f64>,
    phases: DVector<f64>,
}

impl Features {
    /// Generates the declared number of features for inputs with `inputs` components.
    #[must_use]
    pub fn new(how: &Regression, inputs: usize, seed: u64) -> Self {
        let normal = |row: usize, column: usize| {
            random::standard_normal(random::word(seed, 0), (row * inputs + column) as u64)
        };
        let mut random = Random::new(random::word(seed, 1));
        Self {
            frequencies: DMatrix::from_fn(how.features, inputs, |r, c| {
                normal(r, c) / how.length_scale
            }),
            phases: DVector::from_fn(how.features, |_, _| {
                random.between(0.0, std::f64::consts::TAU)
            }),
        }
    }

    /// Returns the features of one input.
    #[must_use]
    pub fn of(&self, input: &[f64]) -> DVector<f64> {
        let scale = (2.0 / self.phases.len() as f64).sqrt();
        let turned = &self.frequencies * DVector::from_column_slice(input) + &self.phases;
        turned.map(|value| scale * libm::cos(value))
    }

    /// Returns the features of several inputs, one row each.
    #[must_use]
    pub fn rows(&self, inputs: &[Vec<f64>]) -> DMatrix<f64> {
        let rows: Vec<_> = inputs
            .iter()
            .map(|input| self.of(input).transpose())
            .collect();
        DMatrix::from_rows(&rows)
    }
}

/// Returns the weights W of features Φ (rows) that minimise |Y - ΦW|² + ridge |W|². Uses the dual W
/// = Φᵀ (ΦΦᵀ + ridge)⁻¹ Y, which is the smaller system if there are more features than points.
///
/// # Errors
/// Returns E720 if the numbers of rows differ, or the system has no Cholesky factor.
pub fn ridge(
    features: &DMatrix<f64>,
    wanted: &DMatrix<f64>,
    ridge: f64,
) -> Result<DMatrix<f64>, EndpointError> {
    if features.nrows() != wanted.nrows() {
        let what = format!("{} inputs but {} outputs", features.nrows(), wanted.nrows());
        return Err(EndpointError::Regression(what));
    }
    let mut kernel = features * features.transpose();
    for at in 0..kernel.nrows() {
        kernel[(at, at)] += ridge;
    }
    let factor = kernel.cholesky().ok_or_else(|| {
        EndpointError::Regression("regression.ridge is too small for these points".to_owned())
    })?;
    Ok(features.transpose() * factor.solve(wanted))
}

/// Quality of a prediction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Square of Pearson's coefficient, averaged over outputs.
    pub r_squared: f64,
    /// Root mean square error divided by the output's range, averaged over outputs.
    pub nrmse: f64,
}

/// Predicts every row by a regression on the rows of all other groups, centred on their mean.
///
/// # Errors
/// Returns E720 like [`ridge`].
pub fn cross_validate(
    how: &Regression,
    seed: u64,
    (inputs, outputs): (&[Vec<f64>], &[Vec<f64>]),
    groups: &[usize],
) -> Result<Vec<Vec<f64>>, EndpointError> {
    let (width, all) = (inputs.first().map_or(0, Vec::len), groups.len());
    let columns = outputs.first().map_or(0, Vec::len);
    let features = Features::new(how, width, seed);
    let rows = features.rows(inputs);
    let mut answers = vec![vec![0.0; columns]; all];
    let mut names = groups.to_vec();
    names.sort_unstable();
    names.dedup();
    for group in names {
        let (out, within): (Vec<usize>, Vec<usize>) = (0..all).partition(|at| groups[*at] == group);
        let taught = rows.select_rows(&within);
        let wanted = DMatrix::from_fn(within.len(), columns, |r, c| outputs[within[r]][c]);
        let mean = wanted.row_mean();
        let centred = DMatrix::from_fn(within.len(), columns, |r, c| wanted[(r, c)] - mean[c]);
        let weights = ridge(&taught, &centred, how.ridge)?;
        let told = rows.select_rows(&out) * weights;
        for (row, at) in out.iter().enumerate() {
            answers[*at] = (0..columns).map(|c| told[(row, c)] + mean[c]).collect();
        }
    }
    Ok(answers)
}

/// Returns the fold of each of `n` rows, from 0. The rows are distributed evenly and in random
/// order.
#[must_use]
pub fn folds(n: usize, folds: usize, seed: u64) -> Vec<usize> {
    let mut all: Vec<usize> = (0..n).map(|at| at % folds).collect();
    Random::new(random::word(seed, 2)).shuffle(&mut all);
    all
}

/// Computes the score over these columns of the outputs; leaves out columns that do not vary.
#[must_use]
pub fn score(outputs: &[Vec<f64>], answers: &[Vec<f64>], columns: std::ops::Range<usize>) -> Score {
    let mut sums = [0.0; 3];
    for column in columns {
        let of =
            |all: &[Vec<f64>]| -> Vec<f64> { all.iter().map(|values| values[column]).collect() };
        let (wanted, told) = (of(outputs), of(answers));
        let fold = |first: f64, pick: fn(f64, f64) -> f64| wanted.iter().copied().fold(first, pick);
        let range = fold(f64::NEG_INFINITY, f64::max) - fold(f64::INFINITY, f64::min);
        let Ok(found) = pearson(&wanted, &told) else {
            continue;
        };
        let square: f64 = wanted.iter().zip(&told).map(|(a, b)| (a - b).powi(2)).sum();
        let rms = (square / wanted.len() as f64).sqrt();
        sums = [
            sums[0] + found.r * found.r,
            sums[1] + rms / range,
            sums[2] + 1.0,
        ];
    }
    let [r, e, n] = sums;
    Score {
        r_squared: r / f64::max(n, 1.0),
        nrmse: e / f64::max(n, 1.0),
    }
}
