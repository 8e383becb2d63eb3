//! Tables 4 to 6 of experiments 2 and 3.

use super::outcome::sessions;
use super::spread::cell;
use super::{Part, Study};
use crate::hamana2022::experiments::Experiment;
use crate::hamana2022::pattern::{Pattern, Points};
use crate::hamana2022::printed::TABLE_5_P;
use crate::hamana2022::replication::{Averages, PATTERNS, Replication};
use crate::hamana2022::sessions::{Session, people};
use crate::laboratory::{Grid, Sheet};
use host_core::statistics::Spread;
use std::collections::BTreeMap;

/// Returns for each draw the averages of its participants.
pub(super) fn averages(experiment: Experiment, sessions: &[Session]) -> Vec<Vec<Averages>> {
    let mut draws: BTreeMap<u64, Vec<Averages>> = BTreeMap::new();
    for session in sessions {
        let session_averages =
            Averages::from_session(experiment, &session.conditions, &session.stimulated);
        draws
            .entry(session.draw)
            .or_default()
            .push(session_averages);
    }
    draws.into_values().collect()
}

fn heads(text: &str) -> Vec<String> {
    text.split('|').map(str::to_owned).collect()
}

impl Study {
    /// Returns the tables of this experiment except those of the applied voltages.
    pub(super) fn pattern_tables(&self, experiment: Experiment, parts: &[Part]) -> Vec<Sheet> {
        let sessions = sessions(parts);
        match experiment {
            Experiment::Torque => vec![self.table_4(&sessions), self.table_5(&sessions)],
            Experiment::Intensities => table_6(&sessions).into_iter().collect(),
            Experiment::Selectivity | Experiment::Posture => Vec::new(),
        }
    }

    fn table_4(&self, sessions: &[Session]) -> Sheet {
        let mut rows = Vec::new();
        for (participant, _) in people(sessions) {
            let own = sessions
                .iter()
                .filter(|session| session.participant == participant);
            let session_averages: Vec<Averages> = own
                .map(|session| {
                    Averages::from_session(
                        Experiment::Torque,
                        &session.conditions,
                        &session.stimulated,
                    )
                })
                .collect();
            let spreads: [Option<Spread>; 6] = std::array::from_fn(|place| {
                let torque = |averages: &Averages| match place {
                    0..4 => averages.points[place],
                    _ => Some(averages.one_point?[place - 4]),
                };
                Spread::of(session_averages.iter().filter_map(torque))
            });
            for (statistic, at) in LINES {
                let cells = spreads.map(|spread| cell(spread.map(at), 2));
                let n = match statistic {
                    "median" => session_averages.len().to_string(),
                    _ => String::new(),
                };
                rows.push([&[format!("{participant}, {statistic}"), n][..], &cells].concat());
            }
        }
        let draws = averages(Experiment::Torque, sessions);
        let replications: Vec<Replication> = draws
            .iter()
            .map(|averages| Replication::from_averages(averages))
            .collect();
        let one_point_spread = |place: usize| {
            Spread::of(
                replications
                    .iter()
                    .filter_map(|replication| Some(replication.one_point?[place])),
            )
        };
        let ours = [one_point_spread(0), one_point_spread(1)]
            .map(|spread| cell(spread.map(|spread| spread.median), 2));
        let n = one_point_spread(0).map_or(0, |spread| spread.n).to_string();
        let paper = self
            .protocol
            .paper
            .one_point
            .map(|one_point| cell(Some(one_point), 2));
        for (name, n, numbers) in [("all, median", n, ours), ("paper", String::new(), paper)] {
            let none = std::iter::repeat_n("-".to_owned(), 4);
            let first = [name.to_owned(), n].into_iter();
            rows.push(first.chain(none).chain(numbers).collect());
        }
        let caption = "Torque of one point, as a fraction of the torque of the participant's \
                       strongest pattern: A or B, conducted (C) or isolated (I), and the larger \
                       of A and B. Median, 5th and 95th percentile of n draws, simulated. The \
                       paper prints the cells of table 4 as a picture without numbers; only the \
                       averages in its text, 0.28 and 0.27, are known.";
        let grid = Grid {
            heads: heads("|n|A-C|A-I|B-C|B-I|larger C|larger I"),
            rows,
        };
        Sheet::table("Table 4", "torque of one point", caption.to_owned(), grid)
    }

