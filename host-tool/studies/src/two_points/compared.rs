//! Experiments 1 to 3 and posture over all draws, beside what Hamana 2022 printed.

use super::experiments::{Condition, Experiment, Protocol, Stimulated};
use super::pattern::{Pattern, Points};
use super::replication::{Averages, CONDUCTED, PATTERNS, Replication};
use crate::laboratory::{Row, Share};
use hal_sim::body::hand::spec::{A, B};
use host_core::statistics::{quantile_of, share};
use std::collections::BTreeMap;

/// One participant's session of one draw.
#[derive(Clone, Debug)]
pub struct Session {
    /// Whose.
    pub participant: String,
    /// Whether the paper tells of them in the additional experiment.
    pub is_printed: bool,
    /// Which replication.
    pub draw: u64,
    /// What was stimulated.
    pub conditions: Vec<Condition>,
    /// In the order in which it was.
    pub stimulated: Vec<Stimulated>,
}

/// One point conducted and isolated are alike from here to here, as in `population.toml`.
const ALIKE: std::ops::RangeInclusive<f64> = 0.9..=1.15;
const DIGITS: [&str; 5] = ["thumb", "index", "middle", "ring", "little"];

fn row(id: &str, quantity: String, unit: &str, paper: Option<f64>, mut all: Vec<f64>) -> Row {
    all.sort_unstable_by(f64::total_cmp);
    let at = |part| (!all.is_empty()).then(|| quantile_of(&all, part));
    Row {
        id: id.to_owned(),
        quantity,
        unit: unit.to_owned(),
        paper,
        ours: at(0.5),
        low: at(0.05),
        high: at(0.95),
        n: all.len(),
    }
}

/// In how many of `all` that could be judged it holds.
fn claim(
    id: &str,
    claim: String,
    paper: Option<bool>,
    all: impl IntoIterator<Item = Option<bool>>,
) -> Share {
    let judged: Vec<bool> = all.into_iter().flatten().collect();
    let (holds, of) = (
        judged.iter().filter(|it| **it).count() as u64,
        judged.len() as u64,
    );
    let interval = share(holds as f64, of, 0.95).ok();
    Share {
        id: id.to_owned(),
        at: String::new(),
        claim,
        paper,
        holds,
        of,
        low: interval.map(|it| it.low),
        high: interval.map(|it| it.high),
    }
}

