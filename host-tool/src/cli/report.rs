//! `flexor report`: the page of a record, made again.

use super::Output;
use crate::record::{Place, load};
use crate::report::{self, Report};
use clap::Args;
use std::path::PathBuf;

/// Make the page and the summary of a record again, also of an interrupted run.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// Folder of the record
    record: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// No record, one that is being written, or no room.
pub fn main(args: &ReportArgs, output: Output) -> anyhow::Result<()> {
    let mut run = load(&args.record)?;
    let _place = Place::existing(&args.record)?;
    // Its writer may have ended in between.
    run.ending = load(&args.record)?.ending;
    let page = report::write(&args.record, &Report::of(&run))?;
    let complete = !run.ending.is_incomplete();
    let mark = if complete { "" } else { " (incomplete)" };
    output.say(
        || format!("{}{mark}: {}", run.title, page.display()),
        || serde_json::json!({ "title": run.title, "complete": complete, "report": page, "error": null }),
    )
}
