//! What a device puts out, held against what the body alone is given: a sample of a study.

use super::{DrawMeasurements, Kind, Part, Study};
use crate::hamana2022::error::TwoPointsError;
use crate::hamana2022::pattern::Pattern;
use hal_sim::body::hand::spec::{A, B};

/// Of so many draws with points and voltages one runs on the device as well; the first of
/// them always.
const CHECKED_OF: usize = 100;
/// Voltages of A and B at which a device is tried before anybody is drawn.
const TRIED_V: [f64; 2] = [20.0; 2];

impl Study {
    /// Whether the study's device puts out a pattern at all; experiment 4 finds out by
    /// itself.
    ///
    /// # Errors
    /// The device is not there; E628: it does not play it.
    pub fn check_device(&self) -> Result<(), TwoPointsError> {
        if self.kind != Kind::Control {
            Pattern::default_two_point().play_on_device(TRIED_V, &self.device)?;
        }
        Ok(())
    }

    /// Every pattern of the sample on the device as well, for people.
    ///
    /// # Errors
    /// E628: the device does not put it out as the body alone is given it.
    pub(super) fn check_outputs(&self, parts: &[Part]) -> Result<Vec<String>, TwoPointsError> {
        let whole = parts
            .iter()
            .filter_map(|part| Some((part, part.became.as_ref().ok()?)));
        let mut notes = Vec::new();
        for (part, came) in whole.step_by(CHECKED_OF) {
            let patterns: Vec<(Pattern, [f64; 2])> = match &came.what {
                DrawMeasurements::Patterns(session) => {
                    let all = session.conditions.iter();
                    all.map(|condition| (condition.pattern, condition.volts))
                        .collect()
                }
                DrawMeasurements::Held(_) => {
                    let all = [
                        Pattern::isolated_point(A),
                        Pattern::isolated_point(B),
                        Pattern::default_two_point(),
                    ];
                    all.map(|pattern| (pattern, came.voltages.most_v)).into()
                }
                DrawMeasurements::Tracked(_) => continue,
            };
            let Some(wearer) = self.wearer(&part.participant, part.draw)? else {
                continue;
            };
            let put_out = wearer.compare_outputs(patterns, &self.device)?;
            let who = format!("{}'s draw {}", part.participant, part.draw);
            notes.push(put_out.in_words(&who, &self.device));
        }
        Ok(notes)
    }
}
