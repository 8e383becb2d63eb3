//! Draws figure 11, and our figure about model mismatches.

use super::analysis::TrainAnalysis;
use super::figures::{frequencies, marked};
use super::quality::printed_analyses;
use super::spread::{mean_sd, quantile_of_finite};
use super::study::{Part, Study};
use super::{SUBJECTS, paper};
use crate::laboratory::{Band, Curve, Plot, Plots, Sheet, SheetAxis};
use hal_sim::body::bench::Kind;

/// Returns mean and standard deviation of times, ms; NaN and 0 if there are none.
fn spread(own: &[f64]) -> (f64, f64) {
    mean_sd(own).unwrap_or((f64::NAN, 0.0))
}

/// Counts positions on an axis from 0.
fn places() -> impl Iterator<Item = f64> {
    (0..).map(f64::from)
}

/// Plots T_RT with its standard deviation at successive positions.
fn times(title: &str, x: SheetAxis, own: &[(f64, f64)], paper: Vec<[f64; 2]>) -> Plot {
    let points = places().zip(own).map(|(x, pair)| [x, pair.0]);
    let ranges = own.iter().map(|(mean, sd)| [mean - sd, mean + sd]);
    Plot {
        title: title.to_owned(),
        x,
        y: SheetAxis::linear("T_RT (ms)", [150.0, 420.0]),
        curves: vec![marked(0, points.collect(), ranges.collect())],
        paper,
        ..Plot::default()
    }
}

impl Study {
    pub(super) fn figure_11(&self, parts: &[Part]) -> Sheet {
        let analyses: Vec<&TrainAnalysis> = (0..SUBJECTS)
            .flat_map(|index| printed_analyses(parts, index))
            .collect();
        let by_frequency = |f: usize| {
            let own = analyses
                .iter()
                .filter_map(|analysis| analysis.responses.last()?[f]);
            spread(
                &own.map(|response| 1e3 * response.t_rt_s())
                    .collect::<Vec<_>>(),
            )
        };
        let by_amplitude = |i: usize| {
            let own = analyses
                .iter()
                .filter_map(|analysis| analysis.measured_t_rt_s.get(i));
            let own = own.flatten().flatten();
            spread(&own.map(|value| 1e3 * value).collect::<Vec<_>>())
        };
        let count = self.declared.trains.amplitudes;
        let left: Vec<(f64, f64)> = (0..3).map(by_frequency).collect();
        let right: Vec<(f64, f64)> = (0..count).map(by_amplitude).collect();
        let means =
            (0..3).map(|f| paper::TABLE_7.iter().map(|table_7| table_7[f]).sum::<f64>() / 10.0);
        let means = places().zip(means).map(|(x, value)| [x, value]).collect();
        let amplitudes = (1..=count).map(|i| format!("I{i}"));
        let plots = Plots {
            beside: 2,
            series: vec!["ours".to_owned()],
            plots: vec![
                times(
                    "by frequency",
                    SheetAxis::categorical("", frequencies()),
                    &left,
                    means,
                ),
                times(
                    "by amplitude",
                    SheetAxis::categorical("", amplitudes),
                    &right,
                    Vec::new(),
                ),
            ],
        };
        let caption = "T_RT, mean ± standard deviation over subjects. Left: fitted model, with \
                       the means of the paper's table 7. Right: measured force, which also \
                       contains the 40 ms average and noise.";
        Sheet::figure("Figure 11", "response time", caption.to_owned(), plots)
    }

    /// Plots NRMSE over the size of a model mismatch.
    pub(super) fn mismatches(&self, parts: &[Part]) -> Sheet {
        let plots = Plots {
            beside: 4,
            series: vec!["I5".to_owned(), "I1 to I4".to_owned()],
            plots: Kind::ALL.map(|kind| self.mismatch_of(parts, kind)).into(),
        };
        let caption = "Simulated muscles whose structure differs from the model: mean NRMSE over \
                       subjects of the model fitted at I5, against the size of the difference \
                       (bars: 10th to 90th percentile). At size 0 the structures are equal; \
                       docs/evidence/identify.md defines size 1. Horizontal lines: the paper's 8.06 % at \
                       I5 and 10.8 to 13.1 % at I1 to I4.";
        Sheet::figure(
            "Figure A",
            "error with other muscle structures",
            caption.to_owned(),
            plots,
        )
    }

    fn mismatch_of(&self, parts: &[Part], kind: Kind) -> Plot {
        let last = self.declared.trains.amplitudes - 1;
        let band = |series, low, middle, high| Band {
            series,
            low,
            middle,
            high,
        };
        Plot {
            title: kind.name().to_owned(),
            x: SheetAxis::linear("size", [0.0, 1.0]),
            y: SheetAxis::linear("NRMSE (%)", [0.0, 30.0]),
            bands: vec![
                band(0, paper::NRMSE_I5, paper::NRMSE_I5, paper::NRMSE_I5),
                band(1, 10.8, 12.0, 13.1),
            ],
            curves: vec![
                self.nrmse_curve(parts, kind, (0, last, last + 1)),
                self.nrmse_curve(parts, kind, (1, 0, last)),
            ],
            ..Plot::default()
        }
    }

    /// Returns the mean NRMSE at the amplitudes `from..to` against the size of the mismatch. The
    /// first point, at size 0, has the structure of the model.
    fn nrmse_curve(
        &self,
        parts: &[Part],
        kind: Kind,
        (series, from, to): (usize, usize, usize),
    ) -> Curve {
        let own = (0..SUBJECTS).flat_map(|index| printed_analyses(parts, index));
        let own = own.flat_map(|analysis| analysis.agreements.get(from..to).unwrap_or_default());
        let mut groups = vec![(0.0, own.map(|fit| fit.nrmse_percent).collect::<Vec<f64>>())];
        for size in &self.declared.foreign.sizes {
            let foreign = parts.iter().filter_map(|part| match part {
                Part::Foreign(Ok(part)) => Some(part),
                _ => None,
            });
            let is = |foreign: hal_sim::body::bench::Foreign| {
                foreign.kind == kind && foreign.size == *size
            };
            let foreign = foreign.filter(|mismatch| is(mismatch.foreign));
            let numbers = foreign
                .flat_map(|mismatch| mismatch.nrmse_percent.get(from..to).unwrap_or_default());
            groups.push((*size, numbers.copied().collect()));
        }
        let (mut points, mut ranges) = (Vec::new(), Vec::new());
        for (size, numbers) in groups {
            let Some((mean, _)) = mean_sd(&numbers) else {
                continue;
            };
            let end = |part| quantile_of_finite(numbers.iter().copied(), part).unwrap_or(mean);
            points.push([size, mean]);
            ranges.push([end(0.1), end(0.9)]);
        }
        marked(series, points, ranges)
    }
}
