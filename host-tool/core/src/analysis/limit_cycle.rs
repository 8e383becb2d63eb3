//! Limit cycles that a device found in a joint's control loop.

use crate::record::Trial;

/// Text with which the device's event about a limit cycle begins in a record.
pub const LIMIT_CYCLE: &str = "limit cycle: ";

/// Returns the limit cycles because of which the device lowered its feedback: the time of each, s,
/// and its text. A limit cycle that leads to the same feedback as the one before it is not counted
/// again.
pub fn limit_cycles(trial: &Trial) -> impl Iterator<Item = (f64, &str)> {
    let mut latest = None;
    trial.events.iter().filter_map(move |(t_s, event)| {
        let description = event.strip_prefix(LIMIT_CYCLE)?;
        let feedback = description.rsplit("; ").next();
        let is_new = std::mem::replace(&mut latest, feedback) != feedback;
        is_new.then_some((*t_s, description))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::describe_event;
    use firmware::link::Event;

    #[test]
    fn only_a_change_of_the_feedback_counts() {
        let found = [(610, 700), (600, 700), (590, 490), (580, 490), (1200, 700)];
        let cycle = |(swing_centideg, gain_milli)| Event::LimitCycle {
            swing_centideg,
            period_ms: 400,
            gain_milli,
        };
        let mut trial = Trial::default();
        for (t_s, found) in (1..).zip(found) {
            trial
                .events
                .push((f64::from(t_s), describe_event(&cycle(found))));
            trial.events.push((f64::from(t_s), "stopped".to_owned()));
        }
        let counted = limit_cycles(&trial).map(|(t_s, _)| t_s);
        assert_eq!(counted.collect::<Vec<_>>(), [1.0, 3.0, 5.0]);
        let (_, first) = limit_cycles(&trial).next().unwrap();
        assert_eq!(first, "6.1° peak to peak, period 400 ms; feedback at 70 %");
    }
}
