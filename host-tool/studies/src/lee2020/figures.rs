//! Draws figures 7 to 10 with the paper's values.

use super::analysis::{TrainAnalysis, run_analysis};
use super::error::LeeError;
use super::outcome::peak_pairs;
use super::protocol::Session;
use super::quality::printed_analyses;
use super::study::{Part, Study};
use super::{SUBJECTS, name, paper};
use crate::laboratory::{Curve, Plot, Plots, Sheet, SheetAxis};
use host_core::identify::{ForceRecord, moving_average, simulate_record};

/// Subject with the best exponential fit in the paper's figure 7: K05, counted from 0.
const BEST: usize = 4;
/// Subject with the worst exponential fit in the paper's figure 7: K03, counted from 0.
const WORST: usize = 2;
/// Subject whose force over time figures 9 and 10 show: K10, counted from 0.
const COURSE: usize = 9;
/// Interval between plotted points, ms.
const EVERY: usize = 10;

pub(super) fn frequencies() -> Vec<String> {
    ["20 Hz", "30 Hz", "40 Hz"].map(str::to_owned).into()
}

pub(super) fn marked(series: usize, points: Vec<[f64; 2]>, ranges: Vec<[f64; 2]>) -> Curve {
    Curve {
        series,
        marked: true,
        points,
        ranges,
    }
}

impl Study {
    /// Returns all figures in their order; none if a subject has no results.
    pub(super) fn figures(&self, parts: &[Part]) -> Result<Vec<Sheet>, LeeError> {
        if (0..SUBJECTS).any(|index| printed_analyses(parts, index).next().is_none()) {
            return Ok(Vec::new());
        }
        let mut sheets = vec![self.figure_7(parts), self.figure_8(parts)];
        let session = self.printed_session(COURSE, 0)?;
        let found = run_analysis(&session, &self.declared)?;
        sheets.extend(self.figures_9_and_10(&session, &found));
        sheets.push(self.figure_11(parts));
        sheets.push(self.mismatches(parts));
        Ok(sheets)
    }

    fn figure_7(&self, parts: &[Part]) -> Sheet {
        let plot = |subject: usize| {
            let own = printed_analyses(parts, subject).next()?;
            let first = *own.amplitudes.first()?;
            let last = *own.amplitudes.last()?;
            let mut curves = Vec::new();
            for (f, exponential) in own.exponentials.iter().enumerate() {
                let (exponential, _) = (*exponential)?;
                let points = (0..=40).map(|i| first + (last - first) * f64::from(i) / 40.0);
                curves.push(Curve::line(f, points.map(|ma| [ma, exponential.at(ma)])));
                let peaks = own.amplitudes.iter().zip(&own.peaks_n);
                curves.push(marked(
                    f,
                    peaks.map(|(ma, n)| [*ma, n[f]]).collect(),
                    Vec::new(),
                ));
            }
            let most = own.peaks_n.iter().flatten().copied().fold(0.0, f64::max);
            Some(Plot {
                title: name(subject),
                x: SheetAxis::linear("amplitude (mA)", [first, last]),
                y: SheetAxis::linear("peak force (N)", [0.0, 1.1 * most]),
                curves,
                ..Plot::default()
            })
        };
        let plots = Plots {
            beside: 2,
            series: frequencies(),
            plots: [BEST, WORST].into_iter().filter_map(plot).collect(),
        };
        let caption = "Peak forces of the first replication, and the exponential fitted to them. \
                       The paper shows K05 as the subject with the best fit (R² 0.97 to 0.99) and \
                       K03 as the one with the worst (0.90 to 0.93); on the simulated test rig \
                       the order is different.";
        Sheet::figure(
            "Figure 7",
            "exponential fits of peak force",
            caption.to_owned(),
            plots,
        )
    }

