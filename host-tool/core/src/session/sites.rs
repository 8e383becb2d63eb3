//! Positions of the electrodes of a simulated wearer: channels that the file names, whether or not
//! the session uses them.

use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Reads the channels, from 0, that the fields `names` give, whether or not the session uses them.
/// Reports a channel that two fields name.
pub(super) fn read_sites<const N: usize>(t: &Table<'_>, names: [&str; N]) -> Option<[usize; N]> {
    let numbers = names.map(|name| t.integer::<u8>(name));
    for (place, (name, &channel)) in names.iter().zip(&numbers).enumerate() {
        if numbers.iter().take(place).any(|taken| *taken == channel) {
            t.report(name, Problem::ChannelTwice { channel });
            return None;
        }
    }
    Some(numbers.map(|number| usize::from(number) - 1)) // 1–10
}
