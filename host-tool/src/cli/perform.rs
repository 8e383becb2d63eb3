//! Runs, records and reports one session, for `flexor run` and `flexor rerun`.

use super::chip::ChipArgs;
use super::{Incomplete, Output, interrupt, watch};
use anyhow::Context;
use hal_sim::chip::gdb::AfterDebugger;
use hal_sim::input;
use host_core::analysis::{
    ForceMetrics, GapMetrics, WallContact, force_limiting_share, force_metrics, limit_cycles,
    metrics_without_lag, wall_contacts,
};
use host_core::link::{PacedPort, Port};
use host_core::record::{
    DeviceKind, Ending, Place, RecordError, Recorder, Run, sha256, write_header, write_run,
};
use host_core::report::force_remarks;
use host_core::run::{
    DeviceName, Dump, FullestPeriod, Keys, SessionFile, acknowledge, begin_trial, interruptible,
    replay_keys, run_with_outputs, wait_for_hello,
};
use host_core::session::{Session, escape_control_chars};
use std::path::{Path, PathBuf};

/// Default seed of a simulated wearer.
pub const SEED: u64 = 1;

/// Inputs of a run that its record does not contain.
pub struct Order<'a> {
    /// Session, under the control law that is used.
    pub session: &'a SessionFile,
    /// Device that runs the session.
    pub device: &'a DeviceName,
    /// Options of the chip simulator.
    pub chip: &'a ChipArgs,
    /// File for the output of a simulated device.
    pub vcd: Option<&'a Path>,
    /// Whether an existing record may be replaced.
    pub replaces: bool,
    /// Source of the key presses.
    pub controls: Controls,
}

/// Source of the key presses during a run.
pub enum Controls {
    /// Keys from a record; empty in a run without keys.
    Repeated(Keys),
    /// A person at the terminal.
    Watched,
}

/// Result of a run, complete or not.
pub struct RunResult {
    /// Record with its trial.
    pub record: Run,
    /// Folder of the record, still locked.
    pub place: Place,
    report: Option<PathBuf>,
    image: Option<PathBuf>,
    refused: usize,
    /// First error of the run.
    pub ended: anyhow::Result<()>,
}

/// Runs `order` and continues `record` with the results. `place` claims the folder for the record's
/// title.
///
/// # Errors
/// Fails before anything was stimulated: no device or no folder.
pub fn perform(
    order: &Order<'_>,
    mut record: Run,
    place: impl FnOnce(&str) -> Result<Place, RecordError>,
    output: Output,
) -> anyhow::Result<RunResult> {
    let session = order.session;
    for note in &session.session.notes {
        eprintln!("note: {}", escape_control_chars(note));
    }
    let seed = record.seed.unwrap_or(SEED); // a device behind a port has its own seed
    let mut port = order.chip.open(
        order.device,
        &session.session,
        seed,
        order.replaces,
        AfterDebugger::Nothing,
    )?;
    let image = port.image().map(Path::to_owned);
    // Read now, because the image may lie in the record that is about to be replaced.
    let mut own_image = None;
    if let Some(path) = &image {
        let bytes = input::read(path, input::LONGEST_DOCUMENT);
        let bytes = bytes.with_context(|| {
            format!(
                "E576 cannot read the firmware image {}; check the path and the permissions",
                path.display()
            )
        })?;
        record.image_sha256 = Some(sha256(&bytes));
        own_image = order.chip.image().map(|_| bytes);
    }
    if matches!(order.controls, Controls::Watched) && port.world().is_some() {
        port = Box::new(PacedPort::new(port)); // in real time for a person
    }
    if let Some(note) = trigger_warning(&session.session, &mut port) {
        eprintln!("note: {note}");
    }
    let interruption = interrupt::catch_signals()?;
    let is_planned = record.plan.as_ref().is_some_and(|plan| plan.acknowledge);
    if is_planned {
        port = acknowledge(port)?;
    } else if order.replaces && port.world().is_none() {
        // Waits for a board before an old record is replaced; simulators always answer.
        port = wait_for_hello(port, &interruption)?;
    }
    let place = place(&record.title)?;
    let dir = place.dir();
    write_run(dir, &record)?;
    if let Some(bytes) = own_image {
        let path = dir.join("image.elf");
        std::fs::write(&path, bytes).map_err(RecordError::write(&path))?;
    }
    let mut recorder = Recorder::create(dir, 0, &begin_trial(session))?;
    let fullest = FullestPeriod::new(&session.session, session.session.duration_us / 2);
    let dump = order.vcd.map(|path| Dump::new(path.to_owned()));
    let mut outputs = (fullest, dump);
    let (mut outcome, shown) = match &order.controls {
        Controls::Watched => {
            let device = order.device.to_string();
            let shown = (session, &*device);
            watch::play(shown, port, &mut recorder, &mut outputs, &interruption)
        }
        Controls::Repeated(keys) => {
            let bar = output.bar(&record.title);
            let seen = replay_keys(keys.clone(), |part| bar.set(part));
            let seen = interruptible(&interruption, seen);
            let (outcome, _) =
                run_with_outputs(session, port, Some(&mut recorder), seen, &mut outputs);
            bar.finish();
            (outcome, Ok(()))
        }
    };
    for remark in outcome
        .trial
        .identity
        .iter()
        .flat_map(|identity| &identity.option_bytes)
    {
        eprintln!("note: {}", escape_control_chars(remark));
    }
    let (fullest, dump) = outputs;
    outcome.trial.edges = fullest.into_edges();
    let vcd = dump.map_or(Ok(()), Dump::close);
    let closed = recorder
        .record_edges(&outcome.trial.edges)
        .and_then(|()| recorder.finish(&outcome.trial.counters, outcome.trial.duration_s));
    let ended = outcome.error.map_or(Ok(()), |error| Err(error.into()));
    let ended: anyhow::Result<()> = ended.and(shown).and(closed.map_err(Into::into));
    record.trials.push(outcome.trial);
    let lost = vcd.and(write_header(dir, &record));
    record.ending = match (&ended, &lost) {
        (Ok(()), Ok(())) => Ending::complete(),
        (Ok(()), Err(lost)) => Ending::complete_with_loss(lost.to_string()),
        (Err(error), _) => Ending::cut_short(format!("{error:#}"), super::exit_code(error)),
    };
    let (report, lost) = match interrupt::close_record(dir, &mut record) {
        Ok(path) => (Some(path), lost),
        Err(error) => (None, lost.and(Err(error))),
    };
    Ok(RunResult {
        record,
        place,
        report,
        image,
        refused: outcome.refused,
        // The first error is the one that is reported.
        ended: ended.and(lost.map_err(Into::into)),
    })
}

