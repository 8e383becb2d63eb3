//! `flexor chart control --files`: compares the default controller without a wearer file, with true
//! ones and with those that `flexor calibrate` writes.

use super::write;
use crate::cli::Output;
use std::path::Path;
use studies::wearer_files::{Comparison, Population, table};

/// Default number of hands, without and with `--quick`.
const HANDS: (u64, u64) = (60, 8);
/// Default number of fingers of each population, without and with `--quick`.
const FINGERS: (u64, u64) = (200, 60);

/// Runs the comparison on `draws` wearers of each population or on the default number, and writes
/// the chart to `out` unless `out` is `None`.
///
/// # Errors
/// E560 to E562, E621 to E623; the errors of `flexor calibrate`. E575: the file cannot be written.
pub(super) fn main(
    (seed, draws): (u64, Option<u64>),
    out: Option<&Path>,
    output: Output,
) -> anyhow::Result<()> {
    let bar = output.bar("files");
    let mut comparisons = Vec::new();
    for (n, population) in Population::ALL.into_iter().enumerate() {
        let (chart, quick) = match population {
            Population::Hands => HANDS,
            Population::Fingers(_) => FINGERS,
        };
        let usual = if out.is_none() { quick } else { chart };
        let plan = (seed, draws.unwrap_or(usual));
        let shown = |part: f64| bar.set((n as f64 + part) / Population::ALL.len() as f64);
        comparisons.push(Comparison::run(population, plan, shown)?);
    }
    bar.finish();
    if let Some(out) = out {
        write(&out.join("control_files.csv"), &table::csv(&comparisons))?;
    }
    output.print(
        || table::text(&comparisons).trim_end().to_owned(),
        || table::json(&comparisons),
    )
}
