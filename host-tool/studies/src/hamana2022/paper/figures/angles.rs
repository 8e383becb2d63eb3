//! Draws figures 25 to 28 and 30 to 32: the angle of the index finger.

use super::super::outcome::sessions;
use super::super::spread::draw_count_label;
use super::super::tracking::Course;
use super::super::{Part, Study};
use super::in_words;
use crate::hamana2022::angles::{IndexAngles, LIES_DEG, index_angles};
use crate::hamana2022::error::TwoPointsError;
use crate::hamana2022::held::Hold;
use crate::hamana2022::pattern::Pattern;
use crate::hamana2022::sessions::people;
use crate::laboratory::{Bar, Curve, Plot, Plots, Sheet, SheetAxis};
use hal_sim::body::hand::spec::{A, B};
use host_core::statistics::Spread;

/// Time between two recorded angles of a hold, s.
const ROW_S: f64 = 0.02;
const METHODS: [&str; 2] = ["one point", "two points"];

/// Returns the angle during a hold over time, as a curve.
fn course(series: usize, hold: &Hold) -> Curve {
    let rows = hold.course_deg.iter().enumerate();
    let at = rows.map(|(row, deg)| [ROW_S * (row + 1) as f64, *deg]);
    Curve::line(series, at)
}

fn angle() -> SheetAxis {
    SheetAxis::linear("angle (°)", [0.0, 100.0])
}

fn ten_seconds() -> SheetAxis {
    SheetAxis::linear("time (s)", [0.0, 10.0])
}

impl Study {
    /// Plots reference and angle of experiment 4: the best and the worst trial with one point and
    /// with two.
    pub(super) fn figures_25_to_28(&self, parts: &[Part]) -> Vec<Sheet> {
        let kinds = [
            (25, false, true),
            (26, false, false),
            (27, true, true),
            (28, true, false),
        ];
        let (mut plots, mut whose) = (Vec::new(), Vec::new());
        for (number, is_two, is_best) in kinds {
            let label = format!(
                "{number}: {}, {}",
                METHODS[usize::from(is_two)],
                if is_best { "best" } else { "worst" }
            );
            let Some((part, course)) = self.find_course(parts, is_two, is_best) else {
                whose.push(format!("{number}: no draw has this trial"));
                continue;
            };
            let words = in_words(&part.participant, part.draw, "P");
            whose.push(format!(
                "{number}: {}, {} trial {}",
                words.replace(", the first that has points and voltages", ""),
                course.method.name(),
                course.number + 1
            ));
            plots.push(tracking_plot(
                format!("{label}: {:.1}°", course.rmse_deg),
                course,
            ));
        }
        let caption = format!(
            "Reference and measured angle in the trials with the smallest and the largest RMSE \
             under the paper's controller, from the first draw in which every trial of the method \
             has an RMSE: {}. Simulated. The grey time is not part of the RMSE. The paper's \
             figures 25 to 28 show P: 8.40 and 26.6° with one point, 9.00 and 12.6° with two \
             points.",
            whose.join("; ")
        );
        let plots = Plots {
            beside: 2,
            series: ["angle", "reference"].map(str::to_owned).to_vec(),
            plots,
        };
        let title = "tracking of a sine";
        vec![Sheet::figure("Figures 25 to 28", title, caption, plots)]
    }

