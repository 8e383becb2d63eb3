//! `flexor bench`: measures the cycles of each algorithm and compares its results between backends.

use super::{Output, interrupt};
use anyhow::{Context, ensure};
use clap::Args;
use hal_sim::chip::alone::FlashWait;
use hal_sim::chip::soc::flash::Prefetched;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use studies::bench::{self, CoreMark, OnChip, PUBLISHED, Row, Speed, coremark};
use studies::figures::cycles_picture;

/// Benchmark every algorithm on the chip simulator
#[derive(Args, Debug)]
pub struct Bench {
    /// Write the cycles as a table to this file
    #[arg(long)]
    csv: Option<PathBuf>,
    /// Write the cycles as a picture to this file
    #[arg(long)]
    svg: Option<PathBuf>,
}

/// # Errors
/// Fails if an image or a backend fails, or if two backends disagree on a result.
pub fn main(args: &Bench, output: Output) -> anyhow::Result<()> {
    interrupt::end_at_once()?;
    let bar = output.bar("bench");
    let found = bench::bench(|part| bar.set(part * 0.7));
    let yardstick = found.and_then(|found| Ok((found, coremark()?)));
    bar.finish();
    let (found, yardstick) = yardstick?;
    write(args.csv.as_deref(), || found.chip.csv())?;
    write(args.svg.as_deref(), || cycles_picture(&found.chip))?;
    let differing = found.differing_algorithms();
    output.print(
        || table(&found, &differing, &yardstick).trim_end().to_owned(),
        || json_report(&found, &differing, &yardstick),
    )?;
    ensure!(
        differing.is_empty(),
        "E521 these algorithms give different results on host, QEMU and chip: {}; please report \
         this",
        differing.join(", ")
    );
    Ok(())
}

fn write(path: Option<&Path>, contents: impl FnOnce() -> String) -> anyhow::Result<()> {
    let Some(path) = path else { return Ok(()) };
    std::fs::write(path, contents()).with_context(|| {
        format!(
            "E522 cannot write {}; check the path, the permissions and the free space",
            path.display()
        )
    })
}

/// Formats the results in at most 80 columns.
fn table(found: &bench::Bench, differing: &[String], yardstick: &CoreMark) -> String {
    let mut out = String::new();
    write_cycles(&mut out, &found.chip, differing);
    write_speeds(&mut out, found);
    write_coremark(&mut out, yardstick);
    out
}

fn write_cycles(out: &mut String, chip: &OnChip, differing: &[String]) {
    out.push_str(&format!(
        "{:28}{:>5}{:>14}{:>14}{:>13}\n",
        "", "", "cached", "not cached", "max, % of"
    ));
    out.push_str(&format!(
        "{:28}{:>5}{:>7}{:>7}{:>7}{:>7}{:>13} same\n",
        "algorithm", "calls", "mean", "max", "mean", "max", "its deadline"
    ));
    for (row, other) in chip.row_pairs() {
        let Row {
            name,
            calls,
            mean,
            max,
            ..
        } = row;
        let worse = if other.max > row.max { other } else { row };
        let load = match (worse.load_percent(), worse.deadline()) {
            (Some(load), Some(deadline)) => {
                format!("{load:.2} {}", format!("{deadline:?}").to_lowercase())
            }
            _ => "-".to_owned(),
        };
        let same = if differing.contains(name) {
            "NO"
        } else {
            "yes"
        };
        let (other_mean, other_max) = (other.mean, other.max);
        out.push_str(&format!(
            "{name:28}{calls:>5}{mean:>7}{max:>7}{other_mean:>7}{other_max:>7}{load:>13} {same}\n"
        ));
    }
    out.push_str(&format!(
        "Cycles on the chip simulator with 5 wait states, prefetch and caches on. Cached:\n\
         prefetched lines enter the instruction cache (the default); not cached: they do\n\
         not. Only a board can show which is right (docs/evidence/hil.md). The cycles of the\n\
         markers, {} and {}, are subtracted. A tick is 168,000 cycles (1 ms), a window\n\
         42,000 (250 us); the percentage uses the larger maximum. Same: the checksums on\n\
         host, QEMU and chip are equal.\n\n",
        chip.overhead, chip.overhead_not_cached
    ));
}

