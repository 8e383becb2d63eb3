//! Checks before a run that random wearers fit every condition, and reports the draw or grid whose
//! field the session does not have.

use super::condition::Condition;
use super::draw::ends;
use super::error::{LaboratoryError, Mistake};
use super::experiment::Experiment;
use super::written::DeclarationText;
use std::collections::BTreeMap;
use toml::Value;

/// Largest number of grid points that are checked before a sweep. At further points, an invalid
/// session ends the sweep when it is reached.
const POINTS_TRIED: u64 = 64;

impl Experiment {
    /// Checks that every condition has a valid session for the first wearer at each grid point, and
    /// for both ends of each random range, one at a time.
    ///
    /// Returns every draw and grid of the declaration that leads to an invalid session; `file`
    /// names the declaration in the message.
    pub(super) fn check_wearable(&self, file: &str) -> Result<(), LaboratoryError> {
        let mut refused = BTreeMap::new();
        for index in 0..self.units(1).min(POINTS_TRIED) {
            let unit = self.unit(self.declaration.seed, 1, index);
            for condition in &self.conditions {
                let Err(together) = condition.session_with(&unit.fields) else {
                    continue;
                };
                let alone = refused_fields(condition, &unit.fields);
                if alone.is_empty() {
                    // No field alone is refused, only all of them together.
                    let reason = format!(
                        "the wearer with {}: {together}",
                        describe_fields(&unit.fields)
                    );
                    refused.entry(None).or_insert((condition.name(), reason));
                }
                for (nth, reason) in alone {
                    refused
                        .entry(Some(nth))
                        .or_insert((condition.name(), reason));
                }
            }
        }
        for (nth, drawn) in self.declaration.drawn.iter().enumerate() {
            for end in ends(drawn) {
                let field = [(drawn.field.clone(), end)];
                for condition in &self.conditions {
                    for (_, reason) in refused_fields(condition, &field) {
                        let refused = refused.entry(Some(nth));
                        refused.or_insert((condition.name(), reason));
                    }
                }
            }
        }
        if refused.is_empty() {
            return Ok(());
        }
        let written = DeclarationText::new(&self.text);
        let mistake = |(nth, (condition, reason)): (&Option<usize>, &(String, String))| {
            let (line, origin) =
                nth.map_or((None, String::new()), |nth| self.asked_by(&written, nth));
            Mistake::at(
                line,
                &format!("{origin}{reason} (in the condition `{condition}`)"),
            )
        };
        let mistakes = refused.iter().map(mistake).collect();
        let file = file.to_owned();
        Err(LaboratoryError::Fields { file, mistakes })
    }

    /// Returns line and name of the `[[draw]]` or `[[grid]]` that sets field `nth` of a unit.
    fn asked_by(&self, written: &DeclarationText<'_>, nth: usize) -> (Option<usize>, String) {
        let (list, at) = match nth.checked_sub(self.declaration.drawn.len()) {
            None => ("draw", nth),
            Some(at) => ("grid", at),
        };
        (written.line(list, at, "field"), format!("{list} "))
    }
}

/// Returns the fields to which the condition refuses the given value even without the other fields:
/// index of the field, and reason.
fn refused_fields(condition: &Condition, fields: &[(String, Value)]) -> Vec<(usize, String)> {
    let chunks = fields.chunks(1).enumerate();
    let refused = chunks.filter_map(|(nth, chunk)| {
        let why = condition.session_with(chunk).err()?;
        Some((nth, format!("{}: {why}", describe_fields(chunk))))
    });
    refused.collect()
}

/// Returns fields and values as text, for example "`body.push_nm` = 0.6, `body.delay_ms` = 25".
fn describe_fields(fields: &[(String, Value)]) -> String {
    let pairs = fields.iter();
    let texts: Vec<String> = pairs
        .map(|(field, value)| format!("`{field}` = {value}"))
        .collect();
    texts.join(", ")
}
