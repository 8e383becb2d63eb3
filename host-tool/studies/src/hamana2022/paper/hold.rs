//! Compares the hold (Hamana 2022, III-D6b) over all draws with the numbers in the paper's text.

use super::tracking::mean;
use super::{Part, Study, draw_results};
use crate::hamana2022::held::Hold;
use crate::hamana2022::sessions::{claim, row};
use crate::laboratory::{Row, Share};

/// Returns for each draw of participant `name` how far the finger sinks in ten seconds with one
/// point and with two, °, as the mean over the trials.
fn mean_drops_deg(parts: &[Part], name: &str) -> Vec<[f64; 2]> {
    let mean_drops = |holds: &[[Hold; 2]]| {
        [0, 1].map(|place| {
            let drops_deg: Vec<f64> = holds
                .iter()
                .map(|values| values[place].drop_deg())
                .collect();
            mean(&drops_deg)
        })
    };
    let held = draw_results(parts, name).filter_map(|outcome| outcome.held());
    held.filter(|values| !values.is_empty())
        .map(mean_drops)
        .collect()
}

impl Study {
    /// Returns rows with how far each participant's finger sinks in ten seconds, beside the printed
    /// values.
    pub(super) fn hold_rows(&self, parts: &[Part]) -> Vec<Row> {
        let mut rows = Vec::new();
        for participant in &self.participants.all {
            let name = &participant.name;
            let drops_deg = mean_drops_deg(parts, name);
            for (place, method) in ["one point", "two points"].into_iter().enumerate() {
                let quantity = format!("{name}, angle lost with {method}");
                let paper = participant
                    .paper
                    .as_ref()
                    .map(|printed_value| printed_value.sinks_deg[place]);
                let values = drops_deg.iter().map(|values| values[place]).collect();
                let id = format!("{name}, {method} sinks/Sinks in 10 s (°)");
                rows.push(row(&id, quantity, "°", paper, values));
            }
        }
        rows
    }

    /// Computes the shares of draws in which the finger sinks less with two points than with one.
    pub(super) fn hold_shares(&self, parts: &[Part]) -> Vec<Share> {
        let share_of = |participant: &crate::hamana2022::Participant| {
            let name = &participant.name;
            let drops_deg = mean_drops_deg(parts, name);
            claim(
                &format!("two-better-{name}"),
                format!("{name}: finger sinks less with two points"),
                participant.paper.as_ref().map(|_| true),
                drops_deg
                    .iter()
                    .map(|[one_point, two]| Some(two < one_point)),
            )
        };
        self.participants.all.iter().map(share_of).collect()
    }
}
