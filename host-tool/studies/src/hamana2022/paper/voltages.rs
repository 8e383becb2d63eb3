//! Compares thresholds and largest voltages of the draws with tables 2, 3 and 7.

use super::spread::cell;
use super::{DrawResult, Kind, Part, Study, draw_results};
use crate::hamana2022::experiments::Experiment;
use crate::hamana2022::participant::Participant;
use crate::hamana2022::printed::{TABLE_2, TABLE_3, TABLE_7_BOTH_V, printed_values};
use crate::hamana2022::sessions::row;
use crate::laboratory::{Grid, Row, Sheet};
use host_core::statistics::Spread;

/// Columns of table 7, for A, B and the extensor's point (E).
const TABLE_7: [&str; 9] = [
    "V_Ath",
    "V_Amax",
    "V_Bth",
    "V_Bmax",
    "V_Eth",
    "V_Emax",
    "r_th",
    "r_th·V_Amax",
    "r_th·V_Bmax",
];
/// Index of the only column that is not a voltage.
const R_TH: usize = 6;

/// Returns the values of one draw, in the order of [`TABLE_7`].
fn draw_voltages(came: &DrawResult) -> [Option<f64>; 9] {
    let [[a, b], [am, bm]] = [came.voltages.threshold_v, came.voltages.most_v];
    let [e, em] = [0, 1].map(|at| came.extensor_v.map(|volts| volts[at]));
    let r = came.voltages.ratio;
    let [a, am, b, bm] = [a, am, b, bm].map(Some);
    let scaled_v = [am, bm].map(|most| Some(r? * most?));
    [a, am, b, bm, e, em, r, scaled_v[0], scaled_v[1]]
}

/// Returns the printed values of a participant, in the order of [`TABLE_7`].
fn printed(participant: &Participant) -> [Option<f64>; 9] {
    let (Some(paper), Some([a, b, e])) = (&participant.paper, participant.thresholds_v) else {
        return [None; 9];
    };
    let [am, bm, em] = paper.most_v;
    let pair = printed_values(&TABLE_7_BOTH_V, &participant.name);
    let [both_a, both_b] = pair.map_or([None; 2], |values| values.map(Some));
    let [a, am, b, bm, e, em, r] = [a, am, b, bm, e, em, paper.r_th].map(Some);
    [a, am, b, bm, e, em, r, both_a, both_b]
}

