//! Analysis of variance: repeated measures on one and on two factors, and two factors between
//! trials with replication.

use super::distribution::{chi_squared_p, fisher_f_p};
use super::sample::{
    StatisticsError, check_count, check_equal_length, check_finite, check_rows, check_varies,
    largest,
};

/// F-test of one source of variation: one factor, or an interaction of factors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Effect {
    /// Sum of squares of the effect.
    pub sum_squares: f64,
    /// Degrees of freedom of the effect, the numerator of F.
    pub df: usize,
    /// Sum of squares of the error, with which the effect is compared.
    pub error_sum_squares: f64,
    /// Degrees of freedom of the error, the denominator of F.
    pub error_df: usize,
    /// Test statistic F: mean square of the effect divided by mean square of the error.
    pub f: f64,
    /// p-value: upper tail of the F distribution.
    pub p: f64,
}

/// p-value corrected for lack of sphericity: both degrees of freedom are multiplied by ε.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CorrectedP {
    /// Estimate ε of sphericity. It is 1 where sphericity holds, and at least 1/df of the effect.
    pub epsilon: f64,
    /// p-value: upper tail of the F distribution with the corrected degrees of freedom.
    pub p: f64,
}

/// Result of Mauchly's test of sphericity.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mauchly {
    /// Statistic W, in [0, 1]. It is 1 if orthonormal contrasts have equal variances and no
    /// correlation.
    pub w: f64,
    /// Test statistic: scaled −ln W, which has approximately a χ² distribution.
    pub chi_squared: f64,
    /// Degrees of freedom of the χ² distribution.
    pub df: usize,
    /// p-value: upper tail of the χ² distribution with Anderson's second-order term.
    pub p: f64,
}

/// Effect of a factor that is repeated within subjects, with and without correction for lack of
/// sphericity.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RepeatedMeasures {
    /// Effect without correction.
    pub effect: Effect,
    /// Correction with Box's ε, as Greenhouse and Geisser (1959) estimate it.
    pub greenhouse_geisser: CorrectedP,
    /// Correction with ε as Huynh and Feldt (1976) estimate it, at most one.
    pub huynh_feldt: CorrectedP,
}

/// Result of an analysis of variance with two factors that are repeated within subjects.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TwoWayRepeated {
    /// Effect of the first factor.
    pub first: RepeatedMeasures,
    /// Effect of the second factor.
    pub second: RepeatedMeasures,
    /// Effect of the interaction of both factors.
    pub interaction: RepeatedMeasures,
}

/// Result of an analysis of variance with two fixed factors and several trials per cell.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TwoWay {
    /// Effect of the first factor.
    pub first: Effect,
    /// Effect of the second factor.
    pub second: Effect,
    /// Effect of the interaction of both factors.
    pub interaction: Effect,
}

/// Computes a one-way repeated-measures analysis of variance (Winer 1971, ch. 4). Rows are
/// subjects, columns are conditions, and each cell has one value.
///
/// # Errors
/// Fewer than two subjects or conditions, rows of unequal length, values that are not finite, no
/// variation besides that of subjects and conditions.
pub fn repeated_measures(subjects: &[Vec<f64>]) -> Result<RepeatedMeasures, StatisticsError> {
    check_rows(["subjects", "conditions"], subjects, 2)?;
    let magnitude = largest(subjects.iter().flatten());
    let scores: Vec<Vec<f64>> = subjects.iter().map(|row| centred(row)).collect();
    within_subjects_effect(&scores, scores[0].len() - 1, 1, magnitude)
}

