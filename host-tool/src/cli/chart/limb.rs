//! `flexor chart limb`: recruitments for a force at the hand, and the device's numbers.

use super::write;
use crate::cli::{Output, within};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use studies::limb::{DECLARED, ONE_JOINT, Pace, Row, Study, Verdict, pace, study};

/// Compare recruitments for a force at the hand on drawn arms
#[derive(Args, Debug)]
pub struct Limb {
    /// Folder for limb.csv
    #[arg(long, default_value = "docs/charts")]
    out: PathBuf,
    /// Arms drawn, instead of the declared ones; then no file is written
    #[arg(long)]
    draws: Option<u64>,
}

/// # Errors
/// E700 to E707; E575: a file cannot be written.
pub fn main(args: &Limb, output: Output) -> anyhow::Result<()> {
    if let Some(draws) = args.draws {
        within("--draws", draws as f64, 1.0, 100_000.0)?;
    }
    let bar = output.bar("drawn arms");
    let found = study(args.draws);
    bar.finish();
    let found = found?;
    let pace = pace()?;
    if args.draws.is_none() {
        write(&args.out.join("limb.csv"), &found.csv())?;
    }
    output.say(|| people(&found, &pace), || machine(&found, &pace))
}

fn machine(found: &Study, pace: &Pace) -> Value {
    json!({
        "name": "limb", "seed": found.declared.seed, "simulated": true,
        "declared": { "text": DECLARED, "draws": found.declared.arms.draws },
        "rows": found.rows(), "shares": found.verdicts(), "numbers": found.numbers,
        "pace": pace, "is_debug_build": cfg!(debug_assertions),
    })
}

/// At most 80 columns.
fn people(found: &Study, pace: &Pace) -> String {
    let mut out = String::new();
    let (rows, verdicts) = (found.rows(), found.verdicts());
    let is_one_joint = |id: &str| id.starts_with(ONE_JOINT);
    for (heading, wants) in [
        ("lines as drawn", false),
        ("lines over one joint each", true),
    ] {
        let (rows, verdicts) = (rows.iter(), verdicts.iter());
        write_rows(
            &mut out,
            heading,
            rows.filter(|row| is_one_joint(&row.id) == wants),
        );
        write_verdicts(
            &mut out,
            verdicts.filter(|it| is_one_joint(&it.id) == wants),
        );
    }
    let numbers = &found.numbers;
    out.push_str(&format!(
        "{} drawn arms, 12 targets and 3 walks each. {} postures for the device's\n\
         numbers, at {} of which they recruit other muscles ({} by rounding alone).\n\
         By the arm's own model: simulated, no evidence about bodies or people.\n\n",
        found.arms.len(),
        numbers.n,
        numbers.device.other_choices,
        numbers.rounding.other_choices
    ));
    let build = match cfg!(debug_assertions) {
        true => "a build for tests",
        false => "a release build",
    };
    out.push_str(&format!(
        "One wanted force to ten amplitudes by least squares, on this computer, in\n\
         {build}: {:.1} µs; with a new posture's Jacobians {:.1} µs (medians of {}).",
        pace.least_squares_us, pace.with_posture_us, pace.n
    ));
    out
}

fn write_rows<'a>(out: &mut String, heading: &str, rows: impl Iterator<Item = &'a Row>) {
    out.push_str(&format!(
        "{heading:<53}{:>9}{:>9}{:>9}\n",
        "median", "95 %", "most"
    ));
    for row in rows {
        let Row {
            quantity,
            unit,
            ours,
            p95,
            most,
            ..
        } = row;
        let words = match *unit {
            "" => quantity.clone(),
            unit => format!("{quantity}, {unit}"),
        };
        out.push_str(&format!("{words:<53}{ours:>9.3}{p95:>9.3}{most:>9.3}\n"));
    }
}

fn write_verdicts<'a>(out: &mut String, verdicts: impl Iterator<Item = &'a Verdict>) {
    for verdict in verdicts {
        let Verdict {
            claim,
            holds,
            of,
            share: [_, low, high],
            ..
        } = verdict;
        out.push_str(&format!(
            "{claim}:\n  in {holds} of {of} arms (95 %: {:.0}…{:.0} %)\n",
            100.0 * low,
            100.0 * high
        ));
    }
    out.push('\n');
}
