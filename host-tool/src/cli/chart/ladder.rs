//! `flexor chart ladder`: each rung of the muscle ladder per kind of scene.

use crate::cli::Output;
use clap::Args;

/// Measure the rungs of the muscle ladder per kind of scene
#[derive(Args, Debug)]
pub struct Ladder {}

/// Runs the command.
///
/// # Errors
/// Always: nothing is measured yet.
pub fn main(_: &Ladder, _: Output) -> anyhow::Result<()> {
    anyhow::bail!("not measured yet")
}
