//! `flexor run`: a session on any device, recorded and reported.

use super::chip::ChipArgs;
use super::out::OutArgs;
use super::{Incomplete, Output, interrupt};
use crate::analysis::{ForceMetrics, GapMetrics, Hit, force_metrics, hits, metrics};
use crate::link::Port;
use crate::record::{Ending, Recorder, Run, write_run};
use crate::report::{self, Report};
use crate::run::{
    DeviceName, SessionFile, acknowledge, begin_trial, edges_of_one_period, heeding, run,
};
use crate::session::{LawName, Session};
use anyhow::Context;
use clap::Args;
use hal_sim::trace::Trace;
use std::path::{Path, PathBuf};

/// Run a session on a device; record it and write a report.
#[derive(Args, Debug)]
pub struct RunArgs {
    /// Session file (TOML)
    session: PathBuf,
    /// native, chip, qemu, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    #[command(flatten)]
    out: OutArgs,
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
        ..Run::default()
    };
    let mut port = args.chip.open(&args.device, &session.session, args.seed)?;
    let image = port.image().map(std::path::Path::to_owned);
    if let Some(note) = ignored_trigger(&session.session, &mut port) {
        eprintln!("note: {note}");
    }
    let interruption = interrupt::heed()?;
    if args.acknowledge {
        port = acknowledge(port)?;
    }
    let place = args.out.place(&record.title)?;
    let dir = place.dir();
    write_run(dir, &record)?;
    let mut recorder = Recorder::create(dir, 0, &begin_trial(&session))?;
    let bar = output.bar(&session.session.title);
    let watch = heeding(&interruption, |part| bar.set(part));
    let (mut outcome, port) = run(&session, port, Some(&mut recorder), watch);
    bar.finish();
    let mut vcd = Ok(());
    if let (Some(mut port), Some(epoch)) = (port, outcome.epoch_us)
        && let Some(world) = port.world()
    {
        let after = session.session.duration_us / 2;
        outcome.trial.edges =
            edges_of_one_period(&session.session, &world.recorder.trace, epoch, after);
        if let Some(path) = &args.vcd {
            vcd = write_vcd(path, &world.recorder.trace);
        }
    }
    let closed = recorder
        .edges(&outcome.trial.edges)
        .and_then(|()| recorder.finish(&outcome.trial.counters, outcome.trial.duration_s));
    let ended = outcome.error.map_or(Ok(()), |error| Err(error.into()));
    let ended: anyhow::Result<()> = ended.and(closed.map_err(Into::into)).and(vcd);
    let metrics = metrics(&outcome.trial);
    let hits = hits(&outcome.trial);
    let forces = force_metrics(&outcome.trial);
    let refused = outcome.refused;
    let (pulses, silent) = (outcome.trial.pulses, outcome.trial.silent.clone());
    record.trials.push(outcome.trial);
    record.ending = match &ended {
        Ok(()) => Ending::complete(),
        Err(error) => Ending::cut_short(format!("{error:#}"), super::exit_code(error)),
    };
    let command = format!("flexor run {} --seed {}", args.session.display(), args.seed);
    let report = Report {
        run: &record,
        paper: &[],
        assumptions: &[],
        command: &command,
    };
    let report = report::write(dir, &report);
    let (report, lost) = match report {
        Ok(path) => (Some(path), Ok(())),
        Err(error) => (None, Err(error.into())),
    };
    // The first that went wrong is the one to tell.
    let ended = ended.and(lost);
    let rmse = metrics.as_ref().map(|m| m.rmse_deg);
    let result = serde_json::json!({
        "no_pulse_was_played": silent, "pulses": pulses, "image": image,
        "title": record.title, "device": record.device_in_words(), "seed": args.seed,
        "rmse_deg": rmse, "hits": hits, "forces": forces, "refused": refused, "report": report,
        "record": dir, "error": null,
    });
    let people = || {
        let tracked = rmse.map(|r| format!("RMSE {r:.2}° "));
        let silence = silent
            .iter()
            .map(|why| format!("no pulse was played: {why}"));
        let mut lines: Vec<String> = silence.chain(hits.iter().map(in_words)).collect();
        lines.extend(forces.iter().map(followed));
        lines.push(format!(
            "{}: {}{refused} refused{}",
            record.title,
            tracked.unwrap_or_default(),
            report.map_or_else(String::new, |path| format!("; report: {}", path.display()))
        ));
        lines.join("\n")
    };
    let Err(error) = ended else {
        output.say(people, || result)?;
        return Ok(());
    };
    if !output.json {
        super::print_line(&people())?;
    }
    super::lies_in(dir);
    Err(Incomplete { error, result }.into())
}

/// A board has a real trigger input: what is said of simulated edges then.
fn ignored_trigger(session: &Session, port: &mut dyn Port) -> Option<&'static str> {
    let is_ignored = session.trigger.is_some() && port.world().is_none();
    is_ignored.then_some(
        "[simulated_trigger] is for devices simulated by this program: this one's own trigger \
         input counts",
    )
}

fn write_vcd(path: &Path, trace: &Trace) -> anyhow::Result<()> {
    std::fs::File::create(path)
        .and_then(|file| hal_sim::trace::write_vcd(std::io::BufWriter::new(file), trace))
        .with_context(|| format!("cannot write {}", path.display()))
}

/// How a force was followed, for people.
fn followed(force: &ForceMetrics) -> String {
    let followed = format!(
        "channel {}: predicted force within {:.3} N (RMSE) of the wanted, {:.3} N at most; it \
         asked for up to {:.1} N",
        force.channel, force.rmse_n, force.max_abs_n, force.peak_n,
    );
    followed + &force.gap.map(limited).unwrap_or_default()
}

/// Where forces were wanted that cannot be given, for people.
fn limited(gap: GapMetrics) -> String {
    format!(
        "; limiting {:.0} % of the time: it wanted forces between {} and {} N, which its limits \
         cannot give, and got the nearer of the two (a lower `force.min_frequency_hz` narrows this)",
        100.0 * gap.share,
        gap.below_n,
        gap.above_n,
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
