//! What the operator sees.

use host_core::calibration::{Entry, OperatorNotice, View};
use std::collections::VecDeque;

/// Notes that are kept.
const NOTES: usize = 20;

/// What the screen shows.
#[derive(Clone, Debug, Default)]
pub struct ScreenState {
    /// The wearer's pseudonym.
    pub wearer: String,
    /// The device, as it was named.
    pub device: String,
    /// The latest view; none before the device is armed.
    pub view: Option<View>,
    /// What happened, newest first: s, words, whether it is bad.
    pub notes: VecDeque<(f64, String, bool)>,
    /// What is being typed.
    pub typed: String,
}

impl ScreenState {
    /// Adds a note.
    pub fn note(&mut self, t_s: f64, text: String, is_bad: bool) {
        self.notes.push_front((t_s, text, is_bad));
        self.notes.truncate(NOTES);
    }

    /// Notes what is told.
    pub(super) fn add_notice(&mut self, told: OperatorNotice<'_>, view: &View) {
        let (text, is_bad) = match told {
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

/// An entry in words; nothing for what the screen shows anyway.
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
            let said = if *moved { "moved" } else { "still" };
            format!("instrument: {said}, {deviation_n:.3} N against {bound_n:.3} N")
        }
        Entry::Found { channel, step, .. } => format!("channel {channel}: {} found", step.name()),
        Entry::TooMuch { channel, level } => format!("channel {channel}: {level} was too much"),
        Entry::Stalled { pause_ms, .. } => {
            format!("this computer stalled for {pause_ms} ms: silent; give the same level again")
        }
        Entry::Skipped { channel } => format!("channel {channel} left out"),
        _ => return None,
    })
}
