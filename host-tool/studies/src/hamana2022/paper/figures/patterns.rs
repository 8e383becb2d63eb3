//! Draws figures 12 to 15 and 17 to 20: individuation and torque by pattern.

use super::super::outcome::sessions;
use super::super::spread::draw_count_label;
use super::super::tables::averages;
use super::super::{Part, Study};
use crate::hamana2022::experiments::Experiment;
use crate::hamana2022::pattern::Pattern;
use crate::hamana2022::replication::{Averages, CONDUCTED, PATTERNS, Replication};
use crate::hamana2022::sessions::{Session, people};
use crate::laboratory::{Band, Bar, Curve, Plot, Plots, Sheet, SheetAxis};
use host_core::statistics::Spread;

/// Names of the bar series. The first two are the states of a pattern's points between pulses.
const STATES: [&str; 3] = ["conducted", "isolated", "one point, conducted"];
const ONE: usize = 2;
/// Position of phase difference 0 on a logarithmic axis, µs.
const TOGETHER_US: f64 = 25.0;
/// Conducted patterns that have an isolated counterpart: number and phase difference, µs. The
/// isolated counterpart has the next higher number.
const LATE: [(usize, &str); 4] = [(6, "1000"), (8, "2000"), (10, "5000"), (12, "10000")];

/// Returns the series of a pattern: 0 for conducted, 1 for isolated.
const fn state(number: usize) -> usize {
    (number >= 7 && number % 2 == 1) as usize
}

/// Measured quantity of a group of figures, and its labels.
struct Measure {
    experiment: Experiment,
    axis: &'static str,
    words: &'static str,
}

const INDIVIDUATION: Measure = Measure {
    experiment: Experiment::Selectivity,
    axis: "individuation index",
    words: "Individuation index of the index finger",
};
const TORQUE: Measure = Measure {
    experiment: Experiment::Torque,
    axis: "torque",
    words: "Torque about the index finger's joint, as a fraction of that of the participant's \
            strongest pattern",
};
const SPREAD: &str = "bars and markers show medians, lines the 5th to 95th percentile of the draws";

impl Study {
    /// Returns figures 12 to 15: the individuation index by pattern and phase difference.
    pub(super) fn individuation_figures(&self, parts: &[Part]) -> Vec<Sheet> {
        let sessions = sessions(parts);
        let own = PatternFigure::new(INDIVIDUATION, &sessions);
        own.sheets(
            ["Figure 12", "Figure 13", "Figure 14", "Figure 15"],
            [
                "The paper's figure 12 shows the averages of four participants.",
                "The paper's figure 13 shows the average of its participants: above 0.8 from \
                 pattern 5 on.",
                "In the paper's figure 14, the index rises with the phase difference and is above \
                 0.9 beyond 500 µs.",
                "In the paper's figure 15, the two are equal except at 1000 µs.",
            ],
            None,
        )
    }

    /// Returns figures 17 to 20: the torque by pattern and phase difference.
    pub(super) fn torque_figures(&self, parts: &[Part]) -> Vec<Sheet> {
        let sessions = sessions(parts);
        let own = PatternFigure::new(TORQUE, &sessions);
        own.sheets(
            ["Figure 17", "Figure 18", "Figure 19", "Figure 20"],
            [
                "The paper's figure 17 shows four participants, with one conducted point at the \
                 right.",
                "The paper's figure 18 shows the average of its participants beside that of one \
                 point, 0.28.",
                "The paper's figure 19 shows no significant effect of the phase difference.",
                "In the paper's figure 20, conducted patterns give more torque.",
            ],
            Some(self.protocol.paper.one_point[0]),
        )
    }
}

struct PatternFigure<'s> {
    measure: Measure,
    sessions: &'s [Session],
    draws: Vec<Replication>,
}

impl<'s> PatternFigure<'s> {
    fn new(measure: Measure, sessions: &'s [Session]) -> Self {
        let draws = averages(measure.experiment, sessions);
        Self {
            draws: draws
                .iter()
                .map(|averages| Replication::from_averages(averages))
                .collect(),
            measure,
            sessions,
        }
    }

    /// Returns four figures: by participant, averages, by phase difference, and conducted beside
    /// isolated. `one_point` is the torque that the paper prints for one point; without it, the figures
    /// omit one point.
    fn sheets(&self, numbers: [&str; 4], papers: [&str; 4], one_point: Option<f64>) -> Vec<Sheet> {
        if self.draws.is_empty() {
            return Vec::new();
        }
        let words = self.measure.words;
        let whose = "mean over the participants for whom points and voltages are found in a draw";
        let whats = [
            ("by participant and pattern", "for each participant"),
            ("by pattern", whose),
            ("by phase difference, conducted", whose),
            ("conducted and isolated", whose),
        ];
        let plots = [
            self.people(one_point),
            self.means(one_point),
            self.phases(),
            self.pairs(),
        ];
        let figures = numbers.into_iter().zip(papers).zip(whats).zip(plots);
        figures
            .map(|(((number, paper), (title, whose)), plots)| {
                let caption = format!("{words}, {whose}, simulated; {SPREAD}. {paper}");
                Sheet::figure(number, title, caption, plots)
            })
            .collect()
    }

    fn y(&self) -> SheetAxis {
        SheetAxis::linear(self.measure.axis, [0.0, 1.05])
    }

