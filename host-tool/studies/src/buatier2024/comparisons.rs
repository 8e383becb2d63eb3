//! Compares conditions within participants and between studies.

use super::declaration::{Claim, Condition, Metric, Side, Study};
use super::error::LiftError;
use super::participant::Participant;
use super::person::{LiftWearer, nominal_values};
use super::replication::Replication;
use super::tests::PAIRS;
use super::whole::compare_whole_device;
use crate::laboratory::{Row, Share};
use host_core::statistics;

/// Returns a participant's value of `metric` in the condition and at the height of `side`; `None`
/// if the condition was not simulated.
#[must_use]
pub fn value(study: &Study, person: &Participant, metric: Metric, side: &Side) -> Option<f64> {
    let height = side.height.as_ref().and_then(|name| study.height(name));
    Some(
        person
            .condition_result(side.condition)?
            .value(metric, height),
    )
}

/// Returns whether a claim holds for one participant: whether its `lower` side has a smaller value
/// than its `higher` side. `None` if either value is missing.
#[must_use]
pub fn holds(study: &Study, person: &Participant, claim: &Claim) -> Option<bool> {
    let side = |side| value(study, person, claim.metric, side);
    let (lower, higher) = (side(&claim.lower)?, side(&claim.higher)?);
    (lower.is_finite() && higher.is_finite()).then_some(lower < higher)
}

fn people(replications: &[Replication]) -> impl Iterator<Item = &Participant> {
    replications
        .iter()
        .flat_map(|replication| &replication.people)
}

fn mean(study: &Study, own: &Replication, metric: Metric, side: &Side) -> f64 {
    let values =
        (own.people.iter()).filter_map(|participant| value(study, participant, metric, side));
    statistics::mean(values).unwrap_or(f64::NAN)
}

/// Returns the p between the claim's two conditions in a study, multiplied by three (Bonferroni);
/// `None` if the claim does not compare two conditions.
fn p_value(own: &Replication, claim: &Claim) -> Option<f64> {
    let place = |side: &Side| {
        Condition::ALL
            .iter()
            .position(|condition| *condition == side.condition)
    };
    let (a, b) = (place(&claim.lower)?, place(&claim.higher)?);
    let pair = PAIRS
        .iter()
        .position(|pair| *pair == [a.min(b), a.max(b)])?;
    let is = |test: &&super::tests::Tested| test.metric == claim.metric && test.height.is_none();
    Some(own.tests.iter().find(is)?.pairs[pair][1])
}

/// Returns three shares for each claim: that of participants for whom the claim holds, that of
/// studies in which it holds, and that of studies in which the difference is significant with
/// either sign.
#[must_use]
pub(super) fn shares(study: &Study, replications: &[Replication]) -> Vec<Share> {
    let mut shares = Vec::new();
    for claim in &study.claims {
        let known: Vec<bool> = people(replications)
            .filter_map(|participant| holds(study, participant, claim))
            .collect();
        let counted = |known: &[bool]| {
            let holds = known.iter().filter(|flag| **flag).count();
            (holds as u64, known.len() as u64)
        };
        let named = |more: &str, says: &str| (format!("{}{more}", claim.id), says.to_owned());
        let (id, says) = named("", &format!("wearers: {}", claim.says));
        shares.push(Share::from_counts(id, says, claim.paper, counted(&known)));
        let sides = |own: &Replication| {
            let mean = |side| mean(study, own, claim.metric, side);
            mean(&claim.lower) < mean(&claim.higher)
        };
        let known: Vec<bool> = replications.iter().map(sides).collect();
        let (id, says) = named("/studies", &format!("studies: {}", claim.says));
        shares.push(Share::from_counts(id, says, claim.paper, counted(&known)));
        let known: Vec<bool> = (replications
            .iter()
            .filter_map(|replication| p_value(replication, claim)))
        .map(|p| p < study.protocol.level)
        .collect();
        if !known.is_empty() {
            let (id, says) = named(
                "/significant",
                &format!("p < 0.05, either sign: {}", claim.says),
            );
            shares.push(Share::from_counts(
                id,
                says,
                claim.significant,
                counted(&known),
            ));
        }
    }
    shares
}

/// Returns rows over studies: every mean of figure 4 beside the printed one, changes of the
/// metabolic proxy, its fraction of the printed power, and effects of stimulation.
#[must_use]
pub(super) fn rows(study: &Study, replications: &[Replication]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (metric, height) in super::replication::families() {
        let name = height.map(|height| study.way.heights[height].name.clone());
        for condition in Condition::ALL {
            let side = Side {
                condition,
                height: name.clone(),
            };
            let (quantity, unit) = metric.name_and_unit();
            let at = name
                .as_deref()
                .map_or_else(String::new, |name| format!(", {name}"));
            let printed = study.printed.iter().find(|printed_value| {
                printed_value.metric == metric
                    && printed_value.condition == condition
                    && printed_value.height == name
            });
            let printed = printed.map(|printed_value| printed_value.mean);
            let values = replications
                .iter()
                .map(|replication| mean(study, replication, metric, &side));
            let id = format!(
                "{}/{}{}",
                condition.name(),
                quantity.replace(' ', "-"),
                at.replace(", ", "/")
            );
            let quantity = format!("{}: {quantity}{at}", condition.name());
            rows.push(Row::from_numbers(id, quantity, unit, printed, values));
        }
    }
    rows.extend(changes(study, replications));
    rows.extend(proxy_rows(study, replications));
    rows.extend(stimulation_rows(replications));
    rows
}

