//! `flexor chart ladder`: each rung of the muscle ladder per kind of scene.

use crate::cli::Output;
use crate::ladder::{self, table};
use anyhow::Context;
use clap::Args;
use std::path::{Path, PathBuf};

/// Measure the rungs of the muscle ladder per kind of scene
#[derive(Args, Debug)]
pub struct Ladder {
    /// Where the workspace is whose docs/charts/ladder.* and firmware table are
    /// written anew
    #[arg(long, default_value = ".")]
    workspace: PathBuf,
    /// Only write picture and firmware table anew from docs/charts/ladder.csv
    #[arg(long)]
    no_measuring: bool,
}

/// The firmware's table, from the workspace.
const FIRMWARE: &str = "firmware/src/muscle/choice/measured.rs";

/// Runs the command.
///
/// # Errors
/// Files that cannot be read or written.
pub fn main(args: &Ladder, output: Output) -> anyhow::Result<()> {
    let place = |file: &str| args.workspace.join(file);
    let table_file = place("docs/charts/ladder.csv");
    let rows = if args.no_measuring {
        table::parse(&read(&table_file)?)?
    } else {
        let bar = output.bar("ladder");
        let measured = ladder::measure(|part| bar.set(part));
        bar.finish();
        let rows = measured?;
        write(&table_file, &table::csv(&rows)?)?;
        rows
    };
    let cycles = read(&place("docs/charts/cycles.csv"))?;
    write(&place(FIRMWARE), &table::firmware_source(&rows, &cycles)?)?;
    output.say(
        || format!("{} measurements in {}", rows.len(), table_file.display()),
        || serde_json::json!({ "rows": rows.len(), "csv": table_file }),
    );
    Ok(())
}

fn read(path: &Path) -> anyhow::Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("E552 {}", path.display()))
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| format!("E552 {}", path.display()))
}
