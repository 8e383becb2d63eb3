//! Cost of each setting on the chip.

use crate::bench::{BenchError, Row, rows_on_chip};
use firmware::bench::NoClock;
use hal_sim::images::Image;

/// Prefix of the rows that measure the loop around a setting.
const EMPTY: &str = "empty@";
/// Prefix of the rows of the shipped model at the corner of its ranges.
const CORNER: &str = "corner:";
/// Prefix of the rows that measure the construction of a muscle.
const MAKE: &str = "make:";

/// Rows that the image printed, in its order.
#[derive(Clone, Debug)]
pub struct Cost {
    /// Cost of every setting without the loop around it: the mean of whole runs, and the maximum of
    /// one reading with the pulses before it.
    pub runs: Vec<Row>,
    /// Cost of the shipped model at the corner of its ranges, for each interval of reading.
    pub corners: Vec<Row>,
    /// Cost of constructing the muscles of [`methods::bench::MADE`].
    pub makes: Vec<Row>,
}

impl Cost {
    fn new(rows: Vec<Row>) -> Self {
        let (mut overhead, mut markers) = (0, 0);
        let mut cost = Self {
            runs: vec![],
            corners: vec![],
            makes: vec![],
        };
        for mut row in rows {
            if row.name.starts_with(EMPTY) {
                (overhead, markers) = (row.mean, row.min);
            } else if row.name.starts_with(MAKE) {
                cost.makes.push(row);
            } else {
                row.mean = row.mean.saturating_sub(overhead);
                row.max = row.max.saturating_sub(markers);
                match row.name.starts_with(CORNER) {
                    true => cost.corners.push(row),
                    false => cost.runs.push(row),
                }
            }
        }
        cost
    }

    /// Measures the cost on the chip simulator.
    pub fn on_chip() -> Result<Self, BenchError> {
        Ok(Self::new(rows_on_chip(Image::Methods)?))
    }

    /// Computes the results on this computer, without cycles.
    pub fn on_host() -> Self {
        let mut rows = vec![];
        methods::bench::run_methods(&NoClock, |row| rows.push(Row::from(row)));
        Self::new(rows)
    }
}
