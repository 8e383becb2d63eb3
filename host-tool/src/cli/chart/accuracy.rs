//! `flexor chart accuracy`: muscle integrators, error against cycles.

use crate::cli::Output;
use clap::Args;

/// Chart the muscle model's integrators: error against cycles
#[derive(Args, Debug)]
pub struct Accuracy {}

/// Runs the command.
///
/// # Errors
/// Always: nothing is measured yet.
pub fn main(_: &Accuracy, _: Output) -> anyhow::Result<()> {
    anyhow::bail!("not measured yet")
}
