//! `[study]`: what a publication must tell and no device knows.

use serde::{Deserialize, Serialize};

use super::channels::Channels;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// What a person must tell, for a publication. Nothing of it decides anything.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Study {
    /// The wearer's pseudonym.
    pub pseudonym: Option<String>,
    /// Who operated the device.
    pub operator: Option<String>,
    /// The ethics vote.
    pub ethics: Option<String>,
    /// Anything else.
    pub notes: Option<String>,
    /// Where the electrodes are, by channel.
    pub electrodes: Vec<Electrode>,
}

/// Where a channel's electrodes are.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Electrode {
    /// The channel, from 1.
    pub channel: u8,
    /// In words.
    pub place: String,
}

/// Reads `[study]`.
pub(super) fn read_study(t: &Table<'_>, channels: &Channels) -> Option<Study> {
    let mut electrodes: Vec<Electrode> = Vec::new();
    for item in t.tables("electrodes").iter().filter(|item| item.is_sound()) {
        let channel: u8 = item.whole("channel");
        channels.find(item, "channel");
        if electrodes.iter().any(|known| known.channel == channel) {
            item.say("channel", Problem::ChannelTwice { channel });
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
