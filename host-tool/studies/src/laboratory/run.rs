//! What a command does with a study, whatever its units are.

use super::error::LaboratoryError;
use super::result::Outcome;
use super::study::{Lines, Study};
use super::sweep::{Drawing, Shard, Sweep, join};
use std::path::{Path, PathBuf};

/// How far a run came.
pub struct Ran {
    /// Of a study that is not a shard: what the units there are come to, all or the first
    /// ones.
    pub outcome: Option<Outcome>,
    /// Why that could not be written.
    pub failed: Option<anyhow::Error>,
    /// Whether every unit was computed.
    pub is_whole: bool,
    /// How many were, in words.
    pub done: String,
}

/// A study that a command runs: [`Study`] without its types.
pub trait Runnable: Sync {
    /// What decides every byte of it.
    fn sweep(&self, shard: Shard) -> Sweep;
    /// Computes what `dir` lacks of this shard; `go_on` hears the part done, 0 to 1, and may
    /// say no. Then writes what the units come to, unless it is but a shard.
    ///
    /// # Errors
    /// The folder holds something else, or a unit cannot be kept in it; a unit failed, which
    /// ends the run with everything before kept.
    fn run(
        &self,
        dir: &Path,
        shard: Shard,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> anyhow::Result<Ran>;
    /// Makes one study in `out` of all of its shards in `parts`: the bytes of one that was
    /// never cut.
    ///
    /// # Errors
    /// The parts are not all shards of this study, one has a hole, or a file fails.
    fn merge(&self, parts: &[PathBuf], out: &Path) -> anyhow::Result<Outcome>;
}

impl<S: Study> Runnable for S {
    fn sweep(&self, shard: Shard) -> Sweep {
        let about = self.about();
        Sweep::drawing(&Lines(self), (about.seed, about.draws), shard)
    }

    fn run(
        &self,
        dir: &Path,
        shard: Shard,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> anyhow::Result<Ran> {
        let (lines, sweep) = (Lines(self), self.sweep(shard));
        let computed = sweep.compute(&lines, Some(dir), go_on)?;
        let (mut outcome, mut failed) = (None, None);
        if shard == Shard::WHOLE {
            let all = lines.outcome(&sweep, &computed.units)?;
            let written = sweep.publish(&lines, dir, &computed.units, &all);
            (outcome, failed) = (Some(all), written.err());
        }
        Ok(Ran {
            outcome,
            failed,
            is_whole: computed.is_whole,
            done: self.in_words(computed.units.len() as u64),
        })
    }

    fn merge(&self, parts: &[PathBuf], out: &Path) -> anyhow::Result<Outcome> {
        Ok(join(parts, out, &Lines(self))?.1)
    }
}

/// The seed and draws of the shard in a folder, which a merge goes by.
///
/// # Errors
/// E604: there is none.
pub fn decided_by(part: &Path) -> Result<(u64, u64), LaboratoryError> {
    let sweep = super::sweep::part_of(part)?;
    Ok((sweep.seed, sweep.draws))
}
