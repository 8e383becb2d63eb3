//! `flexor chart ladder`: each rung of the muscle ladder per kind of scene.

use super::write;
use crate::cli::{Output, within};
use anyhow::Context;
use clap::Args;
use firmware::muscle::Rung;
use host_core::choice::Share;
use host_core::choice::grid::STEPS_MS;
use serde_json::json;
use std::path::{Path, PathBuf};
use studies::figures::ladder_picture;
use studies::ladder::adequacy::{self, Summary, Verdict};
use studies::ladder::table::{self, RUNG_NAMES};
use studies::ladder::{self, motion};

/// Measure the rungs of the muscle ladder per kind of scene
#[derive(Args, Debug)]
pub struct Ladder {
    /// Where the workspace is whose docs/charts/ladder* are written anew
    #[arg(long, default_value = ".")]
    workspace: PathBuf,
    /// Only draw docs/charts/ladder.csv and judge held-out scenes anew
    #[arg(long)]
    no_measuring: bool,
    /// Leave the held-out scenes as they were judged
    #[arg(long, requires = "no_measuring")]
    no_judging: bool,
    /// Held-out scenes for each rung and tolerance, on which its choice is tried in
    /// closed loop
    #[arg(long, default_value_t = 50)]
    scenes: usize,
    /// Which held-out scenes
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// What sessions tolerate: the just-noticeable difference, a third and three
/// times it.
const TOLERANCES: [Share; 3] = [Share::JUST_NOTICEABLE, Share(300), Share(3_000)];
/// The verdicts, from the workspace.
const HELD_OUT: &str = "docs/charts/ladder_held_out.csv";

/// # Errors
/// Files that cannot be read or written.
pub fn main(args: &Ladder, output: Output) -> anyhow::Result<()> {
    within("--scenes", args.scenes as f64, 1.0, 1000.0)?;
    let place = |file: &str| args.workspace.join(file);
    let table_file = place("docs/charts/ladder.csv");
    if !args.no_measuring {
        let bar = output.bar("ladder");
        let measured = ladder::measure(|part| bar.set(part));
        bar.finish();
        write(&table_file, &table::csv(&measured?)?)?;
    }
    let measured = read(&table_file)?;
    let rows = table::parse(&measured)?;
    write(&place("docs/charts/ladder.svg"), &ladder_picture(&rows))?;
    if args.no_judging {
        return output.say(
            || format!("{} measurements in docs/charts/ladder.csv", rows.len()),
            || json!({ "rows": rows.len() }),
        );
    }
    let bar = output.bar("held-out scenes");
    let mut judged = Vec::new();
    for (done, tolerance) in (0..).map(f64::from).zip(TOLERANCES) {
        let parts = TOLERANCES.len() as f64;
        let step = |part| bar.set((done + part) / parts);
        let verdicts = adequacy::campaign(args.seed, args.scenes, tolerance, step)?;
        judged.push((tolerance, verdicts));
    }
    bar.finish();
    write(&place(HELD_OUT), &adequacy::csv(&judged))?;
    let summaries: Vec<Judged> = judged
        .iter()
        .map(|(tolerance, verdicts)| Judged::of(args.seed, *tolerance, verdicts))
        .collect();
    let speeds: Vec<f64> = STEPS_MS
        .iter()
        .map(|&step| motion::speed(step))
        .collect::<Result<_, _>>()?;
    if measured != table::COMMITTED {
        eprintln!(
            "note: the table has changed, but this program chooses by the one it was built with: \
             build it and run `flexor chart ladder --no-measuring`"
        );
    }
    output.say(
        || people(rows.len(), &summaries) + &speeds_line(&speeds),
        || json!({ "rows": rows.len(), "held_out": summaries, "body_speeds": speeds }),
    )?;
    Ok(())
}

/// What held-out scenes showed at one tolerance.
#[derive(serde::Serialize)]
struct Judged {
    tolerance_pct: f64,
    /// Scenes for which nothing is chosen, parts of those drawn.
    refused: f64,
    /// Of the scenes for which each rung is chosen.
    rungs: [Summary; 4],
    all: Summary,
}

impl Judged {
    fn of(seed: u64, tolerance: Share, verdicts: &[Verdict]) -> Self {
        let chose = |rung: Rung| verdicts.iter().filter(move |v| v.choice.rung == rung);
        Self {
            tolerance_pct: f64::from(tolerance.0) / 100.0,
            refused: adequacy::refused(seed, tolerance),
            rungs: Rung::ALL.map(|rung| Summary::of(chose(rung), tolerance)),
            all: Summary::of(verdicts, tolerance),
        }
    }
}

/// At most 80 columns.
fn people(rows: usize, judged: &[Judged]) -> String {
    let share = |part: usize, whole: usize| match whole {
        0 => "-".to_owned(),
        _ => format!("{:.0} %", 100.0 * part as f64 / whole as f64),
    };
    let mut out = format!("{rows} measurements in docs/charts/ladder.csv\n");
    for Judged {
        tolerance_pct,
        refused,
        rungs,
        all,
    } in judged
    {
        out.push_str(&format!(
            "\nHeld-out scenes in closed loop on a float muscle, tolerance {tolerance_pct} %\n\
             {:<22}{:>7}{:>13}{:>13}{:>18}\n",
            "chosen", "scenes", "as expected", "sufficient", "next lower fails"
        ));
        for (name, s) in RUNG_NAMES.into_iter().zip(rungs).chain([("all", all)]) {
            out.push_str(&format!(
                "{name:<22}{:>7}{:>13}{:>13}{:>18}\n",
                s.scenes,
                share(s.as_expected, s.scenes),
                share(s.sufficient, s.scenes),
                share(s.lower_fails, s.with_lower),
            ));
        }
        out.push_str(&format!(
            "refused, as no rung's own prediction is within: {:.0} % of the scenes drawn\n",
            100.0 * refused
        ));
    }
    out.push_str(
        "\nas expected: the change is at most what the choice expects. sufficient: the\n\
         top rung in its place changes the true force by less than the tolerance, in\n\
         the worst wearer. fails: it changes the next lower one's by that or more.",
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
    std::fs::read_to_string(path).with_context(|| format!("E552 cannot read {}", path.display()))
}
