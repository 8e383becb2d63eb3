//! `flexor selftest`: measures the device code on this computer.

use super::chip::Prefetched;
use super::keep_alives::{self, KeepAliveOptions};
use super::on_bench::{self, BenchOptions};
use super::{Output, interrupt, usage_error};
use crate::selftest::{
    Distribution, FullLoad, Latency, Path, Subject, full_load, latency, silence, soak,
};
use clap::Args;
use host_core::run::{DeviceName, chip_image};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Measure latency and full load of a simulator, or test a board
///
/// Host silence, the soak on a noisy link and full load need the native simulator. With --bench-test an
/// operator carries out the bench test of a board.
#[derive(Args, Debug)]
pub struct Selftest {
    /// Device: native, or chip for the flashed image over USB; with --bench-test a board's port
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// ELF to run instead of the board's own image (chip)
    #[arg(long)]
    image: Option<PathBuf>,
    /// Setpoints at random times for each latency measurement; default: 10000, on chip 2000
    #[arg(long)]
    arrivals: Option<u32>,
    /// Length of the simulated soak, s (native); default: 1200
    #[arg(long)]
    seconds: Option<u64>,
    /// Measure only the simulated full load, for this many minutes (native)
    #[arg(long)]
    full_load: Option<u64>,
    /// Seed of all random values
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Whether prefetched flash lines enter the cache (chip; default: cached)
    #[arg(long, value_enum)]
    prefetched: Option<Prefetched>,
    #[command(flatten)]
    keep_alive: KeepAliveOptions,
    #[command(flatten)]
    bench: BenchOptions,
}

/// Largest allowed latencies of a direct amplitude over USB, µs: from the device's ACK of the last
/// packet, and from the host's write.
const CHIP_BOUNDS_US: (u64, u64) = (700, 2_000);

/// # Errors
/// Fails if a measurement is impossible or a bound does not hold.
pub fn main(args: &Selftest, output: Output) -> anyhow::Result<()> {
    if args.bench.bench_test {
        return on_bench::main(&args.bench, &args.device, output);
    }
    interrupt::end_at_once()?;
    if let Some(seconds) = args.keep_alive.keep_alives {
        return keep_alives::main(&args.keep_alive, seconds, output);
    }
    match args.device {
        DeviceName::Native if args.prefetched.is_some() || args.image.is_some() => {
            usage_error("--image and --prefetched need --device chip")
        }
        DeviceName::Chip if args.seconds.is_some() => {
            usage_error("--seconds needs --device native")
        }
        DeviceName::Chip if args.full_load.is_some() => {
            usage_error("--full-load needs --device native")
        }
        DeviceName::Native => on_native(args, output),
        DeviceName::Chip => on_chip(args, output),
        _ => usage_error(format!(
            "--device is {}; allowed: native and chip",
            args.device
        )),
    }
}

/// Measures the latency over USB.
fn on_chip(args: &Selftest, output: Output) -> anyhow::Result<()> {
    let image = chip_image(args.image.as_deref())?;
    let arrivals = args.arrivals.unwrap_or(2_000);
    let chip = Subject::Chip(&image, args.prefetched.unwrap_or_default().into());
    let direct = latency(chip, Path::Direct, arrivals, args.seed)?;
    let control = latency(chip, Path::Control, arrivals.div_ceil(4), args.seed)?;
    output.print(
        || {
            let mut text = String::new();
            histogram(&mut text, "direct amplitude", &direct);
            histogram(&mut text, "through controller", &control);
            text.trim_end().to_owned()
        },
        || json!({ "device": "chip", "direct": latency_json(&direct), "control": latency_json(&control) }),
    )?;
    let (device_us, whole_us) = CHIP_BOUNDS_US;
    let holds = direct.unseen + control.unseen == 0
        && direct.worst_phase_us <= device_us
        && direct.whole.worst_us <= whole_us;
    anyhow::ensure!(
        holds,
        "E520 a measured value is outside its bound; see the numbers above"
    );
    Ok(())
}

