//! `flexor chart ladder`: each rung of the muscle ladder per kind of scene.

use crate::cli::Output;
use crate::ladder::adequacy::{self, Summary};
use crate::ladder::table::{self, RUNG_NAMES};
use crate::ladder::{self, motion, picture};
use anyhow::Context;
use clap::Args;
use firmware::muscle::Rung;
use firmware::muscle::choice::Share;
use firmware::muscle::choice::grid::STEPS_MS;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Measure the rungs of the muscle ladder per kind of scene
#[derive(Args, Debug)]
pub struct Ladder {
    /// Where the workspace is whose docs/charts/ladder.* and firmware table are
    /// written anew
    #[arg(long, default_value = ".")]
    workspace: PathBuf,
    /// Only write picture and firmware table anew from docs/charts/ladder.csv
    #[arg(long)]
    no_measuring: bool,
    /// Held-out scenes for each rung, on which its choice is tried in closed loop
    #[arg(long, default_value_t = 50)]
    scenes: usize,
    /// Which held-out scenes
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// The verdicts, from the workspace.
const HELD_OUT: &str = "docs/charts/ladder_held_out.csv";
/// The firmware's table, from the workspace.
const FIRMWARE: &str = "firmware/src/muscle/choice/measured.rs";

/// Runs the command.
///
/// # Errors
/// Files that cannot be read or written.
pub fn main(args: &Ladder, output: Output) -> anyhow::Result<()> {
    let place = |file: &str| args.workspace.join(file);
    let table_file = place("docs/charts/ladder.csv");
    let rows = if args.no_measuring {
        table::parse(&read(&table_file)?)?
    } else {
        let bar = output.bar("ladder");
        let measured = ladder::measure(|part| bar.set(part));
        bar.finish();
        let rows = measured?;
        write(&table_file, &table::csv(&rows)?)?;
        rows
    };
    let cycles = read(&place("docs/charts/cycles.csv"))?;
    write(&place(FIRMWARE), &table::firmware_source(&rows, &cycles)?)?;
    write(&place("docs/charts/ladder.svg"), &picture::picture(&rows))?;
    let tolerance = Share::JUST_NOTICEABLE;
    let bar = output.bar("held-out scenes");
    let judged = adequacy::campaign(args.seed, args.scenes, tolerance, |part| bar.set(part));
    bar.finish();
    let verdicts = judged?;
    write(&place(HELD_OUT), &adequacy::csv(&verdicts))?;
    let chose = |rung: Rung| verdicts.iter().filter(move |v| v.choice.rung == rung);
    let summaries = Rung::ALL.map(|rung| Summary::of(chose(rung), tolerance));
    let all = Summary::of(&verdicts, tolerance);
    let speeds: Vec<f64> = STEPS_MS
        .iter()
        .map(|&step| motion::speed(step))
        .collect::<Result<_, _>>()?;
    output.say(
        || people(rows.len(), &summaries, &all) + &speeds_line(&speeds),
        || json!({ "rows": rows.len(), "held_out": summaries, "all": all, "body_speeds": speeds }),
    );
    Ok(())
}

/// At most 80 columns.
fn people(rows: usize, summaries: &[Summary; 4], all: &Summary) -> String {
    let share = |part: usize, whole: usize| match whole {
        0 => "-".to_owned(),
        _ => format!("{:.0} %", 100.0 * part as f64 / whole as f64),
    };
    let line = |name: &str, s: &Summary| {
        format!(
            "{name:<22}{:>7}{:>10}{:>12}{:>8}{:>10}{:>9}",
            s.scenes,
            share(s.as_expected, s.scenes),
            share(s.sufficient, s.scenes),
            share(s.lower_fails, s.with_lower),
            share(s.lower_forgiven, s.with_lower),
            share(s.too_careful, s.with_lower),
        )
    };
    let mut out = format!(
        "{rows} measurements in docs/charts/ladder.csv\n\n\
         Held-out scenes in closed loop on a float muscle, tolerance 10 %\n\
         {:<45}{:>20}\n{:<22}{:>7}{:>10}{:>12}{:>8}{:>10}{:>9}\n",
        "",
        "next lower rung",
        "chosen",
        "scenes",
        "expected",
        "sufficient",
        "fails",
        "forgiven",
        "careful"
    );
    let named = RUNG_NAMES.into_iter().zip(summaries).chain([("all", all)]);
    for (name, summary) in named {
        out.push_str(&line(name, summary));
        out.push('\n');
    }
    out.push_str(
        "\nexpected: its error is at most what the choice expects. sufficient: the top\n\
         rung in its place changes the true force by less than 10 % of peak. fails: the\n\
         next lower one changes it by 10 % or more; forgiven: it predicts that wrong,\n\
         but the loop makes up for it; careful: it would have done.",
    );
    out
}

fn speeds_line(speeds: &[f64]) -> String {
    let each: Vec<_> = STEPS_MS
        .iter()
        .zip(speeds)
        .map(|(step, speed)| format!("{step} ms {speed:.0} x"))
        .collect();
    format!(
        "\n\nsimulated finger alone, by its step: {}",
        each.join(", ")
    )
}

fn read(path: &Path) -> anyhow::Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("E552 {}", path.display()))
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| format!("E552 {}", path.display()))
}
