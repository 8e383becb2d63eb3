//! Builds the result of the study for `result.json` and its page.

use super::analysis::TrainAnalysis;
use super::declaration::DECLARED;
use super::error::LeeError;
use super::quality::{FitKind, replications};
use super::spread::{mean_sd, regression, row};
use super::study::{Part, Study};
use super::{SUBJECTS, name, paper};
use crate::laboratory::{Outcome, Preregistration, Row};
use host_core::identify::NAMES;
use host_core::record::sha256;

/// Note in every result that the wearers are simulated.
const SIMULATED: &str = "Simulated: test rigs with the parameters of the paper's tables and with \
                         assumed recruitment, sensor and noise; no evidence about people.";
const MEANING: &str = "Ours is the median; low and high are the 5th and 95th percentiles over the \
                       replications. For a mean over subjects, they are taken over the means of \
                       the replications.";
const PRINTED: &str = "Tables 2 to 7 use trains at the printed amplitudes. The paper says that \
                       I_MT was found in steps of 0.5 mA as the amplitude at which force exceeds \
                       0.015 N. But the force that it prints at I_MT is 1.5 to 11 N, a hundred \
                       times as much. If force rises continuously from zero, both cannot be true. \
                       The test rig reproduces the printed forces: its fibres begin to respond at \
                       0.8 of the printed I_MT (assumed). A search by force therefore finds a \
                       lower I_MT than the printed one.";
const OWN: &str = "Coverage, Cramér-Rao bound and threshold errors are our additions: the paper \
                   has no true values for comparison. A test rig with the same structure as the \
                   fitted model shows that the arithmetic is correct, and nothing about muscles. \
                   Figure A shows how well the model fits test rigs with other structures.";

/// Information about the run that only the command knows.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Arguments that repeat the result on a terminal, without the seed.
    pub command: String,
    /// Description of the missing part; `None` for a complete result.
    pub cut_short: Option<String>,
    /// Results of the check on the device, in words.
    pub device: Vec<String>,
}

impl Study {
    /// Builds the result from the computed units, which are incomplete if the run was interrupted.
    ///
    /// # Errors
    /// Fails if a subject for the figures cannot be simulated.
    pub fn outcome(&self, parts: &[Part], run_info: RunInfo) -> Result<Outcome, LeeError> {
        let mut sheets = self.tables(parts);
        sheets.extend(self.figures(parts)?);
        let notes = [SIMULATED, MEANING, PRINTED, OWN]
            .map(str::to_owned)
            .into_iter();
        let notes = notes.chain(run_info.device).chain(failures(parts));
        Ok(Outcome {
            name: "lee".to_owned(),
            title: self.declared.title.clone(),
            seed: self.seed,
            simulated: Some(true),
            cut_short: run_info.cut_short,
            declared: Preregistration {
                asked: "lee".to_owned(),
                command: Some(run_info.command),
                device: Some(self.device.to_argument()),
                sha256: [("lee.toml".to_owned(), sha256(DECLARED.as_bytes()))].into(),
                source: self.declared.source.clone(),
                draws: self.draws,
                drawn: None,
                as_declared: self.is_as_declared(),
            },
            conditions: Vec::new(),
            rows: self.rows(parts),
            shares: self.shares(parts),
            decides: Vec::new(),
            sheets,
            notes: notes.collect(),
        })
    }

    fn rows(&self, parts: &[Part]) -> Vec<Row> {
        let mut rows = Vec::new();
        for (f, hz) in self.declared.trains.frequencies_hz.iter().enumerate() {
            let [a, b, r2, _, nrmse] = paper::TABLE_3[f];
            let mut add =
                |id: &str,
                 quantity: &str,
                 unit: &str,
                 printed: f64,
                 number: &dyn Fn(&TrainAnalysis) -> Option<f64>| {
                    let (id, quantity) = (format!("{id}-{hz}"), format!("{quantity}, {hz} Hz"));
                    rows.push(row(
                        (&id, &quantity, unit),
                        Some(printed),
                        self.means(parts, number),
                    ));
                };
            let own = move |analysis: &TrainAnalysis| analysis.exponentials[f];
            add("a", "a of the exponential fit", "N", a, &|analysis| {
                Some(own(analysis)?.0.a_n)
            });
            add("b", "b of the exponential fit", "1/mA", b, &|analysis| {
                Some(own(analysis)?.0.b_per_ma)
            });
            add("r2", "R² of the exponential fit", "", r2, &|analysis| {
                Some(own(analysis)?.1.r2)
            });
            add(
                "nrmse",
                "NRMSE of the exponential fit",
                "%",
                nrmse,
                &|analysis| Some(own(analysis)?.1.nrmse_percent),
            );
            let table_7 = paper::TABLE_7.iter().map(|table_7| table_7[f]).sum::<f64>() / 10.0;
            add("t-rt", "T_RT", "ms", table_7, &|analysis| {
                Some(1e3 * analysis.responses.last()?[f]?.t_rt_s())
            });
        }
        for (i, [_, printed]) in paper::TABLE_5_MEANS.iter().enumerate() {
            let (id, quantity) = (
                format!("model-i{}", i + 1),
                format!("NRMSE of the model at I{}", i + 1),
            );
            let own = self.means(parts, &|analysis| {
                Some(analysis.agreements.get(i)?.nrmse_percent)
            });
            rows.push(row((&id, &quantity, "%"), Some(*printed), own));
        }
        rows.extend(self.figure_8_rows(parts));
        rows.extend(self.own_rows(parts));
        rows
    }

