//! Captures as lists of transitions, and sigrok session files that store them.
//!
//! [`read()`] streams a `.sr` file and keeps only the samples at which a probe changed, so memory
//! depends on the number of transitions and not on the length. [`write()`] stores a capture. The
//! format facts are those of libsigrok (`src/session_file.c`, `src/session_driver.c` and
//! `src/output/srzip.c`), checked with files of sigrok-cli 0.7.2.

mod error;
mod metadata;
mod read;
mod write;

pub use error::CaptureError;
pub use read::{ReadOptions, read};
pub use write::write;

use crate::line::MeasuredLine;

/// Highest sample rate that a capture may state, hertz.
pub const MAX_SAMPLERATE_HZ: u64 = 100_000_000_000;

/// One input of the analyser.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Probe {
    /// Bit of the probe in the levels, 0 to 63.
    pub bit: u8,
    /// Name in the capture, for example `D0`.
    pub name: String,
}

/// Sample at which at least one probe changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// Number of the first sample with the new levels, from 1.
    pub sample: u64,
    /// Levels of all probes from this sample on; bit n belongs to the probe with bit n.
    pub levels: u64,
}

/// Recording of an analyser, reduced to its transitions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Capture {
    samplerate_hz: u64,
    samples: u64,
    probes: Vec<Probe>,
    first: u64,
    transitions: Vec<Transition>,
}

impl Capture {
    /// Returns a capture of `samples` samples with the levels `first` at sample 0.
    ///
    /// # Errors
    /// Returns [`CaptureError::BadSamplerate`] unless the rate is 1 Hz to [`MAX_SAMPLERATE_HZ`],
    /// [`CaptureError::BadProbe`] if a bit exceeds 63 or occurs twice, or a name is empty or has a
    /// line break, and [`CaptureError::BadTransition`] if samples do not ascend or lie outside
    /// 1 to `samples` − 1, or a transition changes nothing.
    pub fn new(
        samplerate_hz: u64,
        samples: u64,
        probes: Vec<Probe>,
        first: u64,
        transitions: Vec<Transition>,
    ) -> Result<Self, CaptureError> {
        if samplerate_hz == 0 || samplerate_hz > MAX_SAMPLERATE_HZ {
            let text = format!("{samplerate_hz} Hz");
            return Err(CaptureError::BadSamplerate { text });
        }
        let mut used = 0_u64;
        for probe in &probes {
            let bit = 1_u64.checked_shl(probe.bit.into()).unwrap_or(0);
            let unusable = probe.name.trim().is_empty() || probe.name.contains(['\n', '\r']);
            if bit == 0 || used & bit != 0 || unusable {
                return Err(CaptureError::BadProbe {
                    bit: probe.bit,
                    name: probe.name.clone(),
                });
            }
            used |= bit;
        }
        let (mut sample, mut levels) = (0, first);
        for (index, transition) in transitions.iter().enumerate() {
            let ordered = transition.sample > sample && transition.sample < samples;
            if !ordered || transition.levels == levels {
                return Err(CaptureError::BadTransition { index });
            }
            (sample, levels) = (transition.sample, transition.levels);
        }
        Ok(Self {
            samplerate_hz,
            samples,
            probes,
            first,
            transitions,
        })
    }

    /// Returns the nominal sample rate, hertz.
    pub fn samplerate_hz(&self) -> u64 {
        self.samplerate_hz
    }

    /// Returns the number of samples.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Returns the probes that were recorded.
    pub fn probes(&self) -> &[Probe] {
        &self.probes
    }

    /// Returns the levels at sample 0.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// Returns the transitions in order of time.
    pub fn transitions(&self) -> &[Transition] {
        &self.transitions
    }

    /// Returns the level changes of one probe under the name of the line that it is connected to,
    /// or `None` if the capture has no such probe.
    pub fn line(&self, bit: u8, name: &str) -> Option<MeasuredLine> {
        self.probes.iter().find(|probe| probe.bit == bit)?;
        let level = |levels: u64| levels >> bit & 1 == 1;
        let first_high = level(self.first);
        let mut high = first_high;
        let mut edges = Vec::new();
        for transition in &self.transitions {
            if level(transition.levels) != high {
                high = !high;
                edges.push(transition.sample);
            }
        }
        Some(MeasuredLine {
            name: name.to_string(),
            first_high,
            edges,
        })
    }
}
