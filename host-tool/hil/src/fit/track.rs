//! Edges of one line as times in nanoseconds, with lookups by direction.

use super::FitError;
use crate::line::{Edge, Expected, ExpectedLine, Measurement};

/// Number of measured edges per predicted edge above which a line is noise.
const NOISE_FACTOR: usize = 10;

/// Number of measured edges that are allowed in any case.
const NOISE_MARGIN: usize = 100;

/// Edges of one line. Edges alternate, so their direction follows from the first level.
#[derive(Clone, Debug)]
pub(super) struct Track {
    pub name: String,
    pub first_high: bool,
    /// Known delay that `times` contain, nanoseconds; 0 for captured lines.
    pub skew: f64,
    /// Ascending times, nanoseconds.
    pub times: Vec<f64>,
}

impl Track {
    /// Returns the direction of the edge with an index.
    pub fn edge(&self, index: usize) -> Edge {
        Edge::towards(self.high_after(index))
    }

    /// Returns the level after the edge with an index.
    pub fn high_after(&self, index: usize) -> bool {
        index.is_multiple_of(2) != self.first_high
    }

    /// Returns the level at a time, high if true.
    pub fn high_at(&self, time: f64) -> bool {
        (self.times.partition_point(|t| *t <= time) % 2 == 1) != self.first_high
    }

    /// Returns the indices of the edges from `from` to `until`.
    pub fn range(&self, from: f64, until: f64) -> std::ops::Range<usize> {
        let start = self.times.partition_point(|t| *t < from);
        let end = self.times.partition_point(|t| *t <= until);
        start..end.max(start)
    }

    /// Returns index and time of the edge of a direction that is nearest to `time`, if its
    /// distance does not exceed `tolerance`. The earlier of two equally near edges is returned.
    pub fn nearest(&self, time: f64, edge: Edge, tolerance: f64) -> Option<(usize, f64)> {
        let mut cursor = self.times.partition_point(|t| *t < time);
        self.nearest_from(&mut cursor, time, edge, tolerance)
    }

    /// As [`Track::nearest`], for times that do not decrease from call to call: `cursor` is 0 at
    /// first, and then the place at which the previous search ended.
    pub fn nearest_from(
        &self,
        cursor: &mut usize,
        time: f64,
        edge: Edge,
        tolerance: f64,
    ) -> Option<(usize, f64)> {
        while self.times.get(*cursor).is_some_and(|t| *t < time) {
            *cursor += 1;
        }
        // Directions alternate: two edges on either side contain the nearest of each direction.
        let mut best: Option<(usize, f64)> = None;
        for index in cursor.saturating_sub(2)..*cursor + 2 {
            let Some(&t) = self.times.get(index) else {
                continue;
            };
            let distance = (t - time).abs();
            let nearer = best.is_none_or(|(_, b)| distance < (b - time).abs());
            if self.edge(index) == edge && distance <= tolerance && nearer {
                best = Some((index, t));
            }
        }
        best
    }
}

/// Lines of a capture and of the prediction, in nanoseconds of their own clocks.
pub(super) struct Tracks {
    /// Captured lines.
    pub measured: Vec<Track>,
    /// Expected lines: first those of `measured`, in the same order, then the remaining ones.
    pub expected: Vec<Track>,
    /// Start of the prediction, nanoseconds. No line moves before it.
    pub from: f64,
    /// End of the prediction, nanoseconds.
    pub until: f64,
    /// Time of the last sample, nanoseconds.
    pub end: f64,
}

impl Tracks {
    /// Checks and converts the inputs.
    pub fn new(expected: &Expected, measured: &Measurement) -> Result<Self, FitError> {
        let rate = measured.samplerate_hz as f64;
        if measured.samplerate_hz == 0 {
            return Err(bad_value("samplerate", rate));
        }
        let (from_us, until_us) = (expected.from_us, expected.until_us);
        unique(expected.lines.iter().map(|line| line.name.as_str()))?;
        unique(measured.lines.iter().map(|line| line.name.as_str()))?;
        let find = |name: &str| expected.lines.iter().find(|line| line.name == name);
        let mut tracks = Tracks {
            measured: Vec::new(),
            expected: Vec::new(),
            from: from_us as f64 * 1e3,
            until: until_us as f64 * 1e3,
            end: measured.samples.saturating_sub(1) as f64 * 1e9 / rate,
        };
        for line in &measured.lines {
            let name = line.name.clone();
            let unknown = FitError::UnknownLine { name };
            let expected = find(&line.name).ok_or(unknown)?;
            check_order(
                &line.name,
                &line.edges,
                1,
                measured.samples.saturating_sub(1),
            )?;
            tracks
                .expected
                .push(expected_track(expected, from_us, until_us)?);
            tracks.measured.push(Track {
                name: line.name.clone(),
                first_high: line.first_high,
                skew: 0.0,
                times: line.edges.iter().map(|n| *n as f64 * 1e9 / rate).collect(),
            });
        }
        for line in &expected.lines {
            if measured.lines.iter().all(|other| other.name != line.name) {
                let track = expected_track(line, from_us, until_us)?;
                tracks.expected.push(track);
            }
        }
        Ok(tracks)
    }

    /// Returns the same lines with all captured levels inverted.
    pub fn inverted(&self) -> Tracks {
        let invert = |track: &Track| Track {
            first_high: !track.first_high,
            ..track.clone()
        };
        Tracks {
            measured: self.measured.iter().map(invert).collect(),
            expected: self.expected.clone(),
            ..*self
        }
    }

    /// Returns the captured lines that may decide the alignment, with their indices and expected
    /// lines. A line with many more edges than predicted is noise, for example of a floating probe.
    pub fn voters(&self) -> impl Iterator<Item = (usize, (&Track, &Track))> + Clone {
        self.pairs()
            .enumerate()
            .filter(|(_, (measured, expected))| {
                let (count, predicted) = (measured.times.len(), expected.times.len());
                predicted > 0 && count <= NOISE_FACTOR * predicted + NOISE_MARGIN
            })
    }

    /// Returns the captured lines, each with its expected line.
    pub fn pairs(&self) -> impl Iterator<Item = (&Track, &Track)> + Clone {
        self.measured.iter().zip(&self.expected)
    }
}

fn expected_track(line: &ExpectedLine, from_us: u64, until_us: u64) -> Result<Track, FitError> {
    check_order(&line.name, &line.edges_us, from_us, until_us)?;
    if !line.skew_ns.is_finite() || line.skew_ns.abs() > MAX_SKEW_NS {
        return Err(bad_value("skew_ns", line.skew_ns));
    }
    let time = |t_us: &u64| *t_us as f64 * 1e3 + line.skew_ns;
    Ok(Track {
        name: line.name.clone(),
        first_high: line.first_high,
        skew: line.skew_ns,
        times: line.edges_us.iter().map(time).collect(),
    })
}

/// Largest skew of a line: below the resolution of the expected edges, nanoseconds.
pub(super) const MAX_SKEW_NS: f64 = 1_000.0;

pub(super) fn bad_value(name: &'static str, value: f64) -> FitError {
    FitError::BadValue { name, value }
}

fn check_order(name: &str, edges: &[u64], from: u64, until: u64) -> Result<(), FitError> {
    let mut least = from;
    for (index, &edge) in edges.iter().enumerate() {
        if edge < least || edge > until {
            let name = name.to_string();
            return Err(FitError::BadEdge { name, index });
        }
        least = edge.saturating_add(1);
    }
    Ok(())
}

fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Result<(), FitError> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            let name = name.to_string();
            return Err(FitError::RepeatedLine { name });
        }
    }
    Ok(())
}
