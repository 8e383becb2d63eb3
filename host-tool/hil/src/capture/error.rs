//! Reasons why a capture is refused.

/// Reason why a capture cannot be read or written. [`CaptureError::number`] is stable.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// The archive is damaged or uses a feature that session files do not have.
    #[error("capture: the zip archive cannot be read ({0}); record or copy the file again")]
    Archive(#[source] zip::result::ZipError),
    /// Reading or writing failed, or the checksum of a part of the archive is wrong.
    #[error("capture, {entry}: {source}; record or copy the file again")]
    Io {
        /// Name of the entry in the archive.
        entry: String,
        /// Error of the operating system or of the decompressor.
        source: std::io::Error,
    },
    /// An entry that every session file has is missing.
    #[error("capture: no entry `{entry}`; give a session file that sigrok saved (.sr)")]
    MissingEntry {
        /// Name of the entry.
        entry: &'static str,
    },
    /// The version of the session file is not 1 or 2.
    #[error(
        "capture, version: `{text}` is not 1 or 2; save the capture with sigrok 0.7 or PulseView"
    )]
    BadVersion {
        /// Text of the entry, shortened to 16 characters.
        text: String,
    },
    /// The metadata are not UTF-8, exceed 64 KiB, or a key has a value that is not a number.
    #[error("capture, metadata, line {line}: {problem}; record the file again")]
    BadMetadata {
        /// Line from 1, or 0 if the whole entry is affected.
        line: usize,
        /// Description of the problem.
        problem: &'static str,
    },
    /// A key that the reader needs is missing in `[device 1]`.
    #[error("capture, metadata: [device 1] has no `{key}`; record logic probes, not analogue only")]
    MissingKey {
        /// Name of the key.
        key: &'static str,
    },
    /// The file has more than one device.
    #[error("capture, metadata: more than one device; record each analyser into its own file")]
    SeveralDevices,
    /// The sample rate is not a number of hertz from 1 Hz to 100 GHz.
    #[error("capture: samplerate cannot be `{text}`; allowed: 1 Hz to 100 GHz")]
    BadSamplerate {
        /// Text of the value.
        text: String,
    },
    /// The number of bytes per sample is not 1 to 8.
    #[error("capture, metadata: unitsize cannot be {unitsize}; allowed: 1 to 8 bytes")]
    BadUnitSize {
        /// Number of bytes.
        unitsize: u64,
    },
    /// A probe has no bit in the samples, occurs twice, or has no usable name.
    #[error("capture: probe `{name}` cannot use bit {bit}; allowed: unique bits within unitsize")]
    BadProbe {
        /// Bit of the probe, from 0 (255 if it exceeds 254).
        bit: u8,
        /// Name of the probe.
        name: String,
    },
    /// No probe is recorded.
    #[error("capture, metadata: no probe is enabled; enable the probes and record again")]
    NoProbes,
    /// A chunk of samples is missing.
    #[error(
        "capture: no chunk `{entry}` although a later one exists; record or copy the file again"
    )]
    MissingChunk {
        /// Name of the missing entry.
        entry: String,
    },
    /// The length of a chunk is not a multiple of the sample size.
    #[error(
        "capture, {entry}: ends within a sample of {unitsize} bytes; record or copy the file again"
    )]
    PartialSample {
        /// Name of the chunk.
        entry: String,
        /// Bytes per sample.
        unitsize: usize,
    },
    /// The samples exceed [`super::ReadOptions::max_bytes`].
    #[error("capture: more than {limit} bytes of samples; record a shorter time")]
    TooLong {
        /// Allowed number of bytes.
        limit: u64,
    },
    /// The transitions exceed [`super::ReadOptions::max_transitions`].
    #[error(
        "capture: more than {limit} transitions; disconnect clock lines, or record a shorter time"
    )]
    TooManyTransitions {
        /// Allowed number of transitions.
        limit: usize,
    },
    /// The capture has no sample.
    #[error("capture: no samples; check the trigger and record again")]
    Empty,
    /// Transitions are not in order of time, or one changes nothing.
    #[error(
        "capture: transition {index} is out of order, out of range or changes nothing; sort the transitions"
    )]
    BadTransition {
        /// Index of the transition, from 0.
        index: usize,
    },
}

impl CaptureError {
    /// Returns the stable number of the reason, 1 to 17.
    pub const fn number(&self) -> u8 {
        match self {
            Self::Archive(_) => 1,
            Self::Io { .. } => 2,
            Self::MissingEntry { .. } => 3,
            Self::BadVersion { .. } => 4,
            Self::BadMetadata { .. } => 5,
            Self::MissingKey { .. } => 6,
            Self::SeveralDevices => 7,
            Self::BadSamplerate { .. } => 8,
            Self::BadUnitSize { .. } => 9,
            Self::BadProbe { .. } => 10,
            Self::NoProbes => 11,
            Self::MissingChunk { .. } => 12,
            Self::PartialSample { .. } => 13,
            Self::TooLong { .. } => 14,
            Self::TooManyTransitions { .. } => 15,
            Self::Empty => 16,
            Self::BadTransition { .. } => 17,
        }
    }
}