    fn figure_8(&self, parts: &[Part]) -> Sheet {
        let points: Vec<[f64; 2]> = self
            .draw_analyses(parts, 0)
            .into_iter()
            .flat_map(peak_pairs)
            .map(|(measured, estimated)| [measured, estimated])
            .collect();
        let most = points.iter().flatten().copied().fold(1.0, f64::max);
        // Each point is a curve of its own, so that no line joins them.
        let alone = points
            .iter()
            .map(|point| marked(0, vec![*point], Vec::new()));
        let slope = Curve::line(1, [[0.0, 0.0], [most, paper::FIGURE_8[0] * most]]);
        let curves = alone.chain([slope]).collect();
        let plot = Plot {
            x: SheetAxis::linear("measured peak (N)", [0.0, most]),
            y: SheetAxis::linear("estimated peak (N)", [0.0, most]),
            curves,
            ..Plot::default()
        };
        let plots = Plots {
            beside: 1,
            series: vec!["ours".to_owned(), "the paper's slope".to_owned()],
            plots: vec![plot],
        };
        let caption = "All amplitudes and frequencies of the first replication. The line has the \
                       paper's slope of 0.92; the paper does not print its intercept.";
        Sheet::figure(
            "Figure 8",
            "estimated against measured peak force",
            caption.to_owned(),
            plots,
        )
    }

    /// Draws measured and modelled force of K10's first replication: at I5 in figure 9, at I1 to I4
    /// in figure 10.
    fn figures_9_and_10(&self, session: &Session, found: &TrainAnalysis) -> Vec<Sheet> {
        let last = session.amplitudes.0.len() - 1;
        let sheet = |number: &str, amplitudes: std::ops::Range<usize>, caption: &str| {
            let pairs = amplitudes.flat_map(|i| (0..3).map(move |f| (i, f)));
            let plots = Plots {
                beside: 3,
                series: vec!["measured".to_owned(), "model".to_owned()],
                plots: pairs.map(|at| self.course(session, found, at)).collect(),
            };
            Sheet::figure(number, "force of K10", caption.to_owned(), plots)
        };
        vec![
            sheet(
                "Figure 9",
                last..last + 1,
                "Measured force and model at I5, where the model is fitted; both are averaged \
                 over 40 ms.",
            ),
            sheet(
                "Figure 10",
                0..last,
                "Measured force and model at I1 to I4, with A from equation 6; both are averaged \
                 over 40 ms.",
            ),
        ]
    }

    /// Plots measured and modelled force over time, for one amplitude and frequency.
    fn course(&self, session: &Session, found: &TrainAnalysis, (i, f): (usize, usize)) -> Plot {
        let constants = found.fits[1].constants;
        let last = session.amplitudes.0.len() - 1;
        let reference_ma = session.amplitudes.0[last];
        let (ma, record) = (session.amplitudes.0[i], &session.records[i][f]);
        let gain = match &found.exponentials[f] {
            _ if i == last => 1.0,
            Some((exponential, _)) => exponential.gain(ma, reference_ma),
            None => 0.0,
        };
        let model = ForceRecord {
            gain,
            ..record.clone()
        };
        let thin = |forces_n: Vec<f64>| {
            let samples = forces_n.into_iter().enumerate().step_by(EVERY);
            samples
                .map(|(ms, n)| [1e-3 * ms as f64, n])
                .collect::<Vec<_>>()
        };
        let measured = thin(moving_average(&record.relative_to_rest()));
        let model = thin(moving_average(&simulate_record(constants, &model).0));
        let points = measured.iter().chain(&model);
        let most = points.map(|values| values[1]).fold(0.1, f64::max);
        Plot {
            title: format!("I{}, {} Hz", i + 1, self.declared.trains.frequencies_hz[f]),
            x: SheetAxis::linear("time (s)", [0.0, 2.5]),
            y: SheetAxis::linear("force (N)", [-0.05 * most, 1.15 * most]),
            curves: vec![Curve::line(0, measured), Curve::line(1, model)],
            ..Plot::default()
        }
    }
}
