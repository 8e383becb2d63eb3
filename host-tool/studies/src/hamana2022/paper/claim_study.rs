//! Table of the paper's claims: in how many replications each holds, with forearms of the prior, of
//! the prior below the ceiling, of the posterior and under the second condition.

use super::claims::{Quantities, ReplicationParts, Verdicts};
use super::{Kind, Part, Source, Study};
use crate::hamana2022::TwoPointsError;
use crate::hamana2022::conditioning::{self, ClaimKind, SHIPPED};
use crate::hamana2022::experiments::{EXPERIMENTS, Experiment};
use crate::hamana2022::sessions::percent_text;
use crate::hamana2022::tracked::LAWS;
use crate::hamana2022::wearers::WEARERS;
use crate::laboratory::{self, Grid, Outcome, Preregistration, Row, Share, Sheet, StudyIdentity};
use host_core::record::sha256;
use host_core::run::DeviceName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the study on the command line.
pub const CLAIMS: &str = "hamana-claims";

/// Forearms in the order of the table's columns.
const SOURCES: [Source; 4] = [
    Source::Prior,
    Source::Below,
    Source::Posterior,
    Source::Strict,
];
const COLUMNS: [&str; 4] = ["prior", "below ceiling", "posterior", "strict"];
/// Claim that the second condition conditions on.
const CONDITIONED: &str = "3-full";
/// Claims of experiment 2 that are judged together.
const JOINTLY: (&str, &str) = ("2-jointly", "all claims of experiment 2 in one replication");

const SIMULATED: &str =
    "Simulated: random forearms with assumed parameters; no evidence about people.";
const MEANING: &str = "A replication has one forearm of each participant, chosen by weight, and \
                       the paper's own statistic. The number is the share of replications in which \
                       the claim holds, in percent, with a 95 % interval (Wilson) of the \
                       simulation; it is no confidence in the claim about people.";
const REPEATED: &str = "Forearms of the posterior repeat each other in replications, so that the \
                        interval counts at most as many replications as the participant with the \
                        fewest has effective forearms; below the ceiling there are 40.";
const CHECKED: &str = "A check follows at least in part from the voltages that entered the \
                       conditioning, and confirms nothing. An untouched claim did not enter.";

/// The study: its experiments with each source of forearms.
pub struct ClaimStudy {
    declaration: conditioning::Declaration,
    studies: Vec<SourceStudies>,
    /// Number of effective forearms of the participant with the fewest, in the order of the columns.
    effective: [f64; SOURCES.len()],
    seed: u64,
    draws: u64,
    as_declared: bool,
}

/// The six studies of the paper with forearms of one source.
struct SourceStudies {
    selectivity: Study,
    torque: Study,
    intensities: Study,
    posture: Study,
    control: Study,
    hold: Study,
}

/// One replication with forearms of one source.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Unit {
    /// Index of the source in the order of the columns.
    source: usize,
    verdicts: Verdicts,
    quantities: Quantities,
}

impl SourceStudies {
    fn new(source: Source, seed: u64) -> Result<Self, TwoPointsError> {
        let study = |kind: Kind, is_printed: bool| -> Result<Study, TwoPointsError> {
            let whom = (None, None, Some(source));
            let decided = (Some(seed), Some(1));
            let mut study = Study::new(kind, whom, decided, DeviceName::Native)?;
            if is_printed {
                study
                    .participants
                    .all
                    .retain(|participant| participant.paper.is_some());
            }
            study.laws = &LAWS[..1];
            Ok(study)
        };
        Ok(Self {
            selectivity: study(Kind::Patterns(Experiment::Selectivity), false)?,
            torque: study(Kind::Patterns(Experiment::Torque), false)?,
            intensities: study(Kind::Patterns(Experiment::Intensities), false)?,
            posture: study(Kind::Patterns(Experiment::Posture), true)?,
            control: study(Kind::Control, true)?,
            hold: study(Kind::Hold, true)?,
        })
    }