/// Returns the changes of the metabolic proxy in percent, as the paper's text prints them and as
/// its means imply.
fn changes(study: &Study, replications: &[Replication]) -> [Row; 5] {
    use Condition::{Assist, None, Resist};
    let power = |own: &Replication, condition| {
        let side = Side {
            condition,
            height: Option::None,
        };
        mean(study, own, Metric::Power, &side)
    };
    let printed = |condition| {
        let mut printed_values = study.printed.iter();
        let own = printed_values.find(|printed_value| {
            printed_value.metric == Metric::Power && printed_value.condition == condition
        });
        own.map_or(f64::NAN, |printed_value| printed_value.mean)
    };
    let row = |id: &str, quantity: &str, paper: f64, measure: &dyn Fn(&Replication) -> f64| {
        let values = replications.iter().map(measure);
        Row::from_numbers(id.to_owned(), quantity.to_owned(), "%", Some(paper), values)
    };
    let change = |from, to, over| {
        move |own: &Replication| 100.0 * (power(own, to) - power(own, from)) / power(own, over)
    };
    let meant = |from, to, over| 100.0 * (printed(to) - printed(from)) / printed(over);
    [
        row(
            "resist/of-resist",
            "(resist − none) / resist (paper's text)",
            35.73,
            &change(None, Resist, Resist),
        ),
        row(
            "resist/of-none",
            "(resist − none) / none (paper's means)",
            meant(None, Resist, None),
            &change(None, Resist, None),
        ),
        row(
            "assist/text",
            "(assist − none) / assist (paper's text)",
            20.5,
            &change(None, Assist, Assist),
        ),
        row(
            "assist/of-assist",
            "(assist − none) / assist (paper's means)",
            meant(None, Assist, Assist),
            &change(None, Assist, Assist),
        ),
        row(
            "assist/of-none",
            "(assist − none) / none (paper's means)",
            meant(None, Assist, None),
            &change(None, Assist, None),
        ),
    ]
}

/// Returns the metabolic proxy as a percentage of the power that the paper prints (equation 5), for
/// each condition.
fn proxy_rows(study: &Study, replications: &[Replication]) -> Vec<Row> {
    let rows = Condition::ALL.into_iter().filter_map(|condition| {
        let mut printed = study.printed.iter();
        let printed = printed.find(|printed_value| {
            printed_value.metric == Metric::Power && printed_value.condition == condition
        })?;
        let side = Side {
            condition,
            height: None,
        };
        let part =
            |own: &Replication| 100.0 * mean(study, own, Metric::Power, &side) / printed.mean;
        let quantity = format!("{}: proxy relative to the printed power", condition.name());
        let values = replications.iter().map(part);
        Some(Row::from_numbers(
            format!("{}/proxy-part", condition.name()),
            quantity,
            "%",
            None,
            values,
        ))
    });
    rows.collect()
}

/// Returns rows about stimulation with resist and assist: durations of lifting and dropping, and
/// peak torques. The last row counts steps in which muscles were too weak.
fn stimulation_rows(replications: &[Replication]) -> Vec<Row> {
    let mut rows = Vec::new();
    for condition in [Condition::Resist, Condition::Assist] {
        let own = || {
            people(replications)
                .filter_map(move |participant| participant.condition_result(condition))
        };
        let name = condition.name();
        let row = |id: &str, quantity: &str, unit: &str, paper, values: Vec<f64>| {
            Row::from_numbers(
                format!("{name}/{id}"),
                format!("{name}: {quantity}"),
                unit,
                paper,
                values,
            )
        };
        rows.push(row(
            "lifting",
            "duration of lifting",
            "s",
            Some(1.74),
            own().map(|result| result.phases_s[0]).collect(),
        ));
        rows.push(row(
            "dropping",
            "duration of dropping",
            "s",
            Some(1.74),
            own().map(|result| result.phases_s[1]).collect(),
        ));
        rows.push(row(
            "elbow",
            "peak stimulated torque, elbow",
            "N·m",
            None,
            own().map(|result| result.stimulated_nm[0]).collect(),
        ));
        rows.push(row(
            "shoulder",
            "peak stimulated torque, shoulder",
            "N·m",
            None,
            own().map(|result| result.stimulated_nm[1]).collect(),
        ));
    }
    let weak = people(replications)
        .flat_map(|participant| &participant.conditions)
        .map(|result| 100.0 * result.weak);
    rows.push(Row::from_numbers(
        "weak".to_owned(),
        "steps in which muscles were too weak".to_owned(),
        "%",
        None,
        weak,
    ));
    rows
}

/// Returns a row with the percentage of bursts in which the whole device agrees with the fast
/// simulation, for a lift with assist and one with resist. A burst is one biphasic pulse.
///
/// # Errors
/// Fails as the functions of [`super::whole`] do.
pub(super) fn whole_device_row(study: &Study, seed: u64) -> Result<Row, LiftError> {
    let person = LiftWearer::new(study, nominal_values(study), seed)?;
    let share = |condition| -> Result<f64, LiftError> {
        let found = compare_whole_device(study, &person, condition, (0, seed))?;
        Ok(100.0 * found.same as f64 / (found.bursts + found.alone) as f64)
    };
    Ok(Row::from_numbers(
        "whole-device".to_owned(),
        "bursts of the whole device that equal the fast simulation, to one DAC code".to_owned(),
        "%",
        None,
        vec![share(Condition::Assist)?, share(Condition::Resist)?],
    ))
}
