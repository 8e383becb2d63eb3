//! Repeats Hamana 2022's six studies with random draws of its participants and compares the results
//! with the printed ones.
//!
//! Takes participants, a seed and a number of draws; returns an
//! [`Outcome`](crate::laboratory::Outcome) and `draws.csv`. The module defines the studies,
//! computes the result of each draw, and produces the rows, claims, tables and figures. Searches
//! and trials are in the parent module, the forearm in `hal_sim::body::hand`. Everything is
//! simulated: this is no evidence about people.

mod anova;
mod claim_study;
mod claims;
mod control;
mod csv;
mod device;
mod drawn;
mod figures;
mod hold;
mod outcome;

mod run;
mod spread;
mod tables;
mod tracking;
mod voltages;

pub use claim_study::{CLAIMS, ClaimStudy};
pub use drawn::Source;
pub use outcome::RunInfo;

pub use tracking::{Course, Tracking, Trial};

use super::conditioning::{self, AcceptedForearm, Posterior};
use super::error::TwoPointsError;
use super::experiments::{Experiment, Protocol};
use super::held::Hold;
use super::participant::Participant;
use super::population::Population;
use super::sessions::Session;
use super::tracked::LAWS;
use super::voltages::Voltages;
use super::wearers::{Participants, Wearer};
use crate::laboratory::quote_for_shell;
use host_core::run::DeviceName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// The six studies of the paper. Four of them differ only in their [`Experiment`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Experiments 1 to 3 and posture: patterns on the simulated forearm without a device.
    Patterns(Experiment),
    /// Experiment 4: the finger follows a sine under control of the device.
    Control,
    /// Hold (III-D6b): ten seconds of one pattern.
    Hold,
}

/// Name on the command line, kind and title of each study.
const ALL: [(&str, Kind, &str); 6] = [
    (
        "hamana-1",
        Kind::Patterns(Experiment::Selectivity),
        "Hamana 2022, experiment 1: individuation of 25 patterns",
    ),
    (
        "hamana-2",
        Kind::Patterns(Experiment::Torque),
        "Hamana 2022, experiment 2: torque of 29 patterns",
    ),
    (
        "hamana-3",
        Kind::Patterns(Experiment::Intensities),
        "Hamana 2022, experiment 3: fingers at nine intensities",
    ),
    (
        "hamana-posture",
        Kind::Patterns(Experiment::Posture),
        "Hamana 2022, III-D6: the index finger as the forearm pronates",
    ),
    (
        "hamana-4",
        Kind::Control,
        "Hamana 2022, experiment 4, on a multibody forearm model",
    ),
    (
        "hamana-hold",
        Kind::Hold,
        "Hamana 2022: how far a held finger sinks in 10 s, one point or two",
    ),
];

impl Kind {
    /// Returns the kind of the study with this name on the command line, such as `hamana-1`.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let mut kinds = ALL.into_iter();
        kinds.find_map(|(own, kind, _)| (own == name).then_some(kind))
    }

    fn name_and_title(self) -> (&'static str, &'static str) {
        let mut kinds = ALL.into_iter();
        let own = kinds.find_map(|(name, kind, title)| (kind == self).then_some((name, title)));
        own.unwrap_or_default()
    }
}

/// A study with the options of its command.
#[derive(Clone, Debug)]
pub struct Study {
    kind: Kind,
    participants: Participants,
    /// Forearms that the participants have.
    source: Source,
    /// Prior of the conditioned forearms, and those that were accepted.
    conditioning: conditioning::Declaration,
    posterior: Posterior,
    /// Forearms below the ceiling that were found; they take long to find.
    below: Arc<Mutex<ForearmsBelow>>,
    population: Population,
    protocol: Protocol,
    /// Seed of all draws.
    seed: u64,
    /// Number of draws of each participant.
    draws: u64,
    /// Whether participants, seed and draws are the preregistered ones, without an ablation.
    as_declared: bool,
    /// Controllers of experiment 4.
    laws: &'static [&'static str],
    /// Device on which experiment 4 runs; the other studies check a sample of their patterns on it.
    device: DeviceName,
    /// Options for wearer, ablation and device as they are typed on a command line.
    typed: String,
}

/// Forearms of the prior below the ceiling, by participant and place among them.
type ForearmsBelow = BTreeMap<(String, u64), Option<AcceptedForearm>>;

