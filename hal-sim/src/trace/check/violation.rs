//! What can be wrong with a trace.

use std::fmt;

/// One rule broken at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Violation {
    /// When, unwrapped microseconds.
    pub t_us: u64,
    /// Channel, 0…9 (shown from 1).
    pub channel: u8,
    /// Which rule, and by how much.
    pub rule: Rule,
}

/// The rules of the checker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Rule {
    /// The expectation contradicts itself or its limits; names the field.
    #[error("expectation: {0}")]
    Specification(&'static str),
    /// Recorded times do not increase, or lie past the end of the recording.
    #[error("recorded out of order or past the end")]
    TimeOrder,
    /// A pulse starts where no train of the channel has one.
    #[error("pulse where no train has one; nearest is at {nearest_us:?} µs")]
    OffSchedule {
        /// Nearest analytic start of the channel's train, if there is one.
        nearest_us: Option<u64>,
    },
    /// A phase starts or ends at another instant than the train says.
    #[error("edge due at {expected_us} µs")]
    EdgeTime {
        /// The analytic instant.
        expected_us: u64,
    },
    /// Number or order of phases differ from the train's shape.
    #[error("shape is not the train's")]
    Shape,
    /// Pulses that the train has did not come.
    #[error("{count} pulses missing from here on")]
    Missing {
        /// How many in a row.
        count: u64,
    },
    /// A biphasic pulse left charge behind.
    #[error("net charge {net} code·µs")]
    Charge {
        /// Anodic positive.
        net: i64,
    },
    /// The DAC was written between first and last edge of a burst.
    #[error("DAC written during a burst")]
    DacDuringBurst,
    /// The DAC was written too shortly before a burst.
    #[error("DAC written {lead_us} µs before a burst")]
    DacLate {
        /// Time left.
        lead_us: u64,
    },
    /// The amplitude exceeds the channel's limit.
    #[error("code {code} exceeds {max}")]
    Code {
        /// Code in force at the pulse.
        code: u16,
        /// The channel's limit.
        max: u16,
    },
    /// A phase is shorter or longer than allowed.
    #[error("phase of {width_us} µs")]
    Width {
        /// Its length.
        width_us: u64,
    },
    /// Amplitude and width of a phase are too much together.
    #[error("phase of {code_us} code·µs exceeds {max}")]
    PhaseCharge {
        /// Their product.
        code_us: u64,
        /// The channel's limit.
        max: u64,
    },
    /// A pulse of a burst has another width than the burst's first.
    #[error("phase of {width_us} µs in a burst of {first_us} µs")]
    WidthInBurst {
        /// Its width.
        width_us: u64,
        /// The first pulse's.
        first_us: u64,
    },
    /// Two bursts of a channel follow each other too fast.
    #[error("burst {since_us} µs after the previous one")]
    Repetition {
        /// From start to start.
        since_us: u64,
    },
    /// Opposite polarities too close to each other.
    #[error("polarity reversed after {gap_us} µs")]
    DeadTime {
        /// Undriven time.
        gap_us: u64,
    },
    /// No contiguous grounding of the least length before the next pulse.
    #[error("monophasic pulse not followed by enough contiguous grounding")]
    Discharge,
    /// Not grounded although the channel's own pulse calls for it.
    #[error("grounding missing for {for_us} µs")]
    GroundingMissing {
        /// For how long.
        for_us: u64,
    },
    /// Grounded although nothing calls for it.
    #[error("grounded for {for_us} µs without reason")]
    GroundingUnexpected {
        /// For how long.
        for_us: u64,
    },
    /// Conducted group: not grounded while another member pulses.
    #[error("not conducted for {for_us} µs while another member pulses")]
    NotConducted {
        /// For how long.
        for_us: u64,
    },
    /// Isolated group: grounded while another member pulses.
    #[error("not isolated for {for_us} µs while another member pulses")]
    NotIsolated {
        /// For how long.
        for_us: u64,
    },
    /// Isolated group: two members pulse at once.
    #[error("pulses at the same time as another member of an isolated group")]
    Overlap,
}

impl Violation {
    /// This rule, broken by a channel at this instant.
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
