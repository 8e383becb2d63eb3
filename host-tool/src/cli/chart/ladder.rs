//! `flexor chart ladder`: what each rung of the muscle ladder costs.

use crate::cli::Output;
use clap::Args;
use firmware::muscle::Rung;
use host_core::choice::cycles;
use host_core::session::rung_name;
use serde_json::json;

/// Tell what each rung of the muscle ladder costs
#[derive(Args, Debug)]
pub struct Ladder {}

/// # Errors
/// The output.
pub fn main(_: &Ladder, output: Output) -> anyhow::Result<()> {
    let rungs = Rung::ALL.map(|rung| (rung_name(rung), cycles(rung)));
    output.say(
        || {
            let rows = rungs.map(|(name, cost)| {
                let cost = cost.map_or("-".into(), |c| format!("{}/{}", c.tick, c.tick_with_pulse));
                format!("{name:<22}{cost:>12}")
            });
            format!(
                "most cycles of a tick without and with a pulse\n{}",
                rows.join("\n")
            )
        },
        || {
            let each = rungs.map(|(name, cost)| {
                json!({ "model": name, "tick": cost.map(|c| c.tick),
                        "tick_with_pulse": cost.map(|c| c.tick_with_pulse) })
            });
            json!({ "models": each })
        },
    )
}
