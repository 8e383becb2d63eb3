//! `flexor bench`: cycles of each algorithm, and who agrees on its results.

use super::{Output, interrupt};
use crate::bench::{self, CoreMark, OnChip, PUBLISHED, Row, Speed, coremark};
use anyhow::{Context, ensure};
use clap::Args;
use hal_sim::chip::alone::Wait;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Measure every algorithm on the chip simulator; compare host, QEMU and chip.
#[derive(Args, Debug)]
pub struct Bench {
    /// Write the cycles as a table here
    #[arg(long)]
    csv: Option<PathBuf>,
    /// Write the cycles as a picture here
    #[arg(long)]
    svg: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// Images or machines fail, or two machines disagree on a result.
pub fn main(args: &Bench, output: Output) -> anyhow::Result<()> {
    interrupt::end_at_once()?;
    let bar = output.bar("bench");
    let found = bench::bench(|part| bar.set(part * 0.7));
    let yardstick = found.and_then(|found| Ok((found, coremark()?)));
    bar.finish();
    let (found, yardstick) = yardstick?;
    write(args.csv.as_deref(), || found.chip.csv())?;
    write(args.svg.as_deref(), || found.chip.svg())?;
    let differing = found.differing();
    output.say(
        || table(&found, &differing, &yardstick).trim_end().to_owned(),
        || machine(&found, &differing, &yardstick),
    )?;
    ensure!(
        differing.is_empty(),
        "E521 results differ between host, QEMU and chip: {}",
        differing.join(", ")
    );
    Ok(())
}

fn write(path: Option<&Path>, contents: impl FnOnce() -> String) -> anyhow::Result<()> {
    let Some(path) = path else { return Ok(()) };
    std::fs::write(path, contents()).with_context(|| format!("E522 {}", path.display()))
}

/// At most 80 columns.
fn table(found: &bench::Bench, differing: &[String], yardstick: &CoreMark) -> String {
    let mut out = String::new();
    // Writing to a `String` cannot fail.
    let _ = write_cycles(&mut out, &found.chip, differing)
        .and_then(|()| write_speeds(&mut out, found))
        .and_then(|()| write_coremark(&mut out, yardstick));
    out
}

fn write_cycles(out: &mut String, chip: &OnChip, differing: &[String]) -> std::fmt::Result {
    writeln!(
        out,
        "{:<30}{:>6}{:>9}{:>9}{:>13}  results",
        "algorithm", "calls", "mean", "max", "max of"
    )?;
    for row in &chip.rows {
        let Row {
            name,
            calls,
            mean,
            max,
            ..
        } = row;
        let load = match (row.load_percent(), row.deadline()) {
            (Some(load), Some(deadline)) => {
                format!("{load:.2} % {}", format!("{deadline:?}").to_lowercase())
            }
            _ => "-".to_owned(),
        };
        let same = if differing.contains(name) {
            "DIFFER"
        } else {
            "same"
        };
        writeln!(
            out,
            "{name:<30}{calls:>6}{mean:>9}{max:>9}{load:>16}  {same}"
        )?;
    }
    writeln!(
        out,
        "Cycles: chip simulator, 5 wait states, prefetch and caches on; the {} of the\n\
         markers are taken off; uncalibrated until docs/hil.md is done. A tick is\n\
         168,000 cycles (1 ms), a window 42,000 (250 us). Results: checksums on host,\n\
         QEMU and chip.\n",
        chip.overhead
    )
}

fn write_speeds(out: &mut String, found: &bench::Bench) -> std::fmt::Result {
    writeln!(
        out,
        "speed on this computer, same image: million instructions per second"
    )?;
    let rows = [
        ("chip simulator, every cycle", found.chip.speed),
        ("QEMU, no cycles", found.qemu_speed),
        ("QEMU -icount shift=0, no cycles", found.qemu_icount_speed),
    ];
    for (name, speed) in rows {
        let seconds = speed.time.as_secs_f64();
        writeln!(out, "  {name:<34}{:>8.1} in {seconds:>7.3} s", speed.mips())?;
    }
    let ratio = found.qemu_speed.mips() / found.chip.speed.mips().max(1e-9);
    writeln!(
        out,
        "QEMU is {ratio:.1} times as fast, not counting its start.\n"
    )
}

fn write_coremark(out: &mut String, found: &CoreMark) -> std::fmt::Result {
    let [low, high] = PUBLISHED;
    writeln!(out, "CoreMark/MHz, {}", found.compiler)?;
    for reading in &found.readings {
        let name = name(reading.wait);
        writeln!(out, "  {name:<52}{:>7.3}", reading.per_mhz())?;
    }
    let published = "published (C; ST at 168 MHz, Arm for the core)";
    writeln!(out, "  {published:<52}{low:>7.2}-{high:.2}")?;
    let theirs = 1e6 / high;
    writeln!(
        out,
        "Nothing is fitted to it. The port to Rust executes up to {} instructions per\n\
         iteration, where {high:.2}/MHz leaves {theirs:.0} cycles and a cycle is at most one\n\
         instruction: lists are walked by index into an array where C follows pointers,\n\
         matrices are bounds-checked, and the compiler is another. Compare it with a\n\
         board that runs this very program, not with the published number.",
        found.instructions_per_iteration
    )
}

/// What was assumed of the flash.
const fn name(wait: Wait) -> &'static str {
    match wait {
        Wait::ByTheLetter => "5 wait states, prefetched lines not cached (RM0090)",
        Wait::CopyingPrefetched => "5 wait states, prefetched lines cached",
        Wait::Never => "no wait states",
    }
}

fn machine(found: &bench::Bench, differing: &[String], yardstick: &CoreMark) -> Value {
    let chip = &found.chip;
    let algorithms: Vec<Value> = chip
        .rows
        .iter()
        .map(|row| {
            json!({
                "name": row.name, "calls": row.calls,
                "checksum": format!("{:08x}", row.checksum),
                "min_cycles": row.min, "mean_cycles": row.mean, "max_cycles": row.max,
                "deadline_cycles": row.deadline().map(|d| d.cycles()),
                "same_results": !differing.contains(&row.name),
            })
        })
        .collect();
    let speed = |speed: Speed| json!({ "mips": speed.mips(), "seconds": speed.time.as_secs_f64() });
    let readings: Vec<Value> = yardstick
        .readings
        .iter()
        .map(|r| json!({ "flash": name(r.wait), "per_mhz": r.per_mhz(), "cycles": r.cycles, "iterations": r.iterations }))
        .collect();
    json!({
        "algorithms": algorithms,
        "marker_cycles_taken_off": chip.overhead,
        "cycles": chip.cycles,
        "instructions": chip.speed.instructions,
        "differing": differing,
        "speed": {
            "chip": speed(chip.speed),
            "qemu": speed(found.qemu_speed),
            "qemu_icount": speed(found.qemu_icount_speed),
        },
        "coremark": {
            "compiler": yardstick.compiler,
            "readings": readings,
            "published_per_mhz": PUBLISHED,
            "most_instructions_per_iteration": yardstick.instructions_per_iteration,
        },
    })
}
