//! Limit cycles that a device found in a joint's loop.

use crate::record::Trial;

/// What the event of a limit cycle begins with.
pub const LIMIT_CYCLE: &str = "limit cycle: ";

/// When, s, and what it said of each limit cycle that it found.
pub fn limit_cycles(trial: &Trial) -> impl Iterator<Item = (f64, &str)> {
    let all = trial.events.iter();
    all.filter_map(|(t_s, what)| Some((*t_s, what.strip_prefix(LIMIT_CYCLE)?)))
}
