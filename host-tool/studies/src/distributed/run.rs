//! Connects the study to the laboratory's runner: first the wearers, then the points along the
//! axes.

use super::declared::DECLARED;
use super::outcome::RunInfo;
use super::study::{AxisPoint, DrawResult, NAME, Study};
use crate::laboratory::{self, Outcome, StudyIdentity};
use serde::{Deserialize, Serialize};

/// Result of one unit of work of this study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Part {
    /// Results of one random wearer under every condition.
    Person(DrawResult),
    /// Result of the nominal wearer at one value of an axis.
    Point(AxisPoint),
}

/// Separates the results of random wearers from those at axis points.
fn split_parts(parts: &[Part]) -> (Vec<DrawResult>, Vec<AxisPoint>) {
    let (mut persons, mut points) = (Vec::new(), Vec::new());
    for part in parts {
        match part.clone() {
            Part::Person(found) => persons.push(found),
            Part::Point(point) => points.push(point),
        }
    }
    (persons, points)
}

impl laboratory::Study for Study {
    type Unit = Part;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: NAME,
            arguments: String::new(),
            declaration: ("distributed.toml", DECLARED),
            seed: self.seed,
            draws: self.draws,
        }
    }

    fn units(&self) -> u64 {
        self.draws + self.points().len() as u64
    }

    fn compute(&self, index: u64, _: &(dyn Fn() -> bool + Sync)) -> anyhow::Result<Option<Part>> {
        let Some(nth) = index.checked_sub(self.draws) else {
            return Ok(Some(Part::Person(self.compute_person(index)?)));
        };
        let points = self.points();
        let point = usize::try_from(nth).ok().and_then(|nth| points.get(nth));
        let point = point.map(|point| self.compute_point(point)).transpose()?;
        Ok(point.map(Part::Point))
    }

    fn outcome(&self, parts: &[Part], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        let (persons, points) = split_parts(parts);
        let run_info = RunInfo {
            command: format!("experiment {NAME} --draws {}", self.draws),
            cut_short,
        };
        Ok(self.outcome(&persons, &points, run_info)?)
    }

    fn files(&self, parts: &[Part]) -> anyhow::Result<Vec<(String, String)>> {
        Ok(vec![(
            "draws.csv".to_owned(),
            self.csv(&split_parts(parts).0),
        )])
    }

    fn progress_text(&self, done: u64) -> String {
        let persons = done.min(self.draws);
        format!(
            "{persons} of {} wearers and {} of {} chart points",
            self.draws,
            done - persons,
            self.points().len()
        )
    }
}