impl RunResult {
    /// Prints the result.
    ///
    /// # Errors
    /// Returns the first error of the run.
    pub fn print(self, output: Output) -> anyhow::Result<()> {
        // Both read all samples, so that only the form that is printed is computed.
        if self.ended.is_ok() {
            return output.print(|| self.to_text(), || self.to_json());
        }
        if !output.json {
            super::print_line(&self.to_text())?;
        }
        let result = self.to_json();
        let Err(error) = self.ended else {
            return Ok(());
        };
        super::print_record_place(self.place.dir());
        Err(Incomplete { error, result }.into())
    }

    /// Returns the result as JSON.
    pub fn to_json(&self) -> serde_json::Value {
        let trial = self.record.trials.last();
        let rmse = trial.and_then(metrics_without_lag).map(|m| m.rmse_deg);
        let silent = trial.and_then(|trial| trial.silent.clone());
        let pulses = trial.and_then(|trial| trial.pulses);
        serde_json::json!({
            "no_pulse_was_played": silent, "pulses": pulses, "image": self.image,
            "title": self.record.title, "device": self.record.device_in_words(),
            "seed": self.record.seed, "rmse_deg": rmse,
            "hits": trial.map(wall_contacts), "forces": trial.map(force_metrics),
            "limit_cycles": trial.map(|trial| limit_cycles(trial).count()),
            "force_limiting_share": trial.and_then(force_limiting_share),
            "refused": self.refused, "report": self.report, "record": self.place.dir(),
            "error": null,
        })
    }

    fn to_text(&self) -> String {
        let mut lines = Vec::new();
        if self.record.device_kind() == Some(DeviceKind::Breadboard) {
            lines.push(DeviceKind::Breadboard.words().to_owned());
        }
        let mut parts = Vec::new();
        for trial in &self.record.trials {
            let silence = trial.silent.iter();
            lines.extend(silence.map(|why| format!("no pulse was played: {why}")));
            if let Some(m) = metrics_without_lag(trial) {
                parts = vec![format!("RMSE {:.2}°", m.rmse_deg)];
            }
            let cycles = limit_cycles(trial);
            lines.extend(
                cycles
                    .map(|(t_s, description)| format!("limit cycle at {t_s:.1} s: {description}")),
            );
            lines.extend(wall_contacts(trial).iter().map(wall_contact_text));
            lines.extend(force_metrics(trial).iter().map(force_tracking_text));
            lines.extend(force_remarks(trial));
        }
        parts.extend((self.refused > 0).then(|| format!("requests refused: {}", self.refused)));
        let page = self.report.as_ref();
        parts.extend(page.map(|path| format!("report: {}", path.display())));
        lines.push(format!(
            "{}: {}",
            escape_control_chars(&self.record.title),
            parts.join("; ")
        ));
        lines.join("\n")
    }
}

/// Returns a note that simulated trigger edges have no effect on a board, which has a real input.
fn trigger_warning(session: &Session, port: &mut dyn Port) -> Option<&'static str> {
    let is_ignored = session.trigger.is_some() && port.world().is_none();
    is_ignored.then_some(
        "[simulated_trigger] has no effect on this device, which has a trigger input of its own",
    )
}

/// Describes for people how well a force followed its reference.
fn force_tracking_text(force: &ForceMetrics) -> String {
    let followed = format!(
        "channel {}: predicted force differs from the reference by {:.3} N (RMSE), {:.3} N at \
         most; the reference reached {:.1} N",
        force.channel, force.rmse_n, force.max_abs_n, force.peak_n,
    );
    followed + &force.gap.map(force_gap_text).unwrap_or_default()
}

/// Describes for people how often the reference asked for forces that the limits do not allow.
fn force_gap_text(gap: GapMetrics) -> String {
    format!(
        "; {:.0} % of the time the reference was between {} and {} N, which the limits do not \
         allow, and the nearer of the two was used (a lower `force.min_frequency_hz` narrows \
         this gap)",
        100.0 * gap.share,
        gap.below_n,
        gap.above_n,
    )
}

/// Describes a contact with a virtual wall for people.
fn wall_contact_text(hit: &WallContact) -> String {
    let place = if hit.deepest_deg > 0.0 {
        "inside the wall"
    } else {
        "in front of the wall"
    };
    format!(
        "hit at {:.1} s, {:.0} °/s: deepest {:.1}° {place}, {} reversals, later oscillation {:.1}°",
        hit.at_s,
        hit.speed_deg_per_s,
        hit.deepest_deg.abs(),
        hit.turns,
        hit.late_swing_deg,
    )
}
