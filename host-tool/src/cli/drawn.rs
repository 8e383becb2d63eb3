//! How an experiment on drawn persons ends.

use super::hamana::people::people;
use super::{Incomplete, Output};
use serde_json::{Value, json};
use std::path::Path;
use studies::laboratory::Outcome;

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
