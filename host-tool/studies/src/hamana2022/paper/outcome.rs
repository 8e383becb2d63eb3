//! Assembles the study's outcome for `result.json` and the report page.

use super::{Kind, Part, Study, draw_results};
use crate::hamana2022::compared::compare_with_paper;
use crate::hamana2022::error::TwoPointsError;
use crate::hamana2022::experiments::{EXPERIMENTS, Experiment};
use crate::hamana2022::population::DECLARED;
use crate::hamana2022::sessions::Session;
use crate::laboratory::{Outcome, Preregistration, Sheet};
use host_core::record::sha256;
use std::collections::BTreeMap;

/// Note in every result that the wearers are simulated.
const SIMULATED: &str =
    "Simulated: random forearms with assumed parameters; no evidence about people.";
const MEANING: &str = "Ours is the median; low and high are the 5th and 95th percentiles over the \
                       draws that have a number. A draw is one replication of the study with \
                       those participants for whom points and voltages are found in it.";
const ROTATION: &str = "The sources disagree about rotation of the forearm: the abstract of Bao \
                        2018 reports no significant effect; Hamana 2022 reports that the angle \
                        with one point becomes smaller. The t-tests of 0° against 90° are ours \
                        and include all draws.";
const CONTROL: &str = "A mean is over all five trials. If the device refuses or ends one of them, \
                       that method has no mean in the draw; if this happens at A or B, the other \
                       point counts as one point. The paper's RMSE and table 9 belong to the \
                       paper's controller; they are repeated beside the default controller for \
                       comparison.";
const AMONG: &str = "\"Means in table 8's range\": the mean with one point lies between the \
                     smallest and the largest trial that the paper prints for one point, and \
                     likewise with two points. This criterion is ours, not the paper's.";

/// Information about the run that only the command knows.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Command line that repeats the run, without its seed.
    pub command: String,
    /// Description of the missing part if the run was interrupted.
    pub cut_short: Option<String>,
}

impl Study {
    /// Assembles the outcome of these draws, which may be incomplete after an interruption.
    ///
    /// # Errors
    /// Fails if a forearm that a figure shows is invalid. Returns E628 if the device plays another
    /// pattern.
    pub fn outcome(&self, parts: &[Part], run_info: RunInfo) -> Result<Outcome, TwoPointsError> {
        let (name, title) = self.kind.name_and_title();
        let (rows, shares) = self.compared(parts);
        let mut notes = self.notes(parts);
        if run_info.cut_short.is_none() {
            notes.extend(self.check_outputs(parts)?);
        }
        Ok(Outcome {
            name: name.to_owned(),
            title: title.to_owned(),
            seed: self.seed,
            simulated: Some(true),
            cut_short: run_info.cut_short,
            declared: Preregistration {
                asked: name.to_owned(),
                command: Some(run_info.command),
                device: Some(self.device.to_argument()),
                sha256: self.sha256(),
                source: self.source().to_owned(),
                draws: self.draws,
                drawn: None,
                as_declared: self.as_declared,
            },
            conditions: Vec::new(),
            rows,
            shares,
            decides: Vec::new(),
            sheets: self.sheets(parts)?,
            notes,
        })
    }

    /// Returns the SHA-256 of each declaration and wearer file on which the study depends, by file
    /// name.
    pub(super) fn sha256(&self) -> BTreeMap<String, String> {
        let wearers = self.participants.files.iter();
        let wearers = wearers.map(|(file, text)| (&**file, &**text));
        let experiments = ("experiments.toml", EXPERIMENTS);
        let experiments = matches!(self.kind, Kind::Patterns(_)).then_some(experiments);
        let files = std::iter::once(("population.toml", DECLARED)).chain(wearers);
        let files = files.chain(experiments);
        files
            .map(|(file, text)| (file.to_owned(), sha256(text.as_bytes())))
            .collect()
    }

