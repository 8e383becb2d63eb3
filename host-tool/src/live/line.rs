//! Formats the model as one line for pipes: text or JSON.

use super::model::Model;
use firmware::safety::{RemainingAllowance, State};
use host_core::record::Sample;
use serde_json::{Value, json as object};

pub(super) fn state_word(state: State) -> &'static str {
    match state {
        State::Boot => "connecting",
        State::Idle => "idle",
        State::Armed => "armed",
        State::Stimulating => "stimulating",
        State::Stopping => "stopping",
        State::Fault => "fault",
    }
}

/// Returns one line with the present values and the notes after the first `reported_notes`.
pub fn status_text(model: &Model, reported_notes: usize) -> String {
    let mut text = format!("{:>7.2} s  {:<11}", model.t_s, state_word(model.state));
    if let Some(Sample {
        target_deg,
        measured_deg,
        ..
    }) = current_angles(model)
    {
        for (name, angle) in [("target", target_deg), ("measured", measured_deg)] {
            text += &match angle {
                Some(angle) => format!("  {name} {angle:>5.1}°"),
                None => format!("  {name}     – "),
            };
        }
    }
    for (index, channel) in model.channels.iter().enumerate() {
        let value = model.amplitude(index);
        text += &format!("  {}: {value:.1} {}", channel.number, channel.unit);
        if let Some(force) = model.force_n(channel) {
            text += &format!(" {force:.1} N");
        }
    }
    if model.is_limiting() {
        text += "  limiting";
    }
    let count = &model.counters;
    text += &format!(
        "  frames {} lost {} bad {} refused {}",
        count.frames, count.lost_frames, count.bad_frames, count.refused
    );
    if let Some(left) = &model.left {
        text += &format!("  {}", allowance_text(left));
    }
    for note in new_notes(model, reported_notes) {
        text += &format!("  | {:.2} s {}", note.t_s, note.text);
    }
    text
}

/// Formats the remaining time, and the charge of the channel with the least charge left.
pub fn allowance_text(left: &RemainingAllowance) -> String {
    let (minutes, seconds) = (left.time_ms / 60_000, left.time_ms / 1_000 % 60);
    // The largest number also stands for more, which is no limit to anybody.
    let charge = (left.dose_uc < u32::MAX).then(|| {
        let (millicoulombs, number) = (f64::from(left.dose_uc) * 1e-3, left.channel + 1);
        format!(", {millicoulombs:.1} mC on {number}")
    });
    format!(
        "left {minutes}:{seconds:02} min{}",
        charge.unwrap_or_default()
    )
}

/// Returns the same values as [`status_text`] in JSON; unknown values are null.
pub fn status_json(model: &Model, reported_notes: usize) -> Value {
    let joint = current_angles(model);
    let channels = model.channels.iter().enumerate().map(|(index, channel)| {
        object!({
            "number": channel.number, "name": channel.name, "unit": channel.unit,
            "amplitude": model.amplitude(index), "limit": channel.limit,
            "force_n": model.force_n(channel),
        })
    });
    let notes = new_notes(model, reported_notes)
        .map(|note| object!({ "t_s": note.t_s, "text": note.text, "bad": note.is_bad }));
    let fault = model.fault.map(|record| {
        object!({ "number": record.fault.number(), "name": format!("{:?}", record.fault) })
    });
    let count = &model.counters;
    object!({
        "t_s": model.t_s, "state": state_word(model.state), "device": model.device,
        "kind": model.kind.map(|(kind, _)| format!("{kind:?}").to_lowercase()),
        "target_deg": joint.and_then(|s| s.target_deg),
        "measured_deg": joint.and_then(|s| s.measured_deg),
        "true_deg": joint.and_then(|s| s.true_deg), "effort": joint.and_then(|s| s.effort),
        "limiting": model.is_limiting(), "channels": channels.collect::<Vec<_>>(),
        "fault": fault, "events": notes.collect::<Vec<_>>(),
        "counters": {
            "frames": count.frames, "lost": count.lost_frames, "bad": count.bad_frames,
            "refused": count.refused, "setpoints": count.setpoints, "pulses": count.pulses,
            "dropped": count.dropped,
        },
        "left": model.left.map(|left| object!({
            "time_s": f64::from(left.time_ms) / 1e3, "channel": left.channel + 1,
            "dose_mc": f64::from(left.dose_uc) / 1e3,
        })),
    })
}

/// Returns the latest sample, if it has angles and the device is stimulating; `None` otherwise.
fn current_angles(model: &Model) -> Option<&Sample> {
    let is_known = model.has_joint && model.is_on();
    model.samples.back().filter(|_| is_known)
}

/// Returns the notes after the first `reported_notes` that are still kept.
fn new_notes(model: &Model, reported_notes: usize) -> impl Iterator<Item = &super::Note> {
    let count = model.noted.saturating_sub(reported_notes);
    model
        .notes
        .iter()
        .skip(model.notes.len().saturating_sub(count))
}
