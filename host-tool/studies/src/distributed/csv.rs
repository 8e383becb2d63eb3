//! Writes `draws.csv`, with one row for each condition of each wearer.

use super::study::{DrawResult, Study};
use std::fmt::Write;

impl Study {
    /// Formats the results of these wearers as CSV, with one row for each wearer and condition.
    /// Each row begins with the random parameters of the wearer.
    #[must_use]
    pub fn csv(&self, results: &[DrawResult]) -> String {
        let fields: Vec<&str> = self
            .declared
            .ranges
            .iter()
            .map(|range| &*range.field)
            .collect();
        let mut text = format!(
            "person,{},condition,endurance_s,at_least,refused,ripple,found,first,left,off\n",
            fields.join(",")
        );
        let number =
            |number: Option<f64>| number.map_or_else(String::new, |value| format!("{value:.6}"));
        for found in results {
            let drawn: Vec<String> = found
                .drawn
                .iter()
                .map(|value| format!("{value:.6}"))
                .collect();
            for measurement in &found.measured {
                // Writing to a string cannot fail.
                let _ = writeln!(
                    text,
                    "{},{},{},{:.2},{},{},{},{},{},{},{}",
                    found.index,
                    drawn.join(","),
                    measurement.id,
                    measurement.endurance.seconds,
                    measurement.endurance.is_longer,
                    measurement.is_refused,
                    number(measurement.ripple),
                    measurement.is_found,
                    number(measurement.first),
                    number(measurement.left),
                    number(measurement.distance),
                );
            }
        }
        text
    }
}