    /// Finds the first draw with a recorded best or worst trial of the method, preferably a draw of
    /// participant P.
    fn find_course<'p>(
        &self,
        parts: &'p [Part],
        is_two: bool,
        is_best: bool,
    ) -> Option<(&'p Part, &'p Course)> {
        let others = self
            .participants
            .all
            .iter()
            .map(|participant| &*participant.name);
        let mut ordered_parts = std::iter::once("P")
            .chain(others)
            .flat_map(|name| parts.iter().filter(move |part| part.participant == name));
        ordered_parts.find_map(|part| {
            let tracking = part.became.as_ref().ok()?.tracking()?;
            let mut own = tracking.courses.iter();
            let own = own.find(|course| (course.is_two, course.is_best) == (is_two, is_best))?;
            Some((part, own))
        })
    }

    /// Plots the index finger's angle over ten seconds at three pronations, preferably of
    /// participant Q.
    pub(super) fn figure_30(&self, parts: &[Part]) -> Result<Vec<Sheet>, TwoPointsError> {
        let Some(whose) = self.shown_wearer("Q", parts)? else {
            return Ok(Vec::new());
        };
        let hold = |pattern, lies| {
            whose
                .wearer
                .hold_pattern(&self.population, 0, (pattern, lies))
        };
        let [a, b] = [
            hold(Pattern::isolated_point(A), 0.0)?,
            hold(Pattern::isolated_point(B), 0.0)?,
        ];
        let better = if a.greatest_deg() >= b.greatest_deg() {
            a
        } else {
            b
        };
        let mut plots = Vec::new();
        for (name, pattern) in METHODS
            .into_iter()
            .zip([better.pattern, Pattern::default_two_point()])
        {
            let mut curves = Vec::new();
            for (series, lies) in LIES_DEG.into_iter().enumerate() {
                curves.push(course(series, &hold(pattern, lies)?));
            }
            plots.push(Plot {
                title: format!("{name}: {}", pattern.in_words()),
                x: ten_seconds(),
                y: angle(),
                curves,
                ..Plot::default()
            });
        }
        let caption = format!(
            "Angle of the index finger over ten seconds, in one trial at each pronation, with one \
             point (the one that bends the finger further at 0°) and with two points: {}. \
             Simulated, with the dynamics of the hand. In the paper's figure 30, of Q, one point \
             bends the finger less at 45° and 90° than at 0°; two points bend it fully at every \
             pronation.",
            whose.words
        );
        let plots = Plots {
            beside: 2,
            series: LIES_DEG.map(|lies| format!("{lies}° pronated")).to_vec(),
            plots,
        };
        let title = "index finger at three pronations";
        Ok(vec![Sheet::figure("Figure 30", title, caption, plots)])
    }

    /// Plots the index finger's angle against pronation for each participant, with one point and
    /// with two.
    pub(super) fn figure_31(&self, parts: &[Part]) -> Vec<Sheet> {
        let sessions = sessions(parts);
        let mut plots = Vec::new();
        for (participant, _) in people(&sessions) {
            let own = sessions
                .iter()
                .filter(|session| session.participant == participant);
            let angles: Vec<IndexAngles> = own.filter_map(index_angles).collect();
            let mut bars = Vec::new();
            for place in 0..LIES_DEG.len() {
                for method in 0..METHODS.len() {
                    let left = place as f64 + [-0.38, 0.02][method];
                    let spread = Spread::of(angles.iter().map(|values| values[method][place]));
                    bars.extend(spread.map(|spread| Bar {
                        series: method,
                        x: [left, left + 0.36],
                        value: spread.median,
                        range: Some(spread.range()),
                    }));
                }
            }
            plots.push(Plot {
                title: draw_count_label(participant, angles.len()),
                x: SheetAxis::categorical("pronation", LIES_DEG.map(|lies| format!("{lies}°"))),
                y: angle(),
                bars,
                ..Plot::default()
            });
        }
        if plots.is_empty() {
            return Vec::new();
        }
        let caption = "Angle of the index finger by pronation, as the mean of three trials: \
                       median and 5th to 95th percentile of the draws. Simulated; this is the \
                       steady angle, without fatigue. In the paper's figure 31, one point bends \
                       the finger furthest at 0° in P, Q and S; two points bend it by nearly 100° \
                       at every pronation in P and Q, and by at least 50° at 45° in S.";
        let plots = Plots {
            beside: 4,
            series: METHODS.map(str::to_owned).to_vec(),
            plots,
        };
        let title = "largest angles by pronation";
        vec![Sheet::figure("Figure 31", title, caption.to_owned(), plots)]
    }

    /// Plots the index finger's angle over ten seconds for each participant, with one point and
    /// with two.
    pub(super) fn figure_32(&self, parts: &[Part]) -> Vec<Sheet> {
        let (mut plots, mut whose) = (Vec::new(), Vec::new());
        for participant in &self.participants.all {
            let name = &participant.name;
            let mut own = parts.iter().filter(|part| part.participant == *name);
            let first = own.find_map(|part| {
                let held = part.became.as_ref().ok()?.held()?;
                Some((part.draw, held.first()?))
            });
            let Some((draw, holds)) = first else { continue };
            whose.push(format!("{name}'s draw {draw}"));
            let curves = holds.iter().enumerate();
            let [one, two] = holds.each_ref().map(Hold::drop_deg);
            plots.push(Plot {
                title: format!("{name}: sinks {one:.1}°, {two:.1}°"),
                x: ten_seconds(),
                y: angle(),
                curves: curves.map(|(series, hold)| course(series, hold)).collect(),
                ..Plot::default()
            });
        }
        if plots.is_empty() {
            return Vec::new();
        }
        let caption = format!(
            "Angle of the index finger over ten seconds at the maximum voltages, in one trial \
             with one point (the one that bends the finger further) and with two points, from \
             each participant's first draw that has points and voltages: {}. Simulated. The title \
             of each plot says how far the finger sinks from its largest angle to its angle at 10 \
             s, with one point and with two. In the paper's figure 32 it sinks by 21.9 and 0.0° \
             in P, 44.8 and 0.0° in Q, 29.0 and 13.6° in S.",
            whose.join(", ")
        );
        let plots = Plots {
            beside: 2,
            series: METHODS.map(str::to_owned).to_vec(),
            plots,
        };
        let title = "ten seconds with one point and with two points";
        vec![Sheet::figure("Figure 32", title, caption, plots)]
    }
}

