//! `[study]`: what a publication must tell and no device knows.

use super::channel::Channel;
use super::error::{Problem, SessionError};
use super::table::Table;
use crate::record::{Electrode, Study};

/// Longest text of a field, characters; of the notes.
pub const LONGEST: usize = 200;
const LONGEST_NOTES: usize = 4000;

/// Reads `[study]`.
pub(super) fn read_study(root: &Table<'_>, channels: &[Channel]) -> Result<Study, SessionError> {
    let Some(t) = root.table("study")?.optional() else {
        return Ok(Study::default());
    };
    t.only(&["pseudonym", "operator", "ethics", "notes", "electrodes"])?;
    let mut electrodes: Vec<Electrode> = Vec::new();
    for item in t.tables("electrodes")?.or(Vec::new()) {
        item.only(&["channel", "place"])?;
        let channel = item.channel("channel")?.required()?;
        let field = item.path_of("channel");
        if channels.iter().all(|known| known.number != channel) {
            return Err(item.error("channel", Problem::NoSuchChannel { field, channel }));
        }
        if electrodes.iter().any(|known| known.channel == channel) {
            return Err(item.error("channel", Problem::ChannelTwice { field, channel }));
        }
        let Some(place) = read_text(&item, "place", LONGEST)? else {
            let field = item.path_of("place");
            return Err(item.error("place", Problem::MissingField { field }));
        };
        electrodes.push(Electrode { channel, place });
    }
    electrodes.sort_by_key(|electrode| electrode.channel);
    Ok(Study {
        pseudonym: read_text(&t, "pseudonym", LONGEST)?,
        operator: read_text(&t, "operator", LONGEST)?,
        ethics: read_text(&t, "ethics", LONGEST)?,
        notes: read_text(&t, "notes", LONGEST_NOTES)?,
        electrodes,
    })
}

/// A text of 1 to `longest` characters.
fn read_text(t: &Table<'_>, name: &str, longest: usize) -> Result<Option<String>, SessionError> {
    let Some(text) = t.text(name)?.optional() else {
        return Ok(None);
    };
    if text.trim().is_empty() || text.chars().count() > longest {
        return Err(t.out_of_range(name, format!("1 to {longest} characters")));
    }
    Ok(Some(text.to_owned()))
}
