//! `flexor chart accuracy --error PCT --readings-hz HZ`: the cheapest method for an error, from the
//! committed chart.

use crate::cli::{Output, check_range};
use anyhow::Context;
use serde_json::json;
use studies::accuracy::table::{self, ChartRow};

/// The chart's table. It is compiled in, so that the program answers without a checkout.
const TABLE: &str = include_str!("../../../../docs/charts/accuracy.csv");
/// Readings per second that the chart measured.
const MEASURED_HZ: [f64; 2] = [1000.0, 50.0];
/// Core clock cycles per second.
const CORE_HZ: f64 = 168e6;
/// Number of methods that are listed.
const LISTED: usize = 5;

/// Returns method, arithmetic and step as the chart names them.
fn name(row: &ChartRow) -> String {
    let step = match row.step_us {
        Some(us) => format!("{us}us"),
        None => "pulses".to_owned(),
    };
    let reading = match row.reading.as_str() {
        "cubic" => "/planned",
        "demand" => "/demand",
        _ => "",
    };
    format!("{}/{}/{step}{reading}", row.method, row.arithmetic)
}

/// Prints the cheapest methods with an error of at most `error_pct`, % of peak, whose force is read
/// `readings_hz` times per second.
///
/// # Errors
/// Refuses an error or a rate out of range; E572: no method is that exact.
pub fn main(error_pct: f64, readings_hz: f64, output: Output) -> anyhow::Result<()> {
    check_range("--error", error_pct, 1e-9, 100.0)?;
    check_range("--readings-hz", readings_hz, 1.0, 1000.0)?;
    // The measured rate whose ratio to the wanted one is smaller.
    let is_fast = readings_hz * readings_hz > MEASURED_HZ[0] * MEASURED_HZ[1];
    let measured_hz = MEASURED_HZ[usize::from(!is_fast)];
    let output_us = (1e6 / measured_hz) as u32;
    let mut rows = table::rows(TABLE).context("docs/charts/accuracy.csv, which is compiled in")?;
    rows.retain(|row| row.output_us == output_us);
    let least = rows.iter().map(|row| row.error_pct);
    let least = least.fold(f64::INFINITY, f64::min);
    rows.retain(|row| row.error_pct <= error_pct);
    rows.sort_by_key(|row| row.cycles_per_s);
    rows.truncate(LISTED);
    let Some(best) = rows.first() else {
        anyhow::bail!(
            "E572 no method has an error of at most {error_pct} % at {measured_hz} readings per \
             second; the smallest is {least} %: ask for that or more"
        )
    };
    output.print(
        || {
            let mut out = format!(
                "{:<38}{:>9}{:>14}{:>8}{:>11}\n",
                "cheapest first", "error, %", "cycles per s", "core, %", "worst tick"
            );
            for row in &rows {
                out.push_str(&format!(
                    "{:<38}{:>9}{:>14}{:>8.3}{:>11}\n",
                    name(row),
                    row.error_pct,
                    row.cycles_per_s,
                    100.0 * row.cycles_per_s as f64 / CORE_HZ,
                    row.worst_tick_cycles
                ));
            }
            out.push_str(&format!(
                "Use {} ({}).\nWorst of 140 trains, one muscle, read {measured_hz} times per \
                 second; cycles counted by\nthe chip simulator (docs/evidence/methods.md).",
                name(best),
                best.kind
            ));
            out
        },
        || {
            let all = rows.iter().map(|row| {
                json!({
                    "method": row.method, "arithmetic": row.arithmetic, "step_us": row.step_us,
                    "reading": row.reading, "kind": row.kind, "error_pct": row.error_pct,
                    "cycles_per_s": row.cycles_per_s, "worst_tick_cycles": row.worst_tick_cycles,
                })
            });
            json!({ "simulated": true, "measured_hz": measured_hz,
                    "methods": all.collect::<Vec<_>>() })
        },
    )
}