/// Formats a latency in at most 80 columns.
fn histogram(out: &mut String, name: &str, found: &Latency) {
    /// Width of the longest bar, in columns.
    const BAR: u32 = 22;
    let (device, total) = (&found.device, &found.whole);
    out.push_str(&format!(
        "{name}, {} setpoints over USB: time to the earliest pulse slot, us\n",
        found.arrivals
    ));
    out.push_str(&format!(
        "  from the packet's ACK: {} to {}; at any phase at most {}; uncertainty {}\n",
        device.best_us, device.worst_us, found.worst_phase_us, found.blur_us
    ));
    out.push_str(&format!(
        "  from the host's write: {} to {}\n",
        total.best_us, total.worst_us
    ));
    out.push_str(&format!(
        "{:>12} {:>8} {:22} {:>8}\n",
        "us", "from ACK", "", "write"
    ));
    for step in 0..device.counts.len().max(total.counts.len()) {
        let bar = |times: &Distribution| {
            let count = times.counts.get(step).copied().unwrap_or(0);
            let most = times.counts.iter().max().copied().unwrap_or(0).max(1);
            let length = (count * BAR).div_ceil(most);
            (count, "#".repeat(length as usize))
        };
        let from = step as u64 * Distribution::STEP_US;
        let ((a, a_bar), (b, b_bar)) = (bar(device), bar(total));
        let row = format!(
            "{from:>5}..{:<5} {a:>8} {a_bar:22} {b:>8} {b_bar}",
            from + Distribution::STEP_US
        );
        out.push_str(&format!("{}\n", row.trim_end()));
    }
    out.push('\n');
}

fn latency_json(found: &Latency) -> Value {
    let distribution = |times: &Distribution| {
        json!({
            "best_us": times.best_us, "worst_us": times.worst_us,
            "step_us": Distribution::STEP_US, "counts": times.counts,
        })
    };
    json!({
        "arrivals": found.arrivals, "unseen": found.unseen, "blur_us": found.blur_us,
        "worst_phase_us": found.worst_phase_us,
        "device": distribution(&found.device), "whole": distribution(&found.whole),
    })
}

/// Runs ten channels with setpoints and telemetry at their highest rates.
fn run_full_load(minutes: u64, seed: u64, output: Output) -> anyhow::Result<FullLoad> {
    if !(1..=24 * 60).contains(&minutes) {
        return usage_error(format!(
            "--full-load is {minutes}; allowed: 1 to 1440 minutes"
        ));
    }
    let bar = output.bar("full load");
    let load = full_load(minutes * 60, seed, |part| bar.set(part))?;
    bar.finish();
    Ok(load)
}

/// Formats the results in at most 80 columns.
fn load_text(load: &FullLoad) -> String {
    format!(
        "full load for {} s, from 60 s before the clock wraps, 10 channels at 200 Hz:\n\
         \u{20} {} setpoints at 1 kHz, {} not acknowledged\n\
         \u{20} {} samples of telemetry at 1 kHz, {} gaps\n\
         \u{20} {} pulses, {} not 5 ms after the previous one, {} not requested\n\
         \u{20} {} over-currents injected; {} other faults, {} stops, {} frames lost or refused\n\
         \u{20} net charge, code*us:  {:?}\n\
         \u{20} in the fault records: {:?}",
        load.seconds,
        load.setpoints,
        load.unacknowledged,
        load.samples,
        load.sample_gaps,
        load.pulses,
        load.misplaced,
        load.unasked,
        load.truncations,
        load.faults,
        load.stops,
        load.counted,
        load.net,
        load.recorded,
    )
}

fn load_json(load: &FullLoad) -> Value {
    json!({
        "seconds": load.seconds, "setpoints": load.setpoints,
        "unacknowledged": load.unacknowledged, "samples": load.samples,
        "sample_gaps": load.sample_gaps, "pulses": load.pulses, "misplaced": load.misplaced,
        "unasked": load.unasked, "truncations": load.truncations, "faults": load.faults,
        "stops": load.stops, "counted": load.counted, "net_code_us": load.net,
        "recorded_code_us": load.recorded, "holds": load.holds(),
    })
}