/// Tests the sphericity that [`repeated_measures`] requires by Mauchly's test (Mauchly 1940; χ² and
/// its second-order term: Anderson 1958, 10.7.4). In the second-order term, R's `mauchly.test` and
/// other programs have the number of conditions in one place where Anderson has the number of
/// contrasts. This function agrees with these programs. Two conditions have no sphericity to test.
///
/// # Errors
/// The errors of [`repeated_measures`], fewer than three conditions, or not more subjects than
/// contrasts.
pub fn mauchly(subjects: &[Vec<f64>]) -> Result<Mauchly, StatisticsError> {
    check_rows(["subjects", "conditions"], subjects, 3)?;
    let p = subjects[0].len() - 1;
    check_count("subjects", subjects.len(), p + 2)?;
    let magnitude = largest(subjects.iter().flatten());
    // These are Helmert's contrasts: each condition against the mean of those before it.
    let contrast = |row: &Vec<f64>, at: usize| {
        let before = super::sample::mean(&row[..at]);
        (row[at] - before) * (at as f64 / (at as f64 + 1.0)).sqrt()
    };
    let scores = |at: usize| -> Vec<f64> {
        let contrasts: Vec<f64> = subjects.iter().map(|row| contrast(row, at)).collect();
        centred(&contrasts)
    };
    let scores: Vec<Vec<f64>> = (1..=p).map(scores).collect();
    let spread = squares(scores.iter().flatten().copied());
    check_varies(
        "differences between subjects",
        spread,
        magnitude,
        subjects.len(),
    )?;
    let product = |i: usize, j: usize| -> f64 {
        let pairs = scores[i].iter().zip(&scores[j]);
        pairs.map(|(a, b)| a * b).sum::<f64>() / (spread / p as f64)
    };
    let w = nalgebra::DMatrix::from_fn(p, p, product)
        .determinant()
        .clamp(0.0, 1.0);
    let (k, n) = (p as f64, subjects.len() as f64 - 1.0);
    let df = p * (p + 1) / 2 - 1;
    let rho = 1.0 - (2.0 * k * k + k + 2.0) / (6.0 * k * n);
    let second =
        (k + 2.0) * (k - 1.0) * (k - 2.0) * (2.0 * k.powi(3) + 6.0 * k * k + 3.0 * (k + 1.0) + 2.0)
            / (288.0 * (n * k * rho).powi(2));
    let chi_squared = -n * rho * libm::log(w.max(f64::MIN_POSITIVE));
    let tail = |more: usize| chi_squared_p(chi_squared.max(0.0), (df + more) as f64);
    let (first, fourth) = (tail(0)?, tail(4)?);
    Ok(Mauchly {
        w,
        chi_squared,
        df,
        p: (first + second * (fourth - first)).clamp(0.0, 1.0),
    })
}

/// Computes a two-way repeated-measures analysis of variance (Winer 1971, ch. 7.3).
/// `subjects[s][i][j]` is the value of subject `s` at level `i` of the first and level `j` of the
/// second factor. Every effect is compared with its own interaction with subjects.
///
/// # Errors
/// Fewer than two subjects or levels, unequal lengths, values that are not finite, an effect that
/// is the same for every subject.
pub fn two_way_repeated(subjects: &[Vec<Vec<f64>>]) -> Result<TwoWayRepeated, StatisticsError> {
    check_count("subjects", subjects.len(), 2)?;
    for subject in subjects {
        check_rows(["first factor", "second factor"], subject, 2)?;
        check_equal_length("first factor", subject.len(), subjects[0].len())?;
        check_equal_length("second factor", subject[0].len(), subjects[0][0].len())?;
    }
    let (a, b) = (subjects[0].len(), subjects[0][0].len());
    let magnitude = largest(subjects.iter().flatten().flatten());
    let mut scores = [vec![], vec![], vec![]];
    for subject in subjects {
        let (first, second, interaction) = split(subject);
        scores[0].push(first);
        scores[1].push(second);
        scores[2].push(interaction);
    }
    Ok(TwoWayRepeated {
        first: within_subjects_effect(&scores[0], a - 1, b, magnitude)?,
        second: within_subjects_effect(&scores[1], b - 1, a, magnitude)?,
        interaction: within_subjects_effect(&scores[2], (a - 1) * (b - 1), 1, magnitude)?,
    })
}

/// Computes a balanced two-way analysis of variance with replication (Winer 1971, ch. 5).
/// `cells[i][j]` has the values of the trials at level `i` of the first and level `j` of the second
/// factor, both fixed. All effects are compared with the variation within cells.
///
/// # Errors
/// Fewer than two levels or trials per cell, unequal lengths, values that are not finite, no
/// variation within cells.
pub fn two_way(cells: &[Vec<Vec<f64>>]) -> Result<TwoWay, StatisticsError> {
    check_count("first factor", cells.len(), 2)?;
    check_count("second factor", cells[0].len(), 2)?;
    check_count("trials", cells[0][0].len(), 2)?;
    for level in cells {
        check_equal_length("second factor", level.len(), cells[0].len())?;
        for cell in level {
            check_equal_length("trials", cell.len(), cells[0][0].len())?;
        }
    }
    check_finite("trials", cells.iter().flatten().flatten())?;
    let (a, b, n) = (cells.len(), cells[0].len(), cells[0][0].len());
    let residuals = cells.iter().flatten().flat_map(|cell| centred(cell));
    let error = (squares(residuals), a * b * (n - 1));
    let magnitude = largest(cells.iter().flatten().flatten());
    check_varies("trials", error.0, magnitude, a * b * n)?;
    let average = |cell: &Vec<f64>| super::sample::mean(cell);
    let row = |level: &Vec<Vec<f64>>| level.iter().map(average).collect::<Vec<f64>>();
    let means: Vec<Vec<f64>> = cells.iter().map(row).collect();
    let (first, second, interaction) = split(&means);
    let effect =
        |scores: Vec<f64>, count: usize, df| f_test((count as f64 * squares(scores), df), error);
    Ok(TwoWay {
        first: effect(first, b * n, a - 1)?,
        second: effect(second, a * n, b - 1)?,
        interaction: effect(interaction, n, (a - 1) * (b - 1))?,
    })
}