    /// Plots a bar for each pattern. `one_point` adds a bar for one point: the simulated spread and the
    /// printed value.
    fn plot(
        &self,
        title: &str,
        spreads: &dyn Fn(usize) -> Option<Spread>,
        one_point: Option<(Option<Spread>, Option<f64>)>,
    ) -> Plot {
        let names = (0..PATTERNS).map(|index| index.to_string());
        let names = names.chain(one_point.map(|_| "one".to_owned()));
        let bar = |at: usize, series: usize, item: Spread| {
            let at = at as f64;
            Bar {
                series,
                x: [at - 0.38, at + 0.38],
                value: item.median,
                range: Some(item.range()),
            }
        };
        let bars = (0..PATTERNS).filter_map(|at| Some(bar(at, state(at), spreads(at)?)));
        let ours = one_point.and_then(|(ours, _)| ours);
        let paper = one_point.and_then(|(_, paper)| paper);
        Plot {
            title: title.to_owned(),
            x: SheetAxis::categorical("pattern", names),
            y: self.y(),
            bars: bars
                .chain(ours.map(|spread| bar(PATTERNS, ONE, spread)))
                .collect(),
            paper: paper
                .map(|paper| [PATTERNS as f64, paper])
                .into_iter()
                .collect(),
            ..Plot::default()
        }
    }

    fn series(with_one: bool) -> Vec<String> {
        let count = if with_one { 3 } else { 2 };
        STATES
            .iter()
            .take(count)
            .map(|state| (*state).to_owned())
            .collect()
    }

    fn people(&self, one_point: Option<f64>) -> Plots {
        let plot = |participant: &str| {
            let own = self
                .sessions
                .iter()
                .filter(|session| session.participant == participant);
            let session_averages: Vec<Averages> = own
                .map(|session| {
                    Averages::from_session(
                        self.measure.experiment,
                        &session.conditions,
                        &session.stimulated,
                    )
                })
                .collect();
            let spreads = |at: usize| {
                Spread::of(
                    session_averages
                        .iter()
                        .filter_map(|averages| averages.patterns[at]),
                )
            };
            let alone = Spread::of(
                session_averages
                    .iter()
                    .filter_map(|averages| Some(averages.one_point?[0])),
            );
            let title = draw_count_label(participant, session_averages.len());
            self.plot(&title, &spreads, one_point.map(|_| (alone, None)))
        };
        Plots {
            beside: 2,
            series: Self::series(one_point.is_some()),
            plots: people(self.sessions)
                .iter()
                .map(|(participant, _)| plot(participant))
                .collect(),
        }
    }

    fn mean_of(&self, at: usize) -> Option<Spread> {
        Spread::of(
            self.draws
                .iter()
                .filter_map(|replication| replication.patterns[at]),
        )
    }

    fn means(&self, one_point: Option<f64>) -> Plots {
        let alone = Spread::of(
            self.draws
                .iter()
                .filter_map(|replication| Some(replication.one_point?[0])),
        );
        let given = one_point.map(|paper| (alone, Some(paper)));
        let mut plot = self.plot("", &|at| self.mean_of(at), given);
        let band = alone.filter(|_| one_point.is_some()).map(|spread| Band {
            series: ONE,
            low: spread.low,
            middle: spread.median,
            high: spread.high,
        });
        plot.bands.extend(band);
        Plots {
            beside: 1,
            series: Self::series(one_point.is_some()),
            plots: vec![plot],
        }
    }

    fn phases(&self) -> Plots {
        let mut curve = Curve {
            series: 0,
            marked: true,
            points: Vec::new(),
            ranges: Vec::new(),
        };
        let mut ticks = Vec::new();
        for pattern in Pattern::all_two_point() {
            let (Some(number), Some(after_us)) = (pattern.number(), pattern.phase_difference_us())
            else {
                continue;
            };
            let at = f64::from(after_us).max(TOGETHER_US);
            let is_known = ticks.iter().any(|(known, _)| *known == at);
            if is_known || !CONDUCTED.contains(&number) {
                continue;
            }
            ticks.push((at, after_us.to_string()));
            if let Some(spread) = self.mean_of(number) {
                curve.points.push([at, spread.median]);
                curve.ranges.push(spread.range());
            }
        }
        let x = SheetAxis {
            logarithmic: true,
            ticks,
            ..SheetAxis::linear(
                "phase difference (µs); 0 is at the left end",
                [20.0, 13_000.0],
            )
        };
        let plot = Plot {
            x,
            y: self.y(),
            curves: vec![curve],
            ..Plot::default()
        };
        Plots {
            beside: 1,
            series: vec![STATES[0].to_owned()],
            plots: vec![plot],
        }
    }

    fn pairs(&self) -> Plots {
        let mut bars = Vec::new();
        for (place, (number, _)) in LATE.into_iter().enumerate() {
            for isolated in 0..2 {
                let left = place as f64 + [-0.38, 0.02][isolated];
                bars.extend(self.mean_of(number + isolated).map(|spread| Bar {
                    series: isolated,
                    x: [left, left + 0.36],
                    value: spread.median,
                    range: Some(spread.range()),
                }));
            }
        }
        let names = LATE.into_iter().map(|(_, name)| name.to_owned());
        let plot = Plot {
            x: SheetAxis::categorical("phase difference (µs)", names),
            y: self.y(),
            bars,
            ..Plot::default()
        };
        Plots {
            beside: 1,
            series: Self::series(false),
            plots: vec![plot],
        }
    }
}
