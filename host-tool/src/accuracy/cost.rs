//! What each setting costs on the chip.

use crate::bench::{BenchError, Row, rows_on_chip};
use firmware::bench::NoClock;
use hal_sim::images::Image;

/// The rows of the loop around a setting begin so.
const EMPTY: &str = "empty@";

/// Every setting's row from the chip simulator, in the image's order, the loop
/// around the setting taken off.
///
/// # Errors
/// [`BenchError`].
pub fn on_chip() -> Result<Vec<Row>, BenchError> {
    let mut overhead = 0;
    let mut rows = vec![];
    for mut row in rows_on_chip(Image::Methods)? {
        if row.name.starts_with(EMPTY) {
            overhead = row.mean;
        } else {
            row.take_off(overhead);
            rows.push(row);
        }
    }
    Ok(rows)
}

/// The same rows from this computer: results without cycles.
#[must_use]
pub fn on_host() -> Vec<Row> {
    let mut rows = vec![];
    firmware::bench::run_methods(&NoClock, |row| rows.push(Row::from(row)));
    rows.retain(|row: &Row| !row.name.starts_with(EMPTY));
    rows
}
