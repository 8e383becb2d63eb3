//! Rules for a channel between its pulses: its own grounding, and the rule of its group.

use super::super::intervals::{Interval, append, before, contains, difference, union};
use super::super::levels::CHANNELS;
use super::super::pulses::{ChannelRecord, Pulse};
use super::expectation::{Expectation, Group, GroupKind};
use super::timing::Timed;
use super::violation::{Rule, Violation};

/// Checks that every monophasic pulse is discharged before the next pulse of its channel, by
/// contiguous grounding of the minimum length.
pub(super) fn judge_own_grounding(
    record: &ChannelRecord,
    expected: &Expectation,
    found: &mut Vec<Violation>,
) {
    let mut first = 0;
    for pair in record.pulses.windows(2).filter(|pair| pair[0].phases == 1) {
        let (from_us, until_us) = (pair[0].end_us(), pair[1].start_us);
        while record.grounded.get(first).is_some_and(|g| g.1 <= from_us) {
            first += 1;
        }
        let grounded = record.grounded[first..].iter();
        let mut before = grounded.take_while(|grounded| grounded.0 < until_us);
        let discharged = before.any(|g| g.1 - g.0 >= expected.limits.ground_us);
        if !discharged {
            found.push(Violation::new(from_us, pair[0].channel, Rule::Discharge));
        }
    }
}

/// Checks that every channel is grounded exactly when it should be.
///
/// The check ends at the first pulse that the end of the recording truncated.
pub(super) fn judge_groups(
    records: &[ChannelRecord; CHANNELS],
    timed: &[Vec<Timed<'_>>],
    expected: &Expectation,
    found: &mut Vec<Violation>,
) {
    let horizon_us = records
        .iter()
        .filter_map(|record| record.pulses.last().filter(|pulse| !pulse.complete))
        .map(|pulse| pulse.start_us)
        .fold(expected.end_us, u64::min);
    for channel in 0..CHANNELS as u8 {
        let mut groups = expected.groups.iter();
        let group = groups.find(|group| group.members.contains(&channel));
        let others = group.map_or_else(Vec::new, |group| pulsing_others(records, group, channel));
        let bystander = IdleChannel {
            channel,
            record: &records[usize::from(channel)],
            timed: &timed[usize::from(channel)],
            kind: group.map(|group| group.kind),
            others,
            horizon_us,
        };
        bystander.judge(found);
    }
}

/// Returns the times at which members other than `channel` pulse.
fn pulsing_others(
    records: &[ChannelRecord; CHANNELS],
    group: &Group,
    channel: u8,
) -> Vec<Interval> {
    let others = group.members.iter().filter(|&&member| member != channel);
    let pulsing = others.map(|&member| pulsing(&records[usize::from(member)].pulses));
    pulsing.fold(Vec::new(), |set, pulses| union(&set, &pulses))
}

fn pulsing(pulses: &[Pulse]) -> Vec<Interval> {
    let mut set = Vec::with_capacity(pulses.len());
    for pulse in pulses {
        append(&mut set, (pulse.start_us, pulse.end_us()));
    }
    set
}

/// One channel, with the pulses of the other members of its group.
struct IdleChannel<'a> {
    channel: u8,
    record: &'a ChannelRecord,
    timed: &'a [Timed<'a>],
    kind: Option<GroupKind>,
    others: Vec<Interval>,
    horizon_us: u64,
}

impl IdleChannel<'_> {
    fn judge(&self, found: &mut Vec<Violation>) {
        let own = pulsing(&self.record.pulses);
        let discharge = self.discharge();
        let due = match self.kind {
            Some(GroupKind::Conducted) => union(&discharge, &self.others),
            _ => discharge,
        };
        let due = before(&difference(&due, &own), self.horizon_us);
        let seen = before(&self.record.grounded, self.horizon_us);
        let mut report = |t_us, rule| found.push(Violation::new(t_us, self.channel, rule));
        for (start_us, end_us) in difference(&due, &seen) {
            report(
                start_us,
                self.missing_grounding(start_us, end_us - start_us),
            );
        }
        for (start_us, end_us) in difference(&seen, &due) {
            report(
                start_us,
                self.unexpected_grounding(start_us, end_us - start_us),
            );
        }
        if self.kind == Some(GroupKind::Isolated) {
            // Time that belongs both to the channel's own pulses and to those of others.
            let clear = difference(&own, &self.others);
            for (start_us, _) in difference(&own, &clear) {
                report(start_us, Rule::Overlap);
            }
        }
    }

    fn missing_grounding(&self, t_us: u64, for_us: u64) -> Rule {
        if self.kind == Some(GroupKind::Conducted) && contains(&self.others, t_us) {
            Rule::NotConducted { for_us }
        } else {
            Rule::GroundingMissing { for_us }
        }
    }

    fn unexpected_grounding(&self, t_us: u64, for_us: u64) -> Rule {
        if self.kind == Some(GroupKind::Isolated) && contains(&self.others, t_us) {
            Rule::NotIsolated { for_us }
        } else {
            Rule::GroundingUnexpected { for_us }
        }
    }

    /// Returns the grounding that the channel's own pulses require.
    fn discharge(&self) -> Vec<Interval> {
        let mut set = Vec::new();
        for (index, timed) in self.timed.iter().enumerate() {
            let pulse = timed.pulse;
            if timed.ground_us != 0 && pulse.complete {
                let next = self.timed.get(index + 1);
                let until_us = next.map_or(u64::MAX, |next| next.pulse.start_us);
                self.discharge_one(pulse.end_us(), timed.ground_us, until_us, &mut set);
            }
        }
        set
    }

    /// Adds uninterrupted grounding for `ground_us` from `t_us` on; in an isolated group each pulse
    /// of another member restarts it.
    fn discharge_one(&self, mut t_us: u64, ground_us: u64, until_us: u64, set: &mut Vec<Interval>) {
        if self.kind == Some(GroupKind::Isolated) {
            let first = self.others.partition_point(|other| other.1 <= t_us);
            for other in &self.others[first..] {
                if other.0 >= (t_us + ground_us).min(until_us) {
                    break;
                }
                append(set, (t_us, other.0));
                t_us = other.1;
            }
        }
        append(set, (t_us, (t_us + ground_us).min(until_us)));
    }
}
