//! Runs the paper's statistical tests on one simulated study.

use super::declaration::{Condition, Metric};
use super::error::LiftError;
use super::participant::Participant;
use host_core::statistics::{
    StatisticsError, bonferroni, mauchly, paired_t, repeated_measures, shapiro_wilk,
};
use serde::{Deserialize, Serialize};

/// Pairs of conditions, by their indices in [`Condition::ALL`].
pub const PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Test results of one metric.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Tested {
    pub metric: Metric,
    /// Index of the target height; `None` for the mean over all heights.
    pub height: Option<usize>,
    /// Mean and standard error in each condition.
    pub means: [[f64; 2]; 3],
    /// p of the Shapiro–Wilk test in each condition.
    pub normal_p: [f64; 3],
    /// p of Mauchly's test of sphericity.
    pub sphericity_p: f64,
    /// F of the condition and its p, which has the Greenhouse–Geisser correction if sphericity
    /// fails.
    pub anova: [f64; 2],
    /// Greenhouse–Geisser ε: factor of the degrees of freedom in the corrected test, at most 1.
    pub epsilon: f64,
    /// Paired t, and p times three (Bonferroni), for each of [`PAIRS`].
    pub pairs: [[f64; 2]; 3],
}

/// Tests a metric of these participants; sphericity fails if Mauchly's p is below `level`.
///
/// # Errors
/// Fails with E768 if the values do not vary or are too few.
pub fn test_metric(
    people: &[Participant],
    (metric, height): (Metric, Option<usize>),
    level: f64,
) -> Result<Tested, LiftError> {
    let fails =
        |why: StatisticsError| LiftError::Statistics(metric.name_and_unit().0.to_owned(), why);
    let condition_values = |at: usize| -> Vec<f64> {
        let own = people
            .iter()
            .filter_map(|participant| participant.condition_result(Condition::ALL[at]));
        own.map(|result| result.value(metric, height)).collect()
    };
    let columns = [
        condition_values(0),
        condition_values(1),
        condition_values(2),
    ];
    let rows: Vec<Vec<f64>> = (0..people.len())
        .map(|person| columns.iter().map(|column| column[person]).collect())
        .collect();
    let repeated = repeated_measures(&rows).map_err(fails)?;
    let sphericity_p = mauchly(&rows).map_err(fails)?.p;
    let corrected = repeated.greenhouse_geisser;
    let p = if sphericity_p < level {
        corrected.p
    } else {
        repeated.effect.p
    };
    let (mut normal_p, mut means) = ([0.0; 3], [[0.0; 2]; 3]);
    for (at, column) in columns.iter().enumerate() {
        normal_p[at] = shapiro_wilk(column).map_err(fails)?.p;
        means[at] = mean_and_error(column);
    }
    let mut pairs = [[0.0; 2]; 3];
    for (own, [a, b]) in pairs.iter_mut().zip(PAIRS) {
        let found = paired_t(&columns[a], &columns[b]).map_err(fails)?;
        *own = [found.t, found.p];
    }
    let adjusted = bonferroni(&pairs.map(|pair| pair[1])).map_err(fails)?;
    for (own, p) in pairs.iter_mut().zip(adjusted) {
        own[1] = p;
    }
    Ok(Tested {
        metric,
        height,
        means,
        normal_p,
        sphericity_p,
        anova: [repeated.effect.f, p],
        epsilon: corrected.epsilon,
        pairs,
    })
}

/// Returns the mean and its standard error.
#[must_use]
pub(super) fn mean_and_error(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    [mean, (squares / (n - 1.0) / n).sqrt()]
}
