//! State of the operator's screen.

use host_core::calibration::{Entry, OperatorNotice, View};
use std::collections::VecDeque;

/// Largest number of notes that are kept.
const NOTES: usize = 20;

/// Contents of the screen during a calibration.
#[derive(Clone, Debug, Default)]
pub struct ScreenState {
    /// Pseudonym of the wearer.
    pub wearer: String,
    /// Device, as the user named it.
    pub device: String,
    /// The latest view; `None` before the device is armed.
    pub view: Option<View>,
    /// Notes, newest first: time in s, text, whether it is a problem.
    pub notes: VecDeque<(f64, String, bool)>,
    /// Names that the operator is typing; empty while no names are requested.
    pub typed: String,
}

impl ScreenState {
    pub fn note(&mut self, t_s: f64, text: String, is_bad: bool) {
        self.notes.push_front((t_s, text, is_bad));
        self.notes.truncate(NOTES);
    }

    /// Adds a note for a notice of the calibration, unless the screen shows its content anyway.
    pub(super) fn add_notice(&mut self, notice: OperatorNotice<'_>, view: &View) {
        let (text, is_bad) = match notice {
            OperatorNotice::Recorded(entry) => match entry_text(entry) {
                Some(text) => {
                    let is_bad = matches!(entry, Entry::TooMuch { .. } | Entry::Stalled { .. });
                    (text, is_bad)
                }
                None => return,
            },
            OperatorNotice::Refused(refusal) => (refusal.to_string(), true),
            OperatorNotice::Written => ("the wearer file was written".to_owned(), false),
        };
        self.note(view.t_s, text, is_bad);
    }
}

/// Describes an entry of the journal; `None` if the screen shows it anyway.
fn entry_text(entry: &Entry) -> Option<String> {
    Some(match entry {
        Entry::Armed { channel, check_ma } => match check_ma {
            Some(ma) => format!("channel {channel} armed: its electrode carries {ma:.2} mA"),
            None => format!("channel {channel} armed"),
        },
        Entry::Judged {
            moved,
            deviation_n,
            bound_n,
            ..
        } => {
            let verdict = if *moved { "moved" } else { "no movement" };
            format!("instrument: {verdict}, {deviation_n:.3} N, bound {bound_n:.3} N")
        }
        Entry::Found { channel, step, .. } => format!("channel {channel}: {} found", step.name()),
        Entry::TooMuch { channel, level } => format!("channel {channel}: {level} was too much"),
        Entry::Stalled { pause_ms, .. } => {
            format!("this computer stalled for {pause_ms} ms: output off; repeat the level")
        }
        Entry::Skipped { channel } => format!("channel {channel} left out"),
        _ => return None,
    })
}