fn on_native(args: &Selftest, output: Output) -> anyhow::Result<()> {
    if let Some(minutes) = args.full_load {
        let load = run_full_load(minutes, args.seed, output)?;
        output.print(
            || load_text(&load),
            || json!({ "full_load": load_json(&load) }),
        )?;
        anyhow::ensure!(
            load.holds(),
            "E520 a measured value is outside its bound; see the numbers above"
        );
        return Ok(());
    }
    let arrivals = args.arrivals.unwrap_or(10_000);
    let direct = latency(Subject::Native, Path::Direct, arrivals, args.seed)?;
    // With three channels a deadline occurs less often than with ten, so this takes four times the
    // arrivals.
    let control = latency(Subject::Native, Path::Control, 4 * arrivals, args.seed)?;
    let contradictions = [&direct, &control].map(|l| u64::from(l.unseen) + l.blur_us);
    let contradictions: u64 = contradictions.iter().sum();
    let bar = output.bar("host silence");
    let mut late = 0;
    let mut slack_us = i64::MAX;
    for timeout_ms in 20..=1000u16 {
        let found = silence(timeout_ms, 5 + timeout_ms % 96)?;
        let slack = found.allowed_us() as i64 - found.until_isolated_us.min(1 << 40) as i64;
        late += u32::from(slack < 0);
        slack_us = slack_us.min(slack);
        bar.set(f64::from(timeout_ms) / 1000.0);
    }
    bar.finish();
    let bar = output.bar("soak");
    let soak = soak(args.seconds.unwrap_or(1200), args.seed, |part| {
        bar.set(part)
    })?;
    bar.finish();
    let load = run_full_load(2, args.seed, output)?;
    output.print(
        || {
            format!(
                "us from the last byte to the earliest pulse slot, worst (best):\n\
                 \u{20} direct amplitude     {:>6} ({}), {} setpoints\n\
                 \u{20} through controller   {:>6} ({}), {} setpoints\n\
                 host silence, timeouts of 20-1000 ms: {late} late, smallest margin {slack_us} us\n\
                 soak for {} s, from 60 s before the clock wraps, 1 % lost, 1 % corrupted:\n\
                 \u{20} {} pulses, {} not requested by an accepted setpoint\n\
                 \u{20} {} frames sent = {} understood + {} counted lost: {}\n\
                 \u{20} the wire lost {} and corrupted {}; {} stops because of host silence\n{}",
                direct.worst_phase_us, direct.device.best_us, direct.arrivals, control.worst_phase_us, control.device.best_us, control.arrivals,
                soak.seconds, soak.pulses, soak.unasked,
                soak.sent, soak.understood, soak.counted_lost, soak.is_accounted(),
                soak.wire.lost, soak.wire.corrupted(), soak.stops, load_text(&load),
            )
        },
        || {
            json!({
                "arrivals": arrivals,
                "latency_direct_worst_us": direct.worst_phase_us, "latency_direct_best_us": direct.device.best_us,
                "latency_control_worst_us": control.worst_phase_us, "latency_control_best_us": control.device.best_us,
                "latency_contradictions": contradictions,
                "silence_late": late, "silence_least_slack_us": slack_us,
                "soak_seconds": soak.seconds, "soak_pulses": soak.pulses, "soak_unasked": soak.unasked,
                "soak_sent": soak.sent, "soak_understood": soak.understood, "soak_counted_lost": soak.counted_lost,
                "soak_wire_lost": soak.wire.lost, "soak_wire_corrupted": soak.wire.corrupted(),
                "soak_stops": soak.stops, "full_load": load_json(&load),
            })
        },
    )?;
    let holds = contradictions == 0 && late == 0 && soak.unasked == 0 && soak.is_accounted();
    let holds = holds && load.holds();
    anyhow::ensure!(
        holds,
        "E520 a measured value is outside its bound; see the numbers above"
    );
    Ok(())
}
