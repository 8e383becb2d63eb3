//! Draws the counterparts of the paper's figures 3, 6 and 7.

use super::found::DrawResult;
use super::strength_duration::StrengthDurationFit;
use super::study::Study;
use super::test::Stimulation;
use crate::laboratory::{Curve, Plot, Plots, Sheet, SheetAxis};

/// Names of the curves in figure 3.
const CURVES: [&str; 4] = [
    "contraction threshold, measured",
    "contraction threshold, fitted",
    "recommended maximum, assumed",
    "lowest threshold of the fibres",
];
/// Number of points of a plotted strength–duration curve.
const POINTS: u32 = 60;

impl Study {
    /// Returns figures 3, 6 and 7 for the participants that were computed.
    pub(super) fn figures(&self, results: &[DrawResult]) -> Vec<Sheet> {
        let protocol = &self.declared.protocol;
        let widths = protocol.width_ramp_currents_ma.iter();
        let widths: Vec<_> = widths.map(|&width| Stimulation::Width(width)).collect();
        let currents = protocol.current_ramp_widths_us.iter();
        let currents: Vec<_> = currents
            .map(|&current| Stimulation::Current(current))
            .collect();
        let mut sheets: Vec<Sheet> = self.strength_durations(results).into_iter().collect();
        if let Some(first) = results.first() {
            let caption = "Simulated torque of participant 1 at the load cell: width ramps in the \
                           upper row, current ramps in the lower row, one angle per column. The \
                           paper's figure 6 shows a real participant and prints no numbers.";
            sheets.push(self.torques("Figure 6", caption, first, &[&widths, &currents]));
        }
        if let Some(second) = results.get(1) {
            let caption = "Simulated torque of participant 2 at the load cell: current ramps \
                           only, as in the paper's figure 7.";
            sheets.push(self.torques("Figure 7", caption, second, &[&currents]));
        }
        sheets
    }

    fn torques(
        &self,
        number: &str,
        caption: &str,
        found: &DrawResult,
        rows: &[&[Stimulation]],
    ) -> Sheet {
        let shown = |course: &&super::course::Course| {
            rows.iter()
                .any(|row| row.contains(&course.test.stimulation))
        };
        let moments = found.courses.iter().filter(shown);
        let moments =
            moments.flat_map(|course| course.moments.iter().map(|moment| moment.measured_nm));
        let top_nm = moments.fold(0.5, f64::max);
        let mut plots = Vec::new();
        for row in rows {
            for &deg in &self.declared.protocol.angles_deg {
                plots.push(panel(found, row, deg, top_nm));
            }
        }
        let series = (0..3).map(|place| {
            let held = rows.iter().filter_map(|row| row.get(place));
            let held: Vec<String> = held
                .map(|stimulation| stimulation.constant_value())
                .collect();
            held.join(" above, ") + if rows.len() > 1 { " below" } else { "" }
        });
        Sheet::figure(
            number,
            "elbow torque during the ramps",
            caption.to_owned(),
            Plots {
                beside: self.declared.protocol.angles_deg.len(),
                series: series.collect(),
                plots,
            },
        )
    }

    /// Plots figure 3 for the triceps of each participant.
    fn strength_durations(&self, results: &[DrawResult]) -> Option<Sheet> {
        let plot = |(place, found): (usize, &DrawResult)| self.strength_duration(place, found);
        let plots: Vec<Plot> = results
            .iter()
            .take(2)
            .enumerate()
            .filter_map(plot)
            .collect();
        let caption = "Simulated thresholds of the triceps, found by a search on the test rig, \
                       with the fitted strength-duration law. The paper's figure 3 is redrawn \
                       from Baker et al. 1993 and prints no numbers, so the upper curve is \
                       assumed: it goes through the largest pulses of section 3.3 and is limited \
                       to 80 mA.";
        (!plots.is_empty()).then(|| {
            Sheet::figure(
                "Figure 3",
                "contraction threshold and recommended maximum against pulse width",
                caption.to_owned(),
                Plots {
                    beside: 2,
                    series: CURVES.map(str::to_owned).to_vec(),
                    plots,
                },
            )
        })
    }

    fn strength_duration(&self, place: usize, found: &DrawResult) -> Option<Plot> {
        let own = found.strength_duration.first()?;
        let declared = &self.declared.strength_duration;
        let measured = own.thresholds.iter();
        let measured =
            measured.map(|threshold| [f64::from(threshold.width_us), threshold.current_ma]);
        let mut curves = vec![Curve {
            marked: true,
            ..Curve::line(0, measured)
        }];
        let along = |f: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
            let at = |value: u32| 20.0 + 280.0 * f64::from(value) / f64::from(POINTS);
            (0..=POINTS)
                .map(at)
                .map(|width| [width, f(width)])
                .collect()
        };
        if let Some(fitted) = &own.fitted {
            let law: &dyn Fn(f64) -> f64 =
                &|width| StrengthDurationFit::threshold_ma(fitted, width);
            curves.push(Curve::line(1, along(law)));
        }
        curves.push(Curve::line(2, along(&|width| declared.upper_ma(width))));
        let triceps = found.person.muscles.first()?;
        let truth = |width| triceps.strength.threshold_ma(triceps.pool.lowest(), width);
        curves.push(Curve::line(3, along(&truth)));
        Some(Plot {
            title: format!("participant {}", place + 1),
            x: SheetAxis::linear("pulse width (µs)", [0.0, 310.0]),
            y: SheetAxis::linear("current (mA)", [0.0, 85.0]),
            curves,
            ..Plot::default()
        })
    }
}

fn panel(found: &DrawResult, row: &[Stimulation], deg: f64, top_nm: f64) -> Plot {
    let curve = |(series, stimulation): (usize, &Stimulation)| {
        let is = |course: &&super::course::Course| {
            course.test.stimulation == *stimulation && course.test.included_deg == deg
        };
        let course = found.courses.iter().find(is)?;
        let points = course
            .moments
            .iter()
            .map(|moment| [moment.at, moment.measured_nm]);
        Some(Curve::line(series, points))
    };
    let end = row.iter().filter_map(|stimulation| {
        let is = |course: &&super::course::Course| course.test.stimulation == *stimulation;
        Some(found.courses.iter().find(is)?.moments.last()?.at)
    });
    let end = end.fold(1.0, f64::max);
    Plot {
        title: format!("{deg}°"),
        x: SheetAxis::linear(
            row.first().map_or("", |stimulation| stimulation.axis()),
            [0.0, end],
        ),
        y: SheetAxis::linear("torque (N·m)", [-0.05 * top_nm, 1.05 * top_nm]),
        curves: row.iter().enumerate().filter_map(curve).collect(),
        ..Plot::default()
    }
}
