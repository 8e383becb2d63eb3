//! Rows of the committed table docs/charts/accuracy.csv, for readers that measure nothing.

use serde::Deserialize;

/// One setting at one interval of reading. docs/evidence/methods.md describes the columns.
#[derive(Clone, Debug, Deserialize)]
pub struct ChartRow {
    /// Name of the method, such as `hermite_simpson`.
    pub method: String,
    /// Name of the arithmetic, such as `q7_24`.
    pub arithmetic: String,
    /// Length of a step, µs; `None` from pulse to pulse.
    pub step_us: Option<u32>,
    /// Interval of reading, µs.
    pub output_us: u32,
    /// Worst error, % of peak; infinite beyond all numbers.
    pub error_pct: f64,
    /// Core clock cycles per simulated second and muscle.
    pub cycles_per_s: u64,
    /// `tuned` or `generic`.
    pub kind: String,
    /// `cubic` if readings come from the cubic of a step, `steps` if a step ends at each, `demand` if
    /// steps go from event to event.
    pub reading: String,
    /// 1 if the setting is on the front of its interval of reading.
    pub front: u8,
    /// Core clock cycles of the most expensive reading.
    pub worst_tick_cycles: u64,
}

/// Parses the table.
///
/// # Errors
/// Fails if a row lacks a column or has another type.
pub fn rows(table: &str) -> Result<Vec<ChartRow>, csv::Error> {
    csv::Reader::from_reader(table.as_bytes())
        .deserialize()
        .collect()
}