/// A number for each quantity, and in how many draws each claim holds.
#[must_use]
pub fn compared(
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
    for it in sessions {
        let averages = Averages::of(experiment, &it.conditions, &it.stimulated);
        draws.entry(it.draw).or_default().push(averages);
    }
    let all: Vec<Replication> = draws.values().map(|it| Replication::of(it)).collect();
    let is_torque = experiment == Experiment::Torque;
    let mut rows = pattern_rows(is_torque.then_some(protocol.paper.one_point), &all);
    let printed = match is_torque {
        true => &protocol.paper.torque,
        false => &protocol.paper.selectivity,
    };
    let tests = [
        (
            "friedman",
            "χ²",
            "Friedman over phase differences",
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
        for (place, what) in [statistic, "p"].into_iter().enumerate() {
            let of = |it: &Replication| match id {
                "friedman" => it.friedman,
                _ => it.isolation,
            };
            let values = all.iter().filter_map(|it| Some(of(it)?[place]));
            let id = format!("{id}-{}", ["statistic", "p"][place]);
            let name = format!("{name}, {what}");
            rows.push(row(&id, name, "", Some(paper[place]), values.collect()));
        }
    }
    if is_torque {
        for number in 0..PATTERNS {
            let values = all.iter().filter_map(|it| Some(it.table_5[number]?[0]));
            let name = format!("pattern {number} against one point, t");
            let paper = Some(protocol.paper.table_5[number]);
            let id = format!("pattern {number}/t against one point");
            rows.push(row(&id, name, "", paper, values.collect()));
        }
    }
    let people = all.iter().map(|it| it.n as f64).collect();
    rows.push(row(
        "participants",
        "participants of a draw".into(),
        "",
        Some(4.0),
        people,
    ));
    let left_out = draws.values().flatten();
    let parts = left_out.map(|it| 100.0 * it.left_out as f64 / it.of.max(1) as f64);
    rows.push(row(
        "left-out",
        "trials left out".into(),
        "%",
        None,
        parts.collect(),
    ));
    (rows, pattern_claims(is_torque, protocol, &all))
}

fn pattern_rows(one_point: Option<[f64; 2]>, all: &[Replication]) -> Vec<Row> {
    let measured = match one_point {
        None => "Individuation index",
        Some(_) => "Torque, part of the greatest pattern",
    };
    let mut rows = Vec::new();
    let named = Pattern::two().into_iter().filter_map(|pattern| {
        let state = if pattern.isolated {
            "isolated"
        } else {
            "conducted"
        };
        Some((pattern.number()?, pattern.after_us()?, state))
    });
    let named: BTreeMap<usize, (u32, &str)> = named
        .map(|(number, after_us, state)| (number, (after_us, state)))
        .collect();
    for (number, (after_us, state)) in named {
        let values = all.iter().filter_map(|it| it.patterns[number]);
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
                    let values = all.iter().filter_map(|it| Some(it.one_point?[place]));
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

fn pattern_claims(is_torque: bool, protocol: &Protocol, all: &[Replication]) -> Vec<Share> {
    let significant = |test: super::replication::Test| Some(test?[1] < protocol.significant);
    let of = |number: usize| move |it: &Replication| it.patterns[number];
    let more = |it: &Replication| {
        let pairs = [6, 8, 10, 12].map(|number| {
            let isolated = of(number + 1)(it)?;
            Some(of(number)(it)? > isolated)
        });
        let pairs: Option<Vec<bool>> = pairs.into_iter().collect();
        Some(pairs?.into_iter().all(|it| it))
    };
    let mut shares = vec![
        claim(
            "phase-difference",
            "phase differences differ (Friedman)".into(),
            Some(!is_torque),
            all.iter().map(|it| significant(it.friedman)),
        ),
        claim(
            "isolation",
            "conducted and isolated differ (paired t)".into(),
            Some(is_torque),
            all.iter().map(|it| significant(it.isolation)),
        ),
    ];
    if is_torque {
        shares.push(claim(
            "conducted-more",
            "conducted pulls more at 1, 2, 5, 10 ms".into(),
            Some(true),
            all.iter().map(more),
        ));
        shares.push(claim(
            "one-alike",
            "one point alike, conducted or isolated".into(),
            Some(true),
            all.iter()
                .map(|it| it.one_point.map(|[c, i]| ALIKE.contains(&(c / i)))),
        ));
        shares.push(claim(
            "two-more",
            "conducted two points pull more than one".into(),
            Some(true),
            all.iter().map(|it| {
                let [one, _] = it.one_point?;
                let two: Option<Vec<f64>> = CONDUCTED.iter().map(|&n| it.patterns[n]).collect();
                Some(two?.into_iter().all(|two| two > one))
            }),
        ));
    } else {
        shares.push(claim(
            "selective",
            format!("above {} from pattern 5 on", protocol.selective),
            Some(true),
            all.iter().map(|it| {
                let late: Option<Vec<f64>> = it.patterns[5..].iter().copied().collect();
                Some(late?.into_iter().all(|it| it > protocol.selective))
            }),
        ));
        shares.push(claim(
            "together-worst",
            "together least selective of all".into(),
            Some(true),
            all.iter().map(|it| {
                let rest: Option<Vec<f64>> = it.patterns[1..].iter().copied().collect();
                Some(
                    rest?
                        .into_iter()
                        .all(|rest| rest > it.patterns[0].unwrap_or(1.0)),
                )
            }),
        ));
    }
    shares
}

/// Mean over the trials of the condition that `is`.
fn mean(
    session: &Session,
    is: impl Fn(&Condition) -> bool,
    of: impl Fn(&Stimulated) -> f64,
) -> Option<f64> {
    let all = session.stimulated.iter();
    let own = all.filter(|it| is(&session.conditions[it.condition]));
    let (sum, count) = own.fold((0.0, 0), |(sum, count), it| (sum + of(it), count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Whoever took part, in the order of the sessions.
fn people(sessions: &[Session]) -> Vec<(&str, bool)> {
    let mut all: Vec<(&str, bool)> = Vec::new();
    for it in sessions {
        if !all.iter().any(|(name, _)| *name == it.participant) {
            all.push((&it.participant, it.is_printed));
        }
    }
    all
}

fn intensities(sessions: &[Session]) -> (Vec<Row>, Vec<Share>) {
    let (mut rows, mut shares) = (Vec::new(), Vec::new());
    for (who, _) in people(sessions) {
        let own: Vec<&Session> = sessions.iter().filter(|it| it.participant == who).collect();
        let mut names: Vec<&str> = Vec::new();
        for condition in own.iter().flat_map(|it| &it.conditions) {
            if !names.contains(&&*condition.name) {
                names.push(&condition.name);
            }
        }
        names.sort_unstable();
        for name in names {
            for (digit, called) in DIGITS.into_iter().enumerate() {
                let values = own
                    .iter()
                    .filter_map(|it| mean(it, |c| c.name == name, |s| 100.0 * s.flexed[digit]));
                let quantity = format!("{who}, {name}, {called}");
                let id = format!("{quantity}/Angle, % of the finger's range");
                rows.push(row(&id, quantity, "% of range", None, values.collect()));
            }
        }
        let others = |it: &Session, letters: [char; 3]| {
            let of = |letter: char| {
                let sum = |s: &Stimulated| s.flexed.iter().sum::<f64>() - s.flexed[1];
                mean(it, |c| c.name.starts_with(letter), sum)
            };
            letters
                .map(of)
                .into_iter()
                .collect::<Option<Vec<f64>>>()
                .map(|all| all.iter().sum::<f64>())
        };
        let bend = own
            .iter()
            .map(|it| Some(others(it, ['g', 'h', 'i'])? > others(it, ['d', 'e', 'f'])?));
        let id = format!("over-{who}");
        let words = "others bend more 4 V above the greatest".to_owned();
        shares.push(claim(&id, format!("{who}: {words}"), Some(true), bend));
    }
    (rows, shares)
}

fn postures(protocol: &Protocol, sessions: &[Session]) -> (Vec<Row>, Vec<Share>) {
    const LIES_DEG: [f64; 3] = [0.0, 45.0, 90.0];
    let (mut rows, mut shares) = (Vec::new(), Vec::new());
    for (who, is_printed) in people(sessions) {
        let own = sessions.iter().filter(|it| it.participant == who);
        let bent: Vec<[[f64; 3]; 2]> = own
            .filter_map(|it| {
                let of = |points: Points| {
                    let at = LIES_DEG.map(|lies| {
                        let is =
                            |c: &Condition| c.pattern.points == points && c.pronated_deg == lies;
                        mean(it, is, |s| s.index_deg)
                    });
                    let [none, half, whole] = at;
                    Some([none?, half?, whole?])
                };
                let [a, b] = [of(Points::One(A))?, of(Points::One(B))?];
                let better = if a[0] >= b[0] { a } else { b };
                Some([better, of(Pattern::usual().points)?])
            })
            .collect();
        for (method, name) in ["one point", "two points"].into_iter().enumerate() {
            for (place, lies) in LIES_DEG.into_iter().enumerate() {
                let values = bent.iter().map(|it| it[method][place]).collect();
                let quantity = format!("{who}, {name}, {lies}° pronated");
                let id = format!("{quantity}/Index finger (°)");
                rows.push(row(&id, quantity, "°", None, values));
            }
        }
        shares.extend(posture_claims(who, is_printed, protocol, &bent));
    }
    (rows, shares)
}

/// Of angles by method and pronation.
fn posture_claims(
    who: &str,
    is_printed: bool,
    protocol: &Protocol,
    bent: &[[[f64; 3]; 2]],
) -> [Share; 3] {
    let least_deg = protocol.posture_deg;
    let of = |id: &str, words: String, holds: fn([[f64; 3]; 2], f64) -> bool| {
        let id = format!("{id}-{who}");
        let all = bent.iter().map(|it| Some(holds(*it, least_deg)));
        claim(
            &id,
            format!("{who}: {words}"),
            is_printed.then_some(true),
            all,
        )
    };
    [
        of(
            "one-falls",
            "one point bends most at 0°".into(),
            |[one, _], _| one[0] > one[1] && one[0] > one[2],
        ),
        of(
            "two-more",
            "two points bend more than one at 90°".into(),
            |[one, two], _| two[2] > one[2],
        ),
        of(
            "two-enough",
            format!("two points reach {least_deg}° at 45°"),
            |[_, two], least_deg| two[1] >= least_deg,
        ),
    ]
}
