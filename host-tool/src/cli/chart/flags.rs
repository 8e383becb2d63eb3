//! `flexor chart flags`: compares compiler flags of the device images.

use super::write;
use crate::cli::Output;
use clap::Args;
use host_core::run::SessionFile;
use serde_json::{Value, json};
use std::path::PathBuf;
use studies::figures::flags_picture;
use studies::flags::{DECLARED, Row, SECONDS, choose, compare, csv};

/// Compare compiler flags of the device images; builds each anew
#[derive(Args, Debug)]
pub struct FlagsChart {
    /// Root of the checkout that is built, and in which docs/charts/flags* are written again
    #[arg(long, default_value = ".")]
    workspace: PathBuf,
    /// Number of flags to compare, from the first on; writes no file
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=DECLARED.len() as i64))]
    first: Option<u8>,
}

/// # Errors
/// Fails if an image cannot be built or does not run, or a file cannot be written.
pub fn main(args: &FlagsChart, output: Output) -> anyhow::Result<()> {
    let mut file = SessionFile::load("full_load".as_ref())?;
    output.settle_models(&mut file.session)?;
    file.session.duration_us = (SECONDS * 1e6) as u64;
    let declared = args.first.map_or(&DECLARED[..], |n| {
        DECLARED.get(..usize::from(n)).unwrap_or(&DECLARED)
    });
    let bar = output.bar("flags");
    let rows = compare(declared, &args.workspace, &file, |part| bar.set(part));
    bar.finish();
    let rows = rows?;
    if args.first.is_none() {
        let charts = args.workspace.join("docs/charts");
        write(&charts.join("flags.csv"), &csv(&rows))?;
        write(&charts.join("flags.svg"), &flags_picture(&rows))?;
    }
    output.print(|| table(&rows), || json_report(&rows))
}

/// Formats the rows in at most 80 columns.
fn table(rows: &[Row]) -> String {
    let mut out = format!(
        "{:<12}{:>9}{:>8}{:>8}{:>8}{:>9}{:>7}{:>8}{:>8}\n{:<12}{:>9}{:>16}{:>8}{:>9}{:>7}{:>8}{:>8}",
        "level,",
        "flash,",
        "cycles",
        "not",
        "load,",
        "refill",
        "tick",
        "USB",
        "stack,",
        "inline",
        "bytes",
        "cached",
        "%",
        "margin",
        "waits",
        "waits",
        "bytes"
    );
    let chosen = choose(rows);
    for (n, row) in rows.iter().enumerate() {
        let [cached, not_cached] = row.cycles;
        let star = if chosen == Some(n) { " *" } else { "" };
        out.push_str(&format!(
            "\n{:<12}{:>9}{cached:>8.3}{not_cached:>8.3}",
            format!("{}{star}", row.flags.name()),
            row.flash
        ));
        out.push_str(&match &row.load {
            Some(load) => format!(
                "{:>8.2}{:>9}{:>7}{:>8}{:>8}",
                load.load_percent, load.margin, load.tick_latency, load.usb_latency, load.stack
            ),
            None => "  does not play: a fault".to_owned(),
        });
    }
    out.push_str(
        "\nCounted by the chip simulator under full load; the worse of both interpretations\n\
         of the flash prefetch. Cycles: geometric mean of the benchmark, relative to the\n\
         first row. * is chosen by the rule in docs/evidence/methods.md.",
    );
    out
}

fn json_report(rows: &[Row]) -> Value {
    let chosen = choose(rows);
    let all = rows.iter().enumerate().map(|(n, row)| {
        let load = row.load.as_ref();
        json!({
            "opt_level": row.flags.opt_level, "inline": row.flags.inline,
            "unroll": row.flags.unroll, "flash_bytes": row.flash, "cycles": row.cycles[0],
            "cycles_not_cached": row.cycles[1],
            "load_percent": load.map(|load| load.load_percent),
            "refill_margin_cycles": load.map(|load| load.margin),
            "tick_latency_cycles": load.map(|load| load.tick_latency),
            "usb_latency_cycles": load.map(|load| load.usb_latency),
            "stack_bytes": load.map(|load| load.stack),
            "boot_cycles": load.map(|load| load.boot), "chosen": chosen == Some(n),
        })
    });
    json!({ "simulated": true, "rows": all.collect::<Vec<_>>() })
}
