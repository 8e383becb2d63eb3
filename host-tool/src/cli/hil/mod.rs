//! `flexor hil`: compares captures of a logic analyser with the edges of a session.

mod expected;
mod print;
mod rehearse;

use super::chip::BoardName;
use super::{Output, check_range, usage_error};
use clap::Args;
use hil::capture::{Capture, ReadOptions, read};
use hil::fit::{FitOptions, Verdict};
use hil::merge::merge;
use hil::plan::{Plan, plan};
use host_core::record::{RecordError, check_writable};
use host_core::run::{Board, SessionFile};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Share of `--seconds` that a capture must cover at least.
const COVERED: f64 = 0.95;

/// Check captures of a logic analyser against a session's edges
///
/// Record each part of the plan (--plan) with sigrok while the board runs the session, then give the
/// files in the order of the plan. A capture may begin before the first pulse, and must end before
/// the session does. Every edge in it is judged.
#[derive(Args, Debug)]
pub struct HilArgs {
    /// Session file (TOML) that the board runs
    session: PathBuf,
    /// Captures in sigrok's format (.sr), one for each part of the plan
    captures: Vec<PathBuf>,
    /// Board that is measured
    #[arg(long, value_enum, default_value = "weact")]
    board: BoardName,
    /// Part of the session that each capture must cover, s
    #[arg(long, default_value_t = 1.0)]
    seconds: f64,
    /// Number of the analyser's inputs
    #[arg(long, default_value_t = 8)]
    inputs: usize,
    /// Print which input is connected to which pin in each capture, and end
    #[arg(long, conflicts_with_all = ["captures", "rehearse"])]
    plan: bool,
    /// Write captures of the chip simulator's pins into this folder, and end
    #[arg(long, value_name = "DIR", conflicts_with = "captures")]
    rehearse: Option<PathBuf>,
    /// Clock error of the simulated analyser, ppm
    #[arg(
        long,
        default_value_t = 100.0,
        requires = "rehearse",
        allow_negative_numbers = true
    )]
    ppm: f64,
    /// Sample rate of the simulated analyser, MS/s
    #[arg(long, default_value_t = 100, requires = "rehearse")]
    rate: u64,
    /// Seed of the simulated analyser's jitter of one sample
    #[arg(long, default_value_t = 1, requires = "rehearse")]
    seed: u64,
    /// Write the result with every statistic into this file (JSON)
    #[arg(long, requires = "captures")]
    sheet: Option<PathBuf>,
    /// Replace an existing --sheet file, or captures in --rehearse
    #[arg(long)]
    overwrite: bool,
}

/// # Errors
/// E820 to E822: a capture cannot be read or compared, or an edge is not where it should be.
pub fn main(args: &HilArgs, output: Output) -> anyhow::Result<()> {
    let board = Board::from(args.board);
    check_range("--seconds", args.seconds, 0.05, 60.0)?;
    let parts = plan(&expected::lines(board), expected::SYNC, args.inputs);
    let parts = parts.map_err(|why| anyhow::anyhow!("E820 {why}"))?;
    if args.plan {
        return print::connections(board, &parts, output);
    }
    let mut session = SessionFile::load(&args.session)?;
    output.settle_models(&mut session.session)?;
    if let Some(folder) = &args.rehearse {
        let analyser = rehearse::Analyser {
            ppm: args.ppm,
            rate: args.rate,
            seed: args.seed,
        };
        session.session.duration_us = (args.seconds * 1e6).round() as u64; // at most 6e7
        return rehearse::main(
            &session,
            board,
            &parts,
            &analyser,
            (folder, args.overwrite),
            output,
        );
    }
    if args.captures.len() != parts.captures.len() {
        return usage_error(format!(
            "the plan has {} captures, and {} were given; see flexor hil --plan",
            parts.captures.len(),
            args.captures.len()
        ));
    }
    if let Some(path) = &args.sheet {
        check_writable(path, args.overwrite, &[&args.session], None)?;
    }
    judge(args, &session, board, &parts, output)
}

fn judge(
    args: &HilArgs,
    session: &SessionFile,
    board: Board,
    parts: &Plan,
    output: Output,
) -> anyhow::Result<()> {
    let captures: Vec<Option<Capture>> = args
        .captures
        .iter()
        .map(|path| open(path).map(Some))
        .collect::<anyhow::Result<_>>()?;
    let is_simulated = captures.iter().flatten().any(rehearse::is_simulated);
    let expected = expected::predict(session, board, output)?;
    let options = FitOptions {
        min_covered_us: COVERED * args.seconds * 1e6,
        ..FitOptions::default()
    };
    let report = merge(&expected, parts, &captures, &options);
    let sheet = print::sheet(&report, board, is_simulated);
    if let Some(path) = &args.sheet {
        let text = serde_json::to_string_pretty(&sheet)?;
        std::fs::write(path, text + "\n").map_err(RecordError::write(path))?;
    }
    output.print(|| print::report(&report, is_simulated), || sheet)?;
    match report.verdict {
        Verdict::Passed | Verdict::NotJudged => Ok(()),
        verdict => anyhow::bail!(
            "E822 the captures do not show the predicted edges ({verdict:?}); see the findings above"
        ),
    }
}

fn open(path: &Path) -> anyhow::Result<Capture> {
    let named = |why: &dyn std::fmt::Display| anyhow::anyhow!("E821 {}: {why}", path.display());
    let file = File::open(path).map_err(|why| named(&why))?;
    read(BufReader::new(file), &ReadOptions::default()).map_err(|why| named(&why))
}
