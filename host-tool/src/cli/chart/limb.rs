//! `flexor chart limb`: compares recruitments for a force at the hand, and the device's arithmetic
//! with the host's.

use super::write;
use crate::cli::{Output, check_range};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use studies::limb::{DECLARED, Pace, Row, Study, Verdict, pace, study};

/// Compare ways to recruit muscles for a hand force, on random arms
#[derive(Args, Debug)]
pub struct Limb {
    /// Folder for limb.csv
    #[arg(long, default_value = "docs/charts")]
    out: PathBuf,
    /// Number of random arms, instead of the preregistered number; writes no file
    #[arg(long)]
    draws: Option<u64>,
}

/// # Errors
/// E700 to E707; E575: a file cannot be written.
pub fn main(args: &Limb, output: Output) -> anyhow::Result<()> {
    if let Some(draws) = args.draws {
        check_range("--draws", draws as f64, 1.0, 100_000.0)?;
    }
    let bar = output.bar("random arms");
    let found = study(args.draws);
    bar.finish();
    let found = found?;
    let pace = pace()?;
    if args.draws.is_none() {
        write(&args.out.join("limb.csv"), &found.csv())?;
    }
    output.print(|| text_report(&found, &pace), || json_report(&found, &pace))
}

fn json_report(found: &Study, pace: &Pace) -> Value {
    json!({
        "name": "limb", "seed": found.declared.seed, "simulated": true,
        "declared": { "text": DECLARED, "draws": found.declared.arms.draws },
        "rows": found.rows(), "shares": found.verdicts(), "numbers": found.numbers,
        "pace": pace, "is_debug_build": cfg!(debug_assertions),
    })
}

/// Formats the report in at most 80 columns.
fn text_report(found: &Study, pace: &Pace) -> String {
    let mut out = format!("{:<52}{:>9}{:>9}{:>9}\n", "", "median", "95 %", "max");
    for row in found.rows() {
        let Row {
            quantity,
            unit,
            ours,
            p95,
            most,
            ..
        } = row;
        let words = match unit {
            "" => quantity,
            unit => format!("{quantity}, {unit}"),
        };
        out.push_str(&format!("{words:<52}{ours:>9.3}{p95:>9.3}{most:>9.3}\n"));
    }
    let numbers = &found.numbers;
    out.push_str(&format!(
        "{} random arms with 12 targets and 3 walks each. The device's arithmetic was\n\
         compared with double precision at {} postures: it recruits other muscles at {}\n\
         of them, rounding alone at {}. Computed with the arm's own model: simulated, no\n\
         evidence about people.\n\n",
        found.arms.len(),
        numbers.n,
        numbers.device.other_choices,
        numbers.rounding.other_choices
    ));
    for verdict in found.verdicts() {
        let Verdict {
            claim,
            holds,
            of,
            share: [_, low, high],
        } = verdict;
        out.push_str(&format!(
            "{claim}:\n  in {holds} of {of} arms (95 %: {:.0}…{:.0} %)\n",
            100.0 * low,
            100.0 * high
        ));
    }
    let build = match cfg!(debug_assertions) {
        true => "a debug build",
        false => "a release build",
    };
    out.push_str(&format!(
        "\nTime from one reference force to ten amplitudes by least squares, on this\n\
         computer in {build}: {:.1} µs, or {:.1} µs with the Jacobians of a new posture\n\
         (medians of {}).",
        pace.least_squares_us, pace.with_posture_us, pace.n
    ));
    out
}
