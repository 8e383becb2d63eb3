//! `flexor profile`: measures the cost of a session in the flashed image, cycle by cycle.

use super::chip::Prefetched;
use super::{Output, check_range, interrupt};
use clap::Args;
use hal_sim::chip::board::CYCLES_PER_US;
use hal_sim::chip::profile::{Owner, exception};
use host_core::clock::ProcessorClock;
use host_core::run::{Profiled, SessionFile, chip_image, interruptible, profile};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Profile the flashed image: cycles, latencies, margins, stack
///
/// Runs a session on the chip simulator.
#[derive(Args, Debug)]
pub struct ProfileArgs {
    /// Session file (TOML)
    session: PathBuf,
    /// Duration of the stimulation, s; default: the session's own duration
    #[arg(long)]
    seconds: Option<f64>,
    /// ELF to run instead of the board's own image
    #[arg(long)]
    image: Option<PathBuf>,
    /// Number of functions to list; JSON has all of them
    #[arg(long, default_value_t = 25)]
    functions: usize,
    /// Seed of the simulated wearer
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Whether prefetched flash lines enter the cache (docs/how/chip.md)
    #[arg(long, value_enum, default_value_t)]
    prefetched: Prefetched,
}

/// # Errors
/// Fails if the session or the image is unusable, or the run ends early.
pub fn main(args: &ProfileArgs, output: Output) -> anyhow::Result<()> {
    let mut file = SessionFile::load(&args.session)?;
    if let Some(seconds) = args.seconds {
        check_range("--seconds", seconds, 0.05, 3600.0)?;
    }
    output.settle_models(&mut file.session)?;
    if let Some(seconds) = args.seconds {
        file.session.duration_us = (seconds * 1e6).round() as u64;
    }
    let image = chip_image(args.image.as_deref())?;
    let bar = output.bar(&file.session.title);
    let interruption = interrupt::catch_signals()?;
    let watch = interruptible(&interruption, |part| bar.set(part));
    let clock = ProcessorClock::start();
    let prefetched = args.prefetched.into();
    let profiled = profile(&file, &image, prefetched, args.seed, &clock, watch);
    bar.finish();
    let profiled = profiled?;
    let title = &file.session.title;
    output.print(
        || table(title, &profiled, args),
        || json_report(title, &profiled, args.prefetched),
    )?;
    Ok(())
}

/// Formats the results in at most 80 columns.
fn table(title: &str, found: &Profiled, args: &ProfileArgs) -> String {
    let out = &mut String::new();
    let summary = &found.summary;
    out.push_str(&format!(
        "{title}: {:.3} s of device time\n",
        found.seconds()
    ));
    let reading = args.prefetched;
    out.push_str(&format!(
        "prefetched flash lines: {reading} (docs/how/chip.md)\n"
    ));
    out.push_str(&format!(
        "booted: clock and tape after {} cycles, port open at {:.1} ms\n",
        found.booted.clock,
        found.booted.port_us as f64 * 1e-3
    ));
    out.push_str(&format!(
        "simulation speed (processor time): {:.1} million instructions/s, {:.1} x real time\n\n",
        found.mips(),
        found.real_time_factor()
    ));
    write_owners(out, found);
    write_lines(out, found);
    let stack = summary.stack;
    out.push_str(&format!(
        "stack: {} bytes at the deepest ({:#010x}..{:#010x})",
        stack.used(),
        stack.lowest,
        stack.top
    ));
    match stack.free() {
        Some(free) => out.push_str(&format!(", {free} free above its guard\n")),
        None => out.push_str(", no guard set\n"),
    }
    if let Some(worst) = summary.margins.worst {
        out.push_str(&format!(
            "refill margin: {worst} cycles ({:.1} µs) in the worst of {} windows\n",
            worst as f64 / CYCLES_PER_US as f64,
            summary.margins.windows
        ));
    }
    write_edges(out, found);
    write_functions(out, found, args.functions);
    out.trim_end().to_owned()
}

