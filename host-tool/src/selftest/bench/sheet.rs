//! File of a bench test, which is complete after every step.

use super::{Pattern, Step, steps};
use hal_sim::input;
use host_core::record::{DeviceKind, Identity, replace_file, sha256};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Format version of the file.
const FORMAT: u32 = 1;

/// Longest text that a person may enter, characters.
const LONGEST: usize = 200;

/// A bench sheet: the operator, the board and the measured values.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    /// Format version of the file.
    pub format: u32,
    /// Name of the operator, as typed.
    pub operator: String,
    /// Date, as typed.
    pub date: String,
    /// Instruments of the measurement (oscilloscope, probe, meter), as typed.
    pub instruments: String,
    /// Whether the operator confirmed that nobody is connected.
    pub nobody_connected: bool,
    /// Identity that the board reported, or that of a simulator.
    pub device: Identity,
    /// Channel, from 1.
    pub channel: u8,
    /// Description of the pattern.
    pub pattern: String,
    /// Measured values, in the order of the steps.
    pub answers: Vec<Answer>,
    /// Verdict on all values.
    pub verdict: Verdict,
    /// SHA-256 of this file with this field empty. Detects mistakes and edits, but no forgery.
    pub sum: String,
}

/// One measured value and its bounds.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answer {
    /// Name of the step.
    pub id: String,
    /// The load in the output, Ω.
    pub load_ohm: u32,
    /// Description of the measurement.
    pub what: String,
    /// Unit of the expected, smallest, largest and measured value.
    pub unit: String,
    /// Expected value.
    pub expected: f64,
    /// Smallest value that passes.
    pub low: f64,
    /// Largest value that passes.
    pub high: f64,
    /// Source of the bounds.
    pub source: String,
    /// Measured value, as typed.
    pub measured: f64,
    /// Whether the value lies within the bounds, both included.
    pub holds: bool,
}

/// Verdict on a sheet.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Some steps have no measured value yet.
    Incomplete,
    /// Some values lie outside their bounds.
    Failed,
    /// A board was measured, and every value lies within its bounds.
    Passed,
    /// No board was measured, whatever the values.
    Simulated,
}

/// The reason why a sheet cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum SheetError {
    /// The sheet cannot be continued: the file, and the reason.
    #[error("E786 the bench sheet {0} cannot be continued: {1}")]
    Unfit(PathBuf, String),
    /// The file cannot be written.
    #[error(
        "E787 cannot write the bench sheet {0}: {1}; correct this, then continue with --resume; \
         what was written before is kept"
    )]
    Unwritten(PathBuf, String),
}

impl Answer {
    /// Judges the value measured in a step.
    #[must_use]
    pub fn new(step: &Step, measured: f64) -> Self {
        Self {
            id: step.id.clone(),
            load_ohm: step.load_ohm,
            what: step.what.clone(),
            unit: step.unit.to_owned(),
            expected: step.expected,
            low: step.low,
            high: step.high,
            source: step.source.to_owned(),
            measured,
            holds: (step.low..=step.high).contains(&measured),
        }
    }
}

impl Sheet {
    /// Starts a sheet without answers; `details` is the operator, the date and the instruments.
    #[must_use]
    pub fn begin(details: [&str; 3], device: Identity, pattern: &Pattern) -> Self {
        let [operator, date, instruments] = details.map(ToOwned::to_owned);
        let mut sheet = Self {
            format: FORMAT,
            operator,
            date,
            instruments,
            nobody_connected: true,
            device,
            channel: pattern.channel,
            pattern: pattern.description(),
            answers: Vec::new(),
            verdict: Verdict::Incomplete,
            sum: String::new(),
        };
        sheet.update_verdict(pattern);
        sheet
    }

    /// Returns whether a person's text may stand in a sheet.
    #[must_use]
    pub fn is_valid_text(text: &str) -> bool {
        let length = text.trim().chars().count();
        (1..=LONGEST).contains(&length) && !text.chars().any(char::is_control)
    }