fn tracking_plot(title: String, course: &Course) -> Plot {
    let column = |place: usize| course.rows.iter().map(move |row| [row[0], row[place]]);
    Plot {
        title,
        x: SheetAxis::linear("time (s)", [0.0, 30.0]),
        y: angle(),
        aside: Some([0.0, 10.0]),
        curves: vec![Curve::line(0, column(2)), Curve::line(1, column(1))],
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hamana2022::Voltages;
    use crate::hamana2022::paper::{DrawMeasurements, DrawResult, Kind, Tracking};
    use crate::hamana2022::tracked::Method;
    use host_core::run::DeviceName;

    fn followed_by(name: &str, draw: u64) -> Part {
        let course = Course {
            is_two: false,
            is_best: true,
            method: Method::B,
            number: 2,
            rmse_deg: 8.4,
            rows: vec![[0.0, 45.0, 10.0], [0.05, 46.0, 11.0]],
        };
        let voltages = Voltages {
            threshold_v: [24.0, 28.0],
            most_v: [28.0, 36.0],
            ratio: None,
        };
        Part {
            participant: name.to_owned(),
            draw,
            became: Ok(DrawResult {
                voltages,
                extensor_v: Some([14.0, 26.0]),
                what: DrawMeasurements::Tracked(Tracking {
                    trials: Vec::new(),
                    courses: vec![course],
                }),
            }),
        }
    }

    /// The figure shows P's first draw with a number, or otherwise another participant's, and names
    /// it.
    #[test]
    fn whose_course_is_shown_is_said() {
        let study = Study::new(
            Kind::Control,
            (None, None, None),
            (None, None),
            DeviceName::Native,
        )
        .unwrap();
        let caption = |parts: &[Part]| study.figures_25_to_28(parts)[0].caption.clone();
        let of_p = [
            followed_by("Q", 0),
            followed_by("P", 4),
            followed_by("P", 5),
        ];
        let text = caption(&of_p);
        assert!(text.contains("25: P, draw 4, B trial 3;"), "{text}");
        assert!(text.contains("28: no draw has this trial"), "{text}");
        let text_of_q = caption(&of_p[..1]);
        assert!(
            text_of_q.contains("25: Q, draw 0 (no draw of P has points and voltages), B trial 3"),
            "{text_of_q}"
        );
    }
}
