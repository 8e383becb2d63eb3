//! What a command does with a study, whatever its units are.

use super::error::LaboratoryError;
use super::result::Outcome;
use super::study::{Lines, Study};
use super::sweep::{Drawing, Shard, Sweep, merge_shards};
use host_core::record::Place;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// How far a run came.
pub struct RunProgress {
    /// Of a study that is not a shard: what the units there are come to, all or the first
    /// ones.
    pub outcome: Option<Outcome>,
    /// What a terminal shows of them, where that is more than the outcome's own tables.
    pub table: Option<String>,
    /// Why the outcome could not be written.
    pub failed: Option<anyhow::Error>,
    /// Whether every unit was computed.
    pub is_whole: bool,
    /// How many were, in words.
    pub done: String,
    /// How many were computed now, not before.
    pub fresh: u64,
}

/// A study that a command runs, without its types.
pub trait Runnable: Sync {
    /// What decides every byte of it.
    fn sweep(&self, shard: Shard) -> Sweep;
    /// Takes the folder `dir`, absent, empty or this shard begun before, for this program
    /// alone.
    ///
    /// # Errors
    /// E603: it holds something else, which is left alone; another program writes there.
    fn place(&self, dir: &Path, shard: Shard) -> Result<Place, LaboratoryError> {
        self.sweep(shard).place(dir)
    }
    /// Computes what `dir` lacks of this shard, or all of it without keeping it anywhere;
    /// `go_on` hears the part done, 0 to 1, and may say no. Then writes what the units come
    /// to, unless it is but a shard.
    ///
    /// # Errors
    /// The folder holds something else, or a unit cannot be kept in it; a unit failed, which
    /// ends the run with everything before kept.
    fn run(
        &self,
        dir: Option<&Path>,
        shard: Shard,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> anyhow::Result<RunProgress>;
    /// Makes one study in `out` of all of its shards in `parts`: the bytes of one that was
    /// never cut.
    ///
    /// # Errors
    /// The parts are not all shards of this study, one has a hole, or a file fails.
    fn merge(&self, parts: &[PathBuf], out: &Path) -> anyhow::Result<RunProgress>;
}

/// What a run came to, with its units by their index.
pub type WithUnits<U> = (RunProgress, BTreeMap<u64, U>);

/// Runs a sweep of a drawing, as [`Runnable::run`].
///
/// # Errors
/// As [`Runnable::run`].
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

/// Merges the shards of a drawing, as [`Runnable::merge`].
///
/// # Errors
/// As [`Runnable::merge`].
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

/// The seed and draws of the shard in a folder, which a merge goes by.
///
/// # Errors
/// E604: there is none.
pub fn seed_and_draws(part: &Path) -> Result<(u64, u64), LaboratoryError> {
    let sweep = super::sweep::read_shard(part)?;
    Ok((sweep.seed, sweep.draws))
}
