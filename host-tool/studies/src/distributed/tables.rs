//! Tables: endurance by condition, and the nominal wearer's endurance by pulse rate and by force.

use super::declared::Drive;
use super::study::{AxisPoint, ConditionResult, DrawResult, Study};
use crate::laboratory::{Grid, Row, Sheet};

impl Study {
    /// Returns the sheets of the report page: all figures, then all tables.
    pub(super) fn sheets(&self, results: &[DrawResult], along: &[AxisPoint]) -> Vec<Sheet> {
        let mut sheets = self.figures(results, along);
        sheets.push(self.holds(results));
        sheets.push(rates(along));
        sheets.push(wanted_force_table(along));
        sheets
    }

    /// Tabulates for each condition how many wearers reached the force, and how long they held it.
    fn holds(&self, results: &[DrawResult]) -> Sheet {
        let held = self.declared.conditions.iter();
        let held = held.filter(|condition| condition.drive != Drive::Open);
        let row = |condition: &crate::distributed::Condition| {
            let own: Vec<&ConditionResult> = results
                .iter()
                .filter_map(|result| result.condition_result(&condition.id))
                .collect();
            let count = |is: &dyn Fn(&&&ConditionResult) -> bool| own.iter().filter(is).count();
            let seconds = own.iter().map(|measurement| measurement.endurance.seconds);
            let row = Row::from_numbers(String::new(), String::new(), "s", None, seconds);
            let rounded_text = |number: Option<f64>| {
                number.map_or_else(|| "-".to_owned(), |value| format!("{value:.0}"))
            };
            vec![
                condition.id.clone(),
                format!("{}", count(&|result| result.is_refused)),
                format!("{}", count(&|result| result.endurance.seconds > 0.0)),
                format!("{}", count(&|result| result.endurance.is_longer)),
                rounded_text(row.ours),
                rounded_text(row.low),
                rounded_text(row.high),
            ]
        };
        let heads = [
            "",
            "refused",
            "reached",
            "held to the end",
            "median, s",
            "5 %",
            "95 %",
        ];
        let grid = Grid {
            heads: heads.map(str::to_owned).to_vec(),
            rows: held.map(row).collect(),
        };
        let caption = format!(
            "{} random wearers, simulated. Number of wearers for whom the device refused the force \
             because its model cannot reach it, who reached the force, and who held it to the end \
             of the study; then the endurance of all wearers, 0 for those who did not reach the \
             force. Published: 84 ± 19 s with one electrode, 232 ± 123 s with four, at 25 Hz \
             (Buckmire 2018).",
            results.len()
        );
        Sheet::table(
            "Endurance",
            "how many wearers hold the force, and how long",
            caption,
            grid,
        )
    }
}

/// Tabulates the nominal wearer's endurance by the pulse rate of each electrode.
fn rates(along: &[AxisPoint]) -> Sheet {
    let own = along
        .iter()
        .filter(|axis_point| axis_point.axis == "rate_hz");
    let row = |axis_point: &AxisPoint| {
        let ripple = axis_point.measured.ripple;
        vec![
            format!("{:.2} Hz", axis_point.value),
            format!("{:.0} Hz", 4.0 * axis_point.value),
            seconds(axis_point),
            ripple.map_or_else(|| "-".to_owned(), |ripple| format!("{:.1} %", 1e2 * ripple)),
        ]
    };
    let heads = ["rate of each", "rate of all four", "endurance", "ripple"];
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: own.map(row).collect(),
    };
    let caption = "The nominal wearer (the middle of every range) with four interleaved \
                   electrodes, by the rate of each electrode, simulated. 0 s: the force was not \
                   reached.";
    let title = "endurance by the rate of each electrode";
    Sheet::table("Rate", title, caption.to_owned(), grid)
}

/// Tabulates the nominal wearer's endurance by the reference force.
fn wanted_force_table(along: &[AxisPoint]) -> Sheet {
    let endurance = |value: f64, id: &str| {
        let is = |axis_point: &&AxisPoint| {
            axis_point.axis == "wanted" && axis_point.value == value && axis_point.measured.id == id
        };
        along
            .iter()
            .find(is)
            .map_or_else(|| "-".to_owned(), seconds)
    };
    let firsts = along
        .iter()
        .filter(|axis_point| axis_point.axis == "wanted" && axis_point.measured.id == "one");
    let row = |axis_point: &AxisPoint| {
        let mut row = vec![format!("{:.0} %", 1e2 * axis_point.value)];
        row.extend(["one", "four", "four-half"].map(|id| endurance(axis_point.value, id)));
        row
    };
    let heads = [
        "part of strength",
        "one, 25 Hz",
        "four, 6.25 Hz",
        "four, 12.5 Hz",
    ];
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: firsts.map(row).collect(),
    };
    let caption = "The same wearer, by the reference force, simulated.";
    let title = "endurance by the reference force";
    Sheet::table("Reference force", title, caption.to_owned(), grid)
}

fn seconds(axis_point: &AxisPoint) -> String {
    let endurance = axis_point.measured.endurance;
    let longer = if endurance.is_longer { "> " } else { "" };
    format!("{longer}{:.0} s", endurance.seconds)
}
