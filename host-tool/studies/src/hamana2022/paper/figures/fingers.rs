//! Draws figures 8 to 11 and 21: all five fingers.

use super::super::outcome::sessions;
use super::super::{Part, Study};
use super::DIGITS;
use crate::hamana2022::error::TwoPointsError;
use crate::hamana2022::participant::DEVICE_V;
use crate::hamana2022::pattern::{Pattern, Points};
use crate::hamana2022::sessions::{Session, mean, people};
use crate::hamana2022::voltages::{SELECTIVE, search_steps};
use crate::laboratory::{Bar, Curve, Plot, Plots, Sheet, SheetAxis};
use hal_sim::body::hand::digits::REST_DEG;
use hal_sim::body::hand::spec::{A, B};
use host_core::statistics::Spread;

/// Duration of a pattern (III-A3), µs.
const LASTS_US: u64 = 2_000_000;
/// Time between two recorded angles, s.
const ROW_S: f64 = 0.02;
/// Initials of the digits, because nine bar charts have no room for names.
const LETTERS: [&str; 5] = ["T", "I", "M", "R", "L"];

fn series(count: usize) -> Vec<String> {
    DIGITS
        .iter()
        .take(count)
        .map(|digit| (*digit).to_owned())
        .collect()
}

impl Study {
    /// Plots the search at each point: angles and individuation against voltage.
    pub(super) fn figure_8(&self, parts: &[Part]) -> Result<Vec<Sheet>, TwoPointsError> {
        let Some(mut whose) = self.shown_wearer("P", parts)? else {
            return Ok(Vec::new());
        };
        let voltages = whose.wearer.voltages;
        let mut plots = Vec::new();
        for (point, name) in [(A, "A"), (B, "B")] {
            let steps = search_steps(&mut whose.wearer.hand, point, DEVICE_V)?;
            let mut curves: Vec<Curve> = (0..LETTERS.len())
                .map(|digit| {
                    let at = steps
                        .iter()
                        .map(|searched| [searched.volts, searched.flexed[digit]]);
                    Curve::line(digit, at)
                })
                .collect();
            let at = steps.iter();
            let at = at.filter_map(|searched| Some([searched.volts, searched.individuation?]));
            curves.push(Curve::line(LETTERS.len(), at));
            let [least, most] = [voltages.threshold_v[point], voltages.most_v[point]];
            plots.push(Plot {
                title: format!("point {name}: from {least:.0} to {most:.0} V"),
                x: SheetAxis::linear("voltage (V)", [0.0, DEVICE_V]),
                y: SheetAxis::linear("fraction of the range; index", [0.0, 1.05]),
                curves,
                ..Plot::default()
            });
        }
        let caption = format!(
            "Angle of each finger above rest, as a fraction of its range, and the individuation \
             index, against the voltage at one point, in the steps of the search: {}. Simulated. \
             The title of each plot gives the threshold of the point and its maximum voltage; \
             above this voltage the index falls to {SELECTIVE}, or the search ends. The paper's \
             figure 8 shows P at one point; there the index falls when other fingers bend. Where \
             lines coincide, earlier ones are drawn wider.",
            whose.words
        );
        let plots = Plots {
            beside: 2,
            series: series(6),
            plots,
        };
        let title = "search at one point";
        Ok(vec![Sheet::figure("Figure 8", title, caption, plots)])
    }

