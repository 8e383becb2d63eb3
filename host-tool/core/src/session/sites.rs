//! Positions of the electrodes of a simulated wearer: channels that the file names, whether or not
//! the session uses them.

use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Reads the channels in the fields `names`, counted from 0, where the electrodes of a simulated
/// wearer are. The session need not use these channels. Reports a channel that two of the fields
/// name.
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
