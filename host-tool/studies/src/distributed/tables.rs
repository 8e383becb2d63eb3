//! Tables: conditions, and the middle person by the rate of each electrode.

use super::declared::Drive;
use super::study::{AxisPoint, Found, Measured, Study};
use crate::laboratory::{Grid, Row, Sheet};

impl Study {
    /// Pictures, then tables.
    pub(super) fn sheets(&self, all: &[Found], along: &[AxisPoint]) -> Vec<Sheet> {
        let mut sheets = self.figures(all, along);
        sheets.push(self.holds(all));
        sheets.push(self.rates(along));
        sheets
    }

    /// How many of everybody reached the force, and how long they held it.
    fn holds(&self, all: &[Found]) -> Sheet {
        let held = self.declared.conditions.iter();
        let held = held.filter(|it| it.drive != Drive::Open);
        let row = |condition: &crate::distributed::Condition| {
            let own: Vec<&Measured> = all.iter().filter_map(|it| it.of(&condition.id)).collect();
            let count = |is: &dyn Fn(&&&Measured) -> bool| own.iter().filter(is).count();
            let seconds = own.iter().map(|it| it.endurance.seconds);
            let row = Row::of(String::new(), String::new(), "s", None, seconds.collect());
            let whole =
                |it: Option<f64>| it.map_or_else(|| "-".to_owned(), |it| format!("{it:.0}"));
            vec![
                condition.id.clone(),
                format!("{}", count(&|it| it.is_refused)),
                format!("{}", count(&|it| it.endurance.seconds > 0.0)),
                format!("{}", count(&|it| it.endurance.is_longer)),
                whole(row.ours),
                whole(row.low),
                whole(row.high),
            ]
        };
        let heads = [
            "",
            "refused",
            "reached",
            "to the end",
            "median, s",
            "5 %",
            "95 %",
        ];
        let grid = Grid {
            heads: heads.map(str::to_owned).to_vec(),
            rows: held.map(row).collect(),
        };
        let caption = format!(
            "Persons of {} drawn, simulated: whose force the device refused as out of its model's \
             reach, who reached the force, who still held it at the study's end; endurance of \
             everybody, 0 of who did not reach it. Published: 84 ± 19 s with one electrode, 232 ± \
             123 s with four, at 25 Hz (Buckmire 2018).",
            all.len()
        );
        Sheet::table(
            "Endurance",
            "who holds the force, and how long",
            caption,
            grid,
        )
    }

    /// The middle person.
    fn rates(&self, along: &[AxisPoint]) -> Sheet {
        let own = along.iter().filter(|it| it.axis == "rate_hz");
        let row = |it: &AxisPoint| {
            let ripple = it.measured.ripple;
            let endurance = it.measured.endurance;
            let longer = if endurance.is_longer { "> " } else { "" };
            vec![
                format!("{:.2} Hz", it.value),
                format!("{:.0} Hz", 4.0 * it.value),
                format!("{longer}{:.0} s", endurance.seconds),
                ripple.map_or_else(|| "-".to_owned(), |it| format!("{:.1} %", 1e2 * it)),
            ]
        };
        let heads = ["of each", "of the four", "endurance", "ripple"];
        let grid = Grid {
            heads: heads.map(str::to_owned).to_vec(),
            rows: own.map(row).collect(),
        };
        let caption =
            "A person in the middle of every range under four interleaved electrodes, by \
                       the rate of each, simulated."
                .to_owned();
        Sheet::table(
            "Rate",
            "endurance by the rate of each electrode",
            caption,
            grid,
        )
    }
}
