//! `flexor chart`: the committed pictures and tables of docs/charts, made anew.

mod accuracy;
mod control;
mod ladder;
mod stability;

use super::Output;
use clap::Subcommand;

/// Make the charts of docs/charts anew.
#[derive(Subcommand, Debug)]
pub enum Chart {
    Accuracy(accuracy::Accuracy),
    Control(control::Control),
    Ladder(ladder::Ladder),
    Stability(stability::Stability),
}

/// Runs the command.
///
/// # Errors
/// Each chart's own.
pub fn main(chart: &Chart, output: Output) -> anyhow::Result<()> {
    match chart {
        Chart::Accuracy(args) => accuracy::main(args, output),
        Chart::Control(args) => control::main(args, output),
        Chart::Ladder(args) => ladder::main(args, output),
        Chart::Stability(args) => stability::main(args, output),
    }
}
