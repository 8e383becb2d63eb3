//! Tests of the checker as a whole: a correct trace passes, and every change of it is detected.

mod rules;
mod scene;

use super::*;
use crate::trace::State;
use scene::{Scene, after, good};

use State::{Anodic, Cathodic, Grounded};

const STATES: [State; 4] = [State::Isolated, Anodic, Cathodic, Grounded];

#[test]
fn the_good_trace_passes() {
    assert_eq!(after(|_| {}), []);
}

#[test]
fn a_good_trace_cut_anywhere_passes() {
    let full = good();
    let (trace, mut expected) = (full.trace(), full.expected);
    for end_us in 100_000..110_000 {
        expected.end_us = end_us;
        assert_eq!(check(&trace.up_to(end_us), &expected), [], "{end_us}");
    }
}

#[test]
fn no_single_change_of_the_lines_goes_unseen() {
    let Scene { expected, .. } = good();
    let trace = good().trace();
    let seen = |changed: Trace, description: &str| {
        assert!(
            !check(&changed, &expected).is_empty(),
            "{description} unseen"
        );
    };
    for index in 0..trace.levels.len() {
        let mut without = trace.clone();
        let (t_us, levels) = without.levels.remove(index);
        seen(without, &format!("{t_us} removed"));
        for shifted_us in [t_us - 1, t_us + 1] {
            let mut shifted = trace.clone();
            shifted.levels[index].0 = shifted_us;
            seen(shifted, &format!("{t_us} at {shifted_us}"));
        }
        for (channel, state) in (0..10).flat_map(|ch| STATES.map(|state| (ch, state))) {
            let mut flipped = trace.clone();
            flipped.levels[index].1 = levels.with_channel(channel, state);
            if flipped != trace {
                seen(flipped, &format!("{t_us}: channel {channel} {state}"));
            }
        }
    }
}

#[test]
fn a_trace_out_of_order_is_not_judged() {
    let scene = good();
    let mut trace = scene.trace();
    trace.levels.swap(3, 4);
    let found = check(&trace, &scene.expected);
    assert_eq!((found.len(), found[0].rule), (1, Rule::TimeOrder));
    let mut trace = scene.trace();
    trace.dac.swap(0, 9);
    assert_eq!(check(&trace, &scene.expected)[0].rule, Rule::TimeOrder);
    let mut expected = good().expected;
    expected.end_us = 110_000;
    assert_eq!(check(&good().trace(), &expected)[0].rule, Rule::TimeOrder);
}

#[test]
fn contradictory_expectations_are_named() {
    type Change = fn(&mut Expectation);
    let named = |change: Change| {
        let found = after(|scene| change(&mut scene.expected));
        assert_eq!(found.len(), 1, "{found:?}");
        match found[0].2 {
            Rule::Specification(field) => field,
            other => panic!("{other:?}"),
        }
    };
    let cases: [(Change, &str); 12] = [
        (|e| e.trains[0].channel = 10, "channel"),
        (|e| e.trains[0].width_us = 501, "width"),
        (|e| e.trains[0].gap_us = 201, "gap"),
        (|e| e.trains[0].period_us = 4_999, "period"),
        (|e| e.trains[0].offset_us = 20_001, "offset"),
        (|e| e.trains[0].burst_count = 9, "burst count"),
        (|e| e.trains[1].burst_interval_us = 209, "burst interval"),
        (
            |e| e.trains[1].burst_interval_us = 19_791,
            "burst longer than the period",
        ),
        (|e| e.trains[2].ground_us = 999, "grounding"),
        (
            |e| e.trains.extend(e.trains.clone().pop()),
            "trains overlap",
        ),
        (|e| e.groups[0].members.push(4), "channel in two groups"),
        (|e| e.groups[0].members.push(10), "channel"),
    ];
    for (change, field) in cases {
        assert_eq!(named(change), field);
    }
}

#[test]
fn violations_read_well() {
    let violation = Violation::new(104_500, 3, Rule::Width { width_us: 501 });
    let text = "104500 µs, channel 4: phase of 501 µs";
    assert_eq!(violation.to_string(), text);
}
