//! `flexor run`: a session on any device, recorded and reported.

use super::chip::ChipArgs;
use super::{Incomplete, Output, interrupt};
use crate::analysis::{ForceMetrics, Hit, force_metrics, hits, metrics};
use crate::record::{Recorder, Run, write_run};
use crate::report::{self, Report};
use crate::run::{
    DeviceName, SessionFile, acknowledge, begin_trial, edges_of_one_period, heeding, run,
};
use crate::session::LawName;
use anyhow::Context;
use clap::Args;
use std::path::PathBuf;

/// Run a session on a device; record it and write a report.
#[derive(Args, Debug)]
pub struct RunArgs {
    /// Session file (TOML)
    session: PathBuf,
    /// native, chip, qemu, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Folder for the record and the report
    #[arg(long, default_value = "out/run")]
    out: PathBuf,
    /// Acknowledge a latched fault first, once its cause is found
    #[arg(long)]
    acknowledge: bool,
    /// Seed of a simulated wearer
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Another control law than the file's
    #[arg(long)]
    law: Option<LawName>,
    /// Also write what a simulated device put out, as VCD
    #[arg(long)]
    vcd: Option<PathBuf>,
    #[command(flatten)]
    chip: ChipArgs,
}

/// Runs the command.
///
/// # Errors
/// The session, the device or the record; what was recorded is kept.
pub fn main(args: &RunArgs, output: Output) -> anyhow::Result<()> {
    let mut session = SessionFile::load(&args.session)?;
    if let Some(law) = args.law {
        session.session = session.session.with_law(law)?;
    }
    for note in &session.session.notes {
        eprintln!("note: {note}");
    }
    let mut record = Run {
        title: session.session.title.clone(),
        device: args.device.to_string(),
        seed: args.seed,
        trials: Vec::new(),
        speed_factor: None,
    };
    let mut port = args.chip.open(&args.device, &session.session, args.seed)?;
    let interruption = interrupt::heed()?;
    if args.acknowledge {
        port = acknowledge(port)?;
    }
    write_run(&args.out, &record)?;
    let mut recorder = Recorder::create(&args.out, 0, &begin_trial(&session))?;
    let bar = output.bar(&session.session.title);
    let watch = heeding(&interruption, |part| bar.set(part));
    let (mut outcome, port) = run(&session, port, Some(&mut recorder), watch);
    bar.finish();
    if let (Some(mut port), Some(epoch)) = (port, outcome.epoch_us)
        && let Some(world) = port.world()
    {
        let after = session.session.duration_us / 2;
        outcome.trial.edges =
            edges_of_one_period(&session.session, &world.recorder.trace, epoch, after);
        recorder.edges(&outcome.trial.edges)?;
        if let Some(path) = &args.vcd {
            let file = std::fs::File::create(path)
                .with_context(|| format!("cannot write {}", path.display()))?;
            hal_sim::trace::write_vcd(std::io::BufWriter::new(file), &world.recorder.trace)?;
        }
    }
    recorder.finish(&outcome.trial.counters, outcome.trial.duration_s)?;
    let metrics = metrics(&outcome.trial);
    let hits = hits(&outcome.trial);
    let forces = force_metrics(&outcome.trial);
    let refused = outcome.refused;
    record.trials.push(outcome.trial);
    let command = format!("flexor run {} --seed {}", args.session.display(), args.seed);
    let report = Report {
        run: &record,
        paper: &[],
        assumptions: &[],
        command: &command,
    };
    let report = report::write(&args.out, &report)
        .with_context(|| format!("cannot write to {}", args.out.display()))?;
    let rmse = metrics.as_ref().map(|m| m.rmse_deg);
    let result = serde_json::json!({
        "title": record.title, "device": record.device, "seed": args.seed,
        "rmse_deg": rmse, "hits": hits, "forces": forces, "refused": refused, "report": report,
        "error": null,
    });
    let people = || {
        let tracked = rmse.map(|r| format!("RMSE {r:.2}° "));
        let mut lines: Vec<String> = hits.iter().map(in_words).collect();
        lines.extend(forces.iter().map(followed));
        lines.push(format!(
            "{}: {}{refused} refused; report: {}",
            record.title,
            tracked.unwrap_or_default(),
            report.display()
        ));
        lines.join("\n")
    };
    let Some(error) = outcome.error else {
        output.say(people, || result)?;
        return Ok(());
    };
    if !output.json {
        super::print_line(&people())?;
    }
    let error = error.into();
    Err(Incomplete { error, result }.into())
}

/// How a force was followed, for people.
fn followed(force: &ForceMetrics) -> String {
    format!(
        "channel {}: predicted force within {:.3} N (RMSE) of the wanted, {:.3} N at most; it \
         asked for up to {:.1} N",
        force.channel, force.rmse_n, force.max_abs_n, force.peak_n,
    )
}

/// A hit of a virtual wall, for people.
fn in_words(hit: &Hit) -> String {
    let place = if hit.deepest_deg > 0.0 {
        "inside the wall"
    } else {
        "in front of the wall"
    };
    format!(
        "hit at {:.1} s, {:.0} °/s: deepest {:.1}° {place}, {} turns, later swinging by {:.1}°",
        hit.at_s,
        hit.speed_deg_per_s,
        hit.deepest_deg.abs(),
        hit.turns,
        hit.late_swing_deg,
    )
}
