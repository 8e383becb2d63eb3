//! `flexor hil`: compares captures of a logic analyser with the edges of a session.

mod expected;
mod print;
mod rehearse;

use super::chip::BoardName;
use super::{Output, check_range, usage_error};
use clap::Args;
use hal_sim::input;
use hil::capture::{Capture, ReadOptions, read};
use hil::fit::{FitOptions, Verdict};
use hil::line::Expected;
use hil::merge::merge;
use hil::plan::Plan;
use host_core::record::{RecordError, check_writable, sha256};
use host_core::run::{Board, SessionFile, check_board};
use std::io::Cursor;
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
    /// Number of the analyser's inputs, 2 to 64
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u8).range(2..=64))]
    inputs: u8,
    /// Print which input is connected to which pin in each capture, and end
    #[arg(long, conflicts_with_all = ["captures", "rehearse"])]
    plan: bool,
    /// Write captures of the chip simulator's pins into this folder, and end
    #[arg(long, value_name = "DIR", conflicts_with = "captures")]
    rehearse: Option<PathBuf>,
    /// Clock error of the simulated analyser, -999 to 999 ppm
    #[arg(
        long,
        default_value_t = 100.0,
        requires = "rehearse",
        allow_negative_numbers = true
    )]
    ppm: f64,
    /// Sample rate of the simulated analyser, 1 to 1000 MS/s
    #[arg(
        long,
        default_value_t = 100,
        requires = "rehearse",
        value_parser = clap::value_parser!(u64).range(1..=1000)
    )]
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
/// E505 if the board has no pins for a channel of the session; E820 to E822: a capture cannot be read
/// or compared, or an edge is not where it should be.
pub fn main(args: &HilArgs, output: Output) -> anyhow::Result<()> {
    let board = Board::from(args.board);
    check_range("--seconds", args.seconds, 0.05, 60.0)?;
    check_range("--ppm", args.ppm, -999.0, 999.0)?;
    let mut session = SessionFile::load(&args.session)?;
    check_board(&session.session, board)?;
    if let Some(path) = &args.sheet {
        let captures = args.captures.iter().map(PathBuf::as_path);
        let reads: Vec<&Path> = captures.chain([args.session.as_path()]).collect();
        check_writable(path, args.overwrite, &reads, None)?;
    }
    output.settle_models(&mut session.session)?;
    let expected = expected::predict(&session, board, output)?;
    let parts = expected::plan_captures(&expected, board, args.inputs.into())?;
    if args.plan {
        return print::connections(board, &parts, output);
    }
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
    let captures = args.captures.iter().map(|path| open(path));
    let captures = captures.collect::<anyhow::Result<Vec<_>>>()?;
    judge(args, &session, &captures, (&expected, &parts), output)
}

/// A capture with the name and the hash of its file.
struct CaptureFile {
    path: PathBuf,
    sha256: String,
    capture: Capture,
}

fn judge(
    args: &HilArgs,
    session: &SessionFile,
    files: &[CaptureFile],
    (expected, parts): (&Expected, &Plan),
    output: Output,
) -> anyhow::Result<()> {
    let captures: Vec<_> = files
        .iter()
        .map(|file| Some(file.capture.clone()))
        .collect();
    let is_simulated = captures.iter().flatten().any(rehearse::is_simulated);
    let options = FitOptions {
        min_covered_us: COVERED * args.seconds * 1e6,
        ..FitOptions::default()
    };
    let report = merge(expected, parts, &captures, &options);
    let measurement = print::Measurement {
        session,
        board: args.board.into(),
        seconds: args.seconds,
        files,
        common: &parts.common,
        is_simulated,
    };
    let sheet = print::sheet(&report, &measurement);
    if let Some(path) = &args.sheet {
        let text = serde_json::to_string_pretty(&sheet)?;
        std::fs::write(path, text + "\n").map_err(RecordError::write(path))?;
    }
    output.print(|| print::report(&report, &measurement), || sheet)?;
    match report.verdict {
        Verdict::Passed | Verdict::NotJudged => Ok(()),
        Verdict::Failed => anyhow::bail!(
            "E822 the captures do not show the predicted edges; see the findings of each capture"
        ),
        Verdict::Incomplete => anyhow::bail!(
            "E822 the comparison is incomplete: a capture is too short or cannot be aligned, or a \
             line was not compared; see the captures"
        ),
        Verdict::Ambiguous => anyhow::bail!(
            "E822 a capture is ambiguous: it fits only the start or the end of the session; record \
             longer"
        ),
    }
}

fn open(path: &Path) -> anyhow::Result<CaptureFile> {
    let named = |why: &dyn std::fmt::Display| anyhow::anyhow!("E821 {}: {why}", path.display());
    let bytes = input::read(path, input::LONGEST_TABLE).map_err(|why| named(&why))?;
    let capture = read(Cursor::new(&bytes), &ReadOptions::default());
    Ok(CaptureFile {
        path: path.to_owned(),
        sha256: sha256(&bytes),
        capture: capture.map_err(|why| named(&why))?,
    })
}
