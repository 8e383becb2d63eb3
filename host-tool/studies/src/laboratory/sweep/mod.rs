//! Simulates many wearers on all cores. A sweep can be resumed and divided into shards; the
//! resulting bytes are the same.

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

/// One of several parts into which a sweep is divided. It contains the units whose index modulo
/// `of` is `number` − 1.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Shard {
    /// Number of this shard, from 1.
    pub number: u64,
    /// Number of shards into which the sweep is divided.
    pub of: u64,
}

/// Largest number of shards of a sweep.
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
    /// The only shard of a sweep that is not divided.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    fn has(self, unit: u64) -> bool {
        unit % self.of == self.number - 1
    }

    /// Returns the position of a unit among those of this shard, from 0.
    const fn position(self, unit: u64) -> u64 {
        unit / self.of
    }
}

/// Result of a sweep, complete or not.
pub struct SweepResult {
    /// Result of a complete sweep; `None` if units are missing or if this is only a shard.
    pub outcome: Option<Outcome>,
    /// Comparison with simulations of the whole device; `None` for an experiment with feedback,
    /// which always simulates the device.
    pub checked: Option<DeviceCheck>,
}

/// The inputs that determine every byte of a sweep; stored as `sweep.json`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Sweep {
    /// Name of the experiment or study.
    pub name: String,
    /// Part of the declaration that the sweep covers; `None` if it covers everything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub only: Option<String>,
    /// SHA-256 of the declaration and its sessions, by file name.
    pub sha256: BTreeMap<String, String>,
    /// Seed of wearers and noise.
    pub seed: u64,
    /// Number of random wearers at each point of the grid.
    pub draws: u64,
    /// Shard that is computed in this folder.
    pub shard: Shard,
    /// Version of the program that computes the units.
    pub version: String,
}

/// Units of a shard that exist, computed in this run or earlier.
pub struct ComputedUnits<U> {
    /// Units by index; they are the first ones of the shard.
    pub units: BTreeMap<u64, U>,
    /// Whether these are all units of the shard.
    pub is_whole: bool,
    /// Number of units that this run computed.
    pub fresh: u64,
}

impl Sweep {
    /// Creates the sweep of an experiment.
    #[must_use]
    pub fn new(experiment: &Experiment, seed: u64, draws: u64, shard: Shard) -> Self {
        Self::from_drawing(&Playing::new(experiment), (seed, draws), shard)
    }

    /// Creates the sweep of any drawing with this seed and number of draws.
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

