//! Draws the figures: endurance against crosstalk and other assumptions, force against remaining
//! force, and force over time.

use super::claims::PUBLISHED_S;
use super::declared::Drive;
use super::rows::{PUBLISHED_LEFT, ratio};
use super::study::{AxisPoint, ConditionResult, DrawResult, Study};
use crate::laboratory::{Curve, Plot, Plots, Sheet, SheetAxis};

/// Conditions whose endurance is plotted relative to that with one electrode, beside the published
/// ratio.
const RATIOS: [&str; 2] = ["four-half", "four-fast"];
/// Largest ratio on the axis; larger ratios are plotted at this value.
const MOST_RATIO: f64 = 10.0;

impl Study {
    /// Returns all figures of the wearers and axis points that were computed.
    pub(super) fn figures(&self, results: &[DrawResult], along: &[AxisPoint]) -> Vec<Sheet> {
        let mut sheets = vec![self.against_crosstalk(results, along), self.axes(along)];
        sheets.push(self.remaining_force_figure(results));
        sheets.extend(results.first().map(|result| self.courses(result)));
        sheets
    }

    /// Plots the endurance ratios of all random wearers and of the nominal wearer against
    /// crosstalk.
    fn against_crosstalk(&self, results: &[DrawResult], along: &[AxisPoint]) -> Sheet {
        let place = self
            .declared
            .ranges
            .iter()
            .position(|range| range.field == "crosstalk");
        let plot = |(series, id): (usize, &&str)| {
            let dots = results.iter().filter_map(|found| {
                let crosstalk = *found.drawn.get(place?)?;
                Some(dot(1, [crosstalk, ratio(found, id)?.min(MOST_RATIO)]))
            });
            let middle = Curve {
                marked: true,
                ..Curve::line(0, ratios(along, "crosstalk", id))
            };
            let mut curves: Vec<Curve> = dots.collect();
            curves.push(middle);
            curves.push(published([0.0, 0.5]));
            Plot {
                title: self.condition_text(RATIOS[series]),
                x: SheetAxis::linear("crosstalk", [0.0, 0.5]),
                y: SheetAxis::linear("endurance ratio to one electrode", [0.0, MOST_RATIO]),
                curves,
                ..Plot::default()
            }
        };
        let caption = format!(
            "Endurance at 20 % of strength with four electrodes, divided by that with one, \
             simulated: each random wearer at the wearer's crosstalk, and the nominal wearer (the \
             middle of every range) over the range of crosstalk. Ratios above {MOST_RATIO} are \
             shown at {MOST_RATIO}; for wearers who held the force to the end of the study, the \
             ratio is a lower bound. Line: 232 s / 84 s (Buckmire 2018), at an unknown crosstalk."
        );
        let series = ["nominal wearer", "random wearers", "published, 232/84"];
        let plots = RATIOS.iter().enumerate().map(plot).collect();
        figure(
            "Crosstalk",
            "endurance against crosstalk",
            caption,
            &series,
            plots,
        )
    }

    /// Plots the nominal wearer's endurance ratios over `reach` and over `activation`, two
    /// parameters that are only assumed.
    fn axes(&self, along: &[AxisPoint]) -> Sheet {
        let assumed = |axis: &str, name: &str, end: f64| {
            let curve = |(series, id): (usize, &&str)| Curve {
                marked: true,
                ..Curve::line(series, ratios(along, axis, id))
            };
            let mut curves: Vec<Curve> = RATIOS.iter().enumerate().map(curve).collect();
            curves.push(published([0.0, end]));
            Plot {
                title: name.to_owned(),
                x: SheetAxis::linear(name, [0.0, end]),
                y: SheetAxis::linear("endurance ratio to one electrode", [0.0, MOST_RATIO]),
                curves,
                ..Plot::default()
            }
        };
        let caption =
            "The nominal wearer (the middle of every range) under two assumptions: the part of \
                       every fibre group that the single electrode can reach, and the part of \
                       fatigue that depends on pulses instead of force (0 is Ding's model). \
                       Simulated endurance, divided by that with one electrode."
                .to_owned();
        let series = ["four at 12.5 Hz", "four at 25 Hz", "published, 232/84"];
        let plots = vec![
            assumed("reach", "reach of the single electrode", 1.0),
            assumed("activation", "part of fatigue by pulses", 1.0),
        ];
        figure(
            "Assumptions",
            "assumptions that decide the ratio",
            caption,
            &series,
            plots,
        )
    }

