//! Writes `draws.csv`, with one row for each test of each wearer.

use super::found::DrawResult;
use super::person::is_triceps;
use super::study::Study;
use std::fmt::Write;

impl Study {
    /// Formats the results of these wearers as CSV. The random parameters are left out: they follow
    /// from the seed and the declaration in `result.json`.
    #[must_use]
    pub fn csv(&self, results: &[DrawResult]) -> String {
        let mut text =
            "person,test,angle_deg,peak_nm,begins_at,r_squared,rises,first,others\n".to_owned();
        let judged = &self.declared.judged;
        for found in results {
            for measurement in &found.measured {
                let number = |number: Option<f64>| {
                    number.map_or_else(String::new, |value| format!("{value:.6}"))
                };
                let others = measurement.answers.iter();
                let others = others
                    .filter(|answer| !is_triceps(answer.muscle) && answer.is_stimulated(judged));
                let others: Vec<String> = others
                    .map(|answer| format!("{:?}", answer.muscle))
                    .collect();
                let first = measurement
                    .first
                    .map_or_else(String::new, |muscle| format!("{muscle:?}"));
                // Writing to a string cannot fail.
                let _ = writeln!(
                    text,
                    "{},{},{},{:.6},{},{},{},{first},{}",
                    found.person.index,
                    measurement.test.stimulation.id(),
                    measurement.test.included_deg,
                    measurement.peak_nm,
                    number(measurement.detected_at),
                    number(measurement.linearity),
                    measurement.rises,
                    others.join(" "),
                );
            }
        }
        text
    }
}
