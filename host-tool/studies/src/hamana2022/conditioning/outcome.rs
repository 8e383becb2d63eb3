//! Result of the conditioning: acceptance, weights, prior and posterior of every parameter, and the
//! file of accepted forearms.

use super::data::Table;
use super::judged::JudgedForearm;
use super::mechanism::Mechanism;
use super::mechanisms;
use super::setup::Setup;
use super::study::{ConditioningStudy, Unit};
use super::weights::{WeightSummary, weighted_quantile};
use crate::hamana2022::participant::Participant;
use crate::laboratory::{Outcome, Preregistration, Row};
use std::fmt::Write as _;

pub(super) const SIMULATED: &str =
    "Simulated: random forearms with assumed parameters; no evidence about people.";
const CONDITIONED: &str = "Conditioned on: the greatest selective voltages of A and B in tables 2, \
                           3 and 7, and the thresholds of table 7. Nothing else that the paper \
                           prints entered.";
const WEIGHTS: &str = "The weight of a forearm is the probability that sessions of all tables meet \
                       the printed greatest voltages, given the thresholds. Its mean over forearms \
                       is the probability of these voltages (their evidence), with two standard \
                       errors.";
/// Columns of the file of accepted forearms before the drawn parameters.
const COLUMNS: &str = "participant,seed,forearm,condition,weight,factor,coupling_b,coupling_e,\
                       session_7,a_7,b_7,session_2,a_2,b_2,session_3,a_3,b_3";

/// Names of the conditions in the file of accepted forearms.
const CONDITIONS: [&str; 2] = ["posterior", "strict"];

/// Weights of the forearms of one participant under one change of the model.
struct Group<'a> {
    mechanism: Mechanism,
    participant: &'a Participant,
    judged: Vec<&'a JudgedForearm>,
}

impl Group<'_> {
    fn weights(&self, is_strict: bool) -> Vec<f64> {
        let weight = |forearm: &&JudgedForearm| {
            let candidate = forearm.candidate(is_strict);
            candidate.map_or(0.0, |candidate| candidate.weight())
        };
        self.judged.iter().map(weight).collect()
    }

    fn prefix(&self) -> String {
        let name = &self.participant.name;
        match self.mechanism {
            Mechanism::Default => name.clone(),
            other => format!("{name}, {}", other.name()),
        }
    }
}

fn groups<'a>(study: &'a ConditioningStudy, units: &'a [Unit]) -> Vec<Group<'a>> {
    let mut groups = Vec::new();
    for &mechanism in &study.mechanisms {
        for participant in &study.participants {
            let own = units.iter().filter(|unit| {
                unit.mechanism == mechanism && unit.judged.participant == participant.name
            });
            groups.push(Group {
                mechanism,
                participant,
                judged: own.map(|unit| &unit.judged).collect(),
            });
        }
    }
    groups
}

pub(super) fn outcome(
    study: &ConditioningStudy,
    units: &[Unit],
    cut_short: Option<String>,
) -> Outcome {
    let groups = groups(study, units);
    let mut rows: Vec<Row> = groups.iter().flat_map(summary_rows).collect();
    if !study.is_of_mechanisms() {
        rows.extend(groups.iter().flat_map(|group| parameter_rows(study, group)));
    }
    let notes = [SIMULATED, CONDITIONED, WEIGHTS]
        .map(str::to_owned)
        .into_iter();
    Outcome {
        name: study.name().to_owned(),
        title: study.declaration.title.clone(),
        seed: study.seed,
        simulated: Some(true),
        cut_short,
        declared: Preregistration {
            asked: study.name().to_owned(),
            command: Some(study.command()),
            device: None,
            sha256: study.sha256(),
            source: study.declaration.source.clone(),
            draws: study.draws,
            drawn: Some("forearms".to_owned()),
            as_declared: study.as_declared,
        },
        conditions: Vec::new(),
        rows,
        shares: Vec::new(),
        decides: Vec::new(),
        sheets: match study.is_of_mechanisms() {
            true => vec![
                mechanisms::evidence_table(study, units),
                mechanisms::information_table(study, units),
            ],
            false => Vec::new(),
        },
        notes: notes.chain(groups.iter().filter_map(conflict)).collect(),
    }
}

