//! `flexor chart control`: control laws on random plants, error against cycles.

use crate::cli::Output;
use clap::Args;

/// Chart the control laws on random wearers: error against cycles
#[derive(Args, Debug)]
pub struct Control {}

/// Runs the command.
///
/// # Errors
/// Always: nothing is measured yet.
pub fn main(_: &Control, _: Output) -> anyhow::Result<()> {
    anyhow::bail!("not measured yet")
}
