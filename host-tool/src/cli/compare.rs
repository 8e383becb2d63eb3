//! `flexor compare`: shows records, experiments or sweeps side by side.

use super::out::OutArgs;
use super::{Output, usage_error};
use clap::Args;
use host_core::record::replace_file;
use host_core::report::{
    self, ComparedRecord, Html, compare_body, compare_rows, compare_text, session_differences,
};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use studies::laboratory::{
    NamedResult, declaration_differences, result_rows, results_body, results_text,
};

/// Show the differences between records, experiments or sweeps
///
/// Compares amplitude, charge, rms current and on-time of each channel, traces, and session files
/// key by key; for experiments and sweeps also the results.
#[derive(Args, Debug)]
pub struct Compare {
    /// Folders of records, experiments or sweeps, two or more
    #[arg(required = true)]
    records: Vec<PathBuf>,
    #[command(flatten)]
    out: OutArgs,
}

/// Contents of a folder: the trials of a record, the result of an experiment or sweep, or both.
struct Folder {
    record: Option<ComparedRecord>,
    result: Option<NamedResult>,
}

impl Folder {
    /// Reads `dir`, one trial at a time.
    fn read(dir: &Path) -> anyhow::Result<Self> {
        let has = |file: &str| dir.join(file).exists();
        if has("run.json") || !(has("result.json") || has("sweep.json")) {
            return Ok(Self {
                record: Some(ComparedRecord::read(dir)?),
                result: NamedResult::read(dir)?,
            });
        }
        match NamedResult::read(dir)? {
            None => usage_error(format!(
                "{} holds an unfinished sweep; run the command that started it again to finish it",
                dir.display()
            )),
            result => Ok(Self {
                record: None,
                result,
            }),
        }
    }

    /// Returns a description of the contents for messages.
    const fn kind(&self) -> &'static str {
        match (&self.record, &self.result) {
            (Some(_), Some(_)) => "the record of an experiment",
            (Some(_), None) => "a record without a result",
            _ => "a result without recorded trials",
        }
    }
}

/// # Errors
/// Fails if there are fewer than two folders, if a folder is given twice, has nothing to compare or
/// would be replaced by the page, if the folders have nothing in common, or if the page cannot be
/// written.
pub fn main(args: &Compare, output: Output) -> anyhow::Result<()> {
    if args.records.len() < 2 {
        return usage_error("compare needs two records or more");
    }
    args.out.check_not_record(&args.records)?;
    let folders = read_all(&args.records)?;
    let (records, results) = common_content(&args.records, folders)?;
    // The page is made before an old one is replaced.
    let title = format!("{} records side by side", args.records.len());
    let mut body = Html::default();
    if !records.is_empty() {
        body += compare_body(&records);
    }
    if !results.is_empty() {
        body += results_body(&results);
    }
    let text = report::document(&title, &body);
    let place = args.out.claim_folder("compare")?;
    let page = place.dir().join("compare.html");
    replace_file(&page, text.as_bytes())?;
    output.print(
        || {
            let records = (!records.is_empty()).then(|| compare_text(&records));
            let results = (!results.is_empty()).then(|| results_text(&results));
            let parts = records.into_iter().chain(results);
            let text: Vec<String> = parts.collect();
            format!(
                "{}\npage: {}",
                text.join("\n").trim_start_matches('\n'),
                page.display()
            )
        },
        || {
            let damaged: Vec<&String> = records
                .iter()
                .filter_map(|comparison| comparison.damaged.as_ref())
                .collect();
            serde_json::json!({
                "rows": compare_rows(&records), "files": session_differences(&records),
                "results": result_rows(&results),
                "declarations": declaration_differences(&results),
                "page": page, "damaged": damaged, "error": null,
            })
        },
    )
}

/// Reads all folders.
///
/// # Errors
/// Lists every folder that cannot be compared, one line each.
fn read_all(dirs: &[PathBuf]) -> anyhow::Result<Vec<Folder>> {
    let (mut folders, mut mistakes) = (Vec::new(), Vec::new());
    let mut known: HashMap<PathBuf, &PathBuf> = HashMap::new();
    for dir in dirs {
        let before = dir
            .canonicalize()
            .ok()
            .and_then(|real| known.insert(real, dir));
        let read = match before {
            Some(before) => usage_error(format!(
                "{} is the folder {} again: give each folder once",
                dir.display(),
                before.display()
            )),
            None => Folder::read(dir),
        };
        match read {
            Ok(folder) => folders.push(folder),
            Err(mistake) => mistakes.push(mistake),
        }
    }
    match mistakes.len() {
        0 => Ok(folders),
        1 => Err(mistakes.remove(0)),
        count => {
            let lines: Vec<String> = mistakes.iter().map(|error| format!("{error:#}")).collect();
            anyhow::bail!(
                "E588 {count} of {} folders cannot be compared:\n{}",
                dirs.len(),
                lines.join("\n")
            )
        }
    }
}

/// Returns the contents that all folders have: trials, results, or both.
///
/// # Errors
/// Fails if the folders have neither in common.
fn common_content(
    dirs: &[PathBuf],
    folders: Vec<Folder>,
) -> anyhow::Result<(Vec<ComparedRecord>, Vec<NamedResult>)> {
    let have_records = folders.iter().all(|folder| folder.record.is_some());
    let have_results = folders.iter().all(|folder| folder.result.is_some());
    if !have_records && !have_results {
        let kinds = dirs.iter().zip(&folders);
        let kinds = kinds.map(|(dir, folder)| format!("{} is {}", dir.display(), folder.kind()));
        let kinds: Vec<String> = kinds.collect();
        return usage_error(format!(
            "these folders have nothing in common that could be compared: {}; compare records \
             with records, and results with results (an experiment's record has both)",
            kinds.join(", ")
        ));
    }
    let (mut records, mut results) = (Vec::new(), Vec::new());
    for folder in folders {
        records.extend(folder.record.filter(|_| have_records));
        results.extend(folder.result.filter(|_| have_results));
    }
    Ok((records, results))
}
