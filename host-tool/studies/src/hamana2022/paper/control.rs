//! Compares experiment 4 (Hamana 2022, III-D) over all draws with tables 8 and 9.

use super::anova::{self, SOURCES, published, replications};
use super::spread::{cell, cells};
use super::tracking::{in_words, mean};
use super::{Part, Study, draw_results};
use crate::hamana2022::participant::Participant;
use crate::hamana2022::printed::{TABLE_8, TABLE_9};
use crate::hamana2022::sessions::{claim, row};
use crate::hamana2022::tracked::LAWS;
use crate::laboratory::{Grid, Row, Share, Sheet};
use host_core::statistics::Spread;

/// Returns the name of a controller in the ids of rows, which stay as they were published.
fn id_name(law: &str) -> &'static str {
    match law == LAWS[0] {
        true => "paper's law",
        false => "default law",
    }
}

/// Returns a name of a controller that is short enough for a table of 80 columns.
fn short_name(law: &str) -> &'static str {
    match law == LAWS[0] {
        true => "paper's",
        false => "default",
    }
}

const METHODS: [&str; 2] = ["one point", "two points"];

/// Returns for each draw of participant `name` the mean RMSE with one point and with two, °.
fn means(parts: &[Part], name: &str, law: &str) -> Vec<[Option<f64>; 2]> {
    let tracked = draw_results(parts, name).filter_map(|outcome| outcome.tracking());
    tracked.map(|tracking| tracking.means(law)).collect()
}

/// Returns the [`means`] of the draws that have both.
fn pairs(parts: &[Part], name: &str, law: &str) -> Vec<[f64; 2]> {
    let draw_means = means(parts, name, law).into_iter();
    draw_means
        .filter_map(|[one_point, two]| Some([one_point?, two?]))
        .collect()
}

impl Study {
    fn has_all(&self) -> bool {
        anova::has_all(
            self.participants
                .all
                .iter()
                .map(|participant| &*participant.name),
        )
    }

    /// Computes the rows of RMSE beside table 8, and of F and p beside table 9.
    pub(super) fn control_rows(&self, parts: &[Part]) -> Vec<Row> {
        let mut rows = Vec::new();
        for participant in &self.participants.all {
            for law in LAWS {
                rows.extend(rmse_rows(participant, law, parts));
            }
        }
        for law in LAWS.into_iter().filter(|_| self.has_all()) {
            let analyses = replications(parts, law);
            for (source, name) in SOURCES.into_iter().enumerate() {
                for (place, statistic) in ["F", "p"].into_iter().enumerate() {
                    let quantity = format!("{name}, {}, {statistic}", in_words(law));
                    let id = format!("{name}, {}, {statistic}/Table 9: {statistic}", id_name(law));
                    let values = analyses
                        .iter()
                        .map(|values| values[source][place])
                        .collect();
                    rows.push(row(&id, quantity, "", Some(TABLE_9[source][place]), values));
                }
            }
        }
        rows
    }

    /// Computes the shares of draws in which two points follow the reference better than one, in
    /// which the means lie in the range of table 8, and in which the effects of table 9 are
    /// significant.
    pub(super) fn control_shares(&self, parts: &[Part]) -> Vec<Share> {
        let mut shares = Vec::new();
        for participant in &self.participants.all {
            for law in LAWS {
                shares.extend(share_of(participant, law, parts));
            }
        }
        for law in LAWS.into_iter().filter(|_| self.has_all()) {
            let draw_means = anova::complete_means(parts, law);
            let words = in_words(law);
            shares.push(claim(
                &format!("table-8-{law}"),
                format!("P, Q, S: two points better, {words}"),
                Some(true),
                draw_means
                    .iter()
                    .map(|items| Some(items.iter().all(|[one_point, two]| two < one_point))),
            ));
            let analyses = replications(parts, law);
            let says = [
                ("points", "points", true),
                ("participants", "participants", false),
                ("interaction", "interaction", false),
            ];
            for (source, (id, effect, paper)) in says.into_iter().enumerate() {
                let is = analyses
                    .iter()
                    .map(|values| Some(values[source][1] < self.protocol.significant));
                let id = format!("table-9-{id}-{law}");
                shares.push(claim(
                    &id,
                    format!("ANOVA, {effect}: p < 0.05, {words}"),
                    Some(paper),
                    is,
                ));
            }
        }
        shares
    }

    /// Returns table 8, its trials, and table 9 if P, Q and S all take part.
    pub(super) fn control_sheets(&self, parts: &[Part]) -> Vec<Sheet> {
        let mut sheets = vec![self.table_8(parts)];
        sheets.extend(self.trials_of_table_8(parts));
        sheets.extend(self.has_all().then(|| table_9(parts)));
        sheets
    }