    /// Plots the angles of all five digits over two seconds of three patterns, preferably of
    /// participant S.
    pub(super) fn figures_9_to_11(&self, parts: &[Part]) -> Result<Vec<Sheet>, TwoPointsError> {
        let Some(whose) = self.shown_wearer("S", parts)? else {
            return Ok(Vec::new());
        };
        let [a, b] = whose.wearer.voltages.most_v;
        let two = |after_us| Pattern {
            points: Points::Two { first: A, after_us },
            isolated: false,
        };
        let mut plots = Vec::new();
        for (title, pattern) in [
            ("9: point B alone, isolated", Pattern::isolated_point(B)),
            ("10: 0 µs (pattern 0)", two(0)),
            ("11: 2000 µs (pattern 8)", two(2_000)),
        ] {
            let rows = whose
                .wearer
                .digit_angles(&self.population, 0, (pattern, 0.0), LASTS_US)?;
            let curve = |digit: usize| {
                let rows = std::iter::once(&REST_DEG).chain(&rows);
                let rows = rows.enumerate();
                let at = rows.map(|(at, values)| [ROW_S * at as f64, values[digit]]);
                Curve::line(digit, at)
            };
            plots.push(Plot {
                title: title.to_owned(),
                x: SheetAxis::linear("time (s)", [0.0, 2.0]),
                y: SheetAxis::linear("angle (°)", [-40.0, 100.0]),
                curves: (0..LETTERS.len()).map(curve).collect(),
                ..Plot::default()
            });
        }
        let caption = format!(
            "Angles of five fingers from the first pulse on, at {a:.0} V on A and {b:.0} V on B: \
             {}. Simulated, with the dynamics of the hand. The paper's figures 9 to 11 show S at \
             18 and 24 V. There, one point bends the index finger slightly; two points 0 µs apart \
             bend other fingers as well; two points 2000 µs apart bend the index finger strongly. \
             Figure 9 does not say whether A was isolated. The caption of figure 11 calls pattern \
             8 isolated; figure 5 and the text call it conducted, as it is here. Where lines \
             coincide, earlier ones are drawn wider.",
            whose.words
        );
        let plots = Plots {
            beside: 3,
            series: series(5),
            plots,
        };
        let title = "five fingers over two seconds";
        Ok(vec![Sheet::figure(
            "Figures 9 to 11",
            title,
            caption,
            plots,
        )])
    }

    /// Plots nine bar charts of the digits' angles for each participant, one for each intensity.
    pub(super) fn figure_21(&self, parts: &[Part]) -> Vec<Sheet> {
        let sessions = sessions(parts);
        let participants = people(&sessions).into_iter();
        participants.map(|(participant, _)| {
            let own: Vec<&Session> = sessions
                .iter()
                .filter(|session| session.participant == participant)
                .collect();
            let mut names: Vec<&str> = Vec::new();
            for condition in own.iter().flat_map(|session| &session.conditions) {
                if !names.contains(&&*condition.name) {
                    names.push(&condition.name);
                }
            }
            names.sort_unstable();
            let plots = Plots {
                beside: 3,
                series: vec!["largest angle".to_owned()],
                plots: names.iter().map(|name| intensity(name, &own)).collect(),
            };
            let caption = format!(
                "Angle of each finger above rest, as a fraction of its range and as the mean of \
                 five trials: median and 5th to 95th percentile of the {} draws of {participant} that have \
                 points and voltages. Simulated. T thumb, I index, M middle, R ring, L \
                 little finger. In the paper's figure 21, of P, the index finger bends alone at \
                 intensities a to f, and fully at d and e; the thumb also bends at g, the little \
                 finger at h, and both at i.",
                own.len()
            );
            Sheet::figure("Figure 21", "fingers at nine intensities", caption, plots)
        })
        .collect()
    }
}

/// Plots the angles of five fingers at one intensity.
fn intensity(name: &str, sessions: &[&Session]) -> Plot {
    let bar = |digit: usize| {
        let values = sessions
            .iter()
            .filter_map(|session| mean(session, |c| c.name == name, |s| s.flexed[digit]));
        let spread = Spread::of(values)?;
        let at = digit as f64;
        Some(Bar {
            series: 0,
            x: [at - 0.35, at + 0.35],
            value: spread.median,
            range: Some(spread.range()),
        })
    };
    Plot {
        title: name.to_owned(),
        x: SheetAxis::categorical("", LETTERS.map(str::to_owned)),
        y: SheetAxis::linear("fraction of the range", [0.0, 1.05]),
        bars: (0..LETTERS.len()).filter_map(bar).collect(),
        ..Plot::default()
    }
}
