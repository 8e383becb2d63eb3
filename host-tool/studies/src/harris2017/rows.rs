//! Computes the rows of `result.json`: numbers over all wearers.

use super::angles::{DEPENDS, is_significant, least_found, relative_torque_change};
use super::claims::co_contraction;
use super::error::RampsError;
use super::found::DrawResult;
use super::study::Study;
use super::test::{Stimulation, stimulations};
use crate::laboratory::{Row, Share};

/// Returns a row without a published value.
pub(super) fn row(id: String, quantity: String, unit: &str, numbers: Vec<f64>) -> Row {
    Row::from_numbers(id, quantity, unit, None, numbers)
}

impl Study {
    /// Returns the rows of each ramp at the middle angle, then those of angles, co-contraction,
    /// chronaxie and equivalent pulses.
    pub(super) fn rows(&self, all: &[DrawResult]) -> Result<Vec<Row>, RampsError> {
        let mut rows: Vec<Row> = stimulations(&self.declared.protocol)
            .into_iter()
            .flat_map(|stimulation| self.ramp_rows(stimulation, all))
            .collect();
        rows.extend(self.angle_rows(all)?);
        let parts = all
            .iter()
            .filter_map(|result| co_contraction(&self.declared, result));
        let says = "biceps torque relative to triceps (40 mA × 25 µs and 80 mA × 35 µs)";
        let id = "biceps-part".to_owned();
        rows.push(row(
            id,
            says.to_owned(),
            "%",
            parts.map(|part| 1e2 * part).collect(),
        ));
        let found = all.iter().filter_map(DrawResult::chronaxies_us);
        let parts = found.map(|(found, _, truth)| 1e2 * (found / truth - 1.0));
        let says = "error of the fitted chronaxie".to_owned();
        rows.push(row("chronaxie".to_owned(), says, "%", parts.collect()));
        for (nth, id) in ["beyond-first", "beyond-second"].into_iter().enumerate() {
            let beyond = self.declared.beyond;
            let pulse = [beyond.first, beyond.second][nth];
            let says = format!("torque, {} mA × {} µs", pulse.current_ma, pulse.width_us);
            let numbers = all.iter().map(|result| result.beyond[nth].torque_nm);
            rows.push(row(id.to_owned(), says, "N·m", numbers.collect()));
        }
        Ok(rows)
    }

    fn ramp_rows(&self, stimulation: Stimulation, all: &[DrawResult]) -> [Row; 3] {
        let middle_deg = self.middle_deg();
        let own = || {
            all.iter()
                .filter_map(|result| result.find_test(stimulation, middle_deg))
        };
        let (id, words) = (stimulation.id(), stimulation.in_words());
        let unit = match stimulation {
            Stimulation::Width(_) => "µs",
            _ => "mA",
        };
        let told = |what: &str, says: &str| (format!("{id}/{what}"), format!("{says}, {words}"));
        let (peak, begin, linear) = (
            told("peak", "peak torque"),
            told("begin", "onset of torque"),
            told("linearity", "linearity (R²)"),
        );
        [
            row(
                peak.0,
                peak.1,
                "N·m",
                own().map(|measurement| measurement.peak_nm).collect(),
            ),
            row(
                begin.0,
                begin.1,
                unit,
                own()
                    .filter_map(|measurement| measurement.detected_at)
                    .collect(),
            ),
            row(
                linear.0,
                linear.1,
                "",
                own()
                    .filter_map(|measurement| measurement.linearity)
                    .collect(),
            ),
        ]
    }

    /// Returns the rows about the effect of ±15° on the triceps' torque.
    fn angle_rows(&self, all: &[DrawResult]) -> Result<Vec<Row>, RampsError> {
        let mut rows = Vec::new();
        let protocol = &self.declared.protocol;
        for (nth, (words, depends)) in DEPENDS.into_iter().enumerate() {
            for &deg in protocol
                .angles_deg
                .iter()
                .filter(|angle_deg| **angle_deg != 90.0)
            {
                let numbers = all
                    .iter()
                    .map(|result| relative_torque_change(&result.person, depends, deg));
                let numbers = numbers.collect::<Result<Vec<f64>, _>>()?;
                let id = format!("angle-{nth}-{deg}");
                let says = format!("torque change at {deg}°: {words}");
                let numbers = numbers.into_iter().map(|number| 1e2 * number).collect();
                rows.push(row(id, says, "%", numbers));
            }
        }
        let numbers = all.iter().map(|result| 1e2 * result.departs).collect();
        let says = "largest change at ±15°, current ramp".to_owned();
        rows.push(row("angle-most".to_owned(), says, "%", numbers));
        let level = self.declared.judged.level;
        for noise in [0.06, 0.10] {
            let least = least_found(noise, level, self.seed).map(|value| 1e2 * value);
            let percent = (1e2 * noise).round();
            let says =
                format!("smallest detectable change, noise {percent} % (found by 4 of 5 studies)");
            let id = format!("least-found-{percent}");
            rows.push(row(id, says, "%", least.into_iter().collect()));
        }
        Ok(rows)
    }

    /// Computes the share of studies with two participants in which the angle is significant. Each
    /// study is a pair of wearers: the first with ramps of both kinds, the second with current
    /// ramps only.
    pub(super) fn significance_share(&self, all: &[DrawResult]) -> Share {
        let protocol = &self.declared.protocol;
        let ramps = stimulations(protocol);
        let rows = |found: &DrawResult, with_widths: bool| {
            let own = ramps.iter().filter(|stimulation| {
                with_widths || matches!(stimulation, Stimulation::Current(_))
            });
            let row = |stimulation: &Stimulation| {
                let angles = protocol.angles_deg.iter();
                let peaks =
                    angles.filter_map(|&deg| Some(found.find_test(*stimulation, deg)?.peak_nm));
                peaks.collect::<Vec<f64>>()
            };
            own.map(row).collect::<Vec<_>>()
        };
        let pairs = all.chunks_exact(2);
        let tested = pairs.filter_map(|pair| {
            let mut both = rows(&pair[0], true);
            both.extend(rows(&pair[1], false));
            is_significant(&both, self.declared.judged.level)
        });
        let tested: Vec<bool> = tested.collect();
        let counts = (
            tested.iter().filter(|flag| **flag).count() as u64,
            tested.len() as u64,
        );
        let says = "two participants show an effect of ±15°, p < 0.05";
        Share::from_counts(
            "angle-significant".to_owned(),
            says.to_owned(),
            Some(false),
            counts,
        )
    }

    /// Computes the share of wearers for whom the 95 % interval of the chronaxie contains the true
    /// one; it should be 95 %.
    pub(super) fn coverage_share(&self, all: &[DrawResult]) -> Share {
        let found = all.iter().filter_map(DrawResult::chronaxies_us);
        let within = found.map(|(_, [low, high], truth)| low <= truth && truth <= high);
        let within: Vec<bool> = within.collect();
        let counts = (
            within.iter().filter(|flag| **flag).count() as u64,
            within.len() as u64,
        );
        let says = "the 95 % interval contains the true chronaxie";
        Share::from_counts(
            "chronaxie-covered".to_owned(),
            says.to_owned(),
            None,
            counts,
        )
    }

    /// Returns the middle angle of the protocol, 90°.
    pub(super) fn middle_deg(&self) -> f64 {
        self.declared
            .protocol
            .angles_deg
            .get(1)
            .copied()
            .unwrap_or(90.0)
    }
}
