//! Reasons why a capture cannot be compared.

/// Reason why a capture cannot be aligned with the expected edges. [`FitError::number`] is stable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// A measured line has no expected line with its name.
    #[error("line `{name}`: no such line is expected; use the names of the plan")]
    UnknownLine {
        /// Name of the line.
        name: String,
    },
    /// Two lines have one name.
    #[error("line `{name}`: the name occurs twice; give each line its own name")]
    RepeatedLine {
        /// Name of the line.
        name: String,
    },
    /// Edges of a line do not ascend, or lie outside the capture or the prediction.
    #[error("line `{name}`: edge {index} is out of order or outside the record; sort the edges")]
    BadEdge {
        /// Name of the line.
        name: String,
        /// Index of the edge, from 0.
        index: usize,
    },
    /// An option or a skew is negative or not finite, or the sample rate is 0.
    #[error("{name} cannot be {value}; use a finite number in the documented range")]
    BadValue {
        /// Name of the value.
        name: &'static str,
        /// The rejected number, in the unit of the option.
        value: f64,
    },
    /// No line of the capture has an edge.
    #[error("the capture has no edge; check probes, ground and trigger, and record again")]
    NothingMeasured,
    /// No captured line has an expected edge.
    #[error("no edge is expected on the captured lines; predict a longer time")]
    NothingExpected,
    /// No alignment explains the capture.
    #[error(
        "the capture does not fit the expected edges (best alignment: {matched} of {measured} \
         edges); check session, sample rate and probes"
    )]
    NotAligned {
        /// Measurement edges that the best alignment explains.
        matched: usize,
        /// Measurement edges.
        measured: usize,
    },
    /// The aligned edges do not determine the clock of the analyser.
    #[error("only {matched} edges can be compared; record at least {needed} edges")]
    TooFewEdges {
        /// Number of edges that fit.
        matched: usize,
        /// Smallest number of edges.
        needed: usize,
    },
}

impl FitError {
    /// Returns the stable number of the reason, 1 to 8.
    pub const fn number(&self) -> u8 {
        match self {
            Self::UnknownLine { .. } => 1,
            Self::RepeatedLine { .. } => 2,
            Self::BadEdge { .. } => 3,
            Self::BadValue { .. } => 4,
            Self::NothingMeasured => 5,
            Self::NothingExpected => 6,
            Self::NotAligned { .. } => 7,
            Self::TooFewEdges { .. } => 8,
        }
    }
}