/// Names the printed numbers that no forearm of a group meets.
fn conflict(group: &Group<'_>) -> Option<String> {
    let is_lost = group.weights(false).iter().all(|weight| *weight == 0.0);
    if !is_lost || group.judged.is_empty() {
        return None;
    }
    let (count, name) = (group.judged.len(), group.prefix());
    let any = |meets: fn(&JudgedForearm) -> bool| group.judged.iter().any(|forearm| meets(forearm));
    let has_table_7 = group.participant.thresholds_v.is_some();
    let is_met = |place: usize, points: usize| {
        let mut met = group.judged.iter().filter_map(|forearm| forearm.posterior);
        met.any(move |candidate| candidate.met[place][points] > 0.0)
    };
    let pair = |place: usize, table: &str| match is_met(place, 0) {
        true => format!("A and B of {table} together"),
        false => format!("A of {table}"),
    };
    let what = match () {
        () if has_table_7 && !any(|forearm| forearm.solved[0] > 0.0) => {
            "the threshold and the greatest voltage of A in table 7".to_owned()
        }
        () if has_table_7 && !any(|forearm| forearm.solved[1] > 0.0) => {
            "A and B of table 7 together: with A met, the threshold and the greatest voltage of B"
                .to_owned()
        }
        () if !is_met(0, 1) => pair(0, "table 2"),
        () if !is_met(1, 1) => pair(1, "table 3"),
        () => "tables 2, 3 and 7 together".to_owned(),
    };
    Some(format!("{name}: none of {count} forearms meets {what}."))
}

pub(super) fn number(id: String, quantity: String, unit: &str, value: f64, n: usize) -> Row {
    Row {
        id,
        quantity,
        unit: unit.to_owned(),
        paper: None,
        ours: Some(value).filter(|value| value.is_finite()),
        low: None,
        high: None,
        n,
    }
}

/// Returns acceptance, evidence and sizes of a group, for each condition that applies.
fn summary_rows(group: &Group<'_>) -> Vec<Row> {
    let (prefix, n) = (group.prefix(), group.judged.len());
    let mean = |value: fn(&JudgedForearm) -> f64| {
        group
            .judged
            .iter()
            .map(|forearm| value(forearm))
            .sum::<f64>()
            / n as f64
    };
    let row = |id: &str, quantity: &str, unit: &str, value: f64| {
        number(
            format!("{prefix}/{id}"),
            format!("{prefix}, {quantity}"),
            unit,
            value,
            n,
        )
    };
    let mut rows = Vec::new();
    if group.participant.thresholds_v.is_some() {
        let [a, both] = [mean(|f| f.solved[0]), mean(|f| f.solved[1])];
        rows.push(row(
            "accepted-7-a",
            "sessions that meet table 7 at A",
            "%",
            100.0 * a,
        ));
        rows.push(row(
            "accepted-7",
            "sessions that meet table 7",
            "%",
            100.0 * both,
        ));
    }
    for (is_strict, condition) in [false, true].into_iter().zip(CONDITIONS) {
        let weights = group.weights(is_strict);
        let summary = WeightSummary::of(&weights);
        if is_strict && (summary.positive == 0 || group.mechanism != Mechanism::Default) {
            continue;
        }
        let count = n as f64;
        let evidence = summary.sum / count;
        let variance = weights.iter().map(|w| (w - evidence).powi(2)).sum::<f64>() / count;
        let error = (variance / count).sqrt();
        let mut evidence_row = row(
            &format!("{condition}-evidence"),
            &format!("{condition}: probability of voltages"),
            "1e-9",
            1e9 * evidence,
        );
        evidence_row.low = Some(1e9 * (evidence - 2.0 * error).max(0.0));
        evidence_row.high = Some(1e9 * (evidence + 2.0 * error));
        rows.push(evidence_row);
        let sizes = [
            (
                "forearms",
                "forearms with weight",
                "",
                summary.positive as f64,
            ),
            ("effective", "effective sample size", "", summary.effective),
            ("largest", "largest weight", "%", 100.0 * summary.largest),
        ];
        rows.extend(sizes.map(|(id, words, unit, value)| {
            row(
                &format!("{condition}-{id}"),
                &format!("{condition}: {words}"),
                unit,
                value,
            )
        }));
    }
    rows
}

