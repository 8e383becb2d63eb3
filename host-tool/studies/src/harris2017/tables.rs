//! Tables for questions to which the paper has no table: angles, muscles and equivalent pulses.

use super::angles::{DEPENDS, relative_torque_change};
use super::error::RampsError;
use super::found::{DrawResult, HeldPulse, TestMeasurements};
use super::person::{in_words, is_triceps};
use super::study::Study;
use super::test::{Stimulation, stimulations};
use crate::laboratory::{Grid, Sheet};
use hal_sim::body::bench::arms::Muscle;

/// Muscles other than the triceps, in the order of the columns.
const OTHERS: [Muscle; 3] = [Muscle::Deltoid, Muscle::Brachialis, Muscle::Biceps];

impl Study {
    /// Returns the figures, then the tables.
    pub(super) fn sheets(&self, all: &[DrawResult]) -> Result<Vec<Sheet>, RampsError> {
        let mut sheets = self.figures(all);
        sheets.extend(self.angle_table(all)?);
        sheets.push(self.muscle_table(all));
        sheets.push(self.beyond_table(all));
        sheets.extend(self.strength_table(all));
        Ok(sheets)
    }

    /// Tabulates the effect of the angle on the triceps' torque, for a long head with its optimal
    /// length at 90°. No other random parameter changes this effect.
    fn angle_table(&self, all: &[DrawResult]) -> Result<Option<Sheet>, RampsError> {
        let Some(found) = all.first() else {
            return Ok(None);
        };
        let mut nominal = found.person.clone();
        nominal
            .muscles
            .iter_mut()
            .for_each(|stimulation| stimulation.length_at_90 = 1.0);
        let (mut heads, mut rows) = (vec!["what depends on the angle".to_owned()], Vec::new());
        let angles = || {
            self.declared
                .protocol
                .angles_deg
                .iter()
                .filter(|angle_deg| **angle_deg != 90.0)
        };
        heads.extend(angles().map(|deg| format!("{deg}°")));
        for (words, depends) in DEPENDS {
            let mut row = vec![words.to_owned()];
            for &deg in angles() {
                let percent = 1e2 * relative_torque_change(&nominal, depends, deg)?;
                row.push(format!("{percent:+.1} %"));
            }
            rows.push(row);
        }
        let caption = "Change of the triceps' torque relative to 90°, with all heads excited \
                       equally and the muscle forces of arm26.osim. The long head is assumed to \
                       have its optimal length at 90°; the draws vary this length from 0.8 to 1.2 \
                       of the optimum. The paper: 75° to 105° \"did not alter the torque output \
                       significantly\", for two participants, without a number. Angles are \
                       between forearm and upper arm.";
        let grid = Grid { heads, rows };
        let title = "effect of ±15° on the triceps' torque";
        Ok(Some(Sheet::table(
            "Angles",
            title,
            caption.to_owned(),
            grid,
        )))
    }

    /// Tabulates which muscle responds first in each ramp at 90°, and which muscles are stimulated
    /// at all.
    fn muscle_table(&self, all: &[DrawResult]) -> Sheet {
        let middle_deg = self.middle_deg();
        let judged = &self.declared.judged;
        let percent = |count: usize, of: usize| match of {
            0 => "-".to_owned(),
            of => format!("{:.0} %", 1e2 * count as f64 / of as f64),
        };
        let row = |stimulation: Stimulation| {
            let own: Vec<&TestMeasurements> = all
                .iter()
                .filter_map(|result| result.find_test(stimulation, middle_deg))
                .collect();
            let first = |is: &dyn Fn(Muscle) -> bool| {
                let count = own
                    .iter()
                    .filter(|measurement| measurement.first.is_some_and(is))
                    .count();
                percent(count, own.len())
            };
            let stimulated = |muscle: Muscle| {
                let counts = |measurement: &&&TestMeasurements| {
                    let mut answers = measurement.answers.iter();
                    answers.any(|answer| answer.muscle == muscle && answer.is_stimulated(judged))
                };
                percent(own.iter().filter(counts).count(), own.len())
            };
            let mut row = vec![stimulation.in_words(), first(&is_triceps)];
            row.push(first(&|muscle| !is_triceps(muscle)));
            row.extend(OTHERS.map(stimulated));
            row
        };
        let heads = ["ramp at 90°", "triceps first", "another first"].map(str::to_owned);
        let heads = heads
            .into_iter()
            .chain(OTHERS.map(|muscle| in_words(muscle).to_owned()));
        let grid = Grid {
            heads: heads.collect(),
            rows: stimulations(&self.declared.protocol)
                .into_iter()
                .map(row)
                .collect(),
        };
        let caption = "Shares of the simulated wearers. First: the muscle whose fibres respond \
                       first (1 % of the fibres within reach). Other columns: the muscle counts \
                       as stimulated at the end of the ramp (0.1 N·m of elbow torque, or 5 % of \
                       the fibres for the deltoid, which has no torque at the elbow).";
        let title = "which muscle responds first, and which others respond";
        Sheet::table("Muscles", title, caption.to_owned(), grid)
    }

