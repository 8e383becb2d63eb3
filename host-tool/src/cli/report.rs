//! `flexor report`: the page of a record, made again.

use super::Output;
use clap::Args;
use host_core::record::{Place, load};
use host_core::report::{self, Report};
use std::path::PathBuf;

/// Make the page and the summary of a record again, also of an interrupted run.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// Folder of the record
    record: PathBuf,
}

/// # Errors
/// No record, one that is being written, or no room.
pub fn main(args: &ReportArgs, output: Output) -> anyhow::Result<()> {
    load(&args.record)?; // what is no record gets no lock
    let _place = Place::existing(&args.record)?;
    // Its writer may have ended in between.
    let run = load(&args.record)?;
    let page = report::write(&args.record, &Report::of(&run))?;
    let complete = !run.ending.is_incomplete();
    let damaged = run.damaged(&args.record).map(|error| error.to_string());
    let mark = match &damaged {
        Some(_) => " (damaged)",
        None if !complete => " (incomplete)",
        None => "",
    };
    output.say(
        || {
            let made = format!("{}{mark}: {}", run.title, page.display());
            damaged
                .iter()
                .fold(made, |made, what| format!("{made}\n{what}"))
        },
        || {
            serde_json::json!({
                "title": run.title, "complete": complete, "damaged": damaged, "report": page,
                "error": null,
            })
        },
    )
}
