//! Captures of a board that plays the session without end: faults and stops anywhere in them.

use crate::common::{BEGIN_US, board_plan, exact, session};
use hal_sim::random::Sequence;
use hil::capture::Capture;
use hil::fit::{FitOptions, Verdict, fit};
use hil::line::Expected;
use hil::merge::{MergedReport, merge};
use hil::plan::connect;
use hil::synthesise::{Analyser, ExactEdge, ExactLine, synthesise};

const MS: i64 = 1_000_000_000;
/// Captures of each kind of fault; 200 pass too, in two minutes.
const SEEDS: u64 = 40;
/// Session time at which the captures begin, picoseconds.
const START: i64 = 1_000 * MS;

/// The first `seconds` of the session from the first pulse on, as `flexor hil` predicts them.
fn prediction(seconds: u64) -> Expected {
    let until_us = seconds * 1_000_000;
    let mut expected = session(seconds + 1, 0);
    for line in &mut expected.lines {
        line.edges_us
            .retain(|t| (BEGIN_US..=BEGIN_US + until_us).contains(t));
        line.edges_us.iter_mut().for_each(|t| *t -= BEGIN_US);
    }
    Expected {
        until_us,
        ..expected
    }
}

/// Captures of all parts of the plan, `milliseconds` long. `fault` changes the edges of a line of
/// a capture, both counted from 0.
fn captures(
    rate_hz: u64,
    milliseconds: u64,
    fault: impl Fn(usize, &str, &mut Vec<ExactEdge>),
) -> Vec<Option<Capture>> {
    let session = session(7, 0);
    let record = |(part, connections): (usize, &Vec<hil::plan::Connection>)| {
        let mut lines = exact(&session, connections, 7 + part as u64);
        for connection in connections {
            let line = &mut lines[usize::from(connection.bit)];
            fault(part, &connection.line, &mut line.edges);
        }
        let analyser = Analyser {
            samplerate_hz: rate_hz,
            clock_ppb: 50_000,
            start_ps: START,
            samples: milliseconds * rate_hz / 1_000,
            jitter_samples: 1,
            seed: 3,
        };
        synthesise(&lines, &analyser, &[]).unwrap()
    };
    let plan = board_plan();
    let parts = plan.captures.iter().enumerate();
    parts.map(|part| Some(record(part))).collect()
}

/// Judges captures as `flexor hil --seconds 1` does, against a prediction of `seconds`.
fn judge(seconds: u64, captures: &[Option<Capture>]) -> MergedReport {
    let options = FitOptions {
        min_covered_us: 950_000.0,
        ..FitOptions::default()
    };
    merge(&prediction(seconds), &board_plan(), captures, &options)
}

/// Asserts the verdict on a fault in a capture of 2 s, with the prediction of the whole session and
/// with one that is shorter than the capture.
fn fails(name: &str, fault: impl Fn(usize, &str, &mut Vec<ExactEdge>)) {
    let captures = captures(100_000_000, 2_000, fault);
    for seconds in [6, 1] {
        let report = judge(seconds, &captures);
        assert_eq!(
            report.verdict,
            Verdict::Failed,
            "{name}, predicted {seconds} s: {report:?}"
        );
    }
}

#[test]
fn a_running_board_passes() {
    let report = judge(6, &captures(100_000_000, 2_000, |_, _, _| {}));
    assert_eq!(report.verdict, Verdict::Passed, "{report:?}");
    for capture in report.captures {
        let capture = capture.unwrap();
        assert!(capture.until_us - capture.from_us > 1_999_000.0);
    }
}

#[test]
fn silence_in_a_capture_fails() {
    for at_ms in [300, 500, 800, 1_850] {
        let gap = START + at_ms * MS..START + (at_ms + 100) * MS;
        fails(&format!("silent from {at_ms} ms"), |_, _, edges| {
            edges.retain(|edge| !gap.contains(&edge.time_ps));
        });
    }
}

#[test]
fn a_missing_pulse_in_each_capture_fails() {
    for at_ms in [300, 500, 800] {
        let gap = START + at_ms * MS..START + (at_ms + 20) * MS;
        fails(&format!("pulse missing at {at_ms} ms"), |_, line, edges| {
            if ["c1", "c5", "c8"].contains(&line) {
                edges.retain(|edge| !gap.contains(&edge.time_ps));
            }
        });
    }
}

#[test]
fn moved_edges_in_each_capture_fail() {
    for at_ms in [300, 500, 800] {
        fails(&format!("edges moved at {at_ms} ms"), |_, line, edges| {
            let later = |edge: &&mut ExactEdge| edge.time_ps > START + at_ms * MS;
            if let Some(edge) = edges.iter_mut().find(later)
                && line.starts_with('c')
            {
                edge.time_ps += 1_000_000;
            }
        });
    }
}