fn write_owners(out: &mut String, found: &Profiled) {
    out.push_str(&format!(
        "{:<12} {:>14} {:>14} {:>8}\n",
        "owner", "cycles", "instructions", "load"
    ));
    for owner in Owner::ALL {
        let cost = found.profile.owner(owner);
        if cost.cycles > 0 {
            let (name, part) = (owner.name(), found.percent(cost.cycles));
            let (cycles, instructions) = (cost.cycles, cost.instructions);
            out.push_str(&format!(
                "{name:<12} {cycles:>14} {instructions:>14} {part:>6.2} %\n"
            ));
        }
    }
    let summary = &found.summary;
    let (busy, load) = (summary.total - summary.idle, summary.load_percent());
    out.push_str(&format!(
        "{:<12} {busy:>14} {:>14} {load:>6.2} %\n",
        "all", summary.instructions
    ));
    let (idle, rest) = (summary.idle, found.percent(summary.idle));
    out.push_str(&format!(
        "{:<12} {idle:>14} {:>14} {rest:>6.2} %\n\n",
        "idle", ""
    ));
}

fn write_lines(out: &mut String, found: &Profiled) {
    out.push_str(&format!(
        "{:<10} {:>9} {:>13}   {:>13}  waited for\n",
        "interrupt", "runs", "longest run", "worst latency"
    ));
    for line in &found.summary.lines {
        out.push_str(&format!(
            "{:<10} {:>9} {:>13}   {:>13}  {}\n",
            exception::name(line.number),
            line.count,
            line.longest,
            line.latency.worst,
            exception::name(line.latency.behind)
        ));
    }
    out.push_str(&format!(
        "(cycles of 1/{CYCLES_PER_US} µs; a run does not include code that pre-empts it)\n\n"
    ));
}

fn write_edges(out: &mut String, found: &Profiled) {
    let summary = &found.summary;
    out.push_str(&format!(
        "deviation of pin edges from their computed cycle, spread {} cycles:\n",
        summary.edge_span()
    ));
    out.push_str(&format!(
        "{:>8} {:>12} {:>12}\n",
        "late", "port B", "port C"
    ));
    for phase in &summary.phases {
        out.push_str(&format!(
            "{:>8} {:>12} {:>12}\n",
            phase.late, phase.b, phase.c
        ));
    }
}

fn write_functions(out: &mut String, found: &Profiled, most: usize) {
    out.push_str(&format!("\n{:>13} {:>8}  function\n", "cycles", "load"));
    for (name, cost) in found.profile.functions().iter().take(most) {
        let part = found.percent(cost.cycles);
        out.push_str(&format!(
            "{:>13} {part:>6.2} %  {}\n",
            cost.cycles,
            last_chars(name, 55)
        ));
    }
}

/// Returns the last `most` characters, the most specific part of a path.
fn last_chars(name: &str, most: usize) -> String {
    let count = name.chars().count();
    if count <= most {
        return name.to_owned();
    }
    let end: String = name.chars().skip(count + 1 - most).collect();
    format!("…{end}")
}

fn json_report(title: &str, found: &Profiled, prefetched: Prefetched) -> Value {
    let summary = &found.summary;
    let owners: serde_json::Map<_, _> = Owner::ALL
        .iter()
        .map(|&owner| (owner.name().to_owned(), found.owner_percent(owner).into()))
        .collect();
    let lines = summary.lines.iter().map(|line| {
        json!({
            "name": exception::name(line.number), "number": line.number, "runs": line.count,
            "longest_run_cycles": line.longest, "worst_latency_cycles": line.latency.worst,
            "behind": exception::name(line.latency.behind),
        })
    });
    let phases = summary.phases.iter();
    let phases = phases.map(|p| json!({ "late_cycles": p.late, "port_b": p.b, "port_c": p.c }));
    let functions = found.profile.functions();
    let functions = functions.iter().map(|(name, cost)| {
        json!({ "name": name, "cycles": cost.cycles, "instructions": cost.instructions })
    });
    json!({
        "title": title, "prefetched_lines": prefetched.to_string(),
        "seconds": found.seconds(), "cycles": summary.total,
        "idle_cycles": summary.idle, "instructions": summary.instructions,
        "load_percent": summary.load_percent(), "owners_percent": owners,
        "interrupts": lines.collect::<Vec<_>>(),
        "interrupt_latency_cycles": summary.worst_latency(),
        "stack_bytes": summary.stack.used(), "stack_free_bytes": summary.stack.free(),
        "refill_margin_cycles": summary.margins.worst,
        "refill_windows": summary.margins.windows,
        "edge_span_cycles": summary.edge_span(),
        "edge_phases": phases.collect::<Vec<_>>(),
        "boot": {
            "clock_cycles": found.booted.clock, "port_us": found.booted.port_us,
            "instructions": found.booted.instructions,
        },
        "million_instructions_per_s": found.mips(),
        "times_real_time": found.real_time_factor(),
        "functions": functions.collect::<Vec<_>>(),
    })
}