    /// Plots the force that remains after six minutes at constant amplitude, against the initial
    /// force and against the ripple.
    fn remaining_force_figure(&self, results: &[DrawResult]) -> Sheet {
        let open = self.declared.conditions.iter();
        let open: Vec<_> = open
            .filter(|condition| condition.drive == Drive::Open)
            .collect();
        let plot = |name: &str, end: f64, quantity: &dyn Fn(&ConditionResult) -> Option<f64>| {
            let mut curves = Vec::new();
            for (series, condition) in open.iter().enumerate() {
                let own = results
                    .iter()
                    .filter_map(|result| result.condition_result(&condition.id));
                let points = own.filter_map(|measurement| {
                    Some([1e2 * quantity(measurement)?, 1e2 * measurement.left?])
                });
                curves.extend(points.map(|point| dot(series, point)));
            }
            for left in PUBLISHED_LEFT {
                let ends = [[0.0, 1e2 * left], [end, 1e2 * left]];
                curves.push(Curve::line(open.len(), ends));
            }
            Plot {
                title: name.to_owned(),
                x: SheetAxis::linear(name, [0.0, end]),
                y: SheetAxis::linear("force left after 6 min (%)", [0.0, 110.0]),
                curves,
                ..Plot::default()
            }
        };
        let caption =
            "Six minutes at a constant amplitude that should produce the reference force; \
                       one dot for each wearer, simulated. Wearers with less initial force had too \
                       few fibres to reach the reference, and fatigue less. Lines: mean power left \
                       in Laubacher 2017, 51 % with a single electrode and 66 % with four \
                       (isokinetic, 35 Hz)."
                .to_owned();
        let mut series: Vec<&str> = open.iter().map(|condition| &*condition.id).collect();
        series.push("published");
        let plots = vec![
            plot("initial force (% of reference)", 120.0, &|result| {
                result.first
            }),
            plot("ripple (% of mean)", 80.0, &|result| result.ripple),
        ];
        figure(
            "Force and fatigue",
            "remaining force, by initial force and by ripple",
            caption,
            &series,
            plots,
        )
    }

    /// Plots the force of the first wearer over time.
    fn courses(&self, found: &DrawResult) -> Sheet {
        let groups: [(&str, &[&str]); 2] = [
            (
                "feedback",
                &["one", "two", "four", "four-half", "four-fast"],
            ),
            (
                "amplitudes from models",
                &["one-fresh", "one-tiring", "two-fresh", "two-tiring"],
            ),
        ];
        let plot = |(title, ids): &(&str, &[&str])| {
            let own = ids.iter().enumerate();
            let curves: Vec<Curve> = own
                .filter_map(|(series, id)| {
                    let course = &found.condition_result(id)?.course;
                    Some(Curve::line(series, course.iter().copied()))
                })
                .collect();
            let points = curves.iter().flat_map(|curve| &curve.points);
            let end_s = points.map(|point| point[0]).fold(10.0, f64::max);
            Plot {
                title: (*title).to_owned(),
                x: SheetAxis::linear("time (s)", [0.0, end_s]),
                y: SheetAxis::linear("force / reference", [0.0, 1.6]),
                curves,
                ..Plot::default()
            }
        };
        let caption =
            "Simulated force of wearer 0, frame by frame, until each condition ended (with \
                       models, at least one minute). Colours of the left plot: one, two, and four \
                       electrodes at 6.25, 12.5 and 25 Hz; of the right plot: one electrode with \
                       fresh and tiring models, two with fresh and tiring models. A condition is \
                       missing if the device refused the force because its model cannot reach it."
                .to_owned();
        let series = [
            "one / one, fresh",
            "two / one, tiring",
            "four, 6.25 Hz / two, fresh",
            "four, 12.5 Hz / two, tiring",
            "four, 25 Hz",
        ];
        let plots = groups.iter().map(plot).collect();
        figure("Course", "force over time", caption, &series, plots)
    }

    fn condition_text(&self, id: &str) -> String {
        let found = self
            .declared
            .conditions
            .iter()
            .find(|condition| condition.id == id);
        found.map_or_else(String::new, |condition| condition.says.clone())
    }
}

fn figure(number: &str, title: &str, caption: String, series: &[&str], plots: Vec<Plot>) -> Sheet {
    let plots = Plots {
        beside: 2,
        series: series.iter().map(|series| (*series).to_owned()).collect(),
        plots,
    };
    Sheet::figure(number, title, caption, plots)
}

fn dot(series: usize, at: [f64; 2]) -> Curve {
    Curve {
        marked: true,
        ..Curve::line(series, [at])
    }
}

/// Returns a horizontal line at the endurance ratio that Buckmire published, between two values of
/// x, as the third series of a plot.
fn published([from, to]: [f64; 2]) -> Curve {
    let ratio = PUBLISHED_S[0] / PUBLISHED_S[1];
    Curve::line(2, [[from, ratio], [to, ratio]])
}

/// Returns, for each point of this axis, its value and the nominal wearer's endurance in condition
/// `id` divided by that with one electrode. Leaves out points at which one electrode does not reach
/// the force.
fn ratios(along: &[AxisPoint], axis: &str, id: &str) -> Vec<[f64; 2]> {
    let own = along
        .iter()
        .filter(|axis_point| axis_point.axis == axis && axis_point.measured.id == id);
    let ratio = |axis_point: &AxisPoint| {
        let mut points = along.iter();
        let is_one = |other: &&AxisPoint| {
            other.axis == axis && other.value == axis_point.value && other.measured.id == "one"
        };
        let single_s = points.find(is_one)?.measured.endurance.seconds;
        let ratio = axis_point.measured.endurance.seconds / single_s;
        (single_s > 0.0).then_some([axis_point.value, ratio.min(MOST_RATIO)])
    };
    own.filter_map(ratio).collect()
}