#[test]
fn a_board_that_stops_fails() {
    for at_ms in [100, 500, 1_100, 1_900] {
        fails(&format!("stops at {at_ms} ms"), |_, _, edges| {
            edges.retain(|edge| edge.time_ps < START + at_ms * MS);
        });
    }
    // In the first capture only, so that the others stay good.
    fails("only the first stops", |part, _, edges| {
        edges.retain(|edge| part > 0 || edge.time_ps < START + 1_100 * MS);
    });
}

#[test]
fn captures_that_are_too_short_are_incomplete() {
    for milliseconds in [25, 45, 900] {
        let report = judge(6, &captures(100_000_000, milliseconds, |_, _, _| {}));
        assert_eq!(report.verdict, Verdict::Incomplete, "{milliseconds} ms");
    }
}

/// Faults of [`randomly_placed_faults_are_found`].
#[derive(Clone, Copy, Debug)]
enum Kind {
    Good,
    /// All lines are silent for a random time.
    Gap,
    /// The board stops for good.
    Stop,
    /// One edge is late or early by 200 ns or 1 µs.
    Moved,
    /// One pulse is missing.
    Missing,
}

/// Applies a fault to the lines between two times. Returns whether an edge changed.
fn apply(
    kind: Kind,
    lines: &mut [ExactLine],
    (from, until): (i64, i64),
    random: &mut Sequence,
) -> bool {
    let within = |random: &mut Sequence| from + random.below((until - from) as u64) as i64;
    let time = within(random);
    let range = match kind {
        Kind::Good => return true,
        Kind::Gap => time..(time + (1 + random.below(200)) as i64 * MS).min(until),
        Kind::Stop => time..i64::MAX,
        Kind::Moved | Kind::Missing => {
            let line = random.below(lines.len() as u64) as usize;
            let edges = &mut lines[line].edges;
            let is_next = |edge: &ExactEdge| edge.time_ps >= time && edge.high;
            let Some(index) = edges.iter().position(is_next) else {
                return false;
            };
            if matches!(kind, Kind::Missing) {
                edges.drain(index..index + 2);
            } else {
                let by = [200_000, -200_000, 1_000_000, -1_000_000][random.below(4) as usize];
                edges[index].time_ps += by;
            }
            return true;
        }
    };
    let inside = |edge: &ExactEdge| range.contains(&edge.time_ps) && edge.time_ps < until;
    let changed = lines.iter().any(|line| line.edges.iter().any(inside));
    for line in lines {
        line.edges.retain(|edge| !range.contains(&edge.time_ps));
    }
    changed
}

/// Captures of 1 s at random times of a session of 6 s, with a fault anywhere but in the first and
/// the last 30 ms: silence there may be the time before the session, or no fault.
#[test]
fn randomly_placed_faults_are_found() {
    let (session, expected, plan) = (session(7, 0), prediction(6), board_plan());
    for kind in [
        Kind::Good,
        Kind::Gap,
        Kind::Stop,
        Kind::Moved,
        Kind::Missing,
    ] {
        let (mut judged, mut failed) = (0, 0);
        for seed in 0..SEEDS {
            let mut random = Sequence::new(seed ^ 0xc047 ^ (kind as u64) << 32);
            let connections = &plan.captures[random.below(3) as usize];
            let mut lines = exact(&session, connections, seed);
            let start_ps = 300 * MS + random.below(4_900) as i64 * MS;
            let within = (start_ps + 30 * MS, start_ps + 970 * MS);
            if !apply(kind, &mut lines, within, &mut random) {
                continue;
            }
            let rate_hz = [50_000_000, 100_000_000][random.below(2) as usize];
            let analyser = Analyser {
                samplerate_hz: rate_hz,
                clock_ppb: random.below(200_000) as i64 - 100_000,
                start_ps,
                samples: rate_hz,
                jitter_samples: 1,
                seed,
            };
            let capture = synthesise(&lines, &analyser, &[]).unwrap();
            let measured = connect(&capture, connections).unwrap();
            let report = fit(&expected, &measured, &FitOptions::default());
            judged += 1;
            match report.map(|report| report.verdict) {
                Ok(Verdict::Passed) => {}
                _ => failed += 1,
            }
        }
        println!("continuous session, {kind:?}: {judged} captures, {failed} not passed");
        let wanted = if matches!(kind, Kind::Good) {
            0
        } else {
            judged
        };
        assert_eq!(failed, wanted, "{kind:?}");
    }
}
