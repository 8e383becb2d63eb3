//! `flexor chart stability`: where each method fails, and where theory says so.

use crate::cli::Output;
use clap::Args;

/// Map where each method fails, beside where theory says so
#[derive(Args, Debug)]
pub struct Stability {}

/// Runs the command.
///
/// # Errors
/// Always: nothing is measured yet.
pub fn main(_: &Stability, _: Output) -> anyhow::Result<()> {
    anyhow::bail!("not measured yet")
}
