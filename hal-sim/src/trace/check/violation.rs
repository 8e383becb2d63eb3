//! Violations that the checker reports.

use std::fmt;

/// Violation of one rule at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Violation {
    /// Time of the violation, unwrapped microseconds.
    pub t_us: u64,
    /// Channel number, 0…9 (shown from 1).
    pub channel: u8,
    /// Violated rule, with the amount.
    pub rule: Rule,
}

/// Rules of the checker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Rule {
    /// The expectation contradicts itself or its limits; names the field.
    #[error("expectation: {0}")]
    Specification(&'static str),
    /// Recorded times do not increase, or lie past the end of the recording.
    #[error("edge out of time order or after the end of the recording")]
    TimeOrder,
    /// A pulse starts where no train of the channel has one.
    #[error("pulse that no train contains; the nearest expected pulse is at {nearest_us:?} µs")]
    OffSchedule {
        /// Nearest calculated start of the channel's train, if there is one, µs.
        nearest_us: Option<u64>,
    },
    /// A phase starts or ends at another time than the train specifies.
    #[error("edge expected at {expected_us} µs")]
    EdgeTime {
        /// Calculated time, µs.
        expected_us: u64,
    },
    /// Number or order of phases differ from the train's shape.
    #[error("pulse shape differs from that of the train")]
    Shape,
    /// Pulses of the train are absent.
    #[error("{count} pulses missing from here on")]
    Missing {
        /// Number of consecutive missing pulses.
        count: u64,
    },
    /// A biphasic pulse left charge behind.
    #[error("net charge {net} code·µs")]
    Charge {
        /// Net charge, code·µs, anodic positive.
        net: i64,
    },
    /// The DAC was written between first and last edge of a burst.
    #[error("DAC written during a burst")]
    DacDuringBurst,
    /// The DAC was written too shortly before a burst.
    #[error("DAC written {lead_us} µs before a burst")]
    DacLate {
        /// Time from the write to the burst, µs.
        lead_us: u64,
    },
    /// The amplitude exceeds the channel's limit.
    #[error("code {code} exceeds {max}")]
    Code {
        /// DAC code in force at the pulse.
        code: u16,
        /// Maximum DAC code of the channel.
        max: u16,
    },
    /// A phase is shorter or longer than allowed.
    #[error("phase of {width_us} µs")]
    Width {
        /// Length of the phase, µs.
        width_us: u64,
    },
    /// The product of amplitude and width of a phase is too large.
    #[error("phase of {code_us} code·µs exceeds {max}")]
    PhaseCharge {
        /// Product of code and width, code·µs.
        code_us: u64,
        /// Limit of the channel, code·µs.
        max: u64,
    },
    /// A pulse of a burst has another width than the burst's first.
    #[error("phase of {width_us} µs in a burst of {first_us} µs")]
    WidthInBurst {
        /// Phase width of this pulse, µs.
        width_us: u64,
        /// Phase width of the burst's first pulse, µs.
        first_us: u64,
    },
    /// Two bursts of a channel follow each other too fast.
    #[error("burst {since_us} µs after the previous one")]
    Repetition {
        /// Time from start to start, µs.
        since_us: u64,
    },
    /// Opposite polarities are too close to each other.
    #[error("polarity reversed after {gap_us} µs")]
    DeadTime {
        /// Undriven time between them, µs.
        gap_us: u64,
    },
    /// Contiguous grounding of the minimum length is missing before the next pulse.
    #[error("monophasic pulse not followed by enough contiguous grounding")]
    Discharge,
    /// The channel is not grounded although its own pulse requires it.
    #[error("grounding missing for {for_us} µs")]
    GroundingMissing {
        /// Duration without grounding, µs.
        for_us: u64,
    },
    /// The channel is grounded although nothing requires it.
    #[error("grounded for {for_us} µs without reason")]
    GroundingUnexpected {
        /// Duration of the grounding, µs.
        for_us: u64,
    },
    /// Conducted group: the channel is not grounded while another member pulses.
    #[error("not conducted for {for_us} µs while another member pulses")]
    NotConducted {
        /// Duration of the violation, µs.
        for_us: u64,
    },
    /// Isolated group: the channel is grounded while another member pulses.
    #[error("not isolated for {for_us} µs while another member pulses")]
    NotIsolated {
        /// Duration of the violation, µs.
        for_us: u64,
    },
    /// Isolated group: two members pulse at the same time.
    #[error("pulses at the same time as another member of an isolated group")]
    Overlap,
}

impl Violation {
    /// Creates a violation of `rule` by a channel at `t_us`.
    pub(super) const fn new(t_us: u64, channel: u8, rule: Rule) -> Self {
        Self {
            t_us,
            channel,
            rule,
        }
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let channel = self.channel + 1;
        write!(f, "{} µs, channel {channel}: {}", self.t_us, self.rule)
    }
}
