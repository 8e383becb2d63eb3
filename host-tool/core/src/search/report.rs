//! The report of a search in JSON.

use super::plan::{Search, Site};
use super::stair::{Answer, Finding, SearchEnd};
use crate::session::Session;
use serde_json::{Value, json};

/// Text that stands for the unit of levels that are ratios to the largest level, `max`.
pub const PART: &str = "of max";

/// Returns the unit of the levels of a search: "mA", "V" or [`PART`].
#[must_use]
pub fn level_unit(search: &Search, session: &Session) -> &'static str {
    let site_channel = |site: &Site| match site.max {
        Some(_) => None,
        None => session.channel(site.channel - 1), // from 1: checked
    };
    let channel = search.sites().first().and_then(site_channel);
    channel.map_or(PART, |channel| channel.unit().symbol())
}

/// Returns the report of a search: result, interval, cost and trail.
#[must_use]
pub fn report<E>(search: &Search, session: &Session, finding: &Finding<E>) -> Value {
    let trail = finding.trail.iter().map(|step| {
        let answer = match step.answer {
            Answer::Measured(v) => json!({ "deviation_deg": v.deviation, "bound_deg": v.bound }),
            Answer::Seen(moved) => json!({ "seen": moved }),
            Answer::Rated(rating, accepted) => json!({ "rating": rating, "accepted": accepted }),
        };
        json!({
            "level": step.level, "repeat": step.repeat, "pulses": step.pulses,
            "positive": step.answer.is_positive(), "answer": answer,
        })
    });
    let ended = match finding.ended {
        SearchEnd::Found => "found",
        SearchEnd::Limit => "limit",
        SearchEnd::Refused(_) => "refused",
        SearchEnd::Failed(_) => "failed",
    };
    let channels: Vec<u8> = search.sites().iter().map(|site| site.channel).collect();
    json!({
        "kind": search.declaration().kind.name(), "channels": channels,
        "unit": level_unit(search, session), "value": finding.value, "low": finding.low,
        "high": finding.high, "set": finding.level_to_set(search), "ended": ended,
        "presentations": finding.trail.len(), "pulses": finding.pulses,
        "false_alarm": search.false_alarm(), "trail": trail.collect::<Vec<_>>(),
    })
}