    /// Computes replication `draw`; `None` after `goes_on` has returned `false`. Every study of a
    /// session has the same wearer, and all sessions have the same forearm.
    fn replicate(
        &self,
        (draw, has_control): (u64, bool),
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<ReplicationParts>, TwoPointsError> {
        let mut replication = ReplicationParts::default();
        for participant in &self.selectivity.participants.all {
            let is_of = |study: &&Study| {
                let mut own = study.participants.all.iter();
                own.any(|other| other.name == participant.name)
            };
            let last: [(&Study, &mut Vec<Part>); 4] = [
                (&self.intensities, &mut replication.intensities),
                (&self.posture, &mut replication.posture),
                (&self.control, &mut replication.control),
                (&self.hold, &mut replication.hold),
            ];
            let last: Vec<(&Study, &mut Vec<Part>)> = last
                .into_iter()
                .filter(|(study, _)| is_of(study) && (has_control || study.is_quick()))
                .collect();
            let sessions = [
                vec![(&self.selectivity, &mut replication.selectivity)],
                vec![(&self.torque, &mut replication.torque)],
                last,
            ];
            let chosen = self.selectivity.choose_forearm(participant, draw)?;
            for session in sessions {
                let Some((first, _)) = session.first() else {
                    continue;
                };
                let wearer = match &chosen {
                    Ok(chosen) => first.wearer_of(participant, chosen)?,
                    Err(why) => Err(*why),
                };
                for (study, parts) in session {
                    match study.part_of((participant, draw), &wearer, goes_on)? {
                        Some(part) => parts.push(part),
                        None => return Ok(None),
                    }
                }
            }
        }
        Ok(Some(replication))
    }
}

impl ClaimStudy {
    /// Creates the study; `None` for seed or draws takes the declared ones.
    ///
    /// # Errors
    /// Returns E621 if a declaration is wrong.
    pub fn new((seed, draws): (Option<u64>, Option<u64>)) -> Result<Self, TwoPointsError> {
        let declaration = conditioning::Declaration::load_embedded()?;
        let declared = (declaration.seed, declaration.replications.patterns);
        let (seed, draws) = (seed.unwrap_or(declared.0), draws.unwrap_or(declared.1));
        let studies = SOURCES.map(|source| SourceStudies::new(source, seed));
        let studies: Vec<SourceStudies> = studies.into_iter().collect::<Result<_, _>>()?;
        let effective = |source: usize| {
            let study = &studies[source].selectivity; // one for each source
            let participants = study.participants.all.iter();
            participants
                .map(|own| study.effective_forearms(own))
                .fold(f64::INFINITY, f64::min)
        };
        Ok(Self {
            effective: std::array::from_fn(effective),
            studies,
            as_declared: (seed, draws) == declared,
            declaration,
            seed,
            draws,
        })
    }

    /// Returns verdict counts of a claim with forearms of one source: how often it holds, of how
    /// many.
    fn counts(units: &[Unit], source: usize, id: &str) -> (u64, u64) {
        let own = units.iter().filter(|unit| unit.source == source);
        let judged: Vec<bool> = own
            .filter_map(|unit| unit.verdicts.get(id).copied().flatten())
            .collect();
        let holds = judged.iter().filter(|holds| **holds).count();
        (holds as u64, judged.len() as u64)
    }

    /// Lists identifier, wording, source and kind of each claim, the joint one last.
    fn claims(&self) -> Vec<(&str, &str, &str, &str)> {
        let claims = self.declaration.claims.iter().map(|claim| {
            let kind = match claim.kind {
                ClaimKind::Check => "check",
                ClaimKind::Untouched => "untouched",
            };
            (&*claim.id, &*claim.says, &*claim.source, kind)
        });
        claims
            .chain([(JOINTLY.0, JOINTLY.1, "III-B", "untouched")])
            .collect()
    }

    fn table(&self, units: &[Unit]) -> Sheet {
        let cell = |source: usize, id: &str| match SOURCES[source] {
            Source::Strict if id == CONDITIONED => "conditioned".to_owned(),
            _ => percent_text(Self::counts(units, source, id), self.effective[source]),
        };
        let rows = self.claims().into_iter().map(|(id, says, source, kind)| {
            let first = [says.to_owned(), source.to_owned(), kind.to_owned()];
            first
                .into_iter()
                .chain((0..SOURCES.len()).map(|source| cell(source, id)))
                .collect()
        });
        let heads = ["claim", "paper", "kind"].into_iter().chain(COLUMNS);
        let grid = Grid {
            heads: heads.map(str::to_owned).collect(),
            rows: rows.collect(),
        };
        let caption = format!(
            "Share of replications in which the claim holds, %, with its 95 % interval. {CHECKED} \
             {REPEATED} Prior below ceiling: both greatest voltages below the end of the search. Strict: one \
             point at its greatest voltage flexes P's finger fully."
        );
        let title = "the paper's claims with conditioned forearms";
        Sheet::table("Claims", title, caption, grid)
    }

