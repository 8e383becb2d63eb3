//! `flexor selftest`: what the device code shows on this machine, in numbers.

use super::Output;
use crate::selftest::{Path, latency, silence, soak};
use clap::Args;

/// Measure latency, host silence and a noisy soak on the native simulator.
#[derive(Args, Debug)]
pub struct Selftest {
    /// Random arrivals per latency measurement
    #[arg(long, default_value_t = 10_000)]
    arrivals: u32,
    /// Length of the simulated soak, minutes
    #[arg(long, default_value_t = 20)]
    minutes: u64,
    /// Seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Runs the command.
///
/// # Errors
/// A measurement that could not be made, or a bound that does not hold.
pub fn main(args: &Selftest, output: Output) -> anyhow::Result<()> {
    let direct = latency(Path::Direct, args.arrivals, args.seed)?;
    // Three channels show a deadline less often than ten: four times the arrivals.
    let control = latency(Path::Control, 4 * args.arrivals, args.seed)?;
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
    let soak = soak(args.minutes * 60, args.seed, |part| bar.set(part))?;
    bar.finish();
    output.say(
        || {
            format!(
                "last byte -> earliest slot, worst (best), us:\n\
                 \u{20} direct amplitude     {:>6} ({}), {} arrivals\n\
                 \u{20} through control law  {:>6} ({}), {} arrivals\n\
                 host silence, every timeout 20-1000 ms: {late} late, least slack {slack_us} us\n\
                 soak of {} s from 60 s before the clock wraps, 1 % lost, 1 % corrupted:\n\
                 \u{20} {} pulses, {} that no accepted setpoint asked for\n\
                 \u{20} {} frames sent = {} understood + {} counted lost: {}\n\
                 \u{20} wire lost {} and corrupted {}; {} stops for silence",
                direct.worst_us, direct.best_us, direct.arrivals, control.worst_us, control.best_us, control.arrivals,
                soak.seconds, soak.pulses, soak.unasked,
                soak.sent, soak.understood, soak.counted_lost, soak.is_accounted(),
                soak.wire.lost, soak.wire.corrupted(), soak.stops,
            )
        },
        || {
            serde_json::json!({
                "arrivals": args.arrivals,
                "latency_direct_worst_us": direct.worst_us, "latency_direct_best_us": direct.best_us,
                "latency_control_worst_us": control.worst_us, "latency_control_best_us": control.best_us,
                "latency_contradictions": direct.contradictions + control.contradictions,
                "silence_late": late, "silence_least_slack_us": slack_us,
                "soak_seconds": soak.seconds, "soak_pulses": soak.pulses, "soak_unasked": soak.unasked,
                "soak_sent": soak.sent, "soak_understood": soak.understood, "soak_counted_lost": soak.counted_lost,
                "soak_wire_lost": soak.wire.lost, "soak_wire_corrupted": soak.wire.corrupted(),
                "soak_stops": soak.stops,
            })
        },
    );
    let holds = direct.contradictions + control.contradictions == 0
        && late == 0
        && soak.unasked == 0
        && soak.is_accounted();
    anyhow::ensure!(holds, "E520 a bound does not hold; see the numbers above");
    Ok(())
}
