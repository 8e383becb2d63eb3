//! `flexor explain-model`: which muscle model each channel gets.

use super::Output;
use anyhow::ensure;
use clap::Args;
use host_core::choice::cycles;
use host_core::session::{Channel, Muscle, Session, rung_name, visible};
use serde_json::json;
use std::path::PathBuf;

/// Tell which muscle model each channel of a session gets.
#[derive(Args, Debug)]
pub struct ExplainModel {
    /// Session file (TOML)
    session: PathBuf,
}

/// # Errors
/// The session; one without a muscle (E554).
pub fn main(args: &ExplainModel, output: Output) -> anyhow::Result<()> {
    let session = Session::load(&args.session)?;
    let all: Vec<(&Channel, &Muscle)> = session
        .channels
        .iter()
        .filter_map(|channel| Some((channel, channel.muscle.as_ref()?)))
        .collect();
    ensure!(
        !all.is_empty(),
        "E554 {}: no channel has a `muscle`, so no force is predicted; docs/sessions.md says how to give it one",
        args.session.display()
    );
    output.say(
        || {
            let lines = all.iter().map(|(channel, muscle)| {
                let rung = muscle.rung();
                let cost = cycles(rung).map_or(String::new(), |c| {
                    format!(
                        ", {} cycles a tick, {} with a pulse",
                        c.tick, c.tick_with_pulse
                    )
                });
                let name = visible(&channel.name);
                format!(
                    "channel {}, {name}: {}{cost}",
                    channel.number,
                    rung_name(rung)
                )
            });
            lines.collect::<Vec<_>>().join("\n")
        },
        || {
            let channels: Vec<_> = all
                .iter()
                .map(|(channel, muscle)| {
                    let cost = cycles(muscle.rung());
                    json!({
                        "channel": channel.number, "name": channel.name,
                        "model": rung_name(muscle.rung()),
                        "cycles": cost.map(|c| json!({ "tick": c.tick, "tick_with_pulse": c.tick_with_pulse })),
                    })
                })
                .collect();
            json!({ "channels": channels })
        },
    )
}
