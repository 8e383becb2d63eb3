//! Draws the counterparts of the paper's figures under the same numbers. The paper's photographs
//! and diagrams (1 to 7, 16, 22 to 24 and 29) have none.

mod angles;
mod fingers;
mod patterns;

use super::{Kind, Part, Study};
use crate::hamana2022::error::TwoPointsError;
use crate::hamana2022::experiments::Experiment;
use crate::hamana2022::wearers::Wearer;
use crate::laboratory::Sheet;

/// Names of the plotted series: the five digits, then the individuation index.
const DIGITS: [&str; 6] = [
    "thumb",
    "index",
    "middle",
    "ring",
    "little",
    "individuation index",
];

/// Wearer whose forearm a figure shows.
struct ShownWearer {
    wearer: Wearer,
    /// Description such as "P, draw 3", with the reason if the paper shows another participant.
    words: String,
}

impl Study {
    /// Draws the figures of this kind of study. A figure of one wearer is missing if no draw has
    /// points and voltages.
    pub(super) fn figures(&self, parts: &[Part]) -> Result<Vec<Sheet>, TwoPointsError> {
        Ok(match self.kind {
            Kind::Patterns(Experiment::Selectivity) => {
                let mut sheets = self.figure_8(parts)?;
                sheets.extend(self.figures_9_to_11(parts)?);
                sheets.extend(self.individuation_figures(parts));
                sheets
            }
            Kind::Patterns(Experiment::Torque) => self.torque_figures(parts),
            Kind::Patterns(Experiment::Intensities) => self.figure_21(parts),
            Kind::Patterns(Experiment::Posture) => {
                let mut sheets = self.figure_30(parts)?;
                sheets.extend(self.figure_31(parts));
                sheets
            }
            Kind::Control => self.figures_25_to_28(parts),
            Kind::Hold => self.figure_32(parts),
        })
    }

    /// Returns the first draw with a result, preferably of the participant `wanted`.
    fn shown_wearer(
        &self,
        wanted: &str,
        parts: &[Part],
    ) -> Result<Option<ShownWearer>, TwoPointsError> {
        let others = self
            .participants
            .all
            .iter()
            .map(|participant| &*participant.name);
        for name in std::iter::once(wanted).chain(others) {
            if let Some((draw, wearer)) = self.first_forearm(name, parts)? {
                return Ok(Some(ShownWearer {
                    wearer,
                    words: in_words(name, draw, wanted),
                }));
            }
        }
        Ok(None)
    }
}

/// Describes a draw, and mentions if the paper shows another participant.
fn in_words(name: &str, draw: u64, wanted: &str) -> String {
    match name == wanted {
        true => format!("{name}, draw {draw}, the first that has points and voltages"),
        false => format!("{name}, draw {draw} (no draw of {wanted} has points and voltages)"),
    }
}
