//! Compares the output of a device with the pattern that the study applies to the forearm, for a
//! sample of the draws.

use super::{DrawMeasurements, Kind, Part, Study};
use crate::hamana2022::error::TwoPointsError;
use crate::hamana2022::pattern::Pattern;
use hal_sim::body::hand::spec::{A, B};

/// Of the draws with points and voltages, the first and every further one after this many draws is
/// checked on the device.
const CHECKED_OF: usize = 100;
/// Voltages of A and B at which the device is tried before any draw, V.
const TRIED_V: [f64; 2] = [20.0; 2];

impl Study {
    /// Checks that the study's device plays a pattern. Experiment 4 needs no check, because it runs
    /// on the device.
    ///
    /// # Errors
    /// Fails if the device cannot be opened. Returns E628 if it does not play the pattern.
    pub fn check_device(&self) -> Result<(), TwoPointsError> {
        if self.kind != Kind::Control {
            Pattern::default_two_point().play_on_device(TRIED_V, &self.device)?;
        }
        Ok(())
    }

    /// Plays the patterns of the sampled draws on the device and describes for the report how the
    /// output compares with the intended patterns.
    ///
    /// # Errors
    /// Returns E628 if the output differs from the intended pattern.
    pub(super) fn check_outputs(&self, parts: &[Part]) -> Result<Vec<String>, TwoPointsError> {
        let complete_parts = parts
            .iter()
            .filter_map(|part| Some((part, part.became.as_ref().ok()?)));
        let mut notes = Vec::new();
        for (part, came) in complete_parts.step_by(CHECKED_OF) {
            let patterns: Vec<(Pattern, [f64; 2])> = match &came.what {
                DrawMeasurements::Patterns(session) => {
                    let conditions = session.conditions.iter();
                    conditions
                        .map(|condition| (condition.pattern, condition.volts))
                        .collect()
                }
                DrawMeasurements::Held(_) => {
                    let held_patterns = [
                        Pattern::isolated_point(A),
                        Pattern::isolated_point(B),
                        Pattern::default_two_point(),
                    ];
                    held_patterns
                        .map(|pattern| (pattern, came.voltages.most_v))
                        .into()
                }
                DrawMeasurements::Tracked(_) => continue,
            };
            let Some(wearer) = self.wearer(&part.participant, part.draw)? else {
                continue;
            };
            let put_out = wearer.compare_outputs(patterns, &self.device)?;
            let subject = format!("{}'s draw {}", part.participant, part.draw);
            notes.push(put_out.in_words(&subject, &self.device));
        }
        Ok(notes)
    }
}
