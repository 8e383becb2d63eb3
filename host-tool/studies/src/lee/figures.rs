//! Figures 7 to 11 beside the paper's, and ours of other structures.

use super::analysis::{Analysed, analysed};
use super::error::LeeError;
use super::outcome::estimated;
use super::protocol::Session;
use super::quality::printed;
use super::spread::{at, mean_sd};
use super::study::{Part, Study};
use super::{SUBJECTS, name, paper};
use crate::laboratory::{Along, Band, Curve, Plot, Plots, Sheet};
use hal_sim::body::bench::Kind;
use host_core::identify::{ForceRecord, averaged, simulated};

/// Whose figures 7, 9 and 10 are: best and worst exponential, and the courses.
const BEST: usize = 4;
const WORST: usize = 2;
const COURSE: usize = 9;
/// A point of a course every so many ms.
const EVERY: usize = 10;

fn frequencies() -> Vec<String> {
    ["20 Hz", "30 Hz", "40 Hz"].map(str::to_owned).into()
}

fn marked(series: usize, points: Vec<[f64; 2]>, ranges: Vec<[f64; 2]>) -> Curve {
    Curve {
        series,
        marked: true,
        points,
        ranges,
    }
}

impl Study {
    /// All, in their order; nothing of nothing.
    pub(super) fn figures(&self, parts: &[Part]) -> Result<Vec<Sheet>, LeeError> {
        if (0..SUBJECTS).any(|it| printed(parts, it).next().is_none()) {
            return Ok(Vec::new());
        }
        let mut all = vec![self.figure_7(parts), self.figure_8(parts)];
        let session = self.printed(COURSE, 0)?;
        let found = analysed(&session, &self.declared)?;
        all.extend(self.figures_9_and_10(&session, &found));
        all.push(self.figure_11(parts));
        all.push(self.mismatches(parts));
        Ok(all)
    }

