//! Merges the shards of a sweep into the sweep that would have run without them.

use super::drawing::Drawing;
use super::folder::{self, Folder};
use super::{Shard, Sweep};
use crate::laboratory::error::LaboratoryError;
use crate::laboratory::result::Outcome;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// All units of the merged sweep, by index, and their analysis.
pub type MergedUnits<U> = (BTreeMap<u64, U>, Outcome);

/// Merges the shards in the folders `parts`, which must be all shards of a sweep, into `out`. The
/// files are the same as those of a sweep without shards.
///
/// # Errors
/// Fails if the parts are not all shards of one sweep, if units are missing, or if a file cannot be
/// read or written.
pub fn merge_shards<D: Drawing>(
    parts: &[PathBuf],
    out: &Path,
    drawing: &D,
) -> Result<MergedUnits<D::Unit>, D::Error> {
    let named = parts.iter().map(|part| Ok((name(part), read_shard(part)?)));
    let named: Vec<(String, Sweep)> = named.collect::<Result<_, LaboratoryError>>()?;
    let merged = combined_sweep(&named, drawing)?;
    let mut units = BTreeMap::new();
    for (part, (name, sweep)) in parts.iter().zip(&named) {
        let own = folder::units(part, sweep, drawing)?;
        let lacking = sweep.units(drawing).find(|unit| !own.contains_key(unit));
        if let Some(unit) = lacking {
            let why = format!(
                "{name} lacks unit {unit}; run the command of this shard again to continue it"
            );
            return Err(LaboratoryError::Merge(why).into());
        }
        units.extend(own);
    }
    let _mine = merged.place(out)?;
    let (mut folder, known) = Folder::open(out, &merged, drawing)?;
    for (index, unit) in &units {
        if !known.contains_key(index) {
            folder.append(drawing, &merged, (*index, unit))?;
        }
    }
    let outcome = merged.close(drawing, out, &units)?;
    Ok((units, outcome))
}

fn name(part: &Path) -> String {
    part.display().to_string()
}

/// Reads the description of the shard in the folder `part`.
///
/// # Errors
/// Fails with E604 if the folder contains no shard, or if its `sweep.json` cannot be read.
pub fn read_shard(part: &Path) -> Result<Sweep, LaboratoryError> {
    if part.is_dir() && !folder::sweep_file(part).exists() {
        let part = name(part);
        return Err(LaboratoryError::Merge(format!(
            "{part} has no sweep.json, so it is no shard; give the folders that --shard I/N \
             --out DIR made"
        )));
    }
    Sweep::read(part)
}

/// Returns the description of the whole sweep, after checking that these folders are all of its
/// shards.
fn combined_sweep<D: Drawing>(
    parts: &[(String, Sweep)],
    drawing: &D,
) -> Result<Sweep, LaboratoryError> {
    let refuse = |why: String| Err(LaboratoryError::Merge(why));
    let Some((first_name, first)) = parts.first() else {
        return refuse("no folder was given".to_owned());
    };
    let shard_count = first.shard.of;
    let undivided = |sweep: &Sweep| Sweep {
        shard: Shard::WHOLE,
        ..sweep.clone()
    };
    let mut seen = BTreeMap::new();
    for (name, sweep) in parts {
        if undivided(sweep) != undivided(first) || sweep.shard.of != shard_count {
            let (this, reference) = (sweep.difference(first), first_name);
            return refuse(format!(
                "{name} and {reference} are of different sweeps: {this}"
            ));
        }
        if let Some(other) = seen.insert(sweep.shard.number, name) {
            let number = sweep.shard.number;
            return refuse(format!(
                "{name} and {other} are both shard {number}/{shard_count}"
            ));
        }
    }
    if let Some(number) = (1..=shard_count).find(|number| !seen.contains_key(number)) {
        return refuse(format!("shard {number}/{shard_count} is missing"));
    }
    let merged = undivided(first);
    let wanted = Sweep::from_drawing(drawing, (merged.seed, merged.draws), Shard::WHOLE);
    match merged == wanted {
        true => Ok(merged),
        false => refuse(format!(
            "{first_name} does not fit this program: {}; merge with the program that computed \
             it, or compute it again",
            merged.difference(&wanted)
        )),
    }
}