    fn beyond_table(&self, all: &[DrawResult]) -> Sheet {
        let beyond = self.declared.beyond;
        let median = |numbers: Vec<f64>| {
            let row = super::rows::row(String::new(), String::new(), "", numbers);
            row.ours
                .map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
        };
        let rows = [(beyond.first, 0), (beyond.second, 1)].map(|(pulse, nth)| {
            let own = |result: &DrawResult| result.beyond[nth].clone();
            let held: Vec<HeldPulse> = all.iter().map(own).collect();
            let has = |muscle| {
                held.iter()
                    .filter(|held| held.others.contains(&muscle))
                    .count()
            };
            let mut row = vec![
                format!("{} mA × {} µs", pulse.current_ma, pulse.width_us),
                format!("{:.2}", 1e-3 * pulse.current_ma * f64::from(pulse.width_us)),
                median(held.iter().map(|pulse| pulse.torque_nm).collect()),
            ];
            row.extend(OTHERS.map(|muscle| format!("{} of {}", has(muscle), held.len())));
            row
        });
        let heads = ["pulse", "charge, µC", "torque, N·m"].map(str::to_owned);
        let heads = heads
            .into_iter()
            .chain(OTHERS.map(|muscle| in_words(muscle).to_owned()));
        let caption = "Medians of the simulated wearers at 50 Hz and 90°, computed with the body \
                       alone, because no device of this program outputs more than 100 mA. If \
                       every muscle had a chronaxie of 200 µs, both pulses would have the same \
                       effect by construction, the second with less than half of the charge. The \
                       differences here come from different chronaxies.";
        let grid = Grid {
            heads: heads.collect(),
            rows: rows.to_vec(),
        };
        Sheet::table(
            "Equal pulses",
            "35 mA × 300 µs against 141 mA × 35 µs",
            caption.to_owned(),
            grid,
        )
    }

    /// Tabulates rheobase and chronaxie of the participants' electrode pairs beside the true
    /// values.
    fn strength_table(&self, all: &[DrawResult]) -> Option<Sheet> {
        let heads = [
            "pair",
            "rheobase, mA",
            "95 % interval",
            "chronaxie, µs",
            "95 % interval",
            "true chronaxie, µs",
        ];
        let mut rows = Vec::new();
        for (place, found) in all.iter().take(2).enumerate() {
            for (own, (name, muscle)) in (found.strength_duration.iter()).zip([
                ("triceps", Muscle::TricepsLateral),
                ("biceps", Muscle::Biceps),
            ]) {
                let Some(fitted) = &own.fitted else { continue };
                let truth = found
                    .person
                    .muscles
                    .iter()
                    .find(|stimulation| stimulation.muscle == muscle)?;
                let [low, high] = fitted.rheobase_within;
                let [least, most] = fitted.chronaxie_within;
                rows.push(vec![
                    format!("participant {}, {name}", place + 1),
                    format!("{:.2}", fitted.rheobase_ma),
                    format!("{low:.2}-{high:.2}"),
                    format!("{:.0}", fitted.chronaxie_us),
                    format!("{least:.0}-{most:.0}"),
                    format!("{:.0}", truth.strength.chronaxie_us),
                ]);
            }
        }
        let caption = "Law fitted to thresholds that were found in steps of 0.5 mA at ten pulse \
                       widths. The rheobase belongs to a torque of 0.05 N·m and is therefore \
                       higher than the lowest rheobase of the fibres.";
        let grid = Grid {
            heads: heads.map(str::to_owned).to_vec(),
            rows,
        };
        let title = "thresholds against pulse width";
        (!grid.rows.is_empty())
            .then(|| Sheet::table("Strength and duration", title, caption.to_owned(), grid))
    }
}
