//! Rules of the judge, and the findings about one recording.

use super::stage::Cause;
use serde::Serialize;
use std::fmt;

/// Severe violations, each judged at the electrode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Rule {
    /// A phase longer than any command allows, 500 µs, that no fault excuses.
    CommandedPhase,
    /// A phase longer than the one-shot of a stage allows, 650 µs.
    AnyPhase,
    /// More current than the wearer's limit plus 5 %.
    Current,
    /// More than 1 µA of net direct current over a second, both with and without excused pulses.
    DirectCurrent,
    /// More than 65 µC left by a pulse that a fault truncated or prolonged.
    TruncatedCharge,
    /// More pulses begun within a second than the channel's limit,
    /// [`super::Channel::pulses_per_s`].
    Rate,
    /// Output after the deadline of a stop, host silence or fault.
    PastDeadline,
}

impl Rule {
    /// Returns the unit of a finding's amount and limit.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::CommandedPhase | Self::AnyPhase | Self::PastDeadline => "µs",
            Self::Current => "mA",
            Self::DirectCurrent => "µA",
            Self::TruncatedCharge => "µC",
            Self::Rate => "pulses/s",
        }
    }

    /// Returns the name used in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::CommandedPhase => "commanded phase",
            Self::AnyPhase => "any phase",
            Self::Current => "current",
            Self::DirectCurrent => "net direct current",
            Self::TruncatedCharge => "charge of a truncated pulse",
            Self::Rate => "rate",
            Self::PastDeadline => "output past a deadline",
        }
    }
}

/// Violation of one rule at one electrode, once or more often.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Violated rule, which determines the unit of `amount` and `limit`.
    pub rule: Rule,
    /// Channel number, 0…9 (shown from 1).
    pub channel: u8,
    /// Time of the first violation, unwrapped microseconds.
    pub t_us: u64,
    /// Worst value, in the rule's unit.
    pub amount: f64,
    /// Allowed value at that time.
    pub limit: f64,
    /// Number of violations.
    pub count: u64,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (channel, unit) = (self.channel + 1, self.rule.unit());
        let (name, amount, limit) = (self.rule.name(), self.amount, self.limit);
        write!(f, "{} µs, channel {channel}: {name} ", self.t_us)?;
        write!(
            f,
            "{amount:.3} {unit} (limit {limit:.3}), {} times",
            self.count
        )
    }
}

/// Pulse that a fault truncated or prolonged. The pulse is excused, and left out of the direct
/// current if that makes the current smaller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Truncated {
    /// Start of the pulse, µs.
    pub t_us: u64,
    /// Channel number, 0…9.
    pub channel: u8,
    /// Net charge left by the pulse, µC, anodic positive.
    pub charge_uc: f64,
}

/// Event in which a stage isolated itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Latched {
    /// Time of the event, µs.
    pub t_us: u64,
    /// Channel number, 0…9.
    pub channel: u8,
    /// Reason for the latch.
    pub cause: Cause,
}

/// Findings at all ten electrodes.
#[derive(Clone, Debug, Default, Serialize)]
pub struct OutputJudgement {
    /// Severe violations by time, channel and rule; one entry per channel and rule.
    pub findings: Vec<Finding>,
    /// Pulses excused by injected faults.
    pub truncated: Vec<Truncated>,
    /// Events in which a stage latched.
    pub latched: Vec<Latched>,
    /// Net direct current by channel in the second before the end of its last pulse, µA, anodic
    /// positive.
    pub direct_ua: Vec<f64>,
}

impl OutputJudgement {
    /// Records a violation of `rule`. Violations of the same rule on the same channel share one
    /// entry.
    pub(super) fn record_finding(
        &mut self,
        rule: Rule,
        channel: u8,
        t_us: u64,
        amount: f64,
        limit: f64,
    ) {
        let mut known = self.findings.iter_mut();
        match known.find(|f| f.rule == rule && f.channel == channel) {
            Some(finding) => {
                finding.count += 1;
                if amount > finding.amount {
                    (finding.amount, finding.limit) = (amount, limit);
                }
            }
            None => self.findings.push(Finding {
                rule,
                channel,
                t_us,
                amount,
                limit,
                count: 1,
            }),
        }
    }

    /// Adds the findings of one channel.
    pub(super) fn merge(&mut self, other: Self) {
        self.findings.extend(other.findings);
        self.findings
            .sort_by_key(|found| (found.t_us, found.channel, found.rule));
        self.truncated.extend(other.truncated);
        self.truncated.sort_by_key(|cut| (cut.t_us, cut.channel));
        self.latched.extend(other.latched);
        self.latched
            .sort_by_key(|latch| (latch.t_us, latch.channel));
        self.direct_ua.extend(other.direct_ua);
    }
}
