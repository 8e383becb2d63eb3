//! Runs studies for commands, independent of the type of their units.

use super::error::LaboratoryError;
use super::result::Outcome;
use super::study::{Lines, Study};
use super::sweep::{Drawing, Shard, Sweep, merge_shards};
use host_core::record::Place;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Result of a run, and how much of the study it covers.
pub struct RunProgress {
    /// Result of the units that exist, which are all or only the first; `None` for a shard.
    pub outcome: Option<Outcome>,
    /// Text table for a terminal, if the study has tables beyond those in `outcome`.
    pub table: Option<String>,
    /// Error because of which the result could not be written; the units are stored nevertheless.
    pub failed: Option<anyhow::Error>,
    /// Whether every unit of the study or shard was computed.
    pub is_whole: bool,
    /// Number of existing units in words, such as "12 of 40 sessions".
    pub done: String,
    /// Number of units that this run computed, without those of earlier runs.
    pub fresh: u64,
}

/// A study that a command can run, without its type parameters.
pub trait Runnable: Sync {
    /// Returns the description of the sweep: the inputs that determine every byte of the result.
    fn sweep(&self, shard: Shard) -> Sweep;
    /// Locks the folder `dir` for this process. It must be absent, empty, or contain an earlier
    /// part of the same shard.
    ///
    /// # Errors
    /// Fails with E603 if the folder contains something else, which stays unchanged, or if another
    /// program writes there.
    fn place(&self, dir: &Path, shard: Shard) -> Result<Place, LaboratoryError> {
        self.sweep(shard).place(dir)
    }
    /// Computes the units of this shard that `dir` lacks; without `dir`, computes all units and
    /// stores none. `go_on` receives the finished part, 0 to 1, and ends the run by returning
    /// `false`. Writes the result unless this is only a shard.
    ///
    /// # Errors
    /// Fails if the folder contains something else, if a unit cannot be stored, or if a unit fails;
    /// earlier units stay stored.
    fn run(
        &self,
        dir: Option<&Path>,
        shard: Shard,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> anyhow::Result<RunProgress>;
    /// Merges the shards in the folders `parts`, which must be all of them, into `out`. The files
    /// are the same as those of a run without shards.
    ///
    /// # Errors
    /// Fails if the parts are not all shards of this study, if units are missing, or if a file
    /// cannot be read or written.
    fn merge(&self, parts: &[PathBuf], out: &Path) -> anyhow::Result<RunProgress>;
}

/// Result of a run, and the units that exist, by index.
pub type WithUnits<U> = (RunProgress, BTreeMap<u64, U>);

/// Runs a sweep as [`Runnable::run`] does, for a study that is a [`Drawing`].
///
/// # Errors
/// Fails as [`Runnable::run`] does.
pub fn run_drawing<D: Drawing>(
    drawing: &D,
    sweep: &Sweep,
    dir: Option<&Path>,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<WithUnits<D::Unit>, D::Error>
where
    D::Error: Into<anyhow::Error>,
{
    let computed = sweep.compute(drawing, dir, go_on)?;
    let units = computed.units;
    let mut ran = RunProgress {
        outcome: None,
        table: None,
        failed: None,
        is_whole: computed.is_whole,
        done: drawing.progress_text(sweep, units.len() as u64),
        fresh: computed.fresh,
    };
    if sweep.shard == Shard::WHOLE {
        let outcome = drawing.outcome(sweep, &units)?;
        let written = dir.map(|dir| sweep.publish(drawing, dir, &units, &outcome));
        ran.failed = written.and_then(Result::err).map(Into::into);
        ran.table = drawing.table(sweep, &units);
        ran.outcome = Some(outcome);
    }
    Ok((ran, units))
}

/// Merges shards as [`Runnable::merge`] does, for a study that is a [`Drawing`].
///
/// # Errors
/// Fails as [`Runnable::merge`] does.
pub fn merge_drawing<D: Drawing>(
    drawing: &D,
    parts: &[PathBuf],
    out: &Path,
) -> Result<WithUnits<D::Unit>, D::Error> {
    let (units, outcome) = merge_shards(parts, out, drawing)?;
    let sweep = Sweep::read(out)?;
    let ran = RunProgress {
        outcome: Some(outcome),
        table: drawing.table(&sweep, &units),
        failed: None,
        is_whole: true,
        done: drawing.progress_text(&sweep, units.len() as u64),
        fresh: 0,
    };
    Ok((ran, units))
}

impl<S: Study> Runnable for S {
    fn sweep(&self, shard: Shard) -> Sweep {
        let about = self.metadata();
        Sweep::from_drawing(&Lines(self), (about.seed, about.draws), shard)
    }

    fn place(&self, dir: &Path, shard: Shard) -> Result<Place, LaboratoryError> {
        self.sweep(shard).place_of(&Lines(self), dir)
    }

    fn run(
        &self,
        dir: Option<&Path>,
        shard: Shard,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> anyhow::Result<RunProgress> {
        Ok(run_drawing(&Lines(self), &self.sweep(shard), dir, go_on)?.0)
    }

    fn merge(&self, parts: &[PathBuf], out: &Path) -> anyhow::Result<RunProgress> {
        Ok(merge_drawing(&Lines(self), parts, out)?.0)
    }
}

/// Returns the seed and the number of draws of the shard in the folder `part`; all shards of a
/// sweep have the same.
///
/// # Errors
/// Fails with E604 if the folder contains no shard.
pub fn seed_and_draws(part: &Path) -> Result<(u64, u64), LaboratoryError> {
    let sweep = super::sweep::read_shard(part)?;
    Ok((sweep.seed, sweep.draws))
}
