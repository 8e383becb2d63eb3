//! `flexor chart limb-detail`: judges the level of detail that `[fidelity]` chooses for a simulated
//! hand or arm, and counts what each level costs.

use super::write;
use crate::cli::{Output, check_range};
use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use studies::detail::{JUDGED, Limb, Row, SESSIONS, Summary, csv, read_csv};
use studies::figures::{Cost, detail_picture};

/// Selects the C library's generic functions, so that the count is the same on all processors of
/// this kind.
const TUNABLES: &str =
    "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-AVX512VL,-BMI2,-ERMS,-FMA,-FMA4,-FSRM,-RTM,-XSAVEC";

/// Test the level of detail that [fidelity] chooses for a hand or arm
#[derive(Args, Debug)]
pub struct DetailChart {
    /// Root of the checkout in which docs/charts/{hand,arm}_detail* are written again; instructions
    /// are counted with valgrind
    #[arg(long, default_value = ".")]
    workspace: PathBuf,
    /// Limb that is judged; both without it
    #[arg(long, value_enum)]
    limb: Option<LimbName>,
    /// Number of sessions of each limb
    #[arg(long, default_value_t = SESSIONS)]
    sessions: usize,
    /// Seed of the sessions
    #[arg(long, default_value_t = JUDGED)]
    seed: u64,
    /// Count no instructions and write no files; only print the shares
    #[arg(long, conflicts_with = "workspace")]
    no_files: bool,
    /// Judge no sessions; take the errors from the committed tables, count the instructions again
    /// and draw the pictures again
    #[arg(long, conflicts_with_all = ["no_files", "sessions", "seed"])]
    costs_only: bool,
    /// Only play the session whose instructions are counted, at this level of detail of the limb
    #[arg(
        long,
        hide = true,
        value_name = "LEVEL",
        requires = "limb",
        conflicts_with = "no_files"
    )]
    play: Option<u32>,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum LimbName {
    Hand,
    Arm,
}

impl LimbName {
    const fn limb(self) -> Limb {
        match self {
            Self::Hand => Limb::Hand,
            Self::Arm => Limb::Arm,
        }
    }
}

/// Results for one limb: its sessions, and the cost of each level of detail.
struct LimbResult {
    limb: Limb,
    rows: Vec<Row>,
    costs: Vec<Cost>,
}

/// # Errors
/// Fails if a session cannot be simulated, valgrind cannot be started or a file cannot be written.
pub fn main(args: &DetailChart, output: Output) -> anyhow::Result<()> {
    let limb = args.limb.map(LimbName::limb);
    if let (Some(level), Some(limb)) = (args.play, limb) {
        return Ok(limb.play_counted(level)?);
    }
    check_range("--sessions", args.sessions as f64, 1.0, 10_000.0)?;
    let mut results = Vec::new();
    for limb in Limb::ALL {
        if args.limb.is_none_or(|name| name.limb() == limb) {
            results.push(judge(limb, args, output)?);
        }
    }
    output.print(
        || {
            let parts = results.iter().map(|result| text_report(result, args.seed));
            parts.collect::<Vec<_>>().join("\n\n")
        },
        || {
            json!({ "seed": args.seed, "is_debug_build": cfg!(debug_assertions),
                    "limbs": results.iter().map(json_report).collect::<Vec<_>>() })
        },
    )
}

fn judge(limb: Limb, args: &DetailChart, output: Output) -> anyhow::Result<LimbResult> {
    let charts = args.workspace.join("docs/charts");
    let path = |ending: &str| charts.join(format!("{}_detail{ending}", limb.name()));
    let rows = match args.costs_only {
        true => committed_rows(&path(".csv"))?,
        false => {
            let bar = output.bar(limb.name());
            let rows = limb.campaign(args.seed, args.sessions, |part| bar.set(part));
            bar.finish();
            rows?
        }
    };
    let mut costs = Vec::new();
    if !args.no_files {
        costs = count_costs(limb)?;
        if !args.costs_only {
            write(&path(".csv"), &csv(&rows))?;
        }
        write(&path("_cost.csv"), &cost_csv(limb, &costs))?;
        let picture = detail_picture(limb, &rows, &costs, args.seed);
        write(&path(".svg"), &picture)?;
    }
    Ok(LimbResult { limb, rows, costs })
}

/// Reads the errors of all sessions from a committed table.
fn committed_rows(path: &Path) -> anyhow::Result<Vec<Row>> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {name}"))?;
    read_csv(&text).with_context(|| format!("{name} is no table of this command"))
}

/// Counts with callgrind the instructions that this program executes for a second of the counted
/// session, at each level of detail.
fn count_costs(limb: Limb) -> anyhow::Result<Vec<Cost>> {
    let program = std::env::current_exe()?;
    let count = |level: u32| -> anyhow::Result<Cost> {
        let ran = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(&program)
            .args(["chart", "limb-detail", "--limb", limb.name()])
            .args(["--play", &level.to_string()])
            .env("GLIBC_TUNABLES", TUNABLES)
            .output()
            .context("valgrind cannot be started: install the package valgrind")?;
        let report = String::from_utf8_lossy(&ran.stderr);
        ensure!(ran.status.success(), "valgrind failed:\n{report}");
        let count = report
            .lines()
            .find_map(|line| line.split_once("Collected : "))
            .with_context(|| format!("callgrind reported no instruction count:\n{report}"))?;
        Ok((level, count.1.trim().parse::<f64>()? / limb.counted_s()))
    };
    limb.counted_levels()?.into_iter().map(count).collect()
}

fn cost_csv(limb: Limb, costs: &[Cost]) -> String {
    let rows = costs
        .iter()
        .map(|(level, instructions)| format!("{level},{instructions:.0}\n"));
    std::iter::once(format!("{},instructions_per_s\n", limb.setting()))
        .chain(rows)
        .collect()
}

/// Formats the report in at most 80 columns.
fn text_report(LimbResult { limb, rows, costs }: &LimbResult, seed: u64) -> String {
    let share = |part: usize, total: usize| match total {
        0 => "-".to_owned(),
        _ => format!("{:.1} % of {total}", 100.0 * part as f64 / total as f64),
    };
    let mut out = format!(
        "{}: {} random sessions of seed {seed} (simulated)\n{:<11}{:>20}{:>20}",
        limb.name(),
        rows.len(),
        "tolerance",
        "sessions within",
        "next coarser fails"
    );
    for tolerance in limb.tolerances() {
        let sum = Summary::from_rows(rows, *tolerance);
        out.push_str(&format!(
            "\n{:<11}{:>20}{:>20}",
            tolerance.to_string(),
            share(sum.within, sum.sessions),
            share(sum.coarser_fails, sum.with_coarser),
        ));
    }
    for (level, instructions) in costs {
        let millions = instructions * 1e-6;
        out.push_str(&format!(
            "\n{} {level}: {millions:.1} M instructions per s",
            limb.setting()
        ));
    }
    out
}

fn json_report(LimbResult { limb, rows, costs }: &LimbResult) -> Value {
    let tolerances = limb.tolerances().iter().map(|tolerance| {
        json!({ "tolerance_pct": tolerance.fraction() * 100.0, "shares": Summary::from_rows(rows, *tolerance) })
    });
    let costs = costs.iter().map(
        |(level, instructions)| json!({ limb.setting(): level, "instructions": instructions }),
    );
    json!({ "limb": limb.name(), "sessions": rows.len(),
            "tolerances": tolerances.collect::<Vec<_>>(),
            "instructions_per_s": costs.collect::<Vec<_>>() })
}