    fn figure_7(&self, parts: &[Part]) -> Sheet {
        let plot = |subject: usize| {
            let own = printed(parts, subject).next()?;
            let first = *own.amplitudes.first()?;
            let last = *own.amplitudes.last()?;
            let mut curves = Vec::new();
            for (f, it) in own.exponentials.iter().enumerate() {
                let (it, _) = (*it)?;
                let points = (0..=40).map(|i| first + (last - first) * f64::from(i) / 40.0);
                curves.push(Curve::line(f, points.map(|ma| [ma, it.at(ma)])));
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
                x: Along::even("amplitude (mA)", [first, last]),
                y: Along::even("peak force (N)", [0.0, 1.1 * most]),
                curves,
                ..Plot::default()
            })
        };
        let plots = Plots {
            beside: 2,
            series: frequencies(),
            plots: [BEST, WORST].into_iter().filter_map(plot).collect(),
        };
        let caption = "Peaks of the first replication and the exponential through them. The paper \
                       shows K05 as the best (R² 0.97 to 0.99) and K03 as the worst (0.90 to \
                       0.93); the bench's pools have another order.";
        Sheet::figure(
            "Figure 7",
            "exponential estimates",
            caption.to_owned(),
            plots,
        )
    }

    fn figure_8(&self, parts: &[Part]) -> Sheet {
        let points: Vec<[f64; 2]> = self
            .of_draw(parts, 0)
            .into_iter()
            .flat_map(estimated)
            .map(|(measured, estimated)| [measured, estimated])
            .collect();
        let most = points.iter().flatten().copied().fold(1.0, f64::max);
        // Each by itself: no line joins them.
        let alone = points.iter().map(|it| marked(0, vec![*it], Vec::new()));
        let slope = Curve::line(1, [[0.0, 0.0], [most, paper::FIGURE_8[0] * most]]);
        let curves = alone.chain([slope]).collect();
        let plot = Plot {
            x: Along::even("measured peak (N)", [0.0, most]),
            y: Along::even("estimated peak (N)", [0.0, most]),
            curves,
            ..Plot::default()
        };
        let plots = Plots {
            beside: 1,
            series: vec!["ours".to_owned(), "the paper's slope".to_owned()],
            plots: vec![plot],
        };
        let caption = "All amplitudes and frequencies of the first replication; the paper's slope \
                       of 0.92, whose intercept is not printed.";
        Sheet::figure(
            "Figure 8",
            "estimated over measured peaks",
            caption.to_owned(),
            plots,
        )
    }

    /// The first replication of K10, at I5 and at I1 to I4.
    fn figures_9_and_10(&self, session: &Session, found: &Analysed) -> Vec<Sheet> {
        let constants = found.fits[1].constants;
        let last = session.amplitudes.0.len() - 1;
        let reference_ma = session.amplitudes.0[last];
        let course = |i: usize, f: usize| {
            let (ma, record) = (session.amplitudes.0[i], &session.records[i][f]);
            let gain = match &found.exponentials[f] {
                _ if i == last => 1.0,
                Some((it, _)) => it.gain(ma, reference_ma),
                None => 0.0,
            };
            let model = ForceRecord {
                gain,
                ..record.clone()
            };
            let thin = |all: Vec<f64>| {
                let all = all.into_iter().enumerate().step_by(EVERY);
                all.map(|(ms, n)| [1e-3 * ms as f64, n]).collect::<Vec<_>>()
            };
            let measured = thin(averaged(&record.from_rest()));
            let model = thin(averaged(&simulated(constants, &model).0));
            let both = measured.iter().chain(&model);
            let most = both.map(|it| it[1]).fold(0.1, f64::max);
            Plot {
                title: format!("I{}, {} Hz", i + 1, self.declared.trains.frequencies_hz[f]),
                x: Along::even("time (s)", [0.0, 2.5]),
                y: Along::even("force (N)", [-0.05 * most, 1.15 * most]),
                curves: vec![Curve::line(0, measured), Curve::line(1, model)],
                ..Plot::default()
            }
        };
        let sheet = |number: &str, amplitudes: std::ops::Range<usize>, caption: &str| {
            let all = amplitudes.flat_map(|i| (0..3).map(move |f| (i, f)));
            let plots = Plots {
                beside: 3,
                series: vec!["measured".to_owned(), "model".to_owned()],
                plots: all.map(|(i, f)| course(i, f)).collect(),
            };
            Sheet::figure(number, "force of K10", caption.to_owned(), plots)
        };
        vec![
            sheet(
                "Figure 9",
                last..last + 1,
                "At I5, where the model is fitted; both averaged over 40 ms.",
            ),
            sheet(
                "Figure 10",
                0..last,
                "At I1 to I4, with A of equation 6; both averaged over 40 ms.",
            ),
        ]
    }

    fn figure_11(&self, parts: &[Part]) -> Sheet {
        let all: Vec<&Analysed> = (0..SUBJECTS).flat_map(|it| printed(parts, it)).collect();
        let spread = |own: Vec<f64>| mean_sd(&own).unwrap_or((f64::NAN, 0.0));
        let by_frequency: Vec<(f64, f64)> = (0..3)
            .map(|f| {
                spread(
                    all.iter()
                        .filter_map(|it| Some(1e3 * it.responses.last()?[f]?.t_rt_s()))
                        .collect(),
                )
            })
            .collect();
        let by_amplitude: Vec<(f64, f64)> = (0..self.declared.trains.amplitudes)
            .map(|i| {
                let own = all.iter().filter_map(|it| it.measured_t_rt_s.get(i));
                spread(own.flatten().flatten().map(|it| 1e3 * it).collect())
            })
            .collect();
        let plot = |title: &str, x: Along, own: &[(f64, f64)], paper: Vec<[f64; 2]>| Plot {
            title: title.to_owned(),
            x,
            y: Along::even("T_RT (ms)", [150.0, 420.0]),
            curves: vec![marked(
                0,
                (0..)
                    .map(f64::from)
                    .zip(own)
                    .map(|(x, it)| [x, it.0])
                    .collect(),
                own.iter()
                    .map(|(mean, sd)| [mean - sd, mean + sd])
                    .collect(),
            )],
            paper,
            ..Plot::default()
        };
        let means = (0..3).map(|f| paper::TABLE_7.iter().map(|it| it[f]).sum::<f64>() / 10.0);
        let means = (0..)
            .map(f64::from)
            .zip(means)
            .map(|(x, it)| [x, it])
            .collect();
        let amplitudes = (1..=self.declared.trains.amplitudes).map(|i| format!("I{i}"));
        let plots = Plots {
            beside: 2,
            series: vec!["ours".to_owned()],
            plots: vec![
                plot(
                    "by frequency",
                    Along::of("", frequencies()),
                    &by_frequency,
                    means,
                ),
                plot(
                    "by amplitude",
                    Along::of("", amplitudes),
                    &by_amplitude,
                    Vec::new(),
                ),
            ],
        };
        let caption = "Mean ± standard deviation over subjects: left of the fitted model, with \
                       table 7's means; right of the measured force, which the 40 ms average and \
                       noise reach too.";
        Sheet::figure("Figure 11", "response time", caption.to_owned(), plots)
    }

    /// NRMSE against the size of a departure.
    fn mismatches(&self, parts: &[Part]) -> Sheet {
        let sizes = &self.declared.foreign.sizes;
        let band = |series, low, middle, high| Band {
            series,
            low,
            middle,
            high,
        };
        let plot = |kind: Kind| {
            let of = |size: f64, from: usize, to: usize| {
                let own = parts.iter().filter_map(|it| match it {
                    Part::Foreign(Ok(it)) if it.foreign.kind == kind && it.foreign.size == size => {
                        Some(it)
                    }
                    _ => None,
                });
                own.flat_map(|it| it.nrmse_percent.get(from..to).unwrap_or_default().to_vec())
                    .collect::<Vec<f64>>()
            };
            let alone = |from: usize, to: usize| {
                let all = (0..SUBJECTS).flat_map(|it| printed(parts, it));
                all.flat_map(|it| {
                    it.agreements
                        .get(from..to)
                        .unwrap_or_default()
                        .iter()
                        .map(|it| it.nrmse_percent)
                        .collect::<Vec<_>>()
                })
                .collect::<Vec<f64>>()
            };
            let last = self.declared.trains.amplitudes - 1;
            let curve = |series: usize, from: usize, to: usize| {
                let mut points = Vec::new();
                let mut ranges = Vec::new();
                let first = [(0.0, alone(from, to))].into_iter();
                for (size, all) in
                    first.chain(sizes.iter().map(|size| (*size, of(*size, from, to))))
                {
                    let Some((mean, _)) = mean_sd(&all) else {
                        continue;
                    };
                    points.push([size, mean]);
                    ranges.push([
                        at(all.clone(), 0.1).unwrap_or(mean),
                        at(all, 0.9).unwrap_or(mean),
                    ]);
                }
                marked(series, points, ranges)
            };
            Plot {
                title: kind.name().to_owned(),
                x: Along::even("size", [0.0, 1.0]),
                y: Along::even("NRMSE (%)", [0.0, 30.0]),
                bands: vec![
                    band(0, paper::NRMSE_I5, paper::NRMSE_I5, paper::NRMSE_I5),
                    band(1, 10.8, 12.0, 13.1),
                ],
                curves: vec![curve(0, last, last + 1), curve(1, 0, last)],
                ..Plot::default()
            }
        };
        let plots = Plots {
            beside: 4,
            series: vec!["I5".to_owned(), "I1 to I4".to_owned()],
            plots: Kind::ALL.map(plot).into(),
        };
        let caption = "Bodies of another structure: mean NRMSE over subjects (bars: 10th to 90th \
                       percentile) of the model fitted at I5, against the size of the departure; \
                       size 0 is the model's own structure. Lines across: the paper's 8.06 % at \
                       I5 and 10.8 to 13.1 % at I1 to I4. What a size of 1 is: docs/identify.md.";
        Sheet::figure("Figure A", "other structures", caption.to_owned(), plots)
    }
}
