//! Options with facts that no device knows; they override the session file's `[study]`.

use super::WrongUse;
use clap::Args;
use host_core::session::{Electrode, LONGEST_TEXT, Study};

/// Facts that a publication must report.
#[derive(Args, Debug, Default)]
pub struct StudyArgs {
    /// Pseudonym of the wearer, never a name; kept in the record
    #[arg(long)]
    pseudonym: Option<String>,
    /// Operator of the device; kept in the record
    #[arg(long)]
    operator: Option<String>,
    /// Ethics approval, such as its number or committee; kept in the record
    #[arg(long)]
    ethics: Option<String>,
    /// Notes about the run; kept in the record
    #[arg(long)]
    notes: Option<String>,
    /// Place of a channel's electrodes, as 1=PLACE; once per channel; kept in the record
    #[arg(long, value_name = "CHANNEL=PLACE")]
    electrode: Vec<String>,
}

impl StudyArgs {
    /// Returns the file's study with the values of these options; `channels` are the session's.
    ///
    /// # Errors
    /// E518: a text is empty or too long, or an electrode belongs to no channel.
    pub fn override_study(&self, file: &Study, channels: &[u8]) -> Result<Study, WrongUse> {
        let mut study = file.clone();
        let texts = [
            ("--pseudonym", &self.pseudonym, &mut study.pseudonym),
            ("--operator", &self.operator, &mut study.operator),
            ("--ethics", &self.ethics, &mut study.ethics),
            ("--notes", &self.notes, &mut study.notes),
        ];
        for (option, given, kept) in texts {
            if let Some(text) = given {
                *kept = Some(check_text(option, text)?);
            }
        }
        for given in &self.electrode {
            let (number, place) = given.split_once('=').unwrap_or((given, ""));
            let channel = number.trim().parse().ok();
            let Some(channel) = channel.filter(|channel| channels.contains(channel)) else {
                return Err(WrongUse(format!(
                    "--electrode {given}: give CHANNEL=PLACE with a channel of the session"
                )));
            };
            let place = check_text("--electrode", place)?;
            study.electrodes.retain(|known| known.channel != channel);
            study.electrodes.push(Electrode { channel, place });
        }
        study.electrodes.sort_by_key(|electrode| electrode.channel);
        Ok(study)
    }
}

fn check_text(option: &str, text: &str) -> Result<String, WrongUse> {
    if text.trim().is_empty() || text.chars().count() > LONGEST_TEXT {
        return Err(WrongUse(format!(
            "{option} must have 1 to {LONGEST_TEXT} characters"
        )));
    }
    Ok(text.to_owned())
}
