//! Captures as an analyser at the chip simulator's pins would record them.

use super::expected::pins;
use super::{Output, Plan};
use crate::cli::interrupt::{self, EndedBySignal};
use anyhow::Context;
use hal_sim::chip::board::SharedPinLog;
use hil::capture::{Capture, write};
use hil::synthesise::{self, ExactEdge, ExactLine, synthesise};
use host_core::link::Interruption;
use host_core::record::{RecordError, check_writable};
use host_core::run::{Board, ChipOptions, SessionFile, interruptible, open_chip_port, run};
use serde_json::json;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Beginning of the name of every probe in a capture that no analyser recorded.
const SIMULATED: &str = "simulated ";
/// Picoseconds in a core cycle, times 168.
const PS_168: i128 = 1_000_000;
/// Session time of the first sample, ps: 2 ms before the first pulse.
const START_PS: i64 = -2_000_000_000;

/// Properties of the simulated analyser.
pub struct Analyser {
    /// Clock error, ppm.
    pub ppm: f64,
    /// Sample rate, MS/s.
    pub rate: u64,
    /// Seed of the jitter.
    pub seed: u64,
}

/// Returns whether a capture was made here.
#[must_use]
pub fn is_simulated(capture: &Capture) -> bool {
    capture
        .probes()
        .iter()
        .any(|probe| probe.name.starts_with(SIMULATED))
}

/// Runs `session` on the chip simulator of `board`, and writes a capture for each part of the plan.
///
/// # Errors
/// Fails if the session cannot be run, or a file cannot be written; E580 if a signal came.
pub fn main(
    session: &SessionFile,
    board: Board,
    plan: &Plan,
    analyser: &Analyser,
    (folder, overwrite): (&Path, bool),
    output: Output,
) -> anyhow::Result<()> {
    let names = (1..=plan.captures.len()).map(|n| folder.join(format!("capture-{n}.sr")));
    let files: Vec<PathBuf> = names.collect();
    std::fs::create_dir_all(folder).map_err(RecordError::io(folder))?;
    for path in &files {
        check_writable(path, overwrite, &[], None)?;
    }
    let interruption = interrupt::catch_signals()?;
    let lines = lines(session, board, &interruption, output)?;
    let length_us = session.session.duration_us;
    for (path, connections) in files.iter().zip(&plan.captures) {
        let inputs = connections.iter().map(|connection| connection.bit).max();
        let recorded = |bit: u8| {
            let connection = connections.iter().find(|connection| connection.bit == bit);
            let name = connection.map_or("input", |connection| &connection.line);
            let line = lines.iter().find(|line| line.name == name);
            ExactLine {
                // The analyser names its inputs by number; an open one stays low.
                name: format!("{SIMULATED}{name} D{bit}"),
                first_high: false,
                edges: line.map_or_else(Vec::new, |line| line.edges.clone()),
            }
        };
        let chosen: Vec<ExactLine> = (0..=inputs.unwrap_or(0)).map(recorded).collect();
        let analyser = synthesise::Analyser {
            samplerate_hz: analyser.rate * 1_000_000,
            clock_ppb: (analyser.ppm * 1e3).round() as i64,
            start_ps: START_PS,
            samples: (length_us + 1_000) * analyser.rate,
            jitter_samples: 1,
            seed: analyser.seed,
        };
        if let Some(signal) = interruption.received_signal() {
            let when = "while captures were written; those in the folder are complete";
            return Err(EndedBySignal(signal, when.to_owned()).into());
        }
        let capture = synthesise(&chosen, &analyser, &[]);
        let capture = capture.map_err(|why| anyhow::anyhow!("E820 {why}"))?;
        write_whole(path, &capture)?;
    }
    output.print(
        || {
            let names = files.iter().map(|path| format!("\n  {}", path.display()));
            format!("simulated captures:{}", names.collect::<String>())
        },
        || json!({ "captures": files, "simulated": true }),
    )
}

/// Writes a capture under another name first, so that the file at `path` is always complete.
fn write_whole(path: &Path, capture: &Capture) -> anyhow::Result<()> {
    let partial = path.with_extension("sr.partial");
    let written = File::create(&partial)
        .map_err(|why| RecordError::write(path)(why).into())
        .and_then(|file| {
            let written = write(BufWriter::new(file), capture);
            written.map_err(|why| anyhow::anyhow!("E821 {}: {why}", path.display()))
        })
        .and_then(|()| {
            let renamed = std::fs::rename(&partial, path);
            renamed.map_err(|why| RecordError::write(path)(why).into())
        });
    written.inspect_err(|_| {
        let _ = std::fs::remove_file(&partial); // an incomplete capture is of no use
    })
}

/// Returns the edges of every line, from the pins of the chip simulator.
fn lines(
    session: &SessionFile,
    board: Board,
    interruption: &Interruption,
    output: Output,
) -> anyhow::Result<Vec<ExactLine>> {
    let log = SharedPinLog::default();
    let options = ChipOptions {
        board,
        pins: Some(log.clone()),
        ..ChipOptions::default()
    };
    let port = open_chip_port(&session.session, 1, &options)?;
    let bar = output.bar("simulating");
    let progress = interruptible(interruption, |part| bar.set(part));
    let (outcome, _) = run(session, Box::new(port), None, progress);
    bar.finish();
    if let Some(error) = outcome.error {
        return Err(error.into());
    }
    let epoch = outcome.epoch_us.context("the session did not start")?;
    let log = log
        .lock()
        .map_err(|_| anyhow::anyhow!("the log of the pins is damaged"))?;
    let time_ps = |cycle: u64| {
        let since = i128::from(cycle) - i128::from(log.origin);
        (since * PS_168 / 168 - i128::from(epoch) * 1_000_000) as i64 // within hours of the session
    };
    let lines = pins(board).into_iter().map(|(name, pin)| {
        let is_own = |edge: &&hal_sim::chip::soc::gpio::Edge| {
            usize::from(edge.port) == pin.port.index() && u32::from(edge.changed) & pin.bit() != 0
        };
        let edges = log.edges.iter().filter(is_own).map(|edge| ExactEdge {
            time_ps: time_ps(edge.cycle),
            high: u32::from(edge.levels) & pin.bit() != 0,
        });
        ExactLine {
            name,
            first_high: false,
            edges: edges.collect(),
        }
    });
    Ok(lines.collect())
}
