//! `flexor report`: writes the page of a record again.

use super::{Output, usage_error};
use clap::Args;
use host_core::record::{Place, Run, load};
use host_core::report::{self, Report};
use std::io::ErrorKind;
use std::path::PathBuf;
use studies::laboratory::{Experiment, LaboratoryError, rebuild_page};

/// Rewrite the page and summary of a record, experiment or sweep
///
/// Also works for an interrupted run.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// Folder of the record
    record: PathBuf,
}

/// # Errors
/// Fails if the folder is not a record, another program writes it, or the page cannot be written.
pub fn main(args: &ReportArgs, output: Output) -> anyhow::Result<()> {
    let has = |file: &str| args.record.join(file).exists();
    // An experiment's record that lost its run.json still has its declaration.
    let is_result = has("sweep.json") || (has("result.json") && !has("declaration.toml"));
    if is_result && !has("run.json") {
        return renew_result_page(args, output);
    }
    load(&args.record)?; // a folder that is not a record gets no lock
    let _place = Place::open_existing(&args.record)?;
    // Read again, because the writing program may have ended in between.
    let mut run = load(&args.record)?;
    run.decode_ahead();
    let page = report::write(&args.record, &Report::from_run(&run))?;
    let result = rebuild_page(&args.record, &run.trials)?;
    let complete = !run.ending.is_incomplete();
    let damaged = run
        .damage_error(&args.record)
        .map(|error| error.to_string());
    let damaged = damaged.or_else(|| change_warning(args, &run, result.is_some()));
    let mark = match &damaged {
        Some(_) => " (damaged)",
        None if !complete => " (incomplete)",
        None => "",
    };
    output.print(
        || {
            let made = format!("{}{mark}: {}", run.title, page.display());
            let more = result.iter().map(|path| path.display().to_string());
            let made = more.fold(made, |made, page| format!("{made}\n{page}"));
            damaged
                .iter()
                .fold(made, |made, warning| format!("{made}\n{warning}"))
        },
        || {
            serde_json::json!({
                "title": run.title, "complete": complete, "damaged": damaged, "report": page,
                "result": result, "error": null,
            })
        },
    )
}

/// Returns a warning if a file of an experiment's record has changed or is missing.
fn change_warning(args: &ReportArgs, run: &Run, has_result: bool) -> Option<String> {
    let plan = run.plan.as_ref().filter(|plan| !plan.declared.is_empty())?;
    let kept = Experiment::from_record(&args.record, &plan.declared);
    let lacks = !has_result && !run.ending.is_incomplete();
    let file = || args.record.join("result.json").display().to_string();
    let lacks = lacks.then(|| LaboratoryError::File(file(), ErrorKind::NotFound.into()));
    kept.err().or(lacks).map(|error| error.to_string())
}

/// Writes only the result's page of a sweep or a study with random participants, which have no
/// recorded trials.
fn renew_result_page(args: &ReportArgs, output: Output) -> anyhow::Result<()> {
    let _place = Place::open_existing(&args.record)?;
    let Some(page) = rebuild_page(&args.record, &[])? else {
        return usage_error(format!(
            "{} holds an unfinished sweep; run the command that started it again to finish it",
            args.record.display()
        ));
    };
    output.print(
        || page.display().to_string(),
        || serde_json::json!({ "result": page, "error": null }),
    )
}
