//! Rules for a device, checked from pins, requests and answers.

use crate::device_desk::*;
use firmware::link::{Event, Request};
use firmware::pulse::{CHANNELS, Levels, State as Line};
use proptest::prelude::*;
use std::collections::HashMap;

/// Checks the rules of the pins that hold for any requests.
pub fn judge_pins(desk: &mut TestHost) -> Result<(), TestCaseError> {
    let end = desk.since_boot_us();
    let faults: Vec<u64> = desk_faults(desk);
    let record = &desk.record;
    let mut last = 0;
    for &(t, _) in &record.levels {
        prop_assert!(t >= last, "levels out of order");
        last = t;
    }
    prop_assert!(record.sent.is_sorted(), "bytes out of order");
    prop_assert!(record.dac.is_sorted_by_key(|d| d.0), "DAC out of order");
    for c in 0..CHANNELS {
        let intervals = line_intervals(&record.levels, c, end);
        judge_phases(&intervals, c, end, &faults)?;
        for &(t, _, _) in record.dac.iter().filter(|d| usize::from(d.1) == c) {
            // A DAC is written never inside a pulse, and at least 20 µs before the next.
            let at = intervals.partition_point(|s| s.0 <= t) - 1;
            let is_driven = |s: Line| matches!(s, Line::Anodic | Line::Cathodic);
            prop_assert!(
                !is_driven(intervals[at].1),
                "DAC {c} written in a phase at {t}"
            );
            if let Some(next) = intervals.get(at + 1) {
                prop_assert!(
                    !is_driven(next.1) || next.0 >= t + 20,
                    "DAC {c} written {} µs before a phase",
                    next.0 - t
                );
            }
        }
    }
    Ok(())
}

/// Returns the times of reported faults, µs since boot, from all responses.
pub fn desk_faults(desk: &mut TestHost) -> Vec<u64> {
    let responses = decode(&desk.record.bytes);
    let end = desk.since_boot_us();
    let now = desk.now();
    responses
        .iter()
        .filter_map(|h| match h {
            OwnedResponse::Event(_, Event::Faulted(record)) => {
                Some(end.wrapping_add_signed((record.at - now).us().into()))
            }
            _ => None,
        })
        .collect()
}

pub fn judge_phases(
    intervals: &[(u64, Line, u64)],
    c: usize,
    end: u64,
    faults: &[u64],
) -> Result<(), TestCaseError> {
    let mut last_driven: Option<(Line, u64)> = None;
    for &(from, state, to) in intervals {
        if !matches!(state, Line::Anodic | Line::Cathodic) {
            continue;
        }
        let cut = to == end || faults.contains(&to);
        let width = to - from;
        prop_assert!(width <= 500, "channel {c}: {width} µs at {from}");
        prop_assert!(width >= 10 || cut, "channel {c}: {width} µs at {from}");
        if let Some((before, until)) = last_driven {
            prop_assert!(
                before == state || from - until >= 5,
                "channel {c}: no dead time at {from}"
            );
        }
        last_driven = Some((state, to));
    }
    Ok(())
}

/// Checks that outputs are driven only between an acknowledged Arm and the end of stimulation,
/// never above the charge limit, and never longer than host silence allows.
pub fn judge_permission(
    desk: &mut TestHost,
    asked: &[(u64, u16, Request)],
    longest_us: u64,
) -> Result<(), TestCaseError> {
    let Some(first) =
        desk.record.levels.iter().find(|(_, l)| {
            (0..CHANNELS).any(|c| matches!(l.state(c), Line::Anodic | Line::Cathodic))
        })
    else {
        return Ok(());
    };
    let arm = asked.iter().find(|a| matches!(a.2, Request::Arm { .. }));
    prop_assert!(arm.is_some_and(|a| a.0 <= first.0), "driven before any Arm");
    // While outputs are driven, the last keep-alive is not older than the longest timeout and fall
    // armed in this run. An arm order starts a check of 22 ms.
    let lives: Vec<u64> = asked
        .iter()
        .filter(|a| {
            matches!(
                a.2,
                Request::KeepAlive
                    | Request::Start
                    | Request::Amplitudes { .. }
                    | Request::Pulses { .. }
                    | Request::Angle { .. }
                    | Request::Arm { .. }
            )
        })
        .map(|a| a.0)
        .collect();
    let mut before = Levels::ISOLATED;
    for &(t, levels) in &desk.record.levels {
        let is_driven =
            |l: Levels| (0..CHANNELS).any(|c| matches!(l.state(c), Line::Anodic | Line::Cathodic));
        if is_driven(levels) && !is_driven(before) {
            let heard = lives.iter().rev().find(|&&life| life <= t);
            prop_assert!(
                heard.is_some_and(|&life| t - life <= longest_us),
                "driven at {t} without a host"
            );
        }
        before = levels;
    }
    Ok(())
}

/// Checks that every request of the session got exactly one answer, unless bytes to the host were
/// dropped, which only a host that does not read can cause.
pub fn judge_answers(
    desk: &mut TestHost,
    asked: &[(u64, u16, Request)],
) -> Result<(), TestCaseError> {
    let mut owed: HashMap<u16, i64> = HashMap::new();
    for (_, seq, _) in asked {
        *owed.entry(*seq).or_default() += 1;
    }
    for heard in decode(&desk.record.bytes) {
        let seq = match heard {
            OwnedResponse::Ack(seq, _) | OwnedResponse::Status(seq, _) => Some(seq),
            OwnedResponse::Refused(seq, ..) => seq,
            OwnedResponse::Hello(info) => Some(info.seq),
            _ => None,
        };
        if let Some(seq) = seq {
            *owed.entry(seq).or_default() -= 1;
        }
    }
    let unanswered: Vec<_> = owed.iter().filter(|o| *o.1 > 0).collect();
    prop_assert!(unanswered.is_empty(), "{unanswered:?}");
    Ok(())
}

/// Limits of the setups armed in a run, by channel.
#[derive(Default)]
pub struct Allowed {
    pub code: [u16; CHANNELS],
    pub monophasic: [bool; CHANNELS],
    pub longest_us: u64,
}

impl Allowed {
    pub fn note(&mut self, desk: &TestHost) {
        let Some(setup) = desk.board.setup() else {
            return;
        };
        let wearer = &setup.wearer;
        let silence = u64::from(wearer.host_timeout_us() + wearer.fall_us());
        self.longest_us = self.longest_us.max(silence);
        for (c, channel) in setup.channels.iter().enumerate() {
            let Some(channel) = channel else { continue };
            self.code[c] = self.code[c].max(channel.stage.code(channel.limit).get());
            self.monophasic[c] |= !channel.train.spec().shape.is_biphasic();
        }
    }

    pub fn judge(&self, desk: &mut TestHost) -> Result<(), TestCaseError> {
        for &(t, c, code) in &desk.record.dac {
            prop_assert!(code <= self.code[usize::from(c)], "code {code} at {t}");
        }
        let end = desk.since_boot_us();
        if !desk_faults(desk).is_empty() {
            return Ok(());
        }
        for c in (0..CHANNELS).filter(|&c| !self.monophasic[c]) {
            let mut net = 0;
            for (from, state, to) in line_intervals(&desk.record.levels, c, end) {
                let width = (to - from).cast_signed();
                net += match state {
                    Line::Anodic => width,
                    Line::Cathodic => -width,
                    _ => 0,
                };
                prop_assert!(net.abs() <= 500, "channel {c} at {from}");
            }
            prop_assert_eq!(net, 0, "channel {}", c);
        }
        Ok(())
    }
}
