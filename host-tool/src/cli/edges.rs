//! `flexor edges`: writes every edge of a session's pulses.

use super::{Output, check_range};
use anyhow::{Context, bail};
use clap::Args;
use host_core::record::{RecordError, check_writable, write_edges};
use host_core::run::{DeviceName, SessionFile, edges_between, run};
use std::io::Write;
use std::path::PathBuf;

/// Write every output edge of a session
///
/// One row for each edge: t_us,channel,state,dac_code.
#[derive(Args, Debug)]
pub struct Edges {
    /// Session file (TOML)
    session: PathBuf,
    /// Duration of the stimulation, s
    #[arg(long)]
    seconds: f64,
    /// Device: native, chip or qemu (a board's edges need an oscilloscope)
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Seed of the simulated wearer
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// File for the edges (CSV); times count from the start of the trains
    #[arg(long)]
    csv: PathBuf,
    /// Replace an existing --csv file
    #[arg(long)]
    overwrite: bool,
}

/// # Errors
/// Fails if the session, the device or the file cannot be used.
pub fn main(args: &Edges, output: Output) -> anyhow::Result<()> {
    let mut session = SessionFile::load(&args.session)?;
    check_range("--seconds", args.seconds, 0.001, 3600.0)?;
    check_writable(&args.csv, args.overwrite, &[&args.session], None)?;
    output.settle_models(&mut session.session)?;
    let length_us = (args.seconds * 1e6).round() as u64;
    session.session.duration_us = length_us;
    let port = args.device.open(&session.session, args.seed)?;
    let bar = output.bar("stimulating");
    let (outcome, port) = run(&session, port, None, |part| bar.set(part));
    bar.finish();
    if let Some(error) = outcome.error {
        return Err(error.into());
    }
    let mut port = port.context("the device is gone")?;
    let Some(world) = port.world() else {
        bail!(
            "E514 the outputs of {} cannot be recorded; use --device native, chip or qemu",
            args.device
        );
    };
    let epoch = outcome.epoch_us.context("the session did not start")?;
    let edges = edges_between(&world.recorder.trace, epoch, epoch + length_us);
    let written = std::fs::File::create(&args.csv).and_then(|file| {
        let mut file = std::io::BufWriter::new(file);
        write_edges(&mut file, &edges)?;
        file.flush()
    });
    written.map_err(RecordError::write(&args.csv))?;
    output.print(
        || {
            format!(
                "{} edges of {:.3} s in {}",
                edges.len(),
                args.seconds,
                args.csv.display()
            )
        },
        || serde_json::json!({ "edges": edges.len(), "seconds": args.seconds, "csv": args.csv }),
    )?;
    Ok(())
}
