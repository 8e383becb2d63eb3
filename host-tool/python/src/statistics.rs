//! Statistics of `host_core`, which are checked against SciPy.

use host_core::statistics::{self, StatisticsError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

fn refuse(error: StatisticsError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Paired t-test: mean difference, t, degrees of freedom, p.
#[pyfunction]
pub fn paired_t(first: Vec<f64>, second: Vec<f64>) -> PyResult<(f64, f64, usize, f64)> {
    let test = statistics::paired_t(&first, &second).map_err(refuse)?;
    Ok((test.mean_difference, test.t, test.df, test.p))
}

/// Wilcoxon signed-rank test: statistic, number of pairs, p.
#[pyfunction]
pub fn wilcoxon(first: Vec<f64>, second: Vec<f64>) -> PyResult<(f64, usize, f64)> {
    let test = statistics::wilcoxon(&first, &second).map_err(refuse)?;
    Ok((test.statistic, test.n, test.p))
}

/// Mann–Whitney U test: U, p.
#[pyfunction]
pub fn mann_whitney(first: Vec<f64>, second: Vec<f64>) -> PyResult<(f64, f64)> {
    let test = statistics::mann_whitney(&first, &second).map_err(refuse)?;
    Ok((test.u, test.p))
}

/// Friedman test: chi-squared, degrees of freedom, p.
#[pyfunction]
pub fn friedman(subjects: Vec<Vec<f64>>) -> PyResult<(f64, usize, f64)> {
    let test = statistics::friedman(&subjects).map_err(refuse)?;
    Ok((test.chi_squared, test.df, test.p))
}

/// Shapiro–Wilk test: W, p.
#[pyfunction]
pub fn shapiro_wilk(sample: Vec<f64>) -> PyResult<(f64, f64)> {
    let test = statistics::shapiro_wilk(&sample).map_err(refuse)?;
    Ok((test.w, test.p))
}

/// Holm's correction of p-values.
#[pyfunction]
pub fn holm(p: Vec<f64>) -> PyResult<Vec<f64>> {
    statistics::holm(&p).map_err(refuse)
}

/// Wilson interval of a share: share, low, high.
#[pyfunction]
pub fn wilson_share(successes: f64, trials: u64, level: f64) -> PyResult<(f64, f64, f64)> {
    let share = statistics::wilson_share(successes, trials, level).map_err(refuse)?;
    Ok((share.share, share.low, share.high))
}
