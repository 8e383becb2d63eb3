//! Independent check of a trace against the requested pulses and the limits.
//!
//! Contains the expectation ([`Expectation`]), the violations ([`Violation`]) and the rules. The
//! rules do not schedule pulses; they work backwards, from the observed pulses to the times and
//! states that these imply.
//! In: a trace and an expectation. Out: violations, none for a correct trace. Time and memory are
//! proportional to the length of the trace.

mod expectation;
mod idle;
mod pulse;
#[cfg(test)]
mod tests;
mod timing;
mod violation;

pub use expectation::{Expectation, Group, GroupKind, Limits, Shape, TrainSpec};
pub use violation::{Rule, Violation};

use super::levels::CHANNELS;
use super::record::Trace;

/// Returns all violations of a trace, ordered by time, then channel.
///
/// An expectation that contradicts itself or its own limits is reported as [`Rule::Specification`],
/// a trace out of order as [`Rule::TimeOrder`]; in both cases nothing else is checked.
pub fn check(trace: &Trace, expected: &Expectation) -> Vec<Violation> {
    let mut found = expected.contradictions();
    found.extend(out_of_order(trace, expected.end_us));
    if !found.is_empty() {
        return found;
    }
    let records = trace.channel_records(expected.end_us);
    let mut writes: [Vec<u64>; CHANNELS] = Default::default();
    for write in &trace.dac {
        writes[usize::from(write.channel)].push(write.t_us);
    }
    let mut timed = Vec::with_capacity(CHANNELS);
    for (channel, record) in records.iter().enumerate() {
        let trains = expected.trains_of(channel as u8);
        let pulses = timing::compare(channel as u8, &record.pulses, &trains, expected, &mut found);
        pulse::judge(channel as u8, record, expected, &mut found);
        pulse::judge_writes(&pulses, &writes[channel], expected, &mut found);
        pulse::judge_repetition(&pulses, expected, &mut found);
        idle::judge_own_grounding(record, expected, &mut found);
        timed.push(pulses);
    }
    idle::judge_groups(&records, &timed, expected, &mut found);
    found.sort_by_key(|violation| (violation.t_us, violation.channel));
    found
}

fn out_of_order(trace: &Trace, end_us: u64) -> Option<Violation> {
    let levels = trace.levels.iter().map(|entry| entry.0);
    let writes = trace.dac.iter().map(|write| write.t_us);
    let bad_level = first_out_of_order(levels, end_us, |last, t_us| t_us > last);
    let bad_write = first_out_of_order(writes, end_us, |last, t_us| t_us >= last);
    let t_us = bad_level.or(bad_write)?;
    Some(Violation::new(t_us, 0, Rule::TimeOrder))
}

/// Returns the first time that does not follow its predecessor, or lies past the end.
fn first_out_of_order(
    times: impl Iterator<Item = u64>,
    end_us: u64,
    follows: impl Fn(u64, u64) -> bool,
) -> Option<u64> {
    let mut last = None;
    for t_us in times {
        if t_us > end_us || last.is_some_and(|last| !follows(last, t_us)) {
            return Some(t_us);
        }
        last = Some(t_us);
    }
    None
}
