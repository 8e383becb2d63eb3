//! Random traces for both judges: with no, one or several broken rules, adjacent pulses, changing
//! loads, an interrupted pump and broken lines.

use super::second::{case, compare};
use hal_sim::random::Random;
use hal_sim::trace::judge::{
    Channel, Fault, Line, Pump, QuietInterval, Rule, Stage, StuckLine, Truth, judge,
};
use hal_sim::trace::{Levels, State, Trace};
use std::collections::BTreeMap;

/// Seed of the draws. Their generator and number were fixed before the judges were compared.
const SEED: u64 = 1;
const CASES: u64 = 300;
const CHANNELS: u8 = 3;
const END_US: u64 = 1_500_000;

#[test]
fn both_judges_say_the_same_of_what_is_drawn() {
    let drawn: Vec<_> = (0..CASES).map(|k| draw(&mut random(k))).collect();
    let verdicts: Vec<_> = drawn
        .iter()
        .map(|(trace, pump, truth)| judge(trace, pump, truth, END_US))
        .collect();
    let cases = drawn
        .iter()
        .map(|(trace, pump, truth)| case(trace, pump, truth, END_US));
    let differ = compare(&cases.collect::<Vec<_>>(), &verdicts);
    assert!(differ.is_empty(), "{} differ: {:#?}", differ.len(), differ);
    // The comparison needs draws that break no rule and draws that break different rules.
    let mut broken = BTreeMap::new();
    let accounts = verdicts
        .iter()
        .flat_map(|verdict| [&verdict.as_built, &verdict.bare]);
    for finding in accounts.clone().flat_map(|account| &account.findings) {
        *broken.entry(finding.rule).or_insert(0) += 1;
    }
    let count = |length: fn(&hal_sim::trace::judge::OutputJudgement) -> usize| -> usize {
        accounts.clone().map(length).sum()
    };
    let (latched, truncated) = (
        count(|account| account.latched.len()),
        count(|account| account.truncated.len()),
    );
    println!("{broken:?}, {latched} latched, {truncated} truncated");
    for rule in [
        Rule::CommandedPhase,
        Rule::AnyPhase,
        Rule::Current,
        Rule::DirectCurrent,
        Rule::TruncatedCharge,
        Rule::Rate,
        Rule::PastDeadline,
    ] {
        assert!(broken.contains_key(&rule), "{rule:?} was never broken");
    }
    assert!(latched > 50 && truncated > 50, "{latched} {truncated}");
}

fn random(case: u64) -> Random {
    Random::new(SEED << 32 | case)
}

/// Returns a random element.
fn pick<T: Copy>(random: &mut Random, choices: &[T]) -> T {
    choices[random.below(choices.len() as u64) as usize]
}

fn draw(random: &mut Random) -> (Trace, Pump, Truth) {
    let mut truth = Truth::default();
    let mut trace = Trace::default();
    let mut levels = Vec::new();
    for channel in 0..CHANNELS {
        truth.channels[usize::from(channel)] = channel_of(random);
        for (at, state) in course(random) {
            levels.push((at, channel, state));
        }
        let mut at = 0;
        while at < END_US {
            trace.record_dac(at, channel, random.below(65_536) as u16);
            at += 1 + random.below(600_000);
        }
    }
    levels.sort_by_key(|level| (level.0, level.1));
    let mut now = Levels::ISOLATED;
    for (at, channel, state) in levels {
        now = now.with_channel(channel, state);
        trace.record_levels(at, now);
    }
    trace.dac.sort_by_key(|write| write.t_us);
    for bank in 0..2 {
        if random.below(2) == 0 {
            trace.record_trip(random.below(END_US), bank, random.below(30_000) as u16);
        }
    }
    trace.trips.sort_by_key(|write| write.t_us);
    add_faults(random, &mut truth);
    (trace, pump(random), truth)
}

