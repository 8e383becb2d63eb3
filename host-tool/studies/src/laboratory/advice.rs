//! What a valid declaration cannot answer: notes for people, before anything is run.

use super::Experiment;
use super::error::LaboratoryError;
use super::protocol::Wearer;
use host_core::session::Session;

impl Experiment {
    /// Returns a note for each measure that no trial of some conditions can have, and one if all
    /// repetitions of a condition are equal.
    ///
    /// # Errors
    /// The session of a condition is not valid.
    pub fn advice(&self) -> Result<Vec<String>, LaboratoryError> {
        let files = self.sessions(&[])?;
        let mut notes = Vec::new();
        for measure in self.measures() {
            let without = files
                .iter()
                .filter(|file| !measure.needs.is_met(&file.session));
            let (count, all) = (without.count(), files.len());
            if count > 0 {
                notes.push(format!(
                    "`{}` has no value in {count} of {all} conditions: it needs {}",
                    measure.id,
                    measure.needs.words()
                ));
            }
        }
        let protocol = &self.declaration.protocol;
        let rounds = protocol.blocks.saturating_mul(protocol.repetitions);
        let is_noisy = |session: &Session| session.joint.is_some() || session.wall.is_some();
        let is_same = !files.iter().any(|file| is_noisy(&file.session));
        if rounds > 1 && protocol.wearer == Wearer::Rested && is_same {
            notes.push(format!(
                "all {rounds} trials of a condition are equal to the byte: the wearer is rested \
                 before each, and nothing measures with noise; `wearer = \"same\"` keeps fatigue, \
                 and random wearers differ"
            ));
        }
        Ok(notes)
    }
}
