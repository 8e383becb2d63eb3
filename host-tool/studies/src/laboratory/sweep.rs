//! Many wearers on all cores: resumable, in shards, the same bytes however cut.

mod folder;

use super::claims::Units;
use super::conduct::Conducted;
use super::error::LaboratoryError;
use super::experiment::Experiment;
use super::open_loop::{Checked, Score, is_checked};
use super::page::publish;
use super::result::Outcome;
use folder::Folder;
use host_core::record::Place;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Units computed between two writings, for each core: few, so that little is
/// lost, and enough that no core waits for the slowest.
const AT_ONCE: usize = 8;

/// A part of a sweep: units whose index is `number - 1` modulo `of`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Shard {
    /// From 1.
    pub number: u64,
    /// Shards in all.
    pub of: u64,
}

/// Most shards of a sweep.
const MOST_SHARDS: u64 = 10_000;

impl FromStr for Shard {
    type Err = LaboratoryError;

    fn from_str(text: &str) -> Result<Self, LaboratoryError> {
        let parts = text.split_once('/');
        let parts = parts.and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((number, of)) if (1..=of).contains(&number) && of <= MOST_SHARDS => {
                Ok(Self { number, of })
            }
            _ => Err(LaboratoryError::Shard(text.to_owned())),
        }
    }
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    fn has(self, unit: u64) -> bool {
        unit % self.of == self.number - 1
    }

    /// Which of this part's units it is, from 0.
    const fn position(self, unit: u64) -> u64 {
        unit / self.of
    }
}

/// What came of a sweep, or of as much of it as there is.
pub struct Swept {
    /// Of a whole sweep that came to its end.
    pub outcome: Option<Outcome>,
    /// Of an experiment without feedback, the units that ran on the whole device too.
    pub checked: Option<Checked>,
}

/// What decides every byte of a sweep; `sweep.json`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Sweep {
    /// The experiment.
    pub name: String,
    /// SHA-256 of the declaration and its sessions, by file.
    pub sha256: BTreeMap<String, String>,
    /// Of wearers and noise.
    pub seed: u64,
    /// Wearers, at each point of the grid.
    pub draws: u64,
    /// Which part.
    pub shard: Shard,
    /// Of the program.
    pub version: String,
}