fn channel_of(random: &mut Random) -> Channel {
    let stage = match random.below(3) {
        0 => Stage::Voltage {
            full_scale_v: random.between(5.0, 150.0),
        },
        _ => Stage::Current {
            full_scale_ma: random.between(1.0, 130.0),
        },
    };
    let pulses_per_s = pick(random, &[50, 100, 400, 2_000]);
    let mut channel = Channel::steady(
        stage,
        random.log_between(100.0, 30_000.0),
        random.log_between(1.0, 200.0),
        pulses_per_s,
    );
    channel.mismatch = pick(random, &[0.0, 0.0, 0.01, -0.02]);
    for _ in 0..random.below(3) {
        let ohm = random.log_between(20.0, 100_000.0);
        let load = (random.below(4) > 0).then_some(ohm);
        channel.loads.push((random.below(END_US), load));
    }
    channel.loads.sort_by_key(|load| load.0);
    channel
}

/// Generates pulses of one kind, some of them damaged, or states in any order.
fn course(random: &mut Random) -> Vec<(u64, State)> {
    let mut course = Vec::new();
    let mut at = random.below(20_000);
    let (width, gap) = (10 + random.below(520), random.below(210));
    let period = 2_000 + random.below(30_000);
    let is_grounded = random.below(2) == 0;
    let is_wild = random.below(4) == 0;
    let first = pick(random, &[State::Cathodic, State::Anodic]);
    let second = if first == State::Cathodic {
        State::Anodic
    } else {
        State::Cathodic
    };
    while at < END_US {
        if is_wild {
            let states = [
                State::Isolated,
                State::Cathodic,
                State::Anodic,
                State::Grounded,
            ];
            course.push((at, pick(random, &states)));
            at += 1 + random.log_between(1.0, 40_000.0) as u64;
            continue;
        }
        let is_spoilt = random.below(12) == 0;
        let length = if is_spoilt {
            10 + random.below(800)
        } else {
            width
        };
        course.extend([(at, first), (at + length, State::Isolated)]);
        let mut end = at + length + gap;
        if !is_spoilt || random.below(2) == 0 {
            course.push((end, second));
            if random.below(12) == 0 {
                // The effect of a flipped bit in the tape.
                let middle = end + width / 2;
                course.extend([(middle, State::Isolated), (middle + 1, second)]);
            }
            course.push((end + width, State::Isolated));
            end += width;
        }
        if is_grounded {
            let ground = 700 + random.below(1_000);
            course.extend([
                (end + 1, State::Grounded),
                (end + 1 + ground, State::Isolated),
            ]);
            end += 1 + ground;
        }
        at = end.max(at + period) + random.below(50);
    }
    course
}

/// Adds random faults, and intervals that must be quiet.
fn add_faults(random: &mut Random, truth: &mut Truth) {
    for _ in 0..random.below(3) {
        let t_us = random.below(END_US);
        truth.faults.push(Fault { t_us });
    }
    if random.below(3) == 0 {
        truth.stuck.push(StuckLine {
            channel: random.below(CHANNELS.into()) as u8,
            line: pick(random, &[Line::Cathodic, Line::Anodic]),
            high: random.below(2) == 0,
            from_us: random.below(END_US),
        });
    }
    if random.below(3) == 0 {
        let from_us = random.below(END_US);
        let until_us = pick(random, &[from_us + 100_000, u64::MAX]);
        truth.quiet.push(QuietInterval { from_us, until_us });
    }
}

/// Generates a pump that runs throughout, or runs of edges with gaps.
fn pump(random: &mut Random) -> Pump {
    if random.below(2) == 0 {
        return Pump::Throughout;
    }
    let (mut runs, mut at) = (Vec::new(), random.below(5_000));
    while at < END_US {
        let last = at + random.below(900_000);
        runs.push((at, last));
        at = last + 300 + random.below(20_000);
    }
    Pump::Runs(runs)
}
