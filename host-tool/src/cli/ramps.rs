//! `flexor experiment harris-ramps`: Harris 2017's characterization by drawn persons on a
//! bench.

use super::experiment::{ExperimentArgs, command};
use super::{Incomplete, Output, interrupt, wrong};
use host_core::plot::words::in_columns;
use host_core::record::replace_file;
use host_core::wearer::Wearer;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use studies::laboratory::{self, Outcome, Sheet, Shows, headline};
use studies::ramps::{Found, NAME, RampsError, Study, Told};

/// Most persons.
const MOST: u64 = 100_000;
/// Columns of a terminal.
const COLUMNS: u16 = 80;

/// Whether `args` means it.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    args.name == NAME
}

/// # Errors
/// Arguments out of range, a device that puts out something else, a folder that cannot be
/// written, a signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let study = asked(args)?;
    let place = args.out.place(&args.name)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(&args.name);
    let (pulses, notes) = study.put_out()?;
    let count = study.persons();
    let done = AtomicUsize::new(0);
    let all: Vec<Option<Found>> = (0..count)
        .into_par_iter()
        .map(|index| {
            if interruption.asked().is_some() {
                return Ok(None);
            }
            let found = study.part(index, &pulses)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            bar.set(done as f64 / count as f64);
            Ok(Some(found))
        })
        .collect::<Result<_, RampsError>>()?;
    bar.finish();
    let all: Vec<Found> = all.into_iter().flatten().collect();
    let of = format!("{} of {count} persons", all.len());
    let signal = interruption.asked().filter(|_| (all.len() as u64) < count);
    let told = Told {
        command: command(args, study.draws()),
        cut_short: signal.map(|_| format!("Cut short after {of}.")),
        notes,
    };
    let result = study.outcome(&all, told)?;
    // What was computed is told, whatever becomes of the folder.
    let wearers = all.iter().take(2).enumerate();
    let wearers = wearers.filter_map(|(nth, found)| study.wearer(nth, found));
    let wearers: Vec<Wearer> = wearers.collect();
    let written = write(place.dir(), &result, &study.csv(&all), &wearers);
    let page = place.dir().join("result.html").display().to_string();
    let told = || format!("{}\nPage: {page}", people(&result));
    let ended = signal.map(|it| interrupt::Ended(it, format!("after {of}")).into());
    match written.err().or(ended) {
        None => output.say(told, || json!({ "result": result, "page": page })),
        Some(error) => {
            if !output.json {
                output.say(|| people(&result), || Value::Null)?;
            }
            let result = json!({ "result": result });
            Err(Incomplete { error, result }.into())
        }
    }
}

/// The study that `args` means, its arguments within what it allows.
fn asked(args: &ExperimentArgs) -> anyhow::Result<Study> {
    if args.wearer.is_some() || args.departure.is_some() {
        return wrong(format!(
            "{NAME} draws its persons: no --wearer, no --departure"
        ));
    }
    let device = &args.device;
    if device.is_port() {
        return wrong(format!(
            "a drawn elbow is simulated, --device is {device}; allowed: native, chip, qemu"
        ));
    }
    let study = Study::asked((args.seed, args.draws), device.clone())?;
    match study.draws() {
        2..=MOST => Ok(study),
        draws => wrong(format!(
            "--draws is {draws}, allowed is 2 to {MOST}: the paper has two"
        )),
    }
}

fn write(dir: &Path, result: &Outcome, rows: &str, wearers: &[Wearer]) -> anyhow::Result<()> {
    laboratory::publish(dir, result, &[])?;
    replace_file(&dir.join("draws.csv"), rows.as_bytes())?;
    for wearer in wearers {
        let text = wearer.to_toml();
        replace_file(&dir.join(format!("{}.toml", wearer.name)), text.as_bytes())?;
    }
    Ok(())
}

/// Tables, rows, shares and notes, in 80 columns.
fn people(result: &Outcome) -> String {
    let mut text: String = result.sheets.iter().map(table).collect();
    let number = |it: Option<f64>| it.map_or_else(|| "-".to_owned(), |it| format!("{it:.3}"));
    text += &format!("{:<52}{:>9}{:>9}{:>9}\n", "", "median", "5 %", "95 %");
    for row in &result.rows {
        let name = match &*row.unit {
            "" => row.quantity.clone(),
            unit => format!("{}, {unit}", row.quantity),
        };
        let [ours, low, high] = [row.ours, row.low, row.high].map(number);
        text += &format!("{name:<52.52}{ours:>9}{low:>9}{high:>9}\n");
    }
    text += "\n";
    for share in &result.shares {
        let paper = match share.paper {
            None => "",
            Some(true) => "paper: yes",
            Some(false) => "paper: no",
        };
        let line = format!("{:>8}  {:<58.58}  {paper}", share.percent(), share.claim);
        text += &format!("{}\n", line.trim_end());
    }
    if let Some(cut_short) = &result.cut_short {
        text += &format!("\n{cut_short}");
    }
    text += &format!("\n{}\n", in_columns(&headline(result), COLUMNS));
    for note in &result.notes {
        text += &format!("{}\n", in_columns(note, COLUMNS));
    }
    text.trim_end().to_owned()
}

/// A table, where it has room.
fn table(it: &Sheet) -> String {
    let Shows::Table(grid) = &it.shows else {
        return String::new();
    };
    let text = grid.in_columns();
    let is_narrow = |line: &str| line.chars().count() <= usize::from(COLUMNS);
    match text.lines().all(is_narrow) {
        true => format!("{}: {}\n{text}\n\n", it.number, it.title),
        false => format!("{}: {}: on the page\n\n", it.number, it.title),
    }
}