impl Sweep {
    /// Of this experiment.
    #[must_use]
    pub fn new(experiment: &Experiment, seed: u64, draws: u64, shard: Shard) -> Self {
        Self {
            name: experiment.declaration.name.clone(),
            sha256: experiment.hashes.iter().cloned().collect(),
            seed,
            draws,
            shard,
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    /// Writes in `dir`, which is a record's, that the sweep begins there.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn begin(&self, dir: &Path) -> Result<(), LaboratoryError> {
        folder::begin(dir, self)
    }

    /// What the sweep in `dir` is, whole or not.
    ///
    /// # Errors
    /// There is none.
    pub fn of(dir: &Path) -> Result<Self, LaboratoryError> {
        folder::about_of(&dir.join("sweep.json"))
    }

    /// For people.
    fn in_words(&self) -> String {
        let Self {
            name, seed, draws, ..
        } = self;
        let Shard { number, of } = self.shard;
        format!("{name}, seed {seed}, {draws} draws, shard {number}/{of}")
    }

    /// Computes what `dir` does not hold yet; `go_on` hears the part done, 0 to 1,
    /// and may say no. The page of a whole sweep shows `trials`, which were conducted
    /// before. Without feedback bodies are drawn without their device, one in a hundred
    /// with it as well.
    ///
    /// # Errors
    /// The folder holds something else or cannot be written; a unit failed, or was not
    /// what it is on the whole device, which ends the sweep with everything before kept.
    pub fn run(
        &self,
        experiment: &Experiment,
        dir: &Path,
        trials: &[Conducted],
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Swept, LaboratoryError> {
        let score = Score::of(experiment, (self.seed, self.draws))?;
        let outcome = self.run_to(experiment, (dir, trials), score.as_ref(), go_on)?;
        let checked = score.as_ref().map(Score::checked);
        Ok(Swept { outcome, checked })
    }

    /// [`Self::run`] to this score, if the experiment has one.
    pub(super) fn run_to(
        &self,
        experiment: &Experiment,
        (dir, trials): (&Path, &[Conducted]),
        score: Option<&Score>,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Option<Outcome>, LaboratoryError> {
        let (mut folder, mut units) = Folder::open(dir, self, experiment)?;
        let all: Vec<u64> = self.units(experiment).collect();
        if !units.keys().eq(all.iter().take(units.len())) {
            let file = dir.join("draws.csv").display().to_string();
            let reason = "its units are not the first ones of this part, in order".to_owned();
            return Err(LaboratoryError::Damaged { file, reason });
        }
        let left: Vec<u64> = all
            .iter()
            .copied()
            .filter(|it| !units.contains_key(it))
            .collect();
        for some in left.chunks(AT_ONCE * rayon::current_num_threads()) {
            if !go_on(units.len() as f64 / all.len() as f64) {
                return Ok(None);
            }
            let unit = |index: &u64| {
                let unit = experiment.unit(self.seed, self.draws, *index);
                let measured = match score {
                    Some(score) => {
                        let is_checked = is_checked(self.shard.position(*index));
                        score.perform(experiment, &unit, is_checked)?
                    }
                    None => experiment.perform(&unit)?,
                };
                Ok((measured, unit))
            };
            let done: Vec<Result<_, LaboratoryError>> = some.par_iter().map(unit).collect();
            for result in done {
                let (measured, unit) = result?;
                folder.append(experiment, &unit, &measured)?;
                units.insert(unit.index, measured);
            }
        }
        go_on(1.0);
        match self.shard == Shard::WHOLE {
            true => self.close(experiment, dir, (&units, trials)).map(Some),
            false => Ok(None),
        }
    }

    /// The units of this part, rising.
    fn units(&self, experiment: &Experiment) -> impl Iterator<Item = u64> {
        let shard = self.shard;
        (0..experiment.units(self.draws)).filter(move |unit| shard.has(*unit))
    }

    /// Writes what the whole came to.
    fn close(
        &self,
        experiment: &Experiment,
        dir: &Path,
        (units, trials): (&Units, &[Conducted]),
    ) -> Result<Outcome, LaboratoryError> {
        let outcome = Outcome::of(experiment, (self.seed, self.draws), units, Some(true));
        let outcome = outcome.showing(trials);
        publish(dir, &outcome, trials)?;
        Ok(outcome)
    }
}

/// Makes the folder of a sweep, if it is not there.
///
/// # Errors
/// It is a file, or cannot be made.
pub fn begin(dir: &Path) -> Result<(), LaboratoryError> {
    let made = std::fs::create_dir_all(dir);
    made.map_err(|error| LaboratoryError::File(dir.display().to_string(), error))
}

/// Makes one sweep in `out` of all of its shards in `parts`: the bytes of a sweep
/// that was never cut. `find` knows the experiment of a name.
///
/// # Errors
/// The parts are not all shards of one sweep, one has a hole, or a file fails.
pub fn merge(
    parts: &[PathBuf],
    out: &Path,
    experiment: &Experiment,
) -> Result<Outcome, LaboratoryError> {
    let about = |part: &PathBuf| Ok((part.display().to_string(), Sweep::of(part)?));
    let named = parts.iter().map(about);
    let named: Vec<(String, Sweep)> = named.collect::<Result<_, LaboratoryError>>()?;
    let whole = whole_of(&named, experiment)?;
    let mut units = BTreeMap::new();
    for (part, (name, sweep)) in parts.iter().zip(&named) {
        let own = folder::units(part, sweep, experiment)?;
        let lacking = sweep.units(experiment).find(|unit| !own.contains_key(unit));
        if let Some(unit) = lacking {
            return Err(LaboratoryError::Merge(format!(
                "{name} has a hole: unit {unit} is missing; run its shard again, it goes on"
            )));
        }
        units.extend(own);
    }
    begin(out)?;
    let _mine = Place::existing(out)?;
    let (mut folder, known) = Folder::open(out, &whole, experiment)?;
    for (index, measured) in &units {
        if !known.contains_key(index) {
            let unit = experiment.unit(whole.seed, whole.draws, *index);
            folder.append(experiment, &unit, measured)?;
        }
    }
    whole.close(experiment, out, (&units, &[]))
}

/// The sweep that these are all parts of.
fn whole_of(parts: &[(String, Sweep)], experiment: &Experiment) -> Result<Sweep, LaboratoryError> {
    let refuse = |why: String| Err(LaboratoryError::Merge(why));
    let Some((first_name, first)) = parts.first() else {
        return refuse("there are none".to_owned());
    };
    let of = first.shard.of;
    let whole = |sweep: &Sweep| Sweep {
        shard: Shard::WHOLE,
        ..sweep.clone()
    };
    let mut seen = BTreeMap::new();
    for (name, sweep) in parts {
        if whole(sweep) != whole(first) || sweep.shard.of != of {
            let (this, that) = (sweep.difference(first), first_name);
            return refuse(format!("{name} is not of the sweep of {that}: {this}"));
        }
        if let Some(other) = seen.insert(sweep.shard.number, name) {
            let number = sweep.shard.number;
            return refuse(format!("{name} and {other} are both shard {number}/{of}"));
        }
    }
    if let Some(number) = (1..=of).find(|number| !seen.contains_key(number)) {
        return refuse(format!("shard {number}/{of} is missing"));
    }
    let whole = whole(first);
    match whole == Sweep::new(experiment, whole.seed, whole.draws, Shard::WHOLE) {
        true => Ok(whole),
        false => refuse(format!(
            "{first_name} was made of another declaration or by another version of this program"
        )),
    }
}

impl Sweep {
    /// What differs from `other`, for people.
    fn difference(&self, other: &Self) -> String {
        let pairs = [
            ("experiment", self.name.clone(), other.name.clone()),
            ("seed", self.seed.to_string(), other.seed.to_string()),
            ("draws", self.draws.to_string(), other.draws.to_string()),
            (
                "shards",
                self.shard.of.to_string(),
                other.shard.of.to_string(),
            ),
            ("version", self.version.clone(), other.version.clone()),
        ];
        let differing = pairs.into_iter().find(|(_, this, that)| this != that);
        differing.map_or_else(
            || "another declaration".to_owned(),
            |(what, this, that)| format!("{what} {this}, not {that}"),
        )
    }
}
