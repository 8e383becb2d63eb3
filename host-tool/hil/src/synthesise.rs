//! Captures made from exact edges, as an analyser with a wrong clock would record them.

use crate::capture::{Capture, CaptureError, Probe, Transition};
use hal_sim::random::Sequence;

/// Change of a line at an exact time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExactEdge {
    /// Session time, picoseconds.
    pub time_ps: i64,
    /// Level after the edge: high if true.
    pub high: bool,
}

/// Line with exact edges.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExactLine {
    /// Name of the probe in the capture.
    pub name: String,
    /// Level before the first edge: high if true.
    pub first_high: bool,
    /// Edges in order of time. An edge to the present level changes nothing.
    pub edges: Vec<ExactEdge>,
}

/// Analyser that records the lines. Line n is on the probe with bit n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Analyser {
    /// Nominal sample rate, hertz.
    pub samplerate_hz: u64,
    /// Clock error, parts per billion; positive if the analyser samples too fast. Magnitude below
    /// 10⁹.
    pub clock_ppb: i64,
    /// Session time of sample 0, picoseconds; negative if the capture begins before the session.
    pub start_ps: i64,
    /// Number of samples, from 1.
    pub samples: u64,
    /// Largest displacement of an edge, samples. Every edge is displaced by a random whole number
    /// of samples between −`jitter_samples` and `jitter_samples`.
    pub jitter_samples: u32,
    /// Seed of the displacements. Equal seeds give equal captures.
    pub seed: u64,
}

/// Fault to build into a capture. Lines and edges count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Displaces an edge in time; its neighbours stay.
    MoveEdge {
        /// Index of the line.
        line: usize,
        /// Index of the edge.
        edge: usize,
        /// Displacement, picoseconds.
        by_ps: i64,
    },
    /// Removes one edge. The line then keeps its level until the next edge to the other level.
    DropEdge {
        /// Index of the line.
        line: usize,
        /// Index of the edge.
        edge: usize,
    },
    /// Exchanges the edges of two lines, like exchanged probes.
    SwapLines {
        /// Index of the first line.
        first: usize,
        /// Index of the second line.
        second: usize,
    },
    /// Inverts all levels of a line.
    InvertLine {
        /// Index of the line.
        line: usize,
    },
    /// Makes a line dead.
    HoldLine {
        /// Index of the line.
        line: usize,
        /// Level: high if true.
        high: bool,
    },
    /// Adds a pulse of the level that the line does not have at `time_ps`.
    AddPulse {
        /// Index of the line.
        line: usize,
        /// Start, picoseconds.
        time_ps: i64,
        /// Width, picoseconds, from 1.
        width_ps: i64,
    },
}

/// Reason why a capture cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum SynthesisError {
    /// A fault names a line or an edge that does not exist.
    #[error("{fault:?}: line or edge does not exist; lines and edges count from 0")]
    NoSuchEdge {
        /// Fault that names it.
        fault: Fault,
    },
    /// A value of the analyser is out of range.
    #[error("analyser: {name} is out of range; see its documentation")]
    BadAnalyser {
        /// Name of the value.
        name: &'static str,
    },
    /// There are more than 64 lines, a name repeats, or the sample rate is out of range.
    #[error(transparent)]
    Capture(#[from] CaptureError),
}

/// Makes the capture that `analyser` records of `lines` with `faults`, which apply in order.
///
/// # Errors
/// Returns a [`SynthesisError`] if a fault names a missing line or edge, or the analyser or the
/// lines are out of range.
pub fn synthesise(
    lines: &[ExactLine],
    analyser: &Analyser,
    faults: &[Fault],
) -> Result<Capture, SynthesisError> {
    if analyser.samples == 0 || analyser.samples > 1 << 50 {
        return Err(SynthesisError::BadAnalyser { name: "samples" });
    }
    if analyser.clock_ppb.unsigned_abs() >= 1_000_000_000 {
        return Err(SynthesisError::BadAnalyser { name: "clock_ppb" });
    }
    let mut lines = lines.to_vec();
    for &fault in faults {
        apply(&mut lines, fault).ok_or(SynthesisError::NoSuchEdge { fault })?;
    }
    let mut first = 0_u64;
    let mut changes: Vec<(u64, u32, bool)> = Vec::new();
    let mut probes = Vec::new();
    for (line, bit) in lines.iter().zip(0_u8..64) {
        let (high, edges) = record(line, analyser, bit);
        first |= u64::from(high) << bit;
        changes.extend(edges.into_iter().map(|(n, high)| (n, u32::from(bit), high)));
        probes.push(Probe {
            bit,
            name: line.name.clone(),
        });
    }
    if lines.len() > 64 {
        return Err(SynthesisError::BadAnalyser { name: "lines" });
    }
    changes.sort_unstable();
    let mut transitions: Vec<Transition> = Vec::new();
    let mut levels = first;
    for (sample, bit, high) in changes {
        levels = levels & !(1 << bit) | u64::from(high) << bit;
        match transitions.last_mut() {
            Some(last) if last.sample == sample => last.levels = levels,
            _ => transitions.push(Transition { sample, levels }),
        }
    }
    let (rate, samples) = (analyser.samplerate_hz, analyser.samples);
    Ok(Capture::new(rate, samples, probes, first, transitions)?)
}

