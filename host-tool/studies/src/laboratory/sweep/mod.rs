//! Many wearers on all cores: resumable, in shards, the same bytes however cut.

mod drawing;
mod folder;
mod in_order;
mod merging;
mod playing;

use super::conduct::ConductedTrial;
use super::error::LaboratoryError;
use super::experiment::Experiment;
use super::open_loop::{DeviceCheck, Score};
use super::page::publish;
use super::result::Outcome;
pub use drawing::Drawing;
use folder::Folder;
use host_core::record::Place;
use in_order::in_order;
pub use merging::{MergedUnits, merge_shards, read_shard};
use playing::Playing;
pub use playing::parse_number;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A part of a sweep: units whose index is `number - 1` modulo `read`.
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
pub struct SweepResult {
    /// Of a whole sweep that came to its end.
    pub outcome: Option<Outcome>,
    /// Of an experiment without feedback, the units that ran on the whole device too.
    pub checked: Option<DeviceCheck>,
}

/// What decides every byte of a sweep; `sweep.json`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Sweep {
    /// The experiment.
    pub name: String,
    /// Which part of what is declared, where it is not all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub only: Option<String>,
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

/// The units of a sweep that were computed, now or before.
pub struct ComputedUnits<U> {
    /// The first ones of this part, by index.
    pub units: BTreeMap<u64, U>,
    /// Whether they are all of them.
    pub is_whole: bool,
    /// How many of them were computed now.
    pub fresh: u64,
}

impl Sweep {
    /// Of this experiment.
    #[must_use]
    pub fn new(experiment: &Experiment, seed: u64, draws: u64, shard: Shard) -> Self {
        Self::from_drawing(&Playing::new(experiment), (seed, draws), shard)
    }

    /// Of what is drawn: seed and draws.
    #[must_use]
    pub fn from_drawing(drawing: &impl Drawing, (seed, draws): (u64, u64), shard: Shard) -> Self {
        Self {
            name: drawing.name().to_owned(),
            only: drawing.subset(),
            sha256: drawing.hashes(),
            seed,
            draws,
            shard,
            version: drawing.version(),
        }
    }

