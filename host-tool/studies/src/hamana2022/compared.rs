//! Compares experiments 1 to 3 and the posture experiment over all draws with the printed results
//! of Hamana 2022.

use super::angles::{intensities, postures};
use super::claims::ALIKE;
use super::experiments::{Experiment, Protocol};
use super::pattern::Pattern;
use super::printed::TABLE_5_P;
use super::replication::{Averages, CONDUCTED, PATTERNS, Replication};
use super::sessions::{Session, claim, people, row};
use crate::laboratory::{Row, Share};
use std::collections::BTreeMap;

/// Returns a row for each quantity, beside the printed value if there is one, and the share of
/// draws in which each claim holds.
#[must_use]
pub fn compare_with_paper(
    experiment: Experiment,
    protocol: &Protocol,
    sessions: &[Session],
) -> (Vec<Row>, Vec<Share>) {
    match experiment {
        Experiment::Selectivity | Experiment::Torque => patterns(experiment, protocol, sessions),
        Experiment::Intensities => intensities(sessions),
        Experiment::Posture => postures(protocol, sessions),
    }
}

fn patterns(
    experiment: Experiment,
    protocol: &Protocol,
    sessions: &[Session],
) -> (Vec<Row>, Vec<Share>) {
    let mut draws: BTreeMap<u64, Vec<Averages>> = BTreeMap::new();
    for session in sessions {
        let averages = Averages::from_session(experiment, &session.conditions, &session.stimulated);
        draws.entry(session.draw).or_default().push(averages);
    }
    let replications: Vec<Replication> = draws
        .values()
        .map(|averages| Replication::from_averages(averages))
        .collect();
    let is_torque = experiment == Experiment::Torque;
    let mut rows = pattern_rows(is_torque.then_some(protocol.paper.one_point), &replications);
    let printed = match is_torque {
        true => &protocol.paper.torque,
        false => &protocol.paper.selectivity,
    };
    let tests = [
        (
            "friedman",
            "χ²",
            "Friedman test over phase differences",
            printed.friedman,
        ),
        (
            "isolation",
            "t",
            "conducted against isolated",
            printed.isolation,
        ),
    ];
    for (id, statistic, name, paper) in tests {
        for (place, symbol) in [statistic, "p"].into_iter().enumerate() {
            let test = |replication: &Replication| match id {
                "friedman" => replication.friedman,
                _ => replication.isolation,
            };
            let values = replications
                .iter()
                .filter_map(|replication| Some(test(replication)?[place]));
            let id = format!("{id}-{}", ["statistic", "p"][place]);
            let name = format!("{name}, {symbol}");
            rows.push(row(&id, name, "", Some(paper[place]), values.collect()));
        }
    }
    if is_torque {
        for number in 0..PATTERNS {
            let values = replications
                .iter()
                .filter_map(|replication| Some(replication.table_5[number]?[0]));
            let name = format!("pattern {number} against one point, t");
            let paper = Some(protocol.paper.table_5[number]);
            let id = format!("pattern {number}/t against one point");
            rows.push(row(&id, name, "", paper, values.collect()));
        }
        for (number, paper) in TABLE_5_P.into_iter().enumerate() {
            let values = replications
                .iter()
                .filter_map(|replication| Some(replication.table_5[number]?[1]));
            let name = format!("pattern {number} against one point, p");
            let id = format!("pattern {number}/p against one point");
            rows.push(row(&id, name, "", Some(paper), values.collect()));
        }
        rows.extend(table_4(sessions));
    }
    let people = replications
        .iter()
        .map(|replication| replication.n as f64)
        .collect();
    rows.push(row(
        "participants",
        "participants per draw".into(),
        "",
        Some(4.0),
        people,
    ));
    let left_out = draws.values().flatten();
    let parts =
        left_out.map(|averages| 100.0 * averages.left_out as f64 / averages.of.max(1) as f64);
    rows.push(row(
        "left-out",
        "excluded trials".into(),
        "%",
        None,
        parts.collect(),
    ));
    (rows, pattern_claims(is_torque, protocol, &replications))
}

/// Computes for each participant the torques of A and B alone, conducted and isolated, as fractions
/// of the torque of the participant's strongest pattern. These rows have no printed values: the
/// paper's table 4 is a picture, of which only the averages are known.
fn table_4(sessions: &[Session]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (participant, _) in people(sessions) {
        let own = sessions
            .iter()
            .filter(|session| session.participant == participant);
        let session_averages: Vec<Averages> = own
            .map(|session| {
                Averages::from_session(Experiment::Torque, &session.conditions, &session.stimulated)
            })
            .collect();
        let points = [
            ("A-C", "A, conducted"),
            ("A-I", "A, isolated"),
            ("B-C", "B, conducted"),
            ("B-I", "B, isolated"),
        ];
        for (place, (point, words)) in points.into_iter().enumerate() {
            let name = format!("{participant}, relative torque of {words}");
            let id =
                format!("{participant}, {point}/One point's torque, part of the greatest pattern");
            let values = session_averages
                .iter()
                .filter_map(|averages| averages.points[place]);
            rows.push(row(&id, name, "", None, values.collect()));
        }
    }
    rows
}