    fn table_8(&self, parts: &[Part]) -> Sheet {
        let mut rows = Vec::new();
        for participant in &self.participants.all {
            for law in LAWS {
                let draw_means = means(parts, &participant.name, law);
                let mut row = vec![format!("{}, {}", participant.name, short_name(law))];
                for place in 0..METHODS.len() {
                    let spread = Spread::of(draw_means.iter().filter_map(|values| values[place]));
                    row.extend(cells(spread, 1));
                    let paper = participant
                        .paper
                        .as_ref()
                        .map(|printed_value| printed_value.rmse_deg[place]);
                    row.push(cell(paper, 1));
                }
                rows.push(row);
            }
        }
        let heads = "controller|one|5 to 95 %|n|paper|two|5 to 95 %|n|paper";
        let caption = "RMSE from 10 to 30 s, °, as the mean of five trials with one point (the \
                       better of A and B) and with two points. Ours: median, and 5th to 95th \
                       percentile, of the n draws in which every trial has an RMSE; simulated. \
                       Paper: table 8 has averages of P, Q and S under the paper's controller \
                       only; they are repeated beside the default controller for comparison."
            .to_owned();
        let grid = Grid {
            heads: heads.split('|').map(str::to_owned).collect(),
            rows,
        };
        Sheet::table("Table 8", "RMSE of experiment 4, °", caption, grid)
    }

    /// Tabulates the RMSE of every trial, for each participant in the first draw that has all
    /// trials; `None` if no draw has all.
    fn trials_of_table_8(&self, parts: &[Part]) -> Option<Sheet> {
        let (mut rows, mut whose) = (Vec::new(), Vec::new());
        for participant in &self.participants.all {
            let name = &participant.name;
            let own_parts = parts.iter().filter(|part| part.participant == *name);
            let first = own_parts.filter_map(|part| {
                let tracking = part.became.as_ref().ok()?.tracking()?;
                let (_, one_point) = tracking.one_point_rmse(LAWS[0])?;
                Some((part.draw, [one_point, tracking.two_point_rmse(LAWS[0])?]))
            });
            let Some((draw, ours)) = first.into_iter().next() else {
                continue;
            };
            whose.push(format!("{name}'s draw {draw}"));
            let paper = TABLE_8
                .iter()
                .find(|(printed_name, _)| printed_name == name);
            for number in 0..ours[0].len() {
                let trial_cells = |place: usize| {
                    let paper = paper.and_then(|(_, trials)| trials[place].get(number).copied());
                    [cell(ours[place].get(number).copied(), 1), cell(paper, 1)]
                };
                let name = format!("{name}, trial {}", number + 1);
                rows.push([&[name][..], &trial_cells(0), &trial_cells(1)].concat());
            }
            let averages = [mean(&ours[0]), mean(&ours[1])];
            let average_cells = |place: usize| {
                let paper = participant
                    .paper
                    .as_ref()
                    .map(|printed_value| printed_value.rmse_deg[place]);
                [cell(Some(averages[place]), 1), cell(paper, 1)]
            };
            rows.push(
                [
                    &[format!("{name}, average")][..],
                    &average_cells(0),
                    &average_cells(1),
                ]
                .concat(),
            );
        }
        let caption = format!(
            "RMSE of each trial under the paper's controller, °, in the first draw in which all \
             trials with one point and with two points have an RMSE: {}. Simulated; draws.csv has \
             all trials of all draws.",
            whose.join(", ")
        );
        let heads = "|one|paper|two|paper";
        let grid = Grid {
            heads: heads.split('|').map(str::to_owned).collect(),
            rows,
        };
        let sheet = Sheet::table("Table 8", "trial by trial, °", caption, grid);
        (!whose.is_empty()).then_some(sheet)
    }
}

fn rmse_rows(participant: &Participant, law: &str, parts: &[Part]) -> Vec<Row> {
    let name = &participant.name;
    let draw_means = means(parts, name, law);
    let methods = METHODS.into_iter().enumerate();
    let row_of = |(place, method): (usize, &str)| {
        let quantity = format!("{name}, {method}, {}", in_words(law));
        let paper = participant
            .paper
            .as_ref()
            .map(|printed_value| printed_value.rmse_deg[place]);
        let values = draw_means
            .iter()
            .filter_map(|values| values[place])
            .collect();
        row(
            &format!("{name}, {method}, {}/RMSE (°)", id_name(law)),
            quantity,
            "°",
            paper,
            values,
        )
    };
    methods.map(row_of).collect()
}

fn share_of(participant: &Participant, law: &str, parts: &[Part]) -> Vec<Share> {
    let (name, words) = (&participant.name, in_words(law));
    let mean_pairs = pairs(parts, name, law);
    let is_printed = participant.paper.as_ref().map(|_| true);
    let mut shares = vec![claim(
        &format!("two-better-{name}-{law}"),
        format!("{name}: two points follow better, {words}"),
        is_printed,
        mean_pairs
            .iter()
            .map(|[one_point, two]| Some(two < one_point)),
    )];
    // Compares the means with the paper's own numbers: whether they lie within the range of its
    // trials.
    let trials = TABLE_8
        .iter()
        .find(|(printed_name, _)| printed_name == name);
    if let Some((_, trials)) = trials {
        let within = |place: usize, number: f64| {
            let (low, high) = trials[place]
                .iter()
                .fold((f64::MAX, f64::MIN), |(low, high), value| {
                    (low.min(*value), high.max(*value))
                });
            (low..=high).contains(&number)
        };
        shares.push(claim(
            &format!("table-8-within-{name}-{law}"),
            format!("{name}: means in table 8's range, {words}"),
            is_printed,
            mean_pairs
                .iter()
                .map(|[one_point, two]| Some(within(0, *one_point) && within(1, *two))),
        ));
    }
    shares
}

