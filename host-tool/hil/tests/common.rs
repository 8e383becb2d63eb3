//! Sessions and captures that the tests share.

use hal_sim::random::Sequence;
use hil::capture::Capture;
use hil::expected::{ChannelState, SECOND_PORT_SKEW_NS, StateChange, SyncSource, from_states};
use hil::fit::{FitError, FitOptions, Report, fit};
use hil::line::Expected;
use hil::plan::{Connection, Plan, connect, plan};
use hil::synthesise::{Analyser, ExactEdge, ExactLine, Fault, synthesise};

/// Period of the trains, microseconds.
pub const PERIOD_US: u64 = 20_000;
/// Time of the first pulse, microseconds.
pub const BEGIN_US: u64 = 250_000;

/// Skew of the reference board: channels 6 to 10 and sync are on the second port.
pub fn skew_ns(name: &str) -> f64 {
    let second = [
        "c6", "a6", "c7", "a7", "c8", "a8", "c9", "a9", "c10", "a10", "sync",
    ];
    if second.contains(&name) {
        SECOND_PORT_SKEW_NS
    } else {
        0.0
    }
}

/// The session ten_channels.toml: biphasic pulses at 50 Hz, 2 ms apart, doublets on channel 4.
/// With `ground_us`, each pulse is followed by grounding.
pub fn session(seconds: u64, ground_us: u64) -> Expected {
    let mut rows = Vec::new();
    let until_us = seconds * 1_000_000;
    for period in 0.. {
        let start = BEGIN_US + period * PERIOD_US;
        if start + PERIOD_US > until_us {
            break;
        }
        for channel in 1..=10_u8 {
            let offset = u64::from(channel - 1) * 2_000;
            let burst: &[u64] = if channel == 4 { &[0, 5_000] } else { &[0] };
            for interval in burst {
                let t = start + offset + interval;
                let mut push = |t_us, state| {
                    rows.push(StateChange {
                        t_us,
                        channel,
                        state,
                    });
                };
                push(t, ChannelState::Cathodic);
                push(t + 200, ChannelState::Isolated);
                push(t + 250, ChannelState::Anodic);
                if ground_us > 0 {
                    push(t + 450, ChannelState::Grounded);
                }
                push(t + 450 + ground_us, ChannelState::Isolated);
            }
        }
    }
    rows.sort_by_key(|row| (row.t_us, row.channel));
    let sync = SyncSource {
        channel: 1,
        first: ChannelState::Cathodic,
    };
    from_states(&rows, 10, Some(sync), 0, until_us, skew_ns).expect("rows are in order")
}

/// Plan of the board: 20 lines, 8 inputs.
pub fn board_plan() -> Plan {
    let names: Vec<String> = (1..=10)
        .flat_map(|n| [format!("c{n}"), format!("a{n}")])
        .collect();
    plan(&names, "sync", 8).expect("names are unique")
}

/// Exact edges of the connected lines, as a chip would give them: each edge is late by the skew
/// and by 0 to 119 ns.
pub fn exact(expected: &Expected, connections: &[Connection], seed: u64) -> Vec<ExactLine> {
    let late = |random: &mut Sequence| random.below(119_000) as i64;
    exact_with(expected, connections, seed, late)
}

/// As [`exact`], with another delay in picoseconds.
pub fn exact_with(
    expected: &Expected,
    connections: &[Connection],
    seed: u64,
    delay_ps: impl Fn(&mut Sequence) -> i64,
) -> Vec<ExactLine> {
    let mut random = Sequence::new(seed ^ 0x5eed);
    let highest = connections.iter().map(|c| c.bit).max().unwrap();
    let lines = (0..=highest).map(|bit| {
        let connection = connections.iter().find(|c| c.bit == bit);
        let Some(connection) = connection else {
            return ExactLine {
                name: format!("D{bit}"),
                first_high: false,
                edges: Vec::new(),
            };
        };
        let name = &connection.line;
        let line = expected
            .lines
            .iter()
            .find(|line| line.name == *name)
            .unwrap();
        let mut high = line.first_high;
        let edges = line.edges_us.iter().map(|t_us| {
            high = !high;
            let late = (line.skew_ns * 1e3) as i64 + delay_ps(&mut random);
            ExactEdge {
                time_ps: *t_us as i64 * 1_000_000 + late,
                high,
            }
        });
        ExactLine {
            name: format!("D{bit}"),
            first_high: line.first_high,
            edges: edges.collect(),
        }
    });
    lines.collect()
}

/// One randomly generated capture.
pub struct Draw {
    pub expected: Expected,
    pub connections: Vec<Connection>,
    pub lines: Vec<ExactLine>,
    pub analyser: Analyser,
    pub random: Sequence,
}

impl Draw {
    /// Draws a part of the plan, a start between 170 and 800 ms and a length of 120 to 180 ms.
    pub fn new(seed: u64, rate_hz: u64, ppm: i64, ground_us: u64) -> Draw {
        let mut random = Sequence::new(seed);
        let expected = session(1, ground_us);
        let part = random.below(3) as usize;
        let connections = board_plan().captures.swap_remove(part);
        let lines = exact(&expected, &connections, seed);
        let start_ps = 170_000_000_000 + random.below(630_000_000_000) as i64;
        let length_us = 120_000 + random.below(60_000);
        let analyser = Analyser {
            samplerate_hz: rate_hz,
            clock_ppb: ppm * 1_000,
            start_ps,
            samples: length_us * rate_hz / 1_000_000,
            jitter_samples: 1,
            seed,
        };
        Draw {
            expected,
            connections,
            lines,
            analyser,
            random,
        }
    }

    /// Captured session time without 100 µs at both ends, picoseconds.
    pub fn inside(&self) -> (i64, i64) {
        let length =
            self.analyser.samples as i64 * (1_000_000_000_000 / self.analyser.samplerate_hz as i64);
        let start = self.analyser.start_ps;
        (start + 100_000_000, start + length - 100_000_000)
    }

    /// Draws an edge whose successor is also inside the capture. Returns line and edge index.
    pub fn edge(&mut self) -> (usize, usize) {
        let (from, until) = self.inside();
        let within = |edge: &ExactEdge| from < edge.time_ps && edge.time_ps < until;
        let mut edges = Vec::new();
        for (line, exact) in self.lines.iter().enumerate() {
            for (index, pair) in exact.edges.windows(2).enumerate() {
                if within(&pair[0]) && within(&pair[1]) {
                    edges.push((line, index));
                }
            }
        }
        edges[self.random.below(edges.len() as u64) as usize]
    }

    /// Name of the line on a bit.
    pub fn name(&self, bit: usize) -> String {
        let connection = self.connections.iter().find(|c| usize::from(c.bit) == bit);
        connection.expect("connected").line.clone()
    }

    /// Expected time of an edge, microseconds.
    pub fn time_us(&self, bit: usize, edge: usize) -> u64 {
        let name = self.name(bit);
        let line = self.expected.lines.iter().find(|line| line.name == name);
        line.unwrap().edges_us[edge]
    }

    pub fn capture(&self, faults: &[Fault]) -> Capture {
        synthesise(&self.lines, &self.analyser, faults).expect("faults name existing edges")
    }

    pub fn fit(&self, faults: &[Fault]) -> Result<Report, FitError> {
        self.fit_with(faults, &FitOptions::default())
    }

    pub fn fit_with(&self, faults: &[Fault], options: &FitOptions) -> Result<Report, FitError> {
        let measured = connect(&self.capture(faults), &self.connections).expect("all probes");
        fit(&self.expected, &measured, options)
    }
}
