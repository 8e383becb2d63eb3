//! A long trace of ten channels at different frequencies: the checker finds
//! nothing in the good one, finds one wrong edge in it, and is quick.

use std::time::Instant;

use hal_sim::trace::{
    Expectation, Levels, Limits, Polarity, Rule, Shape, State, Trace, TrainSpec, check,
};

const SECONDS: u64 = 600;
/// Just before the device's 32-bit clock wraps, as every soak does.
const EPOCH_US: u64 = (1 << 32) - 60_000_000;

fn expectation() -> Expectation {
    let trains = (0..10u8)
        .map(|channel| {
            let n = u64::from(channel);
            let polarity = [Polarity::Cathodic, Polarity::Anodic][usize::from(channel % 2)];
            let monophasic = channel % 4 == 3;
            TrainSpec {
                channel,
                shape: if monophasic {
                    Shape::Monophasic(polarity)
                } else {
                    Shape::Biphasic(polarity)
                },
                width_us: 10 + 7 * n,
                gap_us: 3 * n,
                period_us: 5_003 + 97 * n,
                offset_us: 131 * n,
                burst_count: if monophasic { 1 } else { 1 + n % 3 },
                burst_interval_us: 401,
                ground_us: 1_000 + n,
                epoch_us: EPOCH_US,
                active_us: EPOCH_US..u64::MAX / 2,
            }
        })
        .collect();
    Expectation {
        trains,
        groups: Vec::new(),
        dead_time_us: 5,
        max_code: [40_000; 10],
        limits: Limits::default(),
        complete: true,
        end_us: EPOCH_US + SECONDS * 1_000_000,
    }
}

/// States of one pulse as (time after its start, state).
fn waveform(train: &TrainSpec) -> Vec<(u64, State)> {
    let (shape, width) = (train.shape, train.width_us);
    let (Shape::Biphasic(first) | Shape::Monophasic(first)) = shape;
    let (one, other) = match first {
        Polarity::Cathodic => (State::Cathodic, State::Anodic),
        Polarity::Anodic => (State::Anodic, State::Cathodic),
    };
    let second = width + train.gap_us.max(5);
    let mut states = match shape {
        Shape::Biphasic(_) => vec![
            (0, one),
            (width, State::Isolated),
            (second, other),
            (second + width, State::Isolated),
        ],
        Shape::Monophasic(_) => vec![
            (0, one),
            (width, State::Grounded),
            (width + train.ground_us, State::Isolated),
        ],
    };
    states.sort_by_key(|state| state.0);
    states
}

/// The trace of an expectation without groups, and how many pulses it has.
fn render(expected: &Expectation) -> (Trace, usize) {
    let mut edges: Vec<(u64, u8, State)> = Vec::new();
    let mut writes = Vec::new();
    let mut pulses = 0;
    for train in &expected.trains {
        let states = waveform(train);
        let mut burst_us = train.epoch_us + train.offset_us;
        while burst_us + 5_000 < expected.end_us {
            let code = (burst_us / 7 % 40_000) as u16;
            writes.push((burst_us - 20, train.channel, code));
            for j in 0..train.burst_count {
                let start_us = burst_us + j * train.burst_interval_us;
                edges.extend(
                    states
                        .iter()
                        .map(|&(t, s)| (start_us + t, train.channel, s)),
                );
                pulses += 1;
            }
            burst_us += train.period_us;
        }
    }
    edges.sort_by_key(|edge| edge.0);
    writes.sort_by_key(|write| write.0);
    let (mut trace, mut levels) = (Trace::default(), Levels::ISOLATED);
    for (t_us, channel, state) in edges {
        levels = levels.with(channel, state);
        trace.record_levels(t_us, levels);
    }
    for (t_us, channel, code) in writes {
        trace.record_dac(t_us, channel, code);
    }
    (trace, pulses)
}

#[test]
fn two_million_pulses_are_judged_and_one_wrong_edge_is_found() {
    let mut expected = expectation();
    let (mut trace, pulses) = render(&expected);
    expected.end_us -= 6_000;
    trace = trace.until(expected.end_us);
    assert!(pulses > 1_000_000);

    let start = Instant::now();
    assert_eq!(check(&trace, &expected), []);
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{pulses} pulses, {} changes: checked in {seconds:.2} s",
        trace.levels.len()
    );

    let (start, mut again) = (Instant::now(), Trace::default());
    for &(t_us, levels) in &trace.levels {
        again.record_levels(t_us, levels);
    }
    let rate = trace.levels.len() as f64 / start.elapsed().as_secs_f64() / 1e6;
    println!("recorder: {rate:.0} million changes per second");
    assert_eq!(again.levels, trace.levels);

    let wrong = trace.levels.len() / 2;
    trace.levels[wrong].0 += 1;
    assert!(
        trace.levels[wrong].0 < trace.levels[wrong + 1].0,
        "still in order"
    );
    let found = check(&trace, &expected);
    assert!((1..=4).contains(&found.len()), "{found:?}");
    assert!(
        found.iter().any(|violation| matches!(
            violation.rule,
            Rule::EdgeTime { .. } | Rule::OffSchedule { .. } | Rule::GroundingMissing { .. }
        )),
        "{found:?}"
    );
}