fn table_9(parts: &[Part]) -> Sheet {
    let recomputed = published();
    let ours = LAWS.map(|law| replications(parts, law));
    let mut rows = Vec::new();
    for (source, name) in SOURCES.into_iter().enumerate() {
        for (place, (statistic, digits)) in [("F", 2), ("p", 4)].into_iter().enumerate() {
            let paper = cell(Some(TABLE_9[source][place]), digits);
            let again = cell(recomputed.map(|values| values[source][place]), digits);
            let mut row = vec![format!("{name}, {statistic}"), paper, again];
            for analyses in &ours {
                let spread = Spread::of(analyses.iter().map(|values| values[source][place]));
                row.extend(cells(spread, digits));
            }
            rows.push(row);
        }
    }
    let heads = "|paper|table 8|ours|5 to 95 %|n|default|5 to 95 %|n";
    let grid = Grid {
        heads: heads.split('|').map(str::to_owned).collect(),
        rows,
    };
    let caption = "Two-way analysis of variance with replication; the factors are the number of \
                   points and the participant, with five trials each. Columns: as printed in the \
                   paper; recomputed from the published table 8 (its rounded trials give F = 4.32 \
                   where the paper prints 4.30); ours under the paper's controller, then under \
                   the default controller: median, and 5th to 95th percentile, over the n \
                   replications in which P, Q and S have every trial. Ours is simulated.";
    let title = "analysis of variance of table 8";
    Sheet::table("Table 9", title, caption.to_owned(), grid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hamana2022::Voltages;
    use crate::hamana2022::paper::{DrawMeasurements, DrawResult, Kind, Tracking, Trial};
    use crate::hamana2022::tracked::Method;
    use host_core::run::DeviceName;

    /// Returns a draw of `name` with the trials of table 8, in which B is worse than A.
    fn as_printed(name: &str, trials: [[f64; 5]; 2]) -> Part {
        let [one, two] = trials;
        let methods = [
            (Method::A, one),
            (Method::B, one.map(|value| value + 1.0)),
            (Method::Two, two),
        ];
        let all = methods.into_iter().flat_map(|(method, all)| {
            all.into_iter()
                .zip(0..)
                .map(move |(rmse_deg, number)| Trial {
                    law: LAWS[0].to_owned(),
                    method,
                    number,
                    rmse_deg: Ok(rmse_deg),
                })
        });
        let voltages = Voltages {
            threshold_v: [24.0, 28.0],
            most_v: [28.0, 36.0],
            ratio: Some(0.7),
        };
        let measurements = DrawMeasurements::Tracked(Tracking {
            trials: all.collect(),
            courses: Vec::new(),
        });
        Part {
            participant: name.to_owned(),
            draw: 3,
            became: Ok(DrawResult {
                voltages,
                extensor_v: Some([14.0, 26.0]),
                what: measurements,
            }),
        }
    }

    /// Wearers with the trials of the paper must reproduce its numbers and claims.
    #[test]
    fn what_is_printed_comes_out_of_what_is_printed() {
        let study = Study::new(
            Kind::Control,
            (None, None, None),
            (None, None),
            DeviceName::Native,
        )
        .unwrap();
        let parts = TABLE_8.map(|(name, trials)| as_printed(name, trials));
        for row in study.control_rows(&parts) {
            let is_paper_s = row.id.contains("paper's law") && !row.id.starts_with('R');
            assert_eq!(row.n, usize::from(is_paper_s), "{}", row.id);
            if let (true, Some(ours), Some(paper)) = (is_paper_s, row.ours, row.paper) {
                assert!((ours - paper).abs() < 0.07, "{}: {ours} {paper}", row.id);
            }
        }
        for share in study.control_shares(&parts) {
            let is_known = share.id.ends_with("-paper") && !share.id.contains("-R-");
            let as_printed = share.paper == Some(share.holds == 1);
            assert!(share.of == u64::from(is_known), "{}", share.id);
            assert!(!is_known || as_printed, "{}", share.id);
        }
        let rows = study.csv(&parts);
        let row = "P,3,whole,24,28,28,36,0.7,14,26,paper,two,4,10.200,\"\"";
        assert_eq!(
            rows.lines().filter(|line| *line == row).count(),
            1,
            "{rows}"
        );
    }

    /// The averages of table 8 agree with its trials to the printed digits.
    #[test]
    fn averages_are_those_of_the_trials() {
        let participants = crate::hamana2022::Participants::load(None).unwrap().all;
        for (name, trials) in TABLE_8 {
            let own = participants
                .iter()
                .find(|participant| participant.name == name)
                .unwrap();
            let paper = own.paper.as_ref().unwrap();
            for (trials, average) in trials.iter().zip(paper.rmse_deg) {
                assert!((mean(trials) - average).abs() < 0.07, "{name}");
            }
        }
    }
}