    /// Writes in `dir`, which is a record's, that the sweep begins there.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn begin(&self, dir: &Path) -> Result<(), LaboratoryError> {
        folder::write_sweep(dir, self)
    }

    /// What the sweep in `dir` is, whole or not.
    ///
    /// # Errors
    /// There is none.
    pub fn read(dir: &Path) -> Result<Self, LaboratoryError> {
        folder::read_sweep(dir)
    }

    /// Takes the folder `dir`, absent, empty or this sweep begun before, for this program
    /// alone.
    ///
    /// # Errors
    /// E603: it holds something else, which is left alone; another program writes there.
    pub fn place(&self, dir: &Path) -> Result<Place, LaboratoryError> {
        self.take(dir, false)
    }

    /// [`Self::place`] of this drawing, which may hold fewer of its draws if it grows.
    ///
    /// # Errors
    /// As [`Self::place`].
    pub fn place_of(&self, drawing: &impl Drawing, dir: &Path) -> Result<Place, LaboratoryError> {
        self.take(dir, drawing.is_extensible())
    }

    fn take(&self, dir: &Path, grows: bool) -> Result<Place, LaboratoryError> {
        let made = std::fs::create_dir_all(dir);
        made.map_err(|error| LaboratoryError::File(dir.display().to_string(), error))?;
        folder::refuse_other(dir, self, grows)?;
        Ok(Place::open_existing(dir)?)
    }

    /// For people.
    fn in_words(&self) -> String {
        let Self {
            name, seed, draws, ..
        } = self;
        let only = self.only.iter().map(|only| format!(", {only}"));
        let only: String = only.collect();
        let Shard { number, of } = self.shard;
        format!("{name}{only}, seed {seed}, {draws} draws, shard {number}/{of}")
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
        trials: &[ConductedTrial],
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<SweepResult, LaboratoryError> {
        let score = Score::record(experiment, (self.seed, self.draws))?;
        let outcome = self.run_with_score(experiment, (dir, trials), score.as_ref(), go_on)?;
        let checked = score.as_ref().map(Score::check_result);
        Ok(SweepResult { outcome, checked })
    }

    /// [`Self::run`] to this score, if the experiment has one.
    pub(super) fn run_with_score(
        &self,
        experiment: &Experiment,
        (dir, trials): (&Path, &[ConductedTrial]),
        score: Option<&Score>,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Option<Outcome>, LaboratoryError> {
        let playing = Playing {
            experiment,
            score,
            trials,
        };
        let computed = self.compute(&playing, Some(dir), go_on)?;
        match computed.is_whole && self.shard == Shard::WHOLE {
            true => self.close(&playing, dir, &computed.units).map(Some),
            false => Ok(None),
        }
    }

    /// Computes what `dir` does not hold yet, or all of it without keeping it anywhere;
    /// `go_on` hears the part done, 0 to 1, at least every 50 ms, and may say no.
    ///
    /// # Errors
    /// The folder holds something else or cannot be written; a unit failed, which ends the
    /// sweep with everything before kept.
    pub fn compute<D: Drawing>(
        &self,
        drawing: &D,
        dir: Option<&Path>,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<ComputedUnits<D::Unit>, D::Error> {
        let all: Vec<u64> = self.units(drawing).collect();
        let opened = dir.map(|dir| self.open(dir, drawing, &all)).transpose()?;
        let (mut folder, mut units) = match opened {
            Some((folder, units)) => (Some(folder), units),
            None => (None, BTreeMap::new()),
        };
        // What is known are the first ones.
        let left = all.get(units.len()..).unwrap_or_default();
        let part = |done: usize| done as f64 / all.len() as f64;
        let compute = |index: &u64, goes_on: &(dyn Fn() -> bool + Sync)| {
            let unit = drawing.compute(self, *index, goes_on)?;
            Ok(unit.map(|unit| (*index, unit)))
        };
        let keep = &mut |(index, unit): (u64, D::Unit)| -> Result<f64, D::Error> {
            if let Some(folder) = &mut folder {
                folder.append(drawing, self, (index, &unit))?;
            }
            units.insert(index, unit);
            Ok(part(units.len()))
        };
        let begun = part(all.len() - left.len());
        in_order(left, begun, &compute, keep, go_on)?;
        let is_whole = units.len() == all.len();
        if is_whole {
            go_on(1.0);
        }
        let fresh = (units.len() + left.len() - all.len()) as u64;
        Ok(ComputedUnits {
            units,
            is_whole,
            fresh,
        })
    }

    /// The folder of this part, whose units are `all`, and those that it holds.
    fn open<D: Drawing>(
        &self,
        dir: &Path,
        drawing: &D,
        all: &[u64],
    ) -> Result<(Folder, BTreeMap<u64, D::Unit>), LaboratoryError> {
        let (folder, units) = Folder::open(dir, self, drawing)?;
        if units.keys().eq(all.iter().take(units.len())) {
            return Ok((folder, units));
        }
        let file = dir.join(drawing.file()).display().to_string();
        let reason =
            "its units are not the first ones of this part, in order: take the file away, \
                      the same command computes them anew"
                .to_owned();
        Err(LaboratoryError::Damaged { file, reason })
    }

    /// The units of this part, rising.
    fn units(&self, drawing: &impl Drawing) -> impl Iterator<Item = u64> {
        let shard = self.shard;
        (0..drawing.units(self.draws)).filter(move |unit| shard.has(*unit))
    }

    /// Writes what the units came to, be they all or the first ones: result, page and the
    /// study's own files.
    ///
    /// # Errors
    /// It cannot be analysed, or not be written.
    pub fn close<D: Drawing>(
        &self,
        drawing: &D,
        dir: &Path,
        units: &BTreeMap<u64, D::Unit>,
    ) -> Result<Outcome, D::Error> {
        let outcome = drawing.outcome(self, units)?;
        self.publish(drawing, dir, units, &outcome)?;
        Ok(outcome)
    }

    /// Writes what the units came to: result, page and the study's own files.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn publish<D: Drawing>(
        &self,
        drawing: &D,
        dir: &Path,
        units: &BTreeMap<u64, D::Unit>,
        outcome: &Outcome,
    ) -> Result<(), D::Error> {
        publish(dir, outcome, drawing.trials())?;
        for (name, content) in drawing.files(self, units)? {
            folder::write(&dir.join(name), &content)?;
        }
        Ok(())
    }

    /// What differs from `other`, for people.
    fn difference(&self, other: &Self) -> String {
        let only = |item: &Self| item.only.clone().unwrap_or_else(|| "all".to_owned());
        let pairs = [
            ("experiment", self.name.clone(), other.name.clone()),
            ("part", only(self), only(other)),
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
        if let Some((what, this, that)) = differing {
            return format!("{what} {this}, not {that}");
        }
        let mut files = self.sha256.keys().chain(other.sha256.keys());
        let file = files.find(|file| self.sha256.get(*file) != other.sha256.get(*file));
        let file = file.map(|file| format!(" ({file})"));
        format!("another declaration{}", file.unwrap_or_default())
    }
}

/// Makes one sweep in `out` of all of its shards in `parts`: the bytes of a sweep
/// that was never cut.
///
/// # Errors
/// The parts are not all shards of one sweep, one has a hole, or a file fails.
pub fn merge(
    parts: &[PathBuf],
    out: &Path,
    experiment: &Experiment,
) -> Result<Outcome, LaboratoryError> {
    let joined: MergedUnits<_> = merge_shards(parts, out, &Playing::new(experiment))?;
    Ok(joined.1)
}