fn write_speeds(out: &mut String, found: &bench::Bench) {
    out.push_str("speed on this computer, same image: million instructions per second\n");
    let rows = [
        ("chip simulator, every cycle", found.chip.speed),
        ("QEMU, no cycles", found.qemu_speed),
        ("QEMU -icount shift=0, no cycles", found.qemu_icount_speed),
    ];
    for (name, speed) in rows {
        let seconds = speed.time.as_secs_f64();
        out.push_str(&format!(
            "  {name:<34}{:>8.1} in {seconds:>7.3} s\n",
            speed.mips()
        ));
    }
    let ratio = found.qemu_speed.mips() / found.chip.speed.mips().max(1e-9);
    out.push_str(&format!(
        "QEMU is {ratio:.1} times as fast as the chip simulator, not counting its start.\n\n"
    ));
}

fn write_coremark(out: &mut String, found: &CoreMark) {
    let [low, high] = PUBLISHED;
    out.push_str(&format!("CoreMark/MHz, {}\n", found.compiler));
    out.push_str(&format!(
        "  {:<52}{:>9}{:>14}\n",
        "", "prefetch", "without it"
    ));
    for reading in &found.readings {
        let (name, with) = (flash_wait_name(reading.wait), reading.per_mhz());
        let without = reading.per_mhz_without_prefetch();
        out.push_str(&format!("  {name:<52}{with:>9.3}{without:>14.3}\n"));
    }
    let published = "published (C; ST at 168 MHz, Arm for the core)";
    out.push_str(&format!(
        "  {published:<52}{:>9}\n",
        format!("{low:.2}-{high:.2}")
    ));
    let theirs = 1e6 / high;
    out.push_str(&format!(
        "The simulator is not fitted to the published number. The port to Rust executes\n\
         up to {} instructions per iteration, but {high:.2}/MHz means {theirs:.0} cycles per\n\
         iteration, and a cycle is at most one instruction. The port needs more\n\
         instructions because it walks lists by array index where C follows pointers,\n\
         checks the bounds of matrices, and has another compiler. Compare it with a board\n\
         that runs this same program, not with the published number.\n",
        found.instructions_per_iteration
    ));
}

/// Returns the name of an assumption about how long the core waits for the flash.
const fn flash_wait_name(wait: FlashWait) -> &'static str {
    match wait {
        FlashWait::States(Prefetched::Cached) => "5 wait states, prefetched lines cached",
        FlashWait::States(Prefetched::NotCached) => "5 wait states, prefetched lines not cached",
        FlashWait::Never => "no wait states",
    }
}

fn json_report(found: &bench::Bench, differing: &[String], yardstick: &CoreMark) -> Value {
    let chip = &found.chip;
    let algorithms: Vec<Value> = chip
        .row_pairs()
        .map(|(row, other)| {
            json!({
                "name": row.name, "calls": row.calls,
                "checksum": format!("{:08x}", row.checksum),
                "min_cycles": row.min, "mean_cycles": row.mean, "max_cycles": row.max,
                "prefetched_not_cached": {
                    "min_cycles": other.min, "mean_cycles": other.mean, "max_cycles": other.max,
                },
                "deadline_cycles": row.deadline().map(|d| d.cycles()),
                "same_results": !differing.contains(&row.name),
            })
        })
        .collect();
    let speed = |speed: Speed| json!({ "mips": speed.mips(), "seconds": speed.time.as_secs_f64() });
    let readings: Vec<Value> = yardstick
        .readings
        .iter()
        .map(|r| {
            json!({
                "flash": flash_wait_name(r.wait), "iterations": r.iterations,
                "per_mhz": r.per_mhz(), "cycles": r.cycles,
                "per_mhz_without_prefetch": r.per_mhz_without_prefetch(),
                "cycles_without_prefetch": r.cycles_without_prefetch,
            })
        })
        .collect();
    json!({
        "algorithms": algorithms,
        "marker_cycles_taken_off": chip.overhead,
        "marker_cycles_taken_off_prefetched_not_cached": chip.overhead_not_cached,
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
