//! `flexor chart model-selection`: judges the selection of muscle models on random sessions.

use super::write;
use crate::cli::{Output, check_range};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use studies::figures::ladder_picture;
use studies::ladder::draw::{JUDGED, SESSIONS};
use studies::ladder::judge::{Row, Summary, TOLERANCES, campaign, csv};

/// Test the selection of muscle models on random sessions
#[derive(Args, Debug)]
pub struct LevelChart {
    /// Root of the checkout in which docs/charts/ladder* are written again
    #[arg(long, default_value = ".")]
    workspace: PathBuf,
    /// Number of sessions
    #[arg(long, default_value_t = SESSIONS)]
    sessions: usize,
    /// Seed of the sessions
    #[arg(long, default_value_t = JUDGED)]
    seed: u64,
    /// Write no files; only print the shares
    #[arg(long, conflicts_with = "workspace")]
    no_files: bool,
}

/// # Errors
/// Fails if a session cannot be simulated or a file cannot be written.
pub fn main(args: &LevelChart, output: Output) -> anyhow::Result<()> {
    check_range("--sessions", args.sessions as f64, 1.0, 10_000.0)?;
    let bar = output.bar("random sessions");
    let rows = campaign(args.seed, args.sessions, |part| bar.set(part));
    bar.finish();
    let rows = rows?;
    if !args.no_files {
        write(&args.workspace.join("docs/charts/ladder.csv"), &csv(&rows))?;
        let picture = ladder_picture(&rows, args.seed);
        write(&args.workspace.join("docs/charts/ladder.svg"), &picture)?;
    }
    output.print(
        || text_report(args, &rows),
        || {
            let shares = TOLERANCES.iter().enumerate().map(|(n, tolerance)| {
                json!({ "tolerance_pct": tolerance.fraction() * 100.0, "shares": Summary::from_rows(&rows, n) })
            });
            json!({ "seed": args.seed, "sessions": args.sessions, "rows": rows.len(),
                    "tolerances": shares.collect::<Vec<_>>() })
        },
    )
}

/// Formats the report in at most 80 columns.
fn text_report(args: &LevelChart, rows: &[Row]) -> String {
    let share = |part: usize, total: usize| match total {
        0 => "-".to_owned(),
        _ => format!("{:.1} % of {total}", 100.0 * part as f64 / total as f64),
    };
    let mut out = format!(
        "{} random sessions of seed {}, {} muscles (simulated)\n{:<11}{:>9}{:>17}{:>17}{:>20}",
        args.sessions,
        args.seed,
        rows.len(),
        "tolerance",
        "refused",
        "muscles within",
        "sessions within",
        "next cheaper fails"
    );
    for (n, tolerance) in TOLERANCES.iter().enumerate() {
        let sum = Summary::from_rows(rows, n);
        out.push_str(&format!(
            "\n{:<11}{:>9}{:>17}{:>17}{:>20}",
            tolerance.to_string(),
            sum.refused,
            share(sum.within, sum.muscles),
            share(sum.sessions_within, sum.sessions),
            share(sum.cheaper_fails, sum.with_cheaper),
        ));
    }
    out
}
