//! Randomly generated sessions: other periods, widths, bursts and clocks than the test session.
//! The counts of false decisions are printed.

use hal_sim::random::Sequence;
use hil::expected::{ChannelState, StateChange, SyncSource, from_states};
use hil::fit::{Alignment, Finding, FitOptions, Verdict, fit};
use hil::line::Expected;
use hil::plan::{Connection, connect};
use hil::synthesise::{Analyser, ExactEdge, ExactLine, Fault, synthesise};

const SEEDS: u64 = 200;
const UNTIL_US: u64 = 1_500_000;

/// Session with one to three channels, each with its own period, width, gap, grounding and burst.
/// With `equal_periods`, all channels have one period.
fn session(random: &mut Sequence, equal_periods: bool) -> Expected {
    let channels = 1 + random.below(3) as u8;
    let mut rows = Vec::new();
    let common = 5_000 + 1_000 * random.below(95);
    for channel in 1..=channels {
        let period = if equal_periods {
            common
        } else {
            5_000 + 1_000 * random.below(95)
        };
        let width = 50 + random.below(450);
        let gap = 5 + random.below(100);
        let ground = if random.below(2) == 0 { 0 } else { 1_000 };
        let burst = 1 + random.below(3);
        let interval = 2 * width + gap + ground + 100;
        let burst = if interval * burst + 100 < period {
            burst
        } else {
            1
        };
        let begin = 50_000 + random.below(period);
        for period_start in (begin..UNTIL_US - 100_000).step_by(period as usize) {
            for n in 0..burst {
                let t = period_start + n * interval;
                let mut push = |t_us, state| {
                    rows.push(StateChange {
                        t_us,
                        channel,
                        state,
                    });
                };
                push(t, ChannelState::Anodic);
                push(t + width, ChannelState::Isolated);
                push(t + width + gap, ChannelState::Cathodic);
                if ground > 0 {
                    push(t + 2 * width + gap, ChannelState::Grounded);
                }
                push(t + 2 * width + gap + ground, ChannelState::Isolated);
            }
        }
    }
    rows.sort_by_key(|row| (row.t_us, row.channel));
    let sync = SyncSource {
        channel: 1,
        first: ChannelState::Anodic,
    };
    from_states(&rows, channels, Some(sync), 0, UNTIL_US, |_| 0.0).expect("rows are in order")
}

struct Setup {
    expected: Expected,
    connections: Vec<Connection>,
    lines: Vec<ExactLine>,
    analyser: Analyser,
}

fn setup(random: &mut Sequence, seed: u64) -> Setup {
    let equal_periods = random.below(2) == 0;
    let expected = session(random, equal_periods);
    let mut lines = Vec::new();
    let mut connections = Vec::new();
    for (line, bit) in expected.lines.iter().zip(0..) {
        let mut high = line.first_high;
        let edges = line.edges_us.iter().map(|t_us| {
            high = !high;
            ExactEdge {
                time_ps: *t_us as i64 * 1_000_000 + random.below(119_000) as i64,
                high,
            }
        });
        lines.push(ExactLine {
            name: format!("D{bit}"),
            first_high: line.first_high,
            edges: edges.collect(),
        });
        connections.push(Connection {
            bit,
            line: line.name.clone(),
        });
    }
    let rate = [50_000_000, 100_000_000, 200_000_000][random.below(3) as usize];
    let analyser = Analyser {
        samplerate_hz: rate,
        clock_ppb: random.below(300_000) as i64 - 150_000,
        start_ps: (random.below(900_000) as i64 - 100_000) * 1_000_000
            + random.below(1_000_000) as i64,
        samples: (500_000 + random.below(200_000)) * rate / 1_000_000,
        jitter_samples: 1,
        seed,
    };
    Setup {
        expected,
        connections,
        lines,
        analyser,
    }
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    Good,
    Moved,
    Missing,
    Glitch,
}