/// Returns the level of a line at sample 0, and the samples at which it changes.
fn record(line: &ExactLine, analyser: &Analyser, bit: u8) -> (bool, Vec<(u64, bool)>) {
    let stream = u64::from(bit).wrapping_mul(0xd1b5_4a32_d192_ed03);
    let mut random = Sequence::new(analyser.seed ^ stream);
    let jitter = i128::from(analyser.jitter_samples);
    let mut sampled: Vec<(i128, bool)> = Vec::new();
    for edge in &line.edges {
        let draw = random.below(u64::from(analyser.jitter_samples) * 2 + 1);
        let sample = first_sample(edge.time_ps, analyser) + i128::from(draw) - jitter;
        sampled.push((sample, edge.high));
    }
    // Jitter may exchange edges that are closer than two samples.
    sampled.sort_by_key(|entry| entry.0);
    let mut first = line.first_high;
    let mut changes: Vec<(u64, bool)> = Vec::new();
    for (sample, high) in sampled {
        if sample <= 0 {
            first = high;
            continue;
        }
        let Ok(sample) = u64::try_from(sample) else {
            break;
        };
        if sample >= analyser.samples {
            break;
        }
        if changes.last().is_some_and(|last| last.0 == sample) {
            changes.pop();
        }
        if changes.last().map_or(first, |last| last.1) != high {
            changes.push((sample, high));
        }
    }
    (first, changes)
}

/// Returns the number of the first sample at or after a time, which may be negative.
fn first_sample(time_ps: i64, analyser: &Analyser) -> i128 {
    let elapsed = i128::from(time_ps) - i128::from(analyser.start_ps);
    let rate = i128::from(analyser.samplerate_hz);
    // The product saturates only for times beyond 13 days at 100 GHz.
    let scaled = elapsed
        .saturating_mul(rate)
        .saturating_mul(1_000_000_000 + i128::from(analyser.clock_ppb));
    let unit = 1_000_000_000_000_i128 * 1_000_000_000;
    scaled.div_euclid(unit) + i128::from(scaled.rem_euclid(unit) != 0)
}

fn apply(lines: &mut [ExactLine], fault: Fault) -> Option<()> {
    match fault {
        Fault::MoveEdge { line, edge, by_ps } => {
            let edges = &mut lines.get_mut(line)?.edges;
            let moved = edges.get_mut(edge)?;
            moved.time_ps = moved.time_ps.saturating_add(by_ps);
            edges.sort_by_key(|edge| edge.time_ps);
        }
        Fault::DropEdge { line, edge } => {
            let edges = &mut lines.get_mut(line)?.edges;
            if edge >= edges.len() {
                return None;
            }
            edges.remove(edge);
        }
        Fault::SwapLines { first, second } => {
            let a = lines.get(first)?.clone();
            let other = lines.get_mut(second)?;
            let b = std::mem::replace(
                other,
                ExactLine {
                    name: other.name.clone(),
                    ..a.clone()
                },
            );
            *lines.get_mut(first)? = ExactLine { name: a.name, ..b };
        }
        Fault::InvertLine { line } => {
            let line = lines.get_mut(line)?;
            line.first_high = !line.first_high;
            line.edges
                .iter_mut()
                .for_each(|edge| edge.high = !edge.high);
        }
        Fault::HoldLine { line, high } => {
            let line = lines.get_mut(line)?;
            line.first_high = high;
            line.edges.clear();
        }
        Fault::AddPulse {
            line,
            time_ps,
            width_ps,
        } => {
            let line = lines.get_mut(line)?;
            let before = line.edges.partition_point(|edge| edge.time_ps <= time_ps);
            let last = before.checked_sub(1).and_then(|last| line.edges.get(last));
            let high = last.map_or(line.first_high, |last| last.high);
            let end = time_ps.saturating_add(width_ps);
            for (time_ps, high) in [(time_ps, !high), (end, high)] {
                line.edges.push(ExactEdge { time_ps, high });
            }
            line.edges.sort_by_key(|edge| edge.time_ps);
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_appears_at_the_first_sample_after_it() {
        let analyser = Analyser {
            samplerate_hz: 100_000_000,
            clock_ppb: 0,
            start_ps: -1_000_000,
            samples: 1_000,
            jitter_samples: 0,
            seed: 0,
        };
        assert_eq!(first_sample(0, &analyser), 100);
        assert_eq!(first_sample(1, &analyser), 101);
        assert_eq!(first_sample(-1_000_001, &analyser), 0);
        let fast = Analyser {
            clock_ppb: 100_000,
            ..analyser
        };
        // 1 s and 1 µs at 100 MS/s, 100 ppm fast.
        assert_eq!(first_sample(1_000_000_000_000, &fast), 100_010_101);
    }
}