/// Participants with the printed voltages of A and B, V.
type PrintedVoltages = [(&'static str, [f64; 2])];

/// Returns the table that the paper prints for experiment 1 or 2 (table 2 or 3).
fn printed_voltages(experiment: Experiment) -> Option<(&'static str, &'static PrintedVoltages)> {
    match experiment {
        Experiment::Selectivity => Some(("Table 2", &TABLE_2)),
        Experiment::Torque => Some(("Table 3", &TABLE_3)),
        _ => None,
    }
}

impl Study {
    /// Computes the rows of every voltage that the paper prints for this study.
    pub(super) fn voltage_rows(&self, parts: &[Part]) -> Vec<Row> {
        let participants = self.participants.all.iter();
        match self.kind {
            Kind::Control => participants
                .flat_map(|participant| table_7_rows(participant, parts))
                .collect(),
            Kind::Patterns(experiment) => {
                let Some((_, paper)) = printed_voltages(experiment) else {
                    return Vec::new();
                };
                participants
                    .flat_map(|participant| applied_rows(participant, paper, parts))
                    .collect()
            }
            Kind::Hold => Vec::new(),
        }
    }

    /// Returns table 7 for experiment 4, or table 2 or 3 for experiment 1 or 2.
    pub(super) fn voltage_sheet(&self, parts: &[Part]) -> Option<Sheet> {
        match self.kind {
            Kind::Control => Some(self.table_7(parts)),
            Kind::Patterns(experiment) => {
                let (number, paper) = printed_voltages(experiment)?;
                Some(self.table_2_or_3(number, paper, parts))
            }
            Kind::Hold => None,
        }
    }

    fn table_7(&self, parts: &[Part]) -> Sheet {
        let mut rows = Vec::new();
        for participant in &self.participants.all {
            let name = &participant.name;
            let draws: Vec<[Option<f64>; 9]> =
                draw_results(parts, name).map(draw_voltages).collect();
            let place_spread =
                |place: usize| Spread::of(draws.iter().filter_map(|values| values[place]));
            let spreads: [Option<Spread>; 9] = std::array::from_fn(place_spread);
            let lines = [
                (
                    "median",
                    spreads.map(|spread| spread.map(|spread| spread.median)),
                ),
                ("5 %", spreads.map(|spread| spread.map(|spread| spread.low))),
                (
                    "95 %",
                    spreads.map(|spread| spread.map(|spread| spread.high)),
                ),
                ("paper", printed(participant)),
            ];
            for (label, numbers) in lines {
                let numbers = numbers.into_iter().map(|number| cell(number, 1));
                let first = match label {
                    "paper" => [format!("{name}, paper"), String::new()],
                    _ => [format!("{name}, {label}"), draws.len().to_string()],
                };
                rows.push(first.into_iter().chain(numbers).collect());
            }
        }
        let heads = "|n|A th|A max|B th|B max|E th|E max|r_th|r·A|r·B";
        let caption = "Threshold (th) and maximum voltage (max) of A, B and the extensor's point \
                       (E), V; the ratio r_th; and r_th times the maximum of A and of B, V. \
                       Median, 5th and 95th percentile of n draws, simulated. The thresholds of \
                       P, Q and S are fitted to the paper's; all other values are found by the \
                       paper's searches, in steps of 2 V up to 40 V. The paper's table 7 has P, Q \
                       and S."
            .to_owned();
        let grid = Grid {
            heads: heads.split('|').map(str::to_owned).collect(),
            rows,
        };
        Sheet::table("Table 7", "voltages of experiment 4", caption, grid)
    }

    fn table_2_or_3(&self, number: &str, paper: &PrintedVoltages, parts: &[Part]) -> Sheet {
        let row = |participant: &Participant| {
            let name = &participant.name;
            let printed = printed_values(paper, name);
            let mut row = vec![name.clone(), draw_results(parts, name).count().to_string()];
            for point in 0..2 {
                let spread = Spread::of(
                    draw_results(parts, name).map(|outcome| outcome.voltages.most_v[point]),
                );
                let at = |statistic: fn(Spread) -> f64| cell(spread.map(statistic), 1);
                row.extend([
                    at(|spread| spread.median),
                    at(|spread| spread.low),
                    at(|spread| spread.high),
                ]);
                row.push(cell(printed.map(|values| values[point]), 0));
            }
            row
        };
        let heads = "|n|V_A|5 %|95 %|paper|V_B|5 %|95 %|paper";
        let grid = Grid {
            heads: heads.split('|').map(str::to_owned).collect(),
            rows: self.participants.all.iter().map(row).collect(),
        };
        let caption = format!(
            "Voltages that were applied to A and B, V: the highest at which the index finger \
             bends alone (individuation above 0.8), found by the paper's search on each forearm, \
             up to 40 V. Median, 5th and 95th percentile of n draws, simulated. The paper's \
             {number} has one value for each participant and point. The paper repeated the search \
             in each experiment; here all experiments use the same search."
        );
        Sheet::table(number, "voltages applied, V", caption, grid)
    }
}

fn table_7_rows(participant: &Participant, parts: &[Part]) -> Vec<Row> {
    let name = &participant.name;
    let draws: Vec<[Option<f64>; 9]> = draw_results(parts, name).map(draw_voltages).collect();
    let paper = printed(participant);
    let row_of = |place: usize| {
        let quantity = format!("{name}, {}", TABLE_7[place]);
        let (measure, unit) = match place {
            R_TH => ("r_th", ""),
            _ => ("Voltage (V)", "V"),
        };
        let values = draws.iter().filter_map(|values| values[place]).collect();
        let id = format!("{quantity}/{measure}");
        row(&id, quantity, unit, paper[place], values)
    };
    (0..TABLE_7.len()).map(row_of).collect()
}

fn applied_rows(participant: &Participant, paper: &PrintedVoltages, parts: &[Part]) -> Vec<Row> {
    let name = &participant.name;
    let printed = printed_values(paper, name);
    let row_of = |(point, letter): (usize, &str)| {
        let quantity = format!("{name}, V_{letter}app");
        let values = draw_results(parts, name).map(|outcome| outcome.voltages.most_v[point]);
        let id = format!("{quantity}/Voltage applied (V)");
        row(
            &id,
            quantity,
            "V",
            printed.map(|values| values[point]),
            values.collect(),
        )
    };
    ["A", "B"].into_iter().enumerate().map(row_of).collect()
}