/// Result of one draw of a participant, or the reason why there is none.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Part {
    /// Name of the participant.
    pub participant: String,
    /// Index of the draw, from 0.
    pub draw: u64,
    /// Result, or why the searches for points and voltages failed.
    pub became: Result<DrawResult, String>,
}

/// Result of a draw that has points and voltages.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DrawResult {
    /// Thresholds and largest voltages of A and B that the search found.
    pub voltages: Voltages,
    /// Threshold and largest voltage of the extensor's point, V; `None` in a session without it.
    pub extensor_v: Option<[f64; 2]>,
    /// Measurements made at these points and voltages.
    pub what: DrawMeasurements,
}

/// Measurements of one draw, by kind of study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum DrawMeasurements {
    /// All stimulations of experiments 1 to 3 or posture.
    Patterns(Session),
    /// All trials of experiment 4.
    Tracked(Tracking),
    /// Holds with one point and with two, by trial.
    Held(Vec<[Hold; 2]>),
}

impl Study {
    /// Creates the study. `source` selects the forearms of the participants; `None` stands for the
    /// posterior, or for forearms with fixed assumptions if a wearer file or an ablation is given.
    /// `wearer` is `all`, the name of a participant or the path of a wearer
    /// file; `None` stands for all participants, or for P in experiment 3. `None` for `ablation`,
    /// `seed` or `draws` takes the preregistered value.
    ///
    /// # Errors
    /// Returns E621, E624 to E627 or E813 if a declaration or wearer file cannot be read, or there is no
    /// wearer or ablation of this name.
    pub fn new(
        kind: Kind,
        (wearer, ablation, source): (Option<&str>, Option<&str>, Option<Source>),
        (seed, draws): (Option<u64>, Option<u64>),
        device: DeviceName,
    ) -> Result<Self, TwoPointsError> {
        // The paper's experiment 3 has only participant P.
        let is_of_p = kind == Kind::Patterns(Experiment::Intensities);
        let participants = Participants::load(wearer.or(is_of_p.then_some("P")))?;
        let participants = participants.with_departure(ablation)?;
        let is_all = wearer.is_none_or(|wearer| wearer == if is_of_p { "P" } else { "all" });
        let is_own = is_all && ablation.is_none() && source.is_none_or(|s| s == Source::Posterior);
        let is_known = wearer.is_some_and(|wearer| wearer.ends_with(".toml")) || ablation.is_some();
        if let (true, Some(source)) = (is_known, source)
            && source != Source::Fixed
        {
            return Err(TwoPointsError::Source(source.name()));
        }
        let source = source.unwrap_or(match is_known {
            true => Source::Fixed,
            false => Source::Posterior,
        });
        let seed = seed.unwrap_or(participants.seed);
        let draws = draws.unwrap_or(participants.draws);
        let letter = wearer.filter(|wearer| !wearer.ends_with(".toml"));
        let file = wearer.filter(|_| letter.is_none());
        let options = [
            ("--participant", letter),
            ("--wearer", file),
            ("--ablation", ablation),
            (
                "--participants",
                Some(source.name()).filter(|_| !is_known && source != Source::Posterior),
            ),
        ];
        let options = options
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)));
        let mut typed: String = options
            .map(|(name, value)| format!("{name} {} ", quote_for_shell(value)))
            .collect();
        typed += &format!("--device {}", device.to_argument());
        Ok(Self {
            kind,
            laws: &LAWS,
            source,
            conditioning: conditioning::Declaration::load_embedded()?,
            posterior: Posterior::load_embedded()?,
            below: Arc::default(),
            population: Population::load_embedded()?,
            protocol: Protocol::load_embedded()?,
            as_declared: is_own && (seed, draws) == (participants.seed, participants.draws),
            participants,
            seed,
            draws,
            device,
            typed,
        })
    }

    /// Returns the number of draws of each participant.
    #[must_use]
    pub const fn draws(&self) -> u64 {
        self.draws
    }

    /// Returns whether a draw takes milliseconds, because nothing moves in it.
    const fn is_quick(&self) -> bool {
        matches!(self.kind, Kind::Patterns(_))
    }

    /// Lists the units of the study in the order of `draws.csv`. A unit is the index of a
    /// participant and the index of a draw.
    #[must_use]
    pub fn units(&self) -> Vec<(usize, u64)> {
        let indices = 0..self.participants.all.len();
        indices
            .flat_map(|participant| (0..self.draws).map(move |draw| (participant, draw)))
            .collect()
    }

    /// Computes one of [`Self::units`]. Returns `None` after `goes_on` has returned `false`.
    ///
    /// # Errors
    /// Fails if the declaration, a hand or the program's own session is invalid.
    pub fn compute_part(
        &self,
        (who, draw): (usize, u64),
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Part>, TwoPointsError> {
        let Some(participant) = self.participants.all.get(who).filter(|_| goes_on()) else {
            return Ok(None);
        };
        let wearer = self.draw_wearer(participant, draw)?;
        self.part_of((participant, draw), &wearer, goes_on)
    }

    /// Measures a random wearer. Returns `None` after `goes_on` has returned `false`.
    fn part_of(
        &self,
        (participant, draw): (&Participant, u64),
        wearer: &Result<Wearer, &'static str>,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Part>, TwoPointsError> {
        let part = |became| Part {
            participant: participant.name.clone(),
            draw,
            became,
        };
        let wearer = match wearer {
            Ok(wearer) => wearer,
            Err(why) => return Ok(Some(part(Err((*why).to_owned())))),
        };
        let outcome = self.measure_draw((participant, draw), wearer, goes_on)?;
        let came = outcome.map(|measurements| DrawResult {
            voltages: wearer.voltages,
            extensor_v: wearer.extensor_v,
            what: measurements,
        });
        Ok(came.map(|came| part(Ok(came))))
    }

    fn measure_draw(
        &self,
        (participant, draw): (&Participant, u64),
        wearer: &Wearer,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<DrawMeasurements>, TwoPointsError> {
        Ok(match self.kind {
            Kind::Patterns(experiment) => Some(DrawMeasurements::Patterns(Session {
                participant: participant.name.clone(),
                is_printed: participant.paper.is_some(),
                draw,
                conditions: experiment.conditions(&wearer.voltages, &self.protocol),
                stimulated: wearer.run_session(&self.population, &self.protocol, experiment)?,
            })),
            Kind::Control => self
                .tracking(wearer, goes_on)?
                .map(DrawMeasurements::Tracked),
            Kind::Hold => {
                let mut trials = Vec::new();
                for number in 0..self.participants.held {
                    if !goes_on() {
                        return Ok(None);
                    }
                    trials.push(wearer.hold(&self.population, number)?);
                }
                Some(DrawMeasurements::Held(trials))
            }
        })
    }

    /// Returns the first draw of this participant with a result, and its forearm.
    fn first_forearm(
        &self,
        name: &str,
        parts: &[Part],
    ) -> Result<Option<(u64, Wearer)>, TwoPointsError> {
        let is = |part: &&Part| part.participant == name && part.became.is_ok();
        let Some(part) = parts.iter().find(is) else {
            return Ok(None);
        };
        let wearer = self.wearer(name, part.draw)?;
        Ok(wearer.map(|wearer| (part.draw, wearer)))
    }

    /// Generates the forearm of this draw; `None` if it has no points and voltages.
    fn wearer(&self, name: &str, draw: u64) -> Result<Option<Wearer>, TwoPointsError> {
        let own = self
            .participants
            .all
            .iter()
            .find(|participant| participant.name == name);
        let Some(own) = own else { return Ok(None) };
        Ok(self.draw_wearer(own, draw)?.ok())
    }
}

impl DrawResult {
    /// Returns the session, if this is a study of patterns.
    fn session(&self) -> Option<&Session> {
        match &self.what {
            DrawMeasurements::Patterns(session) => Some(session),
            _ => None,
        }
    }

    /// Returns the trials, if this is experiment 4.
    fn tracking(&self) -> Option<&Tracking> {
        match &self.what {
            DrawMeasurements::Tracked(tracking) => Some(tracking),
            _ => None,
        }
    }

    /// Returns the trials, if this is the hold.
    fn held(&self) -> Option<&[[Hold; 2]]> {
        match &self.what {
            DrawMeasurements::Held(held) => Some(held),
            _ => None,
        }
    }
}

/// Returns the result of draw `draw` of participant `name`, if it has one.
fn find_draw<'p>(parts: &'p [Part], name: &str, draw: u64) -> Option<&'p DrawResult> {
    let mut own = parts.iter();
    let own = own.find(|part| part.draw == draw && part.participant == name)?;
    own.became.as_ref().ok()
}

/// Iterates over the results of participant `name` and skips draws without a result.
fn draw_results<'p>(parts: &'p [Part], name: &'p str) -> impl Iterator<Item = &'p DrawResult> {
    let own = parts.iter().filter(move |part| part.participant == name);
    own.filter_map(|part| part.became.as_ref().ok())
}