    /// Reads the sheet at `path` to continue it. `next` is a new sheet for the same board,
    /// firmware, channel and pattern.
    ///
    /// # Errors
    /// Returns [`SheetError::Unfit`] if the file is not a sheet, was changed, or differs from
    /// `next`.
    pub fn resume(path: &Path, next: &Self, pattern: &Pattern) -> Result<Self, SheetError> {
        let unfit = |why: String| SheetError::Unfit(path.to_owned(), why);
        let text = input::read_text(path, input::LONGEST_DOCUMENT);
        let text = text.map_err(|why| unfit(why.to_string()))?;
        let mut sheet: Self = serde_json::from_str(&text)
            .map_err(|why| unfit(format!("it is not a bench sheet: {why}")))?;
        if sheet.format != FORMAT {
            return Err(unfit(format!(
                "its format is {}, not {FORMAT}",
                sheet.format
            )));
        }
        if sheet.sum != sheet.checksum() {
            return Err(unfit(
                "it was changed since it was written; start a new sheet".into(),
            ));
        }
        // Operator, date and the reason of the last reset may differ between days.
        let is_same = |a: &Identity, b: &Identity| {
            (a.kind, a.simulated, &a.unique_id, &a.firmware, &a.schema)
                == (b.kind, b.simulated, &b.unique_id, &b.firmware, &b.schema)
        };
        if !is_same(&sheet.device, &next.device) {
            let description = |identity: &Identity| {
                let id = identity.unique_id.as_deref().unwrap_or("no number");
                format!(
                    "{} {id}, firmware {}",
                    identity.kind.words(),
                    identity.firmware
                )
            };
            return Err(unfit(format!(
                "it belongs to the {}, but this is the {}; connect that one, or give another --out",
                description(&sheet.device),
                description(&next.device)
            )));
        }
        if (sheet.channel, &sheet.pattern) != (next.channel, &next.pattern) {
            return Err(unfit(format!(
                "it was measured with {}, but this test uses {}; give another --out",
                sheet.pattern, next.pattern
            )));
        }
        sheet.update_verdict(pattern);
        Ok(sheet)
    }

    /// Returns whether the sheet has a measured value for the step `id`.
    #[must_use]
    pub fn has_answer(&self, id: &str) -> bool {
        self.answers.iter().any(|answer| answer.id == id)
    }

    /// Adds the measured value of a step, or replaces an earlier one, and updates the verdict.
    pub fn add_answer(&mut self, answer: Answer, pattern: &Pattern) {
        self.answers.retain(|known| known.id != answer.id);
        self.answers.push(answer);
        self.update_verdict(pattern);
    }

    fn update_verdict(&mut self, pattern: &Pattern) {
        let test_steps = steps(pattern);
        self.answers
            .sort_by_key(|answer| test_steps.iter().position(|step| step.id == answer.id));
        let is_board = self.device.kind == DeviceKind::Board && !self.device.simulated;
        let is_whole = test_steps.iter().all(|step| self.has_answer(&step.id));
        self.verdict = if !is_board {
            Verdict::Simulated
        } else if self.answers.iter().any(|answer| !answer.holds) {
            Verdict::Failed
        } else if is_whole {
            Verdict::Passed
        } else {
            Verdict::Incomplete
        };
        self.sum = self.checksum();
    }

    fn checksum(&self) -> String {
        let mut without = self.clone();
        without.sum.clear();
        sha256(without.text().as_bytes())
    }