    fn figure_8_rows(&self, parts: &[Part]) -> Vec<Row> {
        let results = (0..self.draws).filter_map(|draw| {
            let analyses: Vec<&TrainAnalysis> = self.draw_analyses(parts, draw);
            let points: Vec<(f64, f64)> = analyses
                .iter()
                .flat_map(|analysis| peak_pairs(analysis))
                .collect();
            let (slope, r2) = regression(&points)?;
            let square = points.iter().map(|(m, e)| (m - e).powi(2)).sum::<f64>();
            Some([slope, r2, (square / points.len() as f64).sqrt()])
        });
        let results: Vec<[f64; 3]> = results.collect();
        let names = [
            (
                "figure-8-slope",
                "slope of estimated over measured peaks",
                "",
            ),
            ("figure-8-r2", "R² of estimated over measured peaks", ""),
            ("figure-8-rmse", "RMSE of estimated peaks", "N"),
        ];
        let entries = names.iter().zip(paper::FIGURE_8).enumerate();
        entries
            .map(|(i, (label, printed))| {
                row(
                    *label,
                    Some(printed),
                    results.iter().map(|values| values[i]).collect(),
                )
            })
            .collect()
    }

    fn own_rows(&self, parts: &[Part]) -> Vec<Row> {
        let mut rows = Vec::new();
        let numbers = |value: Option<f64>| value.into_iter().collect::<Vec<f64>>();
        for (off, source) in self.t_rt_off_ms(parts).iter().zip(["fitted", "true"]) {
            let title = format!("T_RT error, rms of 8 subjects, {source}");
            rows.push(row(
                (&format!("t-rt-off-{source}"), &title, "ms"),
                None,
                numbers(off.usual),
            ));
            for (subject, rms) in paper::APART.into_iter().zip(off.apart) {
                let (id, quantity) = (
                    format!("t-rt-off-{source}-{}", name(subject)),
                    format!("T_RT error, {}, {source}", name(subject)),
                );
                rows.push(row((&id, &quantity, "ms"), None, numbers(rms)));
            }
        }
        let cells = self.cells(parts, FitKind::Whitened);
        for (i, name) in NAMES.iter().enumerate() {
            let ratios: Vec<f64> = cells
                .iter()
                .map(|cell| cell[i].over_bound)
                .filter(|value| value.is_finite() && *value > 0.0)
                .collect();
            let logarithms: Vec<f64> = ratios.iter().map(|ratio| libm::log(*ratio)).collect();
            let geometric = mean_sd(&logarithms).map(|pair| libm::exp(pair.0));
            let (id, quantity) = (
                format!("over-bound-{name}"),
                format!("variance / Cramér-Rao bound, {name}"),
            );
            rows.push(row((&id, &quantity, ""), None, numbers(geometric)));
        }
        for subject in 0..SUBJECTS {
            let thresholds = super::quality::subject_replications(parts, subject)
                .filter_map(|draw| draw.searched.i_mt_ma());
            let (id, quantity) = (
                format!("i-mt-{}", name(subject)),
                format!("I_MT found by force, {}", name(subject)),
            );
            let printed = self.truths.get(subject).map(|truth| truth.printed_ma);
            rows.push(row((&id, &quantity, "mA"), printed, thresholds.collect()));
        }
        rows
    }

    /// Returns the mean of `number` over subjects, for each replication in which all subjects have a
    /// value.
    fn means(&self, parts: &[Part], number: &dyn Fn(&TrainAnalysis) -> Option<f64>) -> Vec<f64> {
        let results = (0..self.draws).filter_map(|draw| {
            let values: Option<Vec<f64>> = self
                .draw_analyses(parts, draw)
                .into_iter()
                .map(number)
                .collect();
            Some(mean_sd(&values?)?.0)
        });
        results.collect()
    }

    /// Returns the analyses of all subjects at the printed amplitudes in this replication.
    pub(super) fn draw_analyses<'p>(&self, parts: &'p [Part], draw: u64) -> Vec<&'p TrainAnalysis> {
        let selected = replications(parts).filter(|replication| replication.draw == draw);
        selected
            .filter_map(|draw| draw.printed.as_ref().ok())
            .collect()
    }
}

/// Returns pairs of measured peak force and the force that the exponential gives, N, for all
/// amplitudes and frequencies.
pub(super) fn peak_pairs(analysis: &TrainAnalysis) -> Vec<(f64, f64)> {
    let mut points = Vec::new();
    for (ma, peaks) in analysis.amplitudes.iter().zip(&analysis.peaks_n) {
        for (peak, own) in peaks.iter().zip(&analysis.exponentials) {
            points.extend(own.map(|(own, _)| (*peak, own.at(*ma))));
        }
    }
    points
}

/// Describes how many sessions have no result, by reason.
fn failures(parts: &[Part]) -> Vec<String> {
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for part in parts {
        let why: Vec<&String> = match part {
            Part::Own(draw) => draw
                .printed
                .as_ref()
                .err()
                .into_iter()
                .chain(draw.found.as_ref().err())
                .collect(),
            Part::Foreign(mismatch) => mismatch.as_ref().err().into_iter().collect(),
        };
        for why in why {
            // Groups by the number of the error and its first words.
            let why = why.split([':', ';']).next().unwrap_or_default().to_owned();
            *counts.entry(why).or_default() += 1;
        }
    }
    counts
        .into_iter()
        .map(|(why, count)| format!("{count} sessions have no result: {why}."))
        .collect()
}
