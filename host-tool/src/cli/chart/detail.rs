//! `flexor chart hand-detail`: judges how many motor units `[fidelity]` chooses for a simulated
//! hand, and counts what they cost.

use super::write;
use crate::cli::{Output, check_range};
use anyhow::{Context, ensure};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::process::Command;
use studies::figures::{Cost, detail_picture};
use studies::hands::detail::{
    COUNTED_S, JUDGED, Row, SESSIONS, Summary, TOLERANCES, campaign, counted_units, csv,
    play_counted,
};

/// Selects the C library's generic functions, so that the count is the same on all processors of
/// this kind.
const TUNABLES: &str =
    "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-AVX512VL,-BMI2,-ERMS,-FMA,-FMA4,-FSRM,-RTM,-XSAVEC";

/// Test how many motor units [fidelity] chooses for a hand
#[derive(Args, Debug)]
pub struct DetailChart {
    /// Root of the checkout in which docs/charts/hand_detail* are written again; instructions are
    /// counted with valgrind
    #[arg(long, default_value = ".")]
    workspace: PathBuf,
    /// Number of sessions
    #[arg(long, default_value_t = SESSIONS)]
    sessions: usize,
    /// Seed of the sessions
    #[arg(long, default_value_t = JUDGED)]
    seed: u64,
    /// Count no instructions and write no files; only print the shares
    #[arg(long, conflicts_with = "workspace")]
    no_files: bool,
    /// Only play the session whose instructions are counted, with this number of units per pool
    #[arg(long, hide = true, value_name = "UNITS", conflicts_with = "no_files")]
    play: Option<usize>,
}

/// # Errors
/// Fails if a session cannot be simulated, valgrind cannot be started or a file cannot be written.
pub fn main(args: &DetailChart, output: Output) -> anyhow::Result<()> {
    if let Some(units) = args.play {
        return Ok(play_counted(units)?);
    }
    check_range("--sessions", args.sessions as f64, 1.0, 10_000.0)?;
    let bar = output.bar("random sessions");
    let rows = campaign(args.seed, args.sessions, |part| bar.set(part));
    bar.finish();
    let rows = rows?;
    let mut costs = Vec::new();
    if !args.no_files {
        costs = count_costs()?;
        let charts = args.workspace.join("docs/charts");
        write(&charts.join("hand_detail.csv"), &csv(&rows))?;
        write(&charts.join("hand_detail_cost.csv"), &cost_csv(&costs))?;
        let picture = detail_picture(&rows, &costs, args.seed);
        write(&charts.join("hand_detail.svg"), &picture)?;
    }
    output.print(
        || text_report(args, &rows, &costs),
        || {
            let shares = TOLERANCES.map(|tolerance| {
                json!({ "tolerance_pct": tolerance.fraction() * 100.0, "shares": Summary::from_rows(&rows, tolerance) })
            });
            json!({ "seed": args.seed, "sessions": rows.len(), "tolerances": shares,
                    "instructions_per_s": costs.iter().map(|(units, instructions)| {
                        json!({ "units": units, "instructions": instructions })
                    }).collect::<Vec<_>>() })
        },
    )
}

/// Counts with callgrind the instructions that this program executes for a second of the counted
/// session, with each number of motor units.
fn count_costs() -> anyhow::Result<Vec<Cost>> {
    let program = std::env::current_exe()?;
    let count = |units: usize| -> anyhow::Result<Cost> {
        let ran = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(&program)
            .args(["chart", "hand-detail", "--play", &units.to_string()])
            .env("GLIBC_TUNABLES", TUNABLES)
            .output()
            .context("valgrind cannot be started: install the package valgrind")?;
        let report = String::from_utf8_lossy(&ran.stderr);
        ensure!(ran.status.success(), "valgrind failed:\n{report}");
        let count = report
            .lines()
            .find_map(|line| line.split_once("Collected : "))
            .with_context(|| format!("callgrind reported no instruction count:\n{report}"))?;
        Ok((units, count.1.trim().parse::<f64>()? / COUNTED_S))
    };
    counted_units()?.into_iter().map(count).collect()
}

fn cost_csv(costs: &[Cost]) -> String {
    let rows = costs
        .iter()
        .map(|(units, instructions)| format!("{units},{instructions:.0}\n"));
    std::iter::once("units,instructions_per_s\n".to_owned())
        .chain(rows)
        .collect()
}

/// Formats the report in at most 80 columns.
fn text_report(args: &DetailChart, rows: &[Row], costs: &[Cost]) -> String {
    let share = |part: usize, total: usize| match total {
        0 => "-".to_owned(),
        _ => format!("{:.1} % of {total}", 100.0 * part as f64 / total as f64),
    };
    let mut out = format!(
        "{} random sessions of seed {} (simulated)\n{:<11}{:>20}{:>20}",
        rows.len(),
        args.seed,
        "tolerance",
        "sessions within",
        "fewer units fail"
    );
    for tolerance in TOLERANCES {
        let sum = Summary::from_rows(rows, tolerance);
        out.push_str(&format!(
            "\n{:<11}{:>20}{:>20}",
            tolerance.to_string(),
            share(sum.within, sum.sessions),
            share(sum.fewer_fails, sum.with_fewer),
        ));
    }
    for (units, instructions) in costs {
        let millions = instructions * 1e-6;
        out.push_str(&format!(
            "\n{units:>3} units per pool: {millions:.1} M instructions per s"
        ));
    }
    out
}
