//! Shards of a sweep, joined to what it would be undivided.

use super::drawing::Drawing;
use super::folder::{self, Folder};
use super::{Shard, Sweep};
use crate::laboratory::error::LaboratoryError;
use crate::laboratory::result::Outcome;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a whole came to: each unit, and all of them.
pub type MergedUnits<U> = (BTreeMap<u64, U>, Outcome);

/// Makes one sweep in `out` of all of its shards in `parts`: the bytes of a sweep
/// that was never cut.
///
/// # Errors
/// The parts are not all shards of one sweep, one has a hole, or a file fails.
pub fn merge_shards<D: Drawing>(
    parts: &[PathBuf],
    out: &Path,
    drawing: &D,
) -> Result<MergedUnits<D::Unit>, D::Error> {
    let named = parts.iter().map(|part| Ok((name(part), read_shard(part)?)));
    let named: Vec<(String, Sweep)> = named.collect::<Result<_, LaboratoryError>>()?;
    let whole = combined_sweep(&named, drawing)?;
    let mut units = BTreeMap::new();
    for (part, (name, sweep)) in parts.iter().zip(&named) {
        let own = folder::units(part, sweep, drawing)?;
        let lacking = sweep.units(drawing).find(|unit| !own.contains_key(unit));
        if let Some(unit) = lacking {
            let why = format!(
                "{name} has a hole: unit {unit} is missing; run its shard again, it goes on"
            );
            return Err(LaboratoryError::Merge(why).into());
        }
        units.extend(own);
    }
    let _mine = whole.place(out)?;
    let (mut folder, known) = Folder::open(out, &whole, drawing)?;
    for (index, unit) in &units {
        if !known.contains_key(index) {
            folder.append(drawing, &whole, (*index, unit))?;
        }
    }
    let outcome = whole.close(drawing, out, &units)?;
    Ok((units, outcome))
}

fn name(part: &Path) -> String {
    part.display().to_string()
}

/// The shard in this folder.
///
/// # Errors
/// E604: there is none. Its `sweep.json` cannot be read.
pub fn read_shard(part: &Path) -> Result<Sweep, LaboratoryError> {
    if part.is_dir() && !folder::sweep_file(part).exists() {
        let part = name(part);
        return Err(LaboratoryError::Merge(format!(
            "{part} has no sweep.json, so it holds no shard; give the folders that --shard I/N \
             --out DIR made"
        )));
    }
    Sweep::read(part)
}

/// The sweep that these are all parts of.
fn combined_sweep<D: Drawing>(
    parts: &[(String, Sweep)],
    drawing: &D,
) -> Result<Sweep, LaboratoryError> {
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
    let wanted = Sweep::from_drawing(drawing, (whole.seed, whole.draws), Shard::WHOLE);
    match whole == wanted {
        true => Ok(whole),
        false => refuse(format!(
            "{first_name} is not what this program makes of it: {}; merge with the program that \
             drew it, or draw it again",
            whole.difference(&wanted)
        )),
    }
}
