//! `flexor chart`: makes the committed pictures and tables of docs/charts again.

mod accuracy;
mod choice;
mod control;
mod detail;
mod files;
mod flags;
mod hands;
mod ladder;
mod limb;
mod stability;

use super::Output;
use anyhow::Context;
use clap::Subcommand;
use std::path::Path;

/// Rewrite the charts in docs/charts
#[derive(Subcommand, Debug)]
pub enum Chart {
    Accuracy(accuracy::Accuracy),
    Control(control::Control),
    Flags(flags::FlagsChart),
    #[command(name = "limb-detail", alias = "hand-detail")]
    LimbDetail(detail::DetailChart),
    #[command(name = "model-selection")]
    Ladder(ladder::LevelChart),
    Limb(limb::Limb),
    Stability(stability::Stability),
}

pub fn main(chart: &Chart, output: Output) -> anyhow::Result<()> {
    match chart {
        Chart::Accuracy(args) => accuracy::main(args, output),
        Chart::Control(args) => control::main(args, output),
        Chart::Flags(args) => flags::main(args, output),
        Chart::LimbDetail(args) => detail::main(args, output),
        Chart::Ladder(args) => ladder::main(args, output),
        Chart::Limb(args) => limb::main(args, output),
        Chart::Stability(args) => stability::main(args, output),
    }
}

/// Writes a chart and names the file in the error.
fn write(path: &Path, contents: &str) -> anyhow::Result<()> {
    std::fs::write(path, contents).with_context(|| {
        format!(
            "E575 cannot write {}; check the path, the permissions and the free space",
            path.display()
        )
    })
}