    /// Writes `sweep.json` into the folder `dir`.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    pub fn begin(&self, dir: &Path) -> Result<(), LaboratoryError> {
        folder::write_sweep(dir, self)
    }

    /// Reads the description of the sweep in the folder `dir`, which may be incomplete.
    ///
    /// # Errors
    /// Fails if `dir` contains no sweep.
    pub fn read(dir: &Path) -> Result<Self, LaboratoryError> {
        folder::read_sweep(dir)
    }

    /// Locks the folder `dir` for this process. It must be absent, empty, or contain an earlier
    /// part of this sweep.
    ///
    /// # Errors
    /// Fails with E603 if the folder contains something else, which stays unchanged, or if another
    /// program writes there.
    pub fn place(&self, dir: &Path) -> Result<Place, LaboratoryError> {
        self.take(dir, false)
    }

    /// Locks the folder as [`Self::place`] does. It may also contain the same sweep with fewer
    /// draws, if the drawing is extensible.
    ///
    /// # Errors
    /// Fails as [`Self::place`] does.
    pub fn place_of(&self, drawing: &impl Drawing, dir: &Path) -> Result<Place, LaboratoryError> {
        self.take(dir, drawing.is_extensible())
    }

    fn take(&self, dir: &Path, grows: bool) -> Result<Place, LaboratoryError> {
        let made = std::fs::create_dir_all(dir);
        made.map_err(|error| LaboratoryError::File(dir.display().to_string(), error))?;
        folder::refuse_other(dir, self, grows)?;
        Ok(Place::open_existing(dir)?)
    }

    /// Returns a description of the sweep for messages.
    fn in_words(&self) -> String {
        let Self {
            name, seed, draws, ..
        } = self;
        let only = self.only.iter().map(|only| format!(", {only}"));
        let only: String = only.collect();
        let Shard { number, of } = self.shard;
        format!("{name}{only}, seed {seed}, {draws} draws, shard {number}/{of}")
    }

    /// Computes the units that `dir` lacks. `go_on` receives the finished part, 0 to 1, and ends
    /// the run by returning `false`. The page of a complete sweep also shows the earlier recorded
    /// `trials`. An experiment without feedback is simulated without the device; one unit in a
    /// hundred is also simulated with it, and compared.
    ///
    /// # Errors
    /// Fails if the folder contains something else or cannot be written, if a unit fails, or if its
    /// simulations with and without the device differ. The sweep then ends, and all earlier units
    /// stay stored.
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

    /// Runs the sweep as [`Self::run`] does. `score` is the recorded output of the device, if the
    /// experiment has no feedback.
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

    /// Computes the units that `dir` lacks; without `dir`, computes all units and stores none.
    /// `go_on` receives the finished part, 0 to 1, at least every 50 ms, and ends the run by
    /// returning `false`.
    ///
    /// # Errors
    /// Fails if the folder contains something else or cannot be written, or if a unit fails. The
    /// sweep then ends, and all earlier units stay stored.
    pub fn compute<D: Drawing>(
        &self,
        drawing: &D,
        dir: Option<&Path>,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<ComputedUnits<D::Unit>, D::Error> {
        let indices: Vec<u64> = self.units(drawing).collect();
        let opened = dir
            .map(|dir| self.open(dir, drawing, &indices))
            .transpose()?;
        let (mut folder, mut units) = match opened {
            Some((folder, units)) => (Some(folder), units),
            None => (None, BTreeMap::new()),
        };
        // The known units are the first ones.
        let left = indices.get(units.len()..).unwrap_or_default();
        let part = |done: usize| done as f64 / indices.len() as f64;
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
        let begun = part(indices.len() - left.len());
        in_order(left, begun, &compute, keep, go_on)?;
        let is_whole = units.len() == indices.len();
        if is_whole {
            go_on(1.0);
        }
        let fresh = (units.len() + left.len() - indices.len()) as u64;
        Ok(ComputedUnits {
            units,
            is_whole,
            fresh,
        })
    }

    /// Opens the folder of this shard, whose units have the indices `indices`, and returns the units
    /// that the folder contains.
    fn open<D: Drawing>(
        &self,
        dir: &Path,
        drawing: &D,
        indices: &[u64],
    ) -> Result<(Folder, BTreeMap<u64, D::Unit>), LaboratoryError> {
        let (folder, units) = Folder::open(dir, self, drawing)?;
        if units.keys().eq(indices.iter().take(units.len())) {
            return Ok((folder, units));
        }
        let file = dir.join(drawing.file()).display().to_string();
        let reason =
            "its units are not the first units of this part in ascending order; delete the \
                      file, and the same command computes them again"
                .to_owned();
        Err(LaboratoryError::Damaged { file, reason })
    }

    /// Returns the indices of this shard's units, ascending.
    fn units(&self, drawing: &impl Drawing) -> impl Iterator<Item = u64> {
        let shard = self.shard;
        (0..drawing.units(self.draws)).filter(move |unit| shard.has(*unit))
    }

    /// Analyses the units, which are all or only the first ones, and writes result, page and
    /// further files.
    ///
    /// # Errors
    /// Fails if the units cannot be analysed or a file cannot be written.
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

    /// Writes result, page and further files of an analysed sweep.
    ///
    /// # Errors
    /// Fails if a file cannot be written.
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

    /// Returns the first difference from `other` in words.
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
        let differing = pairs.into_iter().find(|(_, this, wanted)| this != wanted);
        if let Some((property, this, that)) = differing {
            return format!("{property} {this} instead of {that}");
        }
        let mut files = self.sha256.keys().chain(other.sha256.keys());
        let file = files.find(|file| self.sha256.get(*file) != other.sha256.get(*file));
        let file = file.map(|file| format!(" ({file})"));
        format!("a different declaration{}", file.unwrap_or_default())
    }
}

/// Merges the shards in the folders `parts`, which must be all shards of an experiment's sweep,
/// into `out`. The files are the same as those of a sweep without shards.
///
/// # Errors
/// Fails if the parts are not all shards of one sweep, if units are missing, or if a file cannot be
/// read or written.
pub fn merge(
    parts: &[PathBuf],
    out: &Path,
    experiment: &Experiment,
) -> Result<Outcome, LaboratoryError> {
    let joined: MergedUnits<_> = merge_shards(parts, out, &Playing::new(experiment))?;
    Ok(joined.1)
}
