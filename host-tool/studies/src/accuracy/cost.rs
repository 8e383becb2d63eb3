//! What each setting costs on the chip.

use crate::bench::{BenchError, Row, rows_on_chip};
use firmware::bench::NoClock;
use hal_sim::images::Image;

/// The rows of the loop around a setting begin so.
const EMPTY: &str = "empty@";
/// The rows of the product's own at the corner of its ranges begin so.
const CORNER: &str = "corner:";
/// The rows of making a muscle begin so.
const MAKE: &str = "make:";

/// What the image printed: rows in its order.
#[derive(Clone, Debug)]
pub struct Cost {
    /// Every setting's, without the loop around it: the mean of whole runs, the most of
    /// one reading and the pulses before it.
    pub runs: Vec<Row>,
    /// The same of the product's own at the corner of its ranges, for each interval.
    pub corners: Vec<Row>,
    /// Of making the muscles of [`methods::bench::MADE`].
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

    /// From the chip simulator.
    pub fn on_chip() -> Result<Self, BenchError> {
        Ok(Self::new(rows_on_chip(Image::Methods)?))
    }

    /// From this computer: results without cycles.
    pub fn on_host() -> Self {
        let mut rows = vec![];
        methods::bench::run_methods(&NoClock, |row| rows.push(Row::from(row)));
        Self::new(rows)
    }
}
