//! Times of a list, one after the other.

use super::super::fields::DAY_US;
use crate::fields::table::Table;

/// Reads the `at_s` of the next of a list, in µs.
pub(in super::super) fn read_time(
    item: &Table<'_>,
    before: Option<u64>,
    what: &str,
) -> Option<u64> {
    let at_us = item.whole::<u64>("at_s");
    match before {
        // Told: what comes next is held against what came before.
        Some(before) if at_us > DAY_US as u64 => return Some(before),
        None if at_us != 0 => item.out_of_range("at_s", "0 at first".into()),
        Some(before) if at_us <= before => {
            item.not_after("at_s", format!("the {what} at {} s", before as f64 / 1e6));
        }
        _ => return Some(at_us),
    }
    None
}