    fn table_5(&self, sessions: &[Session]) -> Sheet {
        let draws = averages(Experiment::Torque, sessions);
        let replications: Vec<Replication> = draws
            .iter()
            .map(|averages| Replication::from_averages(averages))
            .collect();
        let row = |number: usize| {
            let test_spread = |place: usize| {
                Spread::of(
                    replications
                        .iter()
                        .filter_map(|replication| Some(replication.table_5[number]?[place])),
                )
            };
            let (t, p) = (test_spread(0), test_spread(1));
            let n = t.map_or(0, |spread| spread.n).to_string();
            let is_less = |replication: &&Replication| {
                let p = replication.table_5[number].map(|[_, p]| p);
                p.is_some_and(|p| p < self.protocol.significant)
            };
            let [t, p] = [
                cell(t.map(|spread| spread.median), 2),
                cell(p.map(|spread| spread.median), 4),
            ];
            let paper = format!("{:.2}", self.protocol.paper.table_5[number]);
            let paper_p = format!("{}", TABLE_5_P[number]);
            let less = replications.iter().filter(is_less).count().to_string();
            vec![number.to_string(), n, t, paper, p, paper_p, less]
        };
        let caption = "Paired t-test of each two-point pattern against one conducted point, over \
                       the participants of a draw: medians over n draws with at least two \
                       participants, and the number of draws in which p is below 0.05; simulated. \
                       The paper's table 5 has four participants (three degrees of freedom); here \
                       a draw has those participants for whom points and voltages are found.";
        let grid = Grid {
            heads: heads("pattern|n|t|t, paper|p|p, paper|p < 0.05"),
            rows: (0..PATTERNS).map(row).collect(),
        };
        let title = "two points against one point";
        Sheet::table("Table 5", title, caption.to_owned(), grid)
    }
}

/// Name of a table line, and the function that takes its number from a spread.
type Line = (&'static str, fn(Spread) -> f64);

/// Table lines that show a spread: its median, 5th and 95th percentile.
const LINES: [Line; 3] = [
    ("median", |spread| spread.median),
    ("5 %", |spread| spread.low),
    ("95 %", |spread| spread.high),
];

/// Tabulates the voltages of A and B at the nine intensities of experiment 3, V; `None` if there
/// are no sessions.
fn table_6(sessions: &[Session]) -> Option<Sheet> {
    let mut rows = Vec::new();
    let participants = people(sessions);
    for (participant, _) in &participants {
        let own = || {
            sessions
                .iter()
                .filter(|session| session.participant == *participant)
        };
        let mut patterns: BTreeMap<&str, Pattern> = BTreeMap::new();
        for condition in own().flat_map(|session| &session.conditions) {
            patterns.insert(&condition.name, condition.pattern);
        }
        for (name, pattern) in patterns {
            let volts: Vec<[f64; 2]> = own()
                .flat_map(|session| &session.conditions)
                .filter(|condition| condition.name == name)
                .map(|condition| condition.volts)
                .collect();
            let mut row = vec![format!("{participant}, {name}"), volts.len().to_string()];
            for point in 0..2 {
                let is_driven = !matches!(pattern.points, Points::One(other) if other != point);
                let spread = Spread::of(volts.iter().map(|volt| volt[point])).filter(|_| is_driven);
                row.extend(LINES.map(|(_, at)| match is_driven {
                    true => cell(spread.map(at), 1),
                    false => "none".to_owned(),
                }));
            }
            rows.push(row);
        }
    }
    let caption = "Intensities at A and B, V: median, 5th and 95th percentile of n draws, \
                   simulated. The paper's table 6 gives them as symbols (a to i), without volts. \
                   The intensity at r_th is missing in draws in which the two points together \
                   bend the finger at no ratio r."
        .to_owned();
    let grid = Grid {
        heads: heads("|n|V_A|5 %|95 %|V_B|5 %|95 %"),
        rows,
    };
    let sheet = Sheet::table("Table 6", "intensities of experiment 3, V", caption, grid);
    (!participants.is_empty()).then_some(sheet)
}