    const fn source(&self) -> &'static str {
        match self.kind {
            Kind::Patterns(Experiment::Selectivity) => {
                "Hamana et al. 2022, section III-A, table 2, figures 8 to 15"
            }
            Kind::Patterns(Experiment::Torque) => {
                "Hamana et al. 2022, section III-B, tables 3 to 5, figures 17 to 20"
            }
            Kind::Patterns(Experiment::Intensities) => {
                "Hamana et al. 2022, section III-C, table 6, figure 21"
            }
            Kind::Patterns(Experiment::Posture) => {
                "Hamana et al. 2022, section III-D6a, figures 30 and 31"
            }
            Kind::Control => {
                "Hamana et al. 2022, section III-D, tables 1 and 7 to 9, figures 25 to 28"
            }
            Kind::Hold => "Hamana et al. 2022, section III-D6b, tables 1 and 7, figure 32",
        }
    }

    fn compared(
        &self,
        parts: &[Part],
    ) -> (Vec<crate::laboratory::Row>, Vec<crate::laboratory::Share>) {
        let (mut rows, shares) = match self.kind {
            Kind::Patterns(experiment) => {
                compare_with_paper(experiment, &self.protocol, &sessions(parts))
            }
            Kind::Control => (self.control_rows(parts), self.control_shares(parts)),
            Kind::Hold => (self.hold_rows(parts), self.hold_shares(parts)),
        };
        rows.extend(self.voltage_rows(parts));
        (rows, shares)
    }

    /// Returns the tables, then the figures, in the order of the paper.
    fn sheets(&self, parts: &[Part]) -> Result<Vec<Sheet>, TwoPointsError> {
        let mut sheets: Vec<Sheet> = self.voltage_sheet(parts).into_iter().collect();
        match self.kind {
            Kind::Patterns(experiment) => sheets.extend(self.pattern_tables(experiment, parts)),
            Kind::Control => sheets.extend(self.control_sheets(parts)),
            Kind::Hold => {}
        }
        sheets.extend(self.figures(parts)?);
        Ok(sheets)
    }

    fn notes(&self, parts: &[Part]) -> Vec<String> {
        let more: &[&str] = match self.kind {
            Kind::Patterns(Experiment::Posture) => &[ROTATION],
            Kind::Control => &[CONTROL, AMONG],
            _ => &[],
        };
        let forearms = self.source.note();
        let mut notes: Vec<String> = [SIMULATED, forearms, MEANING]
            .iter()
            .chain(more)
            .map(|text| (*text).to_owned())
            .chain(self.participants.ablation_note())
            .collect();
        let draws = self.draws;
        for participant in &self.participants.all {
            let name = &participant.name;
            let mut missing: BTreeMap<String, usize> = BTreeMap::new();
            let mut count = |why: String| *missing.entry(why).or_default() += 1;
            let own_parts = parts.iter().filter(|part| part.participant == *name);
            own_parts
                .filter_map(|part| part.became.as_ref().err())
                .for_each(|why| count(why.clone()));
            let tracked = draw_results(parts, name).filter_map(|outcome| outcome.tracking());
            tracked
                .flat_map(|tracking| tracking.refused())
                .for_each(count);
            let reasons = missing.into_iter();
            notes.extend(reasons.map(|(why, count)| {
                format!("{name}: in {count} of {draws} draws: {}.", in_words(&why))
            }));
        }
        notes
    }
}

/// Returns the wording in notes of a reason that is a value in `draws.csv`.
fn in_words(why: &str) -> &str {
    match why {
        "a point moves nothing, or others too" => {
            "a point moves no finger, or not the index finger alone"
        }
        "the extensor's point extends nothing, or the wrist first" => {
            "the extensor's point does not extend the finger, or extends the wrist first"
        }
        "no coupling gives the thresholds" => {
            "no electrode coupling in the allowed range gives the thresholds"
        }
        other => other,
    }
}

/// Returns the sessions of all draws that have one.
pub(super) fn sessions(parts: &[Part]) -> Vec<Session> {
    let came = parts.iter().filter_map(|part| part.became.as_ref().ok());
    came.filter_map(|outcome| outcome.session().cloned())
        .collect()
}
