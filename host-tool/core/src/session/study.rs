//! `[study]`: facts that a publication must report and that the device cannot know.

use serde::{Deserialize, Serialize};

use super::channels::Channels;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Facts about a study that a person provides for a publication. They have no effect on the
/// session.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Study {
    /// Pseudonym of the wearer; the real name must not be used.
    pub pseudonym: Option<String>,
    /// Person who operates the device.
    pub operator: Option<String>,
    /// Approval of the ethics committee, for example its name and number.
    pub ethics: Option<String>,
    /// Further remarks in free text.
    pub notes: Option<String>,
    /// Positions of the electrodes, sorted by channel.
    pub electrodes: Vec<Electrode>,
}

/// Position on the body of a channel's electrodes.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Electrode {
    /// Number of the channel, 1–10.
    pub channel: u8,
    /// Position on the body, in words.
    pub place: String,
}

/// Reads `[study]`. Reports channels that the file does not have, and channels that are named
/// twice.
pub(super) fn read_study(t: &Table<'_>, channels: &Channels) -> Option<Study> {
    let mut electrodes: Vec<Electrode> = Vec::new();
    for item in t.tables("electrodes").iter().filter(|item| item.is_valid()) {
        let channel: u8 = item.integer("channel");
        channels.find(item, "channel");
        if electrodes.iter().any(|known| known.channel == channel) {
            item.report("channel", Problem::ChannelTwice { channel });
        }
        let place = item.text("place").unwrap_or_default().to_owned();
        electrodes.push(Electrode { channel, place });
    }
    electrodes.sort_by_key(|electrode| electrode.channel);
    let text = |name| t.text(name).map(str::to_owned);
    Some(Study {
        pseudonym: text("pseudonym"),
        operator: text("operator"),
        ethics: text("ethics"),
        notes: text("notes"),
        electrodes,
    })
}
