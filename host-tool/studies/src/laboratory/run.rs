//! Runs studies for commands, independent of the type of their units.

use super::error::LaboratoryError;
use super::result::Outcome;
use super::study::{Lines, Study};
use super::sweep::{Drawing, Shard, Sweep, merge_shards};
use host_core::record::Place;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Result of a run and how much of the study it covers.
pub struct RunProgress {
    /// Result of the units that exist, all or only the first; `None` for a shard.
    pub outcome: Option<Outcome>,
    /// Text table for a terminal, if the study has more than the tables of `outcome`.
    pub table: Option<String>,
    /// Reason why the outcome could not be written.
    pub failed: Option<anyhow::Error>,
    /// Whether every unit was computed.
    pub is_whole: bool,
    /// Number of computed units, in words.
    pub done: String,
    /// Number of units computed in this run, without those computed before.
    pub fresh: u64,
}

/// A study that a command can run, without its type parameters.
pub trait Runnable: Sync {
    /// Returns the parameters that determine every byte of the result.
    fn sweep(&self, shard: Shard) -> Sweep;
    /// Takes the folder `dir` for this process alone. It must be absent, empty, or contain an
    /// earlier part of the same shard.
    ///
    /// # Errors
    /// Fails with E603 if the folder contains something else, which stays unchanged, or if another
    /// program writes there.
    fn place(&self, dir: &Path, shard: Shard) -> Result<Place, LaboratoryError> {
        self.sweep(shard).place(dir)
    }
    /// Computes the units of this shard that `dir` lacks, or without `dir` all of them, which are
    /// then not stored. `go_on` receives the completed share, 0 to 1, and ends the run by returning
    /// `false`. Writes the result, unless this is only a shard.
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
    /// Merges all shards of a study in `parts` into `out`, with the same bytes as a run without
    /// shards.
    ///
    /// # Errors
    /// Fails if the parts are not all shards of this study, if units are missing, or if a file
    /// cannot be read or written.
    fn merge(&self, parts: &[PathBuf], out: &Path) -> anyhow::Result<RunProgress>;
}

/// A run's result, and its units by index.
pub type WithUnits<U> = (RunProgress, BTreeMap<u64, U>);

/// Runs a sweep of a drawing, as [`Runnable::run`] does.
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

/// Merges the shards of a drawing, as [`Runnable::merge`] does.
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

/// Returns the seed and the number of draws of the shard in a folder, which determine the merge.
///
/// # Errors
/// Fails with E604 if the folder contains no shard.
pub fn seed_and_draws(part: &Path) -> Result<(u64, u64), LaboratoryError> {
    let sweep = super::sweep::read_shard(part)?;
    Ok((sweep.seed, sweep.draws))
}