/// Returns the fault, the line and the time of the fault.
fn fault(kind: Kind, setup: &Setup, random: &mut Sequence) -> (Vec<Fault>, String, u64) {
    let analyser = &setup.analyser;
    let length = analyser.samples as i64 * (1_000_000_000_000 / analyser.samplerate_hz as i64);
    let within = |edge: &ExactEdge| {
        edge.time_ps > analyser.start_ps + 100_000_000
            && edge.time_ps < analyser.start_ps + length - 200_000_000
    };
    let mut edges = Vec::new();
    for (line, exact) in setup.lines.iter().enumerate() {
        for (index, pair) in exact.edges.windows(2).enumerate() {
            if within(&pair[0]) && within(&pair[1]) {
                edges.push((line, index));
            }
        }
    }
    let (line, edge) = edges[random.below(edges.len() as u64) as usize];
    let time_us = setup.expected.lines[line].edges_us[edge];
    let by_ps = if random.below(2) == 0 {
        1_000_000
    } else {
        -1_000_000
    };
    let fault = match kind {
        Kind::Good => vec![],
        Kind::Moved => vec![Fault::MoveEdge { line, edge, by_ps }],
        Kind::Missing => vec![Fault::DropEdge { line, edge }],
        Kind::Glitch => vec![Fault::AddPulse {
            line,
            time_ps: time_us as i64 * 1_000_000 + 2_500_000,
            width_ps: 100_000,
        }],
    };
    (fault, setup.expected.lines[line].name.clone(), time_us)
}

fn found(kind: Kind, finding: &Finding, name: &str) -> Option<f64> {
    let (line, time) = match finding {
        Finding::EdgeMoved { line, time_us, .. } if kind == Kind::Moved => (line, *time_us as f64),
        Finding::PulseMissing { line, from_us, .. } if kind == Kind::Missing => {
            (line, *from_us as f64)
        }
        Finding::PulseExtra { line, from_us, .. } if kind == Kind::Glitch => (line, from_us - 2.5),
        _ => return None,
    };
    (line == name).then_some(time)
}

#[test]
fn random_sessions_are_judged_without_error() {
    for kind in [Kind::Good, Kind::Moved, Kind::Missing, Kind::Glitch] {
        let mut counts = [0_u64; 5];
        let mut unique = 0;
        for seed in 0..SEEDS {
            let mut random = Sequence::new(seed ^ 0x7a21 ^ (kind as u64) << 32);
            let setup = setup(&mut random, seed);
            let (faults, name, time_us) = fault(kind, &setup, &mut random);
            let capture = synthesise(&setup.lines, &setup.analyser, &faults).unwrap();
            let measured = connect(&capture, &setup.connections).unwrap();
            let report = match fit(&setup.expected, &measured, &FitOptions::default()) {
                Ok(report) => report,
                Err(error) => {
                    println!("{kind:?} {seed}: {error}");
                    counts[3] += 1;
                    continue;
                }
            };
            unique += u64::from(report.alignment == Alignment::Unique);
            if report.verdict == Verdict::Ambiguous {
                counts[4] += 1;
                println!("{kind:?} {seed}: ambiguous, {:?}", report.alignment);
                continue;
            }
            if kind == Kind::Good {
                if report.verdict != Verdict::Passed {
                    println!(
                        "{kind:?} {seed}: {:?} {:?}",
                        report.findings, report.alignment
                    );
                    counts[1] += 1;
                }
                continue;
            }
            if report.verdict == Verdict::Passed {
                counts[0] += 1;
            }
            let right = match report.findings.as_slice() {
                [finding] => found(kind, finding, &name).is_some_and(|time| {
                    let error = (time - time_us as f64).abs();
                    match report.alignment {
                        Alignment::Unique => error < 0.3,
                        // Any multiple of the period.
                        Alignment::Repeated { period_us, .. } => {
                            let period = period_us as f64;
                            let rest = error % period;
                            rest.min(period - rest) < 0.3
                        }
                    }
                }),
                _ => false,
            };
            if !right {
                println!(
                    "{kind:?} {seed}: {faults:?} {name} {time_us}: {:?} {:?}",
                    report.findings, report.alignment
                );
                counts[2] += 1;
            }
        }
        let [accept, reject, wrong, unaligned, ambiguous] = counts;
        println!(
            "random sessions, {kind:?}: {SEEDS} captures ({unique} unique), false accept {accept}, \
             false reject {reject}, wrong finding {wrong}, not aligned {unaligned}, ambiguous \
             {ambiguous}"
        );
        assert_eq!(accept + reject + wrong + unaligned, 0, "{kind:?}");
    }
}