    fn text(&self) -> String {
        // Typed numbers are finite, so serialization cannot fail.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Writes the sheet to `path` and replaces an existing file as a whole; after a crash the
    /// previous version remains.
    ///
    /// # Errors
    /// Returns [`SheetError::Unwritten`].
    pub fn write(&self, path: &Path) -> Result<(), SheetError> {
        let written = replace_file(path, self.text().as_bytes());
        written.map_err(|why| SheetError::Unwritten(path.to_owned(), why.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::safety::StageKind;

    fn pattern() -> Pattern {
        Pattern::new(
            1,
            StageKind::Current {
                full_scale_ua: 100_000,
            },
        )
    }

    fn device(kind: DeviceKind, simulated: bool) -> Identity {
        Identity {
            kind,
            simulated,
            in_process: false,
            unique_id: Some("0123456789abcdef01234567".into()),
            firmware: "0.1.0".into(),
            schema: "0".into(),
            reset: "power on".into(),
            dead_time_us: 5,
            option_bytes: Vec::new(),
            board: String::new(),
        }
    }

    /// Returns a sheet with the expected value in every step, except for the given step and value.
    fn filled(device: Identity, but: Option<(&str, f64)>) -> Sheet {
        let pattern = pattern();
        let mut sheet = Sheet::begin(["A", "2026-01-02", "scope"], device, &pattern);
        for step in steps(&pattern) {
            let measured = but
                .filter(|pair| pair.0 == step.id)
                .map_or(step.expected, |pair| pair.1);
            sheet.add_answer(Answer::new(&step, measured), &pattern);
        }
        sheet
    }

    #[test]
    fn only_a_board_that_holds_in_every_step_passes() {
        let board = || device(DeviceKind::Board, false);
        assert_eq!(filled(board(), None).verdict, Verdict::Passed);
        for (id, wrong) in [("500-peak", 2.7), ("2000-first", 201.5), ("stop", 0.6)] {
            let sheet = filled(board(), Some((id, wrong)));
            assert_eq!(sheet.verdict, Verdict::Failed, "{id}");
            let failed: Vec<_> = sheet
                .answers
                .iter()
                .filter(|answer| !answer.holds)
                .collect();
            assert!(failed.len() == 1 && failed[0].id == id);
        }
        for kind in [DeviceKind::Native, DeviceKind::Chip, DeviceKind::Qemu] {
            let sheet = filled(device(kind, true), None);
            assert_eq!(sheet.verdict, Verdict::Simulated, "{kind:?}");
        }
        // The simulated flag counts, not the kind.
        let sheet = filled(device(DeviceKind::Board, true), None);
        assert_eq!(sheet.verdict, Verdict::Simulated);
        let (mut sheet, pattern) = (filled(board(), None), pattern());
        sheet.answers.pop();
        sheet.update_verdict(&pattern);
        assert_eq!(sheet.verdict, Verdict::Incomplete);
    }

    #[test]
    fn a_sheet_is_gone_on_with_by_the_same_board_unchanged_only() {
        let folder = std::env::temp_dir().join(format!("flexor-sheet-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (path, pattern) = (folder.join("sheet.json"), pattern());
        let board = device(DeviceKind::Board, false);
        let next = Sheet::begin(["B", "later", "scope"], board.clone(), &pattern);
        let sheet = filled(board.clone(), None);
        sheet.write(&path).unwrap();
        assert_eq!(Sheet::resume(&path, &next, &pattern).unwrap(), sheet);
        let refusal = |next: &Sheet| {
            Sheet::resume(&path, next, &pattern)
                .unwrap_err()
                .to_string()
        };
        let mut other = next.clone();
        other.device.unique_id = Some("ff".into());
        assert!(refusal(&other).contains("that one"), "{}", refusal(&other));
        let simulated = Sheet::begin(["B", "", ""], device(DeviceKind::Chip, true), &pattern);
        assert!(refusal(&simulated).starts_with("E786"));
        let text = std::fs::read_to_string(&path).unwrap();
        for (was, is) in [
            ("\"measured\": 10.0", "\"measured\": 10.1"),
            ("\"simulated\": false", "\"simulated\": true"),
            ("2026-01-02", "2026-01-03"),
        ] {
            assert!(text.contains(was), "{was}");
            std::fs::write(&path, text.replacen(was, is, 1)).unwrap();
            assert!(
                refusal(&next).contains("was changed"),
                "{was}: {}",
                refusal(&next)
            );
        }
        std::fs::write(&path, &text[..text.len() / 2]).unwrap();
        assert!(refusal(&next).contains("it is not a bench sheet"));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