/// Returns the values minus their mean.
fn centred(values: &[f64]) -> Vec<f64> {
    let mean = super::sample::mean(values);
    values.iter().map(|value| value - mean).collect()
}

/// Splits a table into three parts: the means of its rows and of its columns, each minus the mean
/// of all values, and what remains of each value when these are subtracted (the interaction).
fn split(table: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (a, b) = (table.len(), table[0].len());
    let values = centred(&table.concat());
    let sum = |row: &[f64]| row.iter().sum::<f64>() / b as f64;
    let first: Vec<f64> = values.chunks(b).map(sum).collect();
    let column = |j: usize| values.iter().skip(j).step_by(b).sum::<f64>() / a as f64;
    let second: Vec<f64> = (0..b).map(column).collect();
    let left = |(at, value): (usize, &f64)| value - first[at / b] - second[at % b];
    let interaction = values.iter().enumerate().map(left).collect();
    (first, second, interaction)
}

/// Tests the effect that `scores` have in common against the differences between subjects. There is
/// one row per subject, and the sum of each row is zero. Each score is the mean of `count` values.
fn within_subjects_effect(
    scores: &[Vec<f64>],
    df: usize,
    count: usize,
    magnitude: f64,
) -> Result<RepeatedMeasures, StatisticsError> {
    let (n, k) = (scores.len(), scores[0].len());
    let column = |j: usize| scores.iter().map(|row| row[j]).sum::<f64>() / n as f64;
    let means: Vec<f64> = (0..k).map(column).collect();
    let less =
        |row: &Vec<f64>| -> Vec<f64> { row.iter().zip(&means).map(|(x, m)| x - m).collect() };
    let left: Vec<Vec<f64>> = scores.iter().map(less).collect();
    let error = squares(left.iter().flatten().copied());
    check_varies("differences between subjects", error, magnitude, n * k)?;
    let weight = count as f64;
    let between = weight * n as f64 * squares(means);
    let error_df = df * (n - 1);
    let effect = f_test((between, df), (weight * error, error_df))?;
    let corrected = |epsilon: f64| -> Result<CorrectedP, StatisticsError> {
        let p = fisher_f_p(effect.f, epsilon * df as f64, epsilon * error_df as f64)?;
        Ok(CorrectedP { epsilon, p })
    };
    let epsilon = greenhouse_geisser(&left, df);
    Ok(RepeatedMeasures {
        effect,
        greenhouse_geisser: corrected(epsilon)?,
        huynh_feldt: corrected(huynh_feldt(epsilon, df, n))?,
    })
}

/// Returns Greenhouse and Geisser's ε = tr(S)²/(df·tr(S²)), where S is the covariance matrix of the
/// effect's scores. The definition uses the covariance matrix of orthonormal contrasts, which has
/// the same tr(S) and tr(S²).
fn greenhouse_geisser(left: &[Vec<f64>], df: usize) -> f64 {
    let k = left[0].len();
    let product = |i: usize, j: usize| left.iter().map(|row| row[i] * row[j]).sum::<f64>();
    let trace: f64 = (0..k).map(|i| product(i, i)).sum();
    let pairs = (0..k).flat_map(|i| (0..k).map(move |j| (i, j)));
    let square = squares(pairs.map(|(i, j)| product(i, j) / trace));
    (1.0 / (df as f64 * square)).clamp(1.0 / df as f64, 1.0)
}

/// Returns Huynh and Feldt's ε, computed from Greenhouse and Geisser's `epsilon`.
fn huynh_feldt(epsilon: f64, df: usize, subjects: usize) -> f64 {
    let (scaled, n) = (epsilon * df as f64, subjects as f64);
    let (above, below) = (n * scaled - 2.0, df as f64 * (n - 1.0 - scaled));
    if below <= 0.0 {
        return 1.0;
    }
    (above / below).clamp(epsilon, 1.0)
}

/// Returns the F-test of two sums of squares, each given with its degrees of freedom. The error's
/// sum must be above zero.
fn f_test(effect: (f64, usize), error: (f64, usize)) -> Result<Effect, StatisticsError> {
    let f = (effect.0 / effect.1 as f64) / (error.0 / error.1 as f64);
    Ok(Effect {
        sum_squares: effect.0,
        df: effect.1,
        error_sum_squares: error.0,
        error_df: error.1,
        f,
        p: fisher_f_p(f, effect.1 as f64, error.1 as f64)?,
    })
}

/// Returns the sum of squares Σx².
fn squares(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().map(|value| value * value).sum()
}
