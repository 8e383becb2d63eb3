//! The rules, and what was found of them.

use super::stage::Cause;
use serde::Serialize;
use std::fmt;

/// What is severe, each judged at the electrode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Rule {
    /// A phase longer than any command may be, 500 µs, which no fault cut off.
    CommandedPhase,
    /// A phase longer than a one-shot lets any be, 650 µs.
    AnyPhase,
    /// More current than the wearer's limit and 5 %.
    Current,
    /// More than 1 µA of net direct current for a second, with excused pulses and without.
    DirectCurrent,
    /// More than 65 µC left by the pulse that a fault cut off or held.
    TruncatedCharge,
    /// More pulses begun within a second than were checked.
    Rate,
    /// Output past a deadline.
    PastDeadline,
}

impl Rule {
    /// Unit of a finding's amount and limit.
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

    /// The name in reports.
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

/// One rule broken at one electrode, once or often.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Which rule.
    pub rule: Rule,
    /// Channel, 0…9 (shown from 1).
    pub channel: u8,
    /// When first, unwrapped microseconds.
    pub t_us: u64,
    /// The worst, in the rule's unit.
    pub amount: f64,
    /// What would have been allowed then.
    pub limit: f64,
    /// How often.
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

/// The pulse that a fault cut off or held: excused, and counted in no direct
/// current that is less without it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Truncated {
    /// When it began, µs.
    pub t_us: u64,
    /// Channel, 0…9.
    pub channel: u8,
    /// Net charge that it left, µC, anodic positive.
    pub charge_uc: f64,
}

/// A stage isolated itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Latched {
    /// When, µs.
    pub t_us: u64,
    /// Channel, 0…9.
    pub channel: u8,
    /// Why.
    pub cause: Cause,
}

/// Everything that ten electrodes saw.
#[derive(Clone, Debug, Default, Serialize)]
pub struct OutputJudgement {
    /// What is severe, by time, channel and rule; one entry a channel and rule.
    pub findings: Vec<Finding>,
    /// Pulses that declared faults excuse.
    pub truncated: Vec<Truncated>,
    /// Stages that latched.
    pub latched: Vec<Latched>,
    /// Net direct current of the second before its last pulse was over, µA,
    /// anodic positive, by channel.
    pub direct_ua: Vec<f64>,
}

impl OutputJudgement {
    /// Notes that `rule` was broken.
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

    /// Adds a channel's.
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
