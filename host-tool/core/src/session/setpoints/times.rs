//! Times of the entries of a list, which must rise.

use super::super::fields::DAY_US;
use crate::fields::table::Table;

/// Reads `at_s` of one entry of a list, in µs. `before` is the time of the previous entry, or
/// `None` for the first entry, whose time must be 0. `entry` is the word for an entry in error
/// messages.
pub(in super::super) fn read_time(
    item: &Table<'_>,
    before: Option<u64>,
    entry: &str,
) -> Option<u64> {
    let at_us = item.integer::<u64>("at_s");
    match before {
        // A time beyond a day was already reported, so the next entry is compared with the one
        // before.
        Some(before) if at_us > DAY_US as u64 => return Some(before),
        None if at_us != 0 => item.report_out_of_range("at_s", "0 for the first entry".into()),
        Some(before) if at_us <= before => {
            let after = format!("the {} s of the {entry} before it", before as f64 / 1e6);
            item.report_not_after("at_s", after);
        }
        _ => return Some(at_us),
    }
    None
}
