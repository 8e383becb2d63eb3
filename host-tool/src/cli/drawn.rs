//! What experiments on drawn persons share: they go on until a signal, and how they end.

use super::hamana::people::people;
use super::{Incomplete, Output};
use host_core::link::Interruption;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use studies::laboratory::Outcome;

/// What `find` finds of every number below `draws`, on all cores, in their order; fewer once
/// a signal has come. `passed` hears how many there are.
///
/// # Errors
/// The first that `find` has.
pub(super) fn until_asked<T: Send, E: Send>(
    draws: u64,
    interruption: &Interruption,
    passed: impl Fn(u64) + Sync,
    find: impl Fn(u64) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let done = AtomicU64::new(0);
    let all = (0..draws).into_par_iter().map(|index| {
        if interruption.asked().is_some() {
            return Ok(None);
        }
        let found = find(index)?;
        passed(done.fetch_add(1, Ordering::Relaxed) + 1);
        Ok(Some(found))
    });
    let all: Vec<Option<T>> = all.collect::<Result<_, E>>()?;
    Ok(all.into_iter().flatten().collect())
}

/// Tells what was computed, whatever became of its folder; where all went well, its page.
///
/// # Errors
/// What failed, or ended it.
pub(super) fn conclude(
    output: Output,
    dir: &Path,
    result: &Outcome,
    failed: Option<anyhow::Error>,
) -> anyhow::Result<()> {
    let Some(error) = failed else {
        let page = dir.join("result.html").display().to_string();
        return output.say(
            || format!("{}\nPage: {page}", people(result)),
            || json!({ "result": result, "page": page }),
        );
    };
    if !output.json {
        output.say(|| people(result), || Value::Null)?;
    }
    let result = json!({ "result": result });
    Err(Incomplete { error, result }.into())
}