fn pattern_rows(one_point: Option<[f64; 2]>, replications: &[Replication]) -> Vec<Row> {
    let measured = match one_point {
        None => "Individuation index",
        Some(_) => "Torque, part of the greatest pattern",
    };
    let mut rows = Vec::new();
    let named = Pattern::all_two_point().into_iter().filter_map(|pattern| {
        let state = if pattern.isolated {
            "isolated"
        } else {
            "conducted"
        };
        Some((pattern.number()?, pattern.phase_difference_us()?, state))
    });
    let named: BTreeMap<usize, (u32, &str)> = named
        .map(|(number, after_us, state)| (number, (after_us, state)))
        .collect();
    for (number, (after_us, state)) in named {
        let values = replications
            .iter()
            .filter_map(|replication| replication.patterns[number]);
        let name = format!("pattern {number}, {after_us} µs, {state}");
        let id = format!("{name}/{measured}");
        rows.push(row(&id, name, "", None, values.collect()));
    }
    if let Some(paper) = one_point {
        rows.extend(
            ["conducted", "isolated"]
                .into_iter()
                .enumerate()
                .map(|(place, state)| {
                    let values = replications
                        .iter()
                        .filter_map(|replication| Some(replication.one_point?[place]));
                    let id = format!("one point, {state}/{measured}");
                    row(
                        &id,
                        format!("one point, {state}"),
                        "",
                        Some(paper[place]),
                        values.collect(),
                    )
                }),
        );
    }
    rows
}

fn pattern_claims(
    is_torque: bool,
    protocol: &Protocol,
    replications: &[Replication],
) -> Vec<Share> {
    let significant = |test: super::replication::Test| Some(test?[1] < protocol.significant);
    let pattern_value =
        |number: usize| move |replication: &Replication| replication.patterns[number];
    let more = |replication: &Replication| {
        let pairs = [6, 8, 10, 12].map(|number| {
            let isolated = pattern_value(number + 1)(replication)?;
            Some(pattern_value(number)(replication)? > isolated)
        });
        let pairs: Option<Vec<bool>> = pairs.into_iter().collect();
        Some(pairs?.into_iter().all(|pair| pair))
    };
    let mut shares = vec![
        claim(
            "phase-difference",
            "results differ by phase difference (Friedman)".into(),
            Some(!is_torque),
            replications
                .iter()
                .map(|comparison| significant(comparison.friedman)),
        ),
        claim(
            "isolation",
            "conducted and isolated differ (paired t)".into(),
            Some(is_torque),
            replications
                .iter()
                .map(|comparison| significant(comparison.isolation)),
        ),
    ];
    if is_torque {
        shares.push(claim(
            "conducted-more",
            "conducted: more torque at 1, 2, 5 and 10 ms".into(),
            Some(true),
            replications.iter().map(more),
        ));
        shares.push(claim(
            "one-alike",
            "one point: same torque, conducted or isolated".into(),
            Some(true),
            replications
                .iter()
                .map(|replication| replication.one_point.map(|[c, i]| ALIKE.contains(&(c / i)))),
        ));
        shares.push(claim(
            "two-more",
            "conducted: more torque by two points than by one".into(),
            Some(true),
            replications.iter().map(|replication| {
                let [one, _] = replication.one_point?;
                let two: Option<Vec<f64>> =
                    CONDUCTED.iter().map(|&n| replication.patterns[n]).collect();
                Some(two?.into_iter().all(|two| two > one))
            }),
        ));
    } else {
        shares.push(claim(
            "selective",
            format!(
                "individuation above {} from pattern 5 on",
                protocol.selective
            ),
            Some(true),
            replications.iter().map(|replication| {
                let late: Option<Vec<f64>> = replication.patterns[5..].iter().copied().collect();
                Some(late?.into_iter().all(|value| value > protocol.selective))
            }),
        ));
        shares.push(claim(
            "together-worst",
            "simultaneous pulses are least selective".into(),
            Some(true),
            replications.iter().map(|replication| {
                let rest: Option<Vec<f64>> = replication.patterns[1..].iter().copied().collect();
                Some(
                    rest?
                        .into_iter()
                        .all(|rest| rest > replication.patterns[0].unwrap_or(1.0)),
                )
            }),
        ));
    }
    shares
}
