//! Compares the observed pulses with the calculated times of the trains.

use super::super::pulses::Pulse;
use super::expectation::{Expectation, Shape, TrainSpec};
use super::violation::{Rule, Violation};

/// A pulse with the values that its train specifies.
pub(super) struct Timed<'a> {
    pub pulse: &'a Pulse,
    /// Start of its burst; its own start if it belongs to no train.
    pub burst_us: u64,
    /// Required grounding after the pulse: that of its train, and after a monophasic pulse at least
    /// the minimum.
    pub ground_us: u64,
}

/// Finds the train of every pulse of one channel, and reports pulses that have none, differ from
/// it, or are missing.
pub(super) fn compare<'a>(
    channel: u8,
    pulses: &'a [Pulse],
    trains: &[&TrainSpec],
    expected: &Expectation,
    found: &mut Vec<Violation>,
) -> Vec<Timed<'a>> {
    let mut timed = Vec::with_capacity(pulses.len());
    let mut current = 0;
    // Start of the current burst, and the width of its first pulse.
    let mut begun = (u64::MAX, 0);
    let mut roll: Vec<RollCall> = trains.iter().map(|train| RollCall::new(train)).collect();
    for pulse in pulses {
        let past = |train: &TrainSpec| train.active_us.end + train.period_us <= pulse.start_us;
        while trains.get(current).is_some_and(|train| past(train)) {
            current += 1;
        }
        let place = (current..trains.len())
            .find_map(|index| Some((index, locate(trains[index], pulse.start_us)?)));
        let (burst_us, ground_us) = match place {
            Some((index, (burst, number))) => {
                let train = trains[index];
                let burst_us = train.start_us(burst, 0);
                if begun.0 != burst_us {
                    begun = (burst_us, pulse.width_us[0]);
                }
                compare_width(pulse, train, begun.1, found);
                compare_shape(pulse, train, expected.dead_time_us, found);
                roll[index].record_present(burst * train.burst_count + number, expected, found);
                (burst_us, train.ground_us)
            }
            None => {
                let near = trains
                    .iter()
                    .filter_map(|train_spec| nearest(train_spec, pulse.start_us));
                let nearest_us = near.min_by_key(|t_us| t_us.abs_diff(pulse.start_us));
                let rule = Rule::OffSchedule { nearest_us };
                found.push(Violation::new(pulse.start_us, channel, rule));
                (pulse.start_us, 0)
            }
        };
        timed.push(Timed {
            pulse,
            burst_us,
            ground_us: match pulse.phases {
                1 => ground_us.max(expected.limits.ground_us),
                _ => ground_us,
            },
        });
    }
    for calls in roll {
        calls.finish(expected, found);
    }
    timed
}

/// Returns the burst number and the number within the burst of the pulse that starts at `t_us`, or
/// `None` if the train has no pulse then.
fn locate(train: &TrainSpec, t_us: u64) -> Option<(u64, u64)> {
    let since_us = t_us.checked_sub(train.first_us())?;
    let (burst, within_us) = (since_us / train.period_us, since_us % train.period_us);
    let number = match train.burst_count {
        1 => 0,
        _ => within_us / train.burst_interval_us,
    };
    let exact = number < train.burst_count && train.start_us(burst, number) == t_us;
    (exact && train.bursts().contains(&burst)).then_some((burst, number))
}

/// Returns the start nearest to `t_us` among the train's pulses.
fn nearest(train: &TrainSpec, t_us: u64) -> Option<u64> {
    let bursts = train.bursts();
    let last = bursts.end.checked_sub(1).filter(|_| !bursts.is_empty())?;
    let burst = t_us.saturating_sub(train.first_us()) / train.period_us;
    (burst..=burst + 1)
        .flat_map(|burst| (0..train.burst_count).map(move |number| (burst, number)))
        .map(|(burst, number)| train.start_us(burst.clamp(bursts.start, last), number))
        .min_by_key(|start_us| start_us.abs_diff(t_us))
}

/// Checks a width that may change: it must be within its bounds, and the same throughout a burst.
fn compare_width(pulse: &Pulse, train: &TrainSpec, first_us: u64, found: &mut Vec<Violation>) {
    let Some(widest_us) = train.widest_us.filter(|_| pulse.complete) else {
        return;
    };
    let width_us = pulse.width_us[0];
    let mut report = |rule| found.push(Violation::new(pulse.start_us, pulse.channel, rule));
    if width_us > widest_us {
        report(Rule::Width { width_us });
    }
    if width_us != first_us {
        report(Rule::WidthInBurst { width_us, first_us });
    }
}

fn compare_shape(pulse: &Pulse, train: &TrainSpec, dead_time_us: u64, found: &mut Vec<Violation>) {
    let (phases, first) = match train.shape {
        Shape::Biphasic(first) => (2, first),
        Shape::Monophasic(first) => (1, first),
    };
    if pulse.first != first || (pulse.complete && pulse.phases != phases) {
        found.push(Violation::new(pulse.start_us, pulse.channel, Rule::Shape));
    }
    if !pulse.complete || pulse.phases != phases {
        return;
    }
    let gap_us = train.gap_us.max(dead_time_us);
    let own_us = match train.widest_us {
        Some(_) => pulse.width_us[0],
        None => train.width_us,
    };
    let mut due_us = own_us;
    let mut seen_us = pulse.width_us[0];
    let mut compare = |seen_us: u64, due_us: u64| {
        if seen_us != due_us {
            let expected_us = pulse.start_us + due_us;
            let rule = Rule::EdgeTime { expected_us };
            found.push(Violation::new(
                pulse.start_us + seen_us,
                pulse.channel,
                rule,
            ));
        }
    };
    compare(seen_us, due_us);
    if phases == 2 {
        (seen_us, due_us) = (seen_us + pulse.gap_us, due_us + gap_us);
        compare(seen_us, due_us);
        compare(seen_us + pulse.width_us[1], due_us + own_us);
    }
}

/// Counts the pulses of a train, to find missing ones.
struct RollCall<'a> {
    train: &'a TrainSpec,
    next: u64,
}

impl<'a> RollCall<'a> {
    fn new(train: &'a TrainSpec) -> RollCall<'a> {
        let next = train.bursts().start * train.burst_count;
        RollCall { train, next }
    }

    fn record_present(&mut self, number: u64, expected: &Expectation, found: &mut Vec<Violation>) {
        self.missing_until(number, expected, found);
        self.next = number + 1;
    }

    fn missing_until(&self, number: u64, expected: &Expectation, found: &mut Vec<Violation>) {
        let count = number.saturating_sub(self.next);
        if expected.complete && count > 0 {
            let t_us = self.start_us(self.next);
            found.push(Violation::new(
                t_us,
                self.train.channel,
                Rule::Missing { count },
            ));
        }
    }

    /// Reports all pulses due before the end of the recording that are missing.
    fn finish(self, expected: &Expectation, found: &mut Vec<Violation>) {
        let end = self.train.bursts().end * self.train.burst_count;
        let beyond = expected.end_us.saturating_sub(self.train.first_us()) / self.train.period_us;
        let mut due = end.min((beyond + 1) * self.train.burst_count);
        while due > self.next && self.start_us(due - 1) >= expected.end_us {
            due -= 1;
        }
        self.missing_until(due, expected, found);
    }

    fn start_us(&self, number: u64) -> u64 {
        let count = self.train.burst_count;
        self.train.start_us(number / count, number % count)
    }
}
