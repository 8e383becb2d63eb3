//! Converts the result of a fault class to `result.json`: every number of the class and its kinds,
//! and the cases that need review.

use super::declaration::Declaration;
use super::outcome::Outcome;
use super::table::{SEVERE, SIMULATED, in_words};
use crate::laboratory::{self, Preregistration, Row, Share};

impl Outcome {
    /// Returns the contents of `result.json` for this campaign on `device` with this seed.
    #[must_use]
    pub fn result(
        &self,
        declaration: &Declaration,
        (device, seed): (&str, u64),
        notes: &[String],
    ) -> laboratory::Outcome {
        let class = self.class;
        let mut texts = vec![SIMULATED.to_owned(), SEVERE.to_owned()];
        texts.extend_from_slice(notes);
        texts.extend(self.remarks());
        texts.extend(self.listed.iter().map(in_words));
        let harmless = self.drawn - self.severe;
        let count = declaration.count(device == "native");
        laboratory::Outcome {
            name: format!("faults-{class}"),
            title: format!("Faults: {class}"),
            seed,
            simulated: Some(true),
            cut_short: None,
            declared: Preregistration {
                asked: format!("faults --class {class}"),
                command: Some(format!(
                    "faults --class {class} --device {device} --draws {}",
                    self.drawn
                )),
                device: Some(device.to_owned()),
                sha256: declaration.sha256.clone(),
                source: "docs/evidence/faults.md".to_owned(),
                draws: self.drawn,
                drawn: Some("cases".to_owned()),
                as_declared: (seed, self.drawn) == (declaration.seed(), count),
            },
            conditions: Vec::new(),
            rows: std::iter::once(self)
                .chain(&self.kinds)
                .flat_map(Self::rows)
                .collect(),
            shares: vec![
                part(
                    "found",
                    "a fault that must be found is found",
                    self.found,
                    self.to_find,
                ),
                part("harmless", "a case is not severe", harmless, self.drawn),
            ],
            decides: Vec::new(),
            sheets: Vec::new(),
            notes: texts,
        }
    }

    fn rows(&self) -> Vec<Row> {
        let cases = [
            ("changed", "with a visible effect", self.changed),
            ("harmless", "harmless", self.harmless),
            ("to-find", "must be found", self.to_find),
            ("found", "found", self.found),
            ("soon", "disconnected within 500 us", self.soon),
            ("stopped", "refused by the simulator", self.stopped),
            ("severe", "severe", self.severe),
            ("bare", "severe with bare stages", self.bare),
            ("truncated", "truncated pulses", self.truncated),
        ];
        let cases = cases.map(|(id, quantity, n)| (id, quantity, "cases", Some(n as f64)));
        let us = |us: Option<u64>| us.map(|us| us as f64);
        let percent = self.severe_bound().map(|share| 100.0 * share);
        let others = [
            ("severe-bound", "severe, at most (95 %)", "%", percent),
            (
                "median",
                "time to disconnection, median",
                "us",
                self.median_us,
            ),
            (
                "latest",
                "time to disconnection, longest",
                "us",
                us(self.latest_us),
            ),
            (
                "slowest",
                "time from report to disconnection, longest",
                "us",
                us(self.slowest_us),
            ),
            (
                "shown",
                "tape flip on an output line, longest",
                "us",
                us(self.shown_us),
            ),
            (
                "charge",
                "charge left by a truncated pulse, largest",
                "uC",
                self.truncated_uc,
            ),
        ];
        let class = self.class;
        let group = match &self.kind {
            None => class.to_string(),
            Some(kind) if kind.is_empty() => format!("{class}/others"),
            Some(kind) => format!("{class}/{kind}"),
        };
        let row = |(id, quantity, unit, ours): (&str, &str, &str, Option<f64>)| Row {
            id: format!("{group}/{id}"),
            quantity: format!("{group}: {quantity}"),
            unit: unit.to_owned(),
            paper: None,
            ours,
            low: None,
            high: None,
            n: self.drawn as usize,
        };
        cases.into_iter().chain(others).map(row).collect()
    }
}

/// Creates the share of the claim `id`, which holds in `holds` of `cases` cases, with its confidence
/// interval.
fn part(id: &str, claim: &str, holds: u64, cases: u64) -> Share {
    Share::from_counts(id.to_owned(), claim.to_owned(), None, (holds, cases))
}
