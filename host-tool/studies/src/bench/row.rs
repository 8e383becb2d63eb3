//! Result of one algorithm, and the table of all results.

use hal_sim::chip::board::CYCLES_PER_US;
use std::str::FromStr;

/// Cycles of one refill window, 250 µs.
const WINDOW: u64 = 250 * CYCLES_PER_US;
/// Cycles of one control tick, 1 ms.
const TICK: u64 = 1_000 * CYCLES_PER_US;

/// Result and cost of one benchmarked algorithm. Cycles are core clock cycles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Name of the algorithm in `firmware::bench`, such as `render_…` or `joint_…`.
    pub name: String,
    /// Number of measured calls, each with different inputs.
    pub calls: u32,
    /// Checksum of the results of all calls; it must be the same on every backend.
    pub checksum: u32,
    /// Cycles of the fastest call.
    pub min: u64,
    /// Mean cycles of a call, rounded.
    pub mean: u64,
    /// Cycles of the slowest call.
    pub max: u64,
}

/// Time by which an algorithm must finish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deadline {
    /// Before the next refill window of 250 µs begins.
    Window,
    /// Before the next control tick, 1 ms later.
    Tick,
}

impl Deadline {
    /// Returns the deadline in cycles of the board's clock.
    pub const fn cycles(self) -> u64 {
        match self {
            Self::Window => WINDOW,
            Self::Tick => TICK,
        }
    }
}

impl Row {
    /// Returns the deadline of the interrupt that calls the algorithm. Returns `None` for work that
    /// the thread does for each frame of the link, which has no deadline.
    pub fn deadline(&self) -> Option<Deadline> {
        let is = |beginnings: &[&str]| beginnings.iter().any(|b| self.name.starts_with(b));
        if is(&["render_", "paint_", "owner_refill"]) {
            Some(Deadline::Window)
        } else if is(&[
            "calcium_",
            "recruitment_",
            "joint_",
            "differentiator",
            "owner_control",
        ]) {
            Some(Deadline::Tick)
        } else {
            None
        }
    }

    /// Returns the cycles of the slowest call in percent of the deadline; `None` without a
    /// deadline.
    pub fn load_percent(&self) -> Option<f64> {
        let deadline = self.deadline()?;
        Some(self.max as f64 * 100.0 / deadline.cycles() as f64)
    }

    pub(crate) const fn subtract_overhead(&mut self, cycles: u64) {
        self.min = self.min.saturating_sub(cycles);
        self.mean = self.mean.saturating_sub(cycles);
        self.max = self.max.saturating_sub(cycles);
    }
}

impl<N: ToString> From<&firmware::bench::Row<N>> for Row {
    fn from(row: &firmware::bench::Row<N>) -> Self {
        Self {
            name: row.name.to_string(),
            calls: row.runs,
            checksum: row.checksum,
            min: row.min.into(),
            mean: row.mean(),
            max: row.max.into(),
        }
    }
}

/// Error for a line that is not a row; it contains the line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "E573 a benchmark image printed a line that is not a result: {0}; build the image and flexor from the same source"
)]
pub struct RowError(String);

impl RowError {
    pub(super) fn new(text: &str) -> Self {
        Self(text.trim().to_owned())
    }
}

impl FromStr for Row {
    type Err = RowError;

    fn from_str(line: &str) -> Result<Self, RowError> {
        let parts: Vec<&str> = line.split(' ').collect();
        let row = || {
            let [name, calls, checksum, min, mean, max] = parts[..] else {
                return None;
            };
            Some(Self {
                name: name.to_owned(),
                calls: calls.parse().ok()?,
                checksum: u32::from_str_radix(checksum, 16).ok()?,
                min: min.parse().ok()?,
                mean: mean.parse().ok()?,
                max: max.parse().ok()?,
            })
        };
        row().ok_or_else(|| RowError(line.to_owned()))
    }
}

/// Parses all lines that the image printed, except the heading.
pub(super) fn parse(console: &str) -> Result<Vec<Row>, RowError> {
    console.lines().skip(1).map(str::parse).collect()
}

/// Formats `rows` as CSV with a heading and checksums in hexadecimal. Each row also has its cycles
/// in `not_cached`, measured without caching prefetched flash lines.
pub fn csv(rows: &[Row], not_cached: &[Row]) -> String {
    let mut text = "algorithm,calls,checksum,min_cycles,mean_cycles,max_cycles,\
                    min_cycles_prefetched_not_cached,mean_cycles_prefetched_not_cached,\
                    max_cycles_prefetched_not_cached\n"
        .to_owned();
    for (row, other) in rows.iter().zip(not_cached) {
        let Row {
            name,
            calls,
            checksum,
            min,
            mean,
            max,
        } = row;
        text.push_str(&format!(
            "{name},{calls},{checksum:08x},{min},{mean},{max},{},{},{}\n",
            other.min, other.mean, other.max
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_and_written_again() {
        let console = "name runs checksum min mean max\nowner_refill 800 2107ebdc 737 2206 5390\n";
        let mut rows = parse(console).unwrap();
        assert_eq!(rows.len(), 1);
        rows[0].subtract_overhead(23);
        let mut other = rows.clone();
        other[0].subtract_overhead(14);
        let table = csv(&rows, &other);
        assert!(table.ends_with("\nowner_refill,800,2107ebdc,714,2183,5367,700,2169,5353\n"));
        assert_eq!(rows[0].deadline(), Some(Deadline::Window));
        let load = rows[0].load_percent().unwrap();
        assert!((load - 5367.0 / 420.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_no_row_is_shown() {
        for line in ["", "a 1 2 3 4", "a 1 2 3 4 5 6", "a x 2 3 4 5", "panicked"] {
            assert_eq!(line.parse::<Row>(), Err(RowError(line.to_owned())));
        }
    }
}
