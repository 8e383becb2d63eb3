//! Writes `draws.csv`, with one row for each trial, so that every number can be recomputed.

use super::{DrawMeasurements, DrawResult, Kind, Part, Study};
use crate::hamana2022::pattern::Pattern;
use std::fmt::Write;

/// First columns of every row: wearer, draw and result, then thresholds and largest voltages as
/// searched, V.
const BEGIN: &str = "wearer,draw,became,va_th,va_max,vb_th,vb_max,r_th,ve_th,ve_max";
const PATTERNS: &str = "condition,trial,place,index_nm,individuation,index_deg,\
                        thumb,index,middle,ring,little";
const TRACKED: &str = "law,points,trial,rmse_deg,refused";
const HELD: &str = "points,trial,greatest_deg,last_deg,sinks_deg";

impl Study {
    /// Formats draws as CSV in their order. A draw without a result becomes a row with the reason.
    #[must_use]
    pub fn csv(&self, parts: &[Part]) -> String {
        let rest = match self.kind {
            Kind::Patterns(_) => PATTERNS,
            Kind::Control => TRACKED,
            Kind::Hold => HELD,
        };
        let head = format!("{BEGIN},{rest}");
        let empty = ",".repeat(head.matches(',').count() - 2);
        let mut text = head + "\n";
        for part in parts {
            let (name, draw) = (&part.participant, part.draw);
            match &part.became {
                // Writing to a string cannot fail.
                Err(why) => drop(writeln!(text, "{name},{draw},\"{why}\"{empty}")),
                Ok(came) => rows(
                    &mut text,
                    &format!("{name},{draw},whole,{}", voltage_fields(came)),
                    came,
                ),
            }
        }
        text
    }
}

fn voltage_fields(came: &DrawResult) -> String {
    let [[a, b], [am, bm]] = [came.voltages.threshold_v, came.voltages.most_v];
    let extensor = came.extensor_v;
    let text = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    let r = text(came.voltages.ratio);
    let [e, em] = [0, 1].map(|at| text(extensor.map(|volts| volts[at])));
    format!("{a},{am},{b},{bm},{r},{e},{em}")
}

fn rows(text: &mut String, begin: &str, came: &DrawResult) {
    let number = |value: f64| format!("{value:.4}");
    match &came.what {
        DrawMeasurements::Patterns(session) => {
            for stimulation in &session.stimulated {
                let condition = &session.conditions[stimulation.condition].name;
                let individuation = stimulation.individuation.map_or_else(String::new, number);
                let flexed = stimulation.flexed.map(number).join(",");
                let _ = writeln!(
                    text,
                    "{begin},\"{condition}\",{},{},{:.6},{individuation},{:.3},{flexed}",
                    stimulation.trial,
                    stimulation.place,
                    stimulation.torque_nm,
                    stimulation.index_deg
                );
            }
        }
        DrawMeasurements::Tracked(tracking) => {
            for trial in &tracking.trials {
                let (rmse, why) = match &trial.rmse_deg {
                    Ok(rmse) => (format!("{rmse:.3}"), String::new()),
                    Err(why) => (String::new(), why.replace('"', "'").replace('\n', " ")),
                };
                let (law, points) = (&trial.law, trial.method.name());
                let _ = writeln!(
                    text,
                    "{begin},{law},{points},{},{rmse},\"{why}\"",
                    trial.number
                );
            }
        }
        DrawMeasurements::Held(trials) => {
            for (number, hold) in trials.iter().flatten().enumerate() {
                let points = points(hold.pattern);
                let [greatest, last] = [hold.greatest_deg(), hold.last_deg()];
                let (trial, sinks) = (number / 2, hold.drop_deg());
                let _ = writeln!(
                    text,
                    "{begin},{points},{trial},{greatest:.3},{last:.3},{sinks:.3}"
                );
            }
        }
    }
}

/// Returns "A", "B" or "two", like [`crate::hamana2022::Method::name`].
fn points(pattern: Pattern) -> &'static str {
    use crate::hamana2022::pattern::Points;
    use hal_sim::body::hand::spec::A;
    match pattern.points {
        Points::One(A) => "A",
        Points::One(_) => "B",
        Points::Two { .. } => "two",
    }
}
