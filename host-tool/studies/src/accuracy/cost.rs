//! Cost of each setting on the chip.

use crate::bench::{BenchError, Row, rows_on_chip};
use firmware::bench::NoClock;
use hal_sim::images::Image;

/// Name prefix of the rows that measure the benchmark loop without a muscle. Its cycles are
/// subtracted from the rows that follow.
const EMPTY: &str = "empty@";
/// Name prefix of the rows that measure the shipped model with the smallest K and the shortest time
/// constants that the device accepts, where it needs the most steps.
const CORNER: &str = "corner:";
/// Name prefix of the rows that measure how long it takes to construct a muscle.
const MAKE: &str = "make:";

/// Name prefix of the rows of the shipped model.
const SHIPPED: &str = "shipped/";

/// Replaces each row that is not the shipped model's by its counterpart in `others` if that takes
/// fewer cycles and computes the same.
fn take_faster(rows: &mut [Row], others: Vec<Row>) {
    for (row, other) in rows.iter_mut().zip(others) {
        let is_shipped = row.name.trim_start_matches(MAKE).starts_with(SHIPPED);
        let is_same = row.name == other.name && row.checksum == other.checksum;
        if !is_shipped && is_same && other.mean < row.mean {
            *row = other;
        }
    }
}

/// Benchmark rows of the muscle models, in the order in which the image prints them.
#[derive(Clone, Debug)]
pub struct Cost {
    /// Cost of every setting without the loop around it: in `mean` that of a whole run, in `max`
    /// that of the most expensive reading with the pulses before it.
    pub runs: Vec<Row>,
    /// Cost of the shipped model with the parameters at which it is most expensive, one row for
    /// each reading interval.
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

    /// Runs the image `methods` on the chip simulator and measures its cycles: the shipped model
    /// with the device's flags of the compiler, every other method with those flags or with
    /// [optimisation level 3](Image::MethodsLevel3), whichever takes fewer cycles.
    pub fn on_chip() -> Result<Self, BenchError> {
        let mut cost = Self::new(rows_on_chip(Image::Methods)?);
        let other = Self::new(rows_on_chip(Image::MethodsLevel3)?);
        take_faster(&mut cost.runs, other.runs);
        take_faster(&mut cost.makes, other.makes);
        Ok(cost)
    }

    /// Runs the same code on this computer. The rows then contain checksums and no cycles.
    pub fn on_host() -> Self {
        let mut rows = vec![];
        methods::bench::run_methods(&NoClock, |row| rows.push(Row::from(row)));
        Self::new(rows)
    }
}
