//! Lines as the fit compares them: names, first levels and times of level changes.

use std::fmt;

/// Direction of a level change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Edge {
    /// From low to high.
    Rising,
    /// From high to low.
    Falling,
}

impl Edge {
    /// Returns the direction that ends at the given level.
    pub const fn towards(high: bool) -> Edge {
        if high { Edge::Rising } else { Edge::Falling }
    }
}

impl fmt::Display for Edge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Edge::Rising => "rising",
            Edge::Falling => "falling",
        })
    }
}

/// Predicted level changes of one line.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedLine {
    /// Name, for example `c1`, `a1` or `sync`.
    pub name: String,
    /// Known delay of the line against the first port, nanoseconds. Must be finite.
    pub skew_ns: f64,
    /// Level before the first edge: high if true.
    pub first_high: bool,
    /// Times of the level changes, microseconds, strictly ascending. Each one toggles the level.
    pub edges_us: Vec<u64>,
}

/// Line that changes its level at all times, with a period that no session changes.
#[derive(Clone, Debug, PartialEq)]
pub struct TogglingLine {
    /// Name, for example `pump`.
    pub name: String,
    /// Time between two level changes, microseconds. Must be finite and above 1.
    pub half_period_us: f64,
}

/// Predicted level changes of all lines.
#[derive(Clone, Debug, PartialEq)]
pub struct Expected {
    /// Start of the prediction, microseconds. Every line keeps its first level before it, so a
    /// capture may begin earlier, but must not have edges there.
    pub from_us: u64,
    /// End of the prediction, microseconds. Nothing is known about the time after it, so a capture
    /// must end earlier.
    pub until_us: u64,
    /// Lines with unique names. Their edges must lie between `from_us` and `until_us`.
    pub lines: Vec<ExpectedLine>,
    /// Lines that toggle at all times, also before and after the prediction.
    pub toggling: Vec<TogglingLine>,
}

/// Level changes of one line in a capture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeasuredLine {
    /// Name of the expected line that the probe is connected to.
    pub name: String,
    /// Level at sample 0: high if true.
    pub first_high: bool,
    /// Numbers of the first samples with a changed level, strictly ascending, from 1.
    pub edges: Vec<u64>,
}

/// Level changes of all lines in one capture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Measurement {
    /// Nominal sample rate of the analyser, hertz. Must not be 0.
    pub samplerate_hz: u64,
    /// Number of samples in the capture.
    pub samples: u64,
    /// Lines with unique names.
    pub lines: Vec<MeasuredLine>,
}
