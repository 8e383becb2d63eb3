//! `flexor selftest --keep-alives`: measures whether this computer is fast enough to calibrate.

use super::{Output, usage_error};
use crate::selftest::{KeepAlives, keep_alives};
use clap::Args;
use host_core::calibration::HOST_TIMEOUT_MS;
use host_core::link::Lateness;
use serde_json::{Value, json};
use std::time::Duration;

/// Options for timing keep-alives.
#[derive(Args, Debug)]
pub struct KeepAliveOptions {
    /// Only time the keep-alives of a calibration on this computer, for this many seconds
    #[arg(long, value_name = "SECONDS")]
    pub keep_alives: Option<u32>,
    /// With --keep-alives: number of endless computing loops that run at the same time
    #[arg(long, requires = "keep_alives", default_value_t = 0)]
    busy: u32,
}

/// # Errors
/// Fails if the length is out of range or the system gives no thread.
pub fn main(options: &KeepAliveOptions, seconds: u32, output: Output) -> anyhow::Result<()> {
    if !(1..=86_400).contains(&seconds) || options.busy > 1_000 {
        return usage_error(format!(
            "--keep-alives is {seconds} with --busy {}; allowed: 1 to 86400 s, 0 to 1000 loops",
            options.busy
        ));
    }
    let timeout = Duration::from_millis(HOST_TIMEOUT_MS.into());
    let (period, length) = (timeout / 4, Duration::from_secs(seconds.into()));
    let bar = output.bar("keep-alives");
    let found = keep_alives(period, length, options.busy, |part| bar.set(part))?;
    bar.finish();
    let busy = options.busy;
    output.print(
        || text_report(&found, (period, timeout), busy),
        || {
            json!({
                "seconds": seconds, "busy": busy, "period_ms": period.as_secs_f64() * 1e3,
                "host_timeout_ms": HOST_TIMEOUT_MS,
                "keep_alives": lateness_json(&found.keep_alives), "looks": lateness_json(&found.looks),
                "in_time": is_in_time(&found, timeout - period),
            })
        },
    )
}

/// Returns the median, the 99.9 % quantile and the maximum of a lateness, ms.
fn quantiles_ms(lateness: &Lateness) -> [f64; 3] {
    let ms = |share| f64::from(lateness.quantile_us(share).unwrap_or(0)) * 1e-3;
    [ms(0.5), ms(0.999), ms(1.0)]
}

/// Returns whether every keep-alive came less than `spare` too late. After that time the device
/// would have ended stimulation.
fn is_in_time(found: &KeepAlives, spare: Duration) -> bool {
    let worst = found.keep_alives.quantile_us(1.0).unwrap_or(0);
    Duration::from_micros(worst.into()) < spare
}

/// Formats the report in at most 80 columns.
fn text_report(found: &KeepAlives, (period, timeout): (Duration, Duration), busy: u32) -> String {
    let row = |name: &str, lateness: &Lateness| {
        let [median, most, worst] = quantiles_ms(lateness);
        let count = lateness.count();
        format!("{name:<30} {count:>8} {median:>9.3} {most:>9.3} {worst:>9.3}\n")
    };
    let (period_ms, timeout_ms) = (period.as_millis(), timeout.as_millis());
    let verdict = match is_in_time(found, timeout - period) {
        true => "no keep-alive was too late",
        false => "some keep-alives were too late: the device would have stopped stimulating",
    };
    format!(
        "lateness, ms, while {busy} busy loops run:\n\
         {:<30} {:>8} {:>9} {:>9} {:>9}\n{}{}\
         during a calibration the device waits {timeout_ms} ms for a message;\n{verdict}",
        "",
        "count",
        "p50",
        "p99.9",
        "worst",
        row(
            &format!("keep-alives every {period_ms} ms"),
            &found.keep_alives
        ),
        row("loop that wakes every 5 ms", &found.looks),
    )
}

fn lateness_json(lateness: &Lateness) -> Value {
    let [p50, p999, worst] = quantiles_ms(lateness);
    json!({
        "count": lateness.count(), "p50_ms": p50, "p99_9_ms": p999, "worst_ms": worst,
    })
}