/// Returns prior and posterior of every parameter, as median and 5 to 95 %. The prior is that of all
/// forearms; a session parameter is that of the session of table 7.
fn parameter_rows(study: &ConditioningStudy, group: &Group<'_>) -> Vec<Row> {
    let prior = study.prior(group.participant, group.mechanism);
    let fields: Vec<&str> = prior.fields().collect();
    let name = &group.participant.name;
    let of = |condition: &str, drawn: &[(Vec<f64>, f64)]| -> Vec<Row> {
        let fields = fields.iter().enumerate();
        fields
            .map(|(place, field)| {
                let values: Vec<(f64, f64)> = drawn
                    .iter()
                    .map(|(values, weight)| (values[place], *weight))
                    .collect();
                let at = |part| weighted_quantile(&values, part);
                Row {
                    id: format!("{name}/{field}/{condition}"),
                    quantity: format!("{name}, {field}, {condition}"),
                    unit: String::new(),
                    paper: None,
                    ours: at(0.5),
                    low: at(0.05),
                    high: at(0.95),
                    n: drawn.len(),
                }
            })
            .collect()
    };
    let all = (0..study.draws).map(|index| (prior.values(index, Table::Seven, 0), 1.0));
    let mut rows = of("prior", &all.collect::<Vec<_>>());
    for (is_strict, condition) in [false, true].into_iter().zip(CONDITIONS) {
        let weights = group.weights(is_strict);
        let weighted = group
            .judged
            .iter()
            .zip(weights)
            .filter_map(|(forearm, weight)| {
                let session = forearm.candidate(is_strict)?.solved.setup.session;
                let values = prior.values(forearm.index, Table::Seven, session);
                (weight > 0.0).then_some((values, weight))
            });
        let weighted: Vec<(Vec<f64>, f64)> = weighted.collect();
        if !weighted.is_empty() {
            rows.extend(of(condition, &weighted));
        }
    }
    rows
}

/// Returns the accepted forearms with their weights, sessions and parameters.
pub(super) fn posterior_csv(study: &ConditioningStudy, units: &[Unit]) -> String {
    let mut text = COLUMNS.to_owned();
    let groups = groups(study, units);
    if let Some(group) = groups.first() {
        for field in study.prior(group.participant, group.mechanism).fields() {
            text += ",";
            text += field;
        }
    }
    text += "\n";
    for group in groups
        .iter()
        .filter(|group| group.mechanism == Mechanism::Default)
    {
        let prior = study.prior(group.participant, group.mechanism);
        for (is_strict, condition) in [false, true].into_iter().zip(CONDITIONS) {
            let weights = group.weights(is_strict);
            let total = WeightSummary::of(&weights).sum;
            for (forearm, weight) in group.judged.iter().zip(weights) {
                let Some(candidate) = forearm.candidate(is_strict) else {
                    continue;
                };
                let weight = weight / total;
                if !weight.is_finite() || weight <= LEAST_WEIGHT {
                    continue;
                }
                let setup = candidate.solved.setup;
                let values = prior.values(forearm.index, Table::Seven, setup.session);
                let (name, seed, index) = (&group.participant.name, study.seed, forearm.index);
                let (factor, coupling) = (candidate.solved.factor, candidate.solved.coupling);
                let _ = write!(
                    text,
                    "{name},{seed},{index},{condition},{weight:e},{factor},{},{}",
                    coupling[1], coupling[2]
                );
                for setup in [Some(setup)].into_iter().chain(candidate.unsolved) {
                    text += &setup_fields(setup);
                }
                for value in values {
                    let _ = write!(text, ",{}", rounded(value));
                }
                text += "\n";
            }
        }
    }
    text
}

/// Smallest weight that is written, as a fraction of all: a ten-thousandth of a forearm's share
/// changes nothing.
const LEAST_WEIGHT: f64 = 1e-6;

fn setup_fields(setup: Option<Setup>) -> String {
    let Some(Setup {
        session,
        points: [a, b],
    }) = setup
    else {
        return ",,,".to_owned();
    };
    format!(",{session},{a},{b}")
}

/// Returns a parameter with four significant digits, which suffice to read it: forearms are created
/// from seed and number.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