    fn rows(units: &[Unit]) -> Vec<Row> {
        let mut values: BTreeMap<(usize, &str), Vec<f64>> = BTreeMap::new();
        for unit in units {
            for (name, value) in &unit.quantities {
                values.entry((unit.source, name)).or_default().push(*value);
            }
        }
        let rows = values.into_iter().map(|((source, name), values)| {
            let column = SOURCES.get(source).map_or("", |source| source.name());
            let id = format!("{column}/{name}");
            Row::from_numbers(id, format!("{column}: {name}"), "", None, values)
        });
        rows.collect()
    }
}

impl laboratory::Study for ClaimStudy {
    type Unit = Unit;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: CLAIMS,
            arguments: String::new(),
            declaration: ("hamana-participants.toml", conditioning::DECLARED),
            seed: self.seed,
            draws: self.draws,
        }
    }

    fn hashes(&self) -> BTreeMap<String, String> {
        let files = [
            ("hamana-participants.toml", conditioning::DECLARED),
            ("hamana-posterior.csv", SHIPPED),
            ("experiments.toml", EXPERIMENTS),
            ("wearers.toml", WEARERS),
        ];
        BTreeMap::from(files.map(|(file, text)| (file.to_owned(), sha256(text.as_bytes()))))
    }

    fn units(&self) -> u64 {
        SOURCES.len() as u64 * self.draws
    }

    fn compute(
        &self,
        index: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<Unit>> {
        let draws = self.draws.max(1);
        let (source, draw) = ((index / draws) as usize, index % draws);
        let Some(studies) = self.studies.get(source) else {
            return Ok(None);
        };
        let has_control = draw < self.declaration.replications.control;
        let Some(parts) = studies.replicate((draw, has_control), goes_on)? else {
            return Ok(None);
        };
        let fully_deg = self.declaration.strict.flexed_deg;
        let (verdicts, quantities) = parts.judge(&studies.torque.protocol, fully_deg);
        Ok(Some(Unit {
            source,
            verdicts,
            quantities,
        }))
    }

    fn outcome(&self, units: &[Unit], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        let sources = SOURCES.into_iter().enumerate();
        let shares = sources.flat_map(|(source, forearms)| {
            self.claims()
                .into_iter()
                .map(move |(id, says, _, _)| Share {
                    at: forearms.name().to_owned(),
                    ..Share::from_counts(
                        id.to_owned(),
                        format!("{}: {says}", forearms.name()),
                        Some(true),
                        Self::counts(units, source, id),
                    )
                })
        });
        Ok(Outcome {
            name: CLAIMS.to_owned(),
            title: "Hamana 2022: the paper's claims with forearms that agree with its voltages"
                .to_owned(),
            seed: self.seed,
            simulated: Some(true),
            cut_short,
            declared: Preregistration {
                asked: CLAIMS.to_owned(),
                command: Some(format!("experiment {CLAIMS} --draws {}", self.draws)),
                device: None,
                sha256: laboratory::Study::hashes(self),
                source: "Hamana et al. 2022, sections III and IV".to_owned(),
                draws: self.draws,
                drawn: Some("replications".to_owned()),
                as_declared: self.as_declared,
            },
            conditions: Vec::new(),
            rows: Self::rows(units),
            shares: shares.collect(),
            decides: Vec::new(),
            sheets: vec![self.table(units)],
            notes: [SIMULATED, MEANING, REPEATED, CHECKED]
                .map(str::to_owned)
                .to_vec(),
        })
    }

    fn files(&self, units: &[Unit]) -> anyhow::Result<Vec<(String, String)>> {
        let mut text = "claim,kind,forearms,holds,of\n".to_owned();
        for (id, _, _, kind) in self.claims() {
            for (source, forearms) in SOURCES.into_iter().enumerate() {
                let (holds, of) = Self::counts(units, source, id);
                text += &format!("{id},{kind},{},{holds},{of}\n", forearms.name());
            }
        }
        Ok(vec![("claims.csv".to_owned(), text)])
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} replications", laboratory::Study::units(self))
    }
}
