//! Description of a channel in a record.

use crate::session::level_name;
use firmware::muscle::MuscleLevel;
use serde::{Deserialize, Deserializer, Serialize};

/// A channel that a trial used, and the columns that it has in the trial's tables.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ChannelInfo {
    /// Channel number, from 1.
    pub number: u8,
    /// Name of the channel for people, for example "flexor A".
    pub name: String,
    /// Unit of the channel's amplitude: "V" or "mA".
    pub unit: String,
    /// Largest amplitude that the wearer allows on the channel, in `unit`.
    pub limit: f64,
    /// Whether the pulse width may change; if so, the channel has an entry in `Sample::widths_us`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub live_width: bool,
    /// Whether the force of the channel's muscle is predicted; if so, the channel has an entry in
    /// `Sample::forces_n`.
    #[serde(default)]
    pub muscle: bool,
    /// Name of the model level with which the prediction of the force starts; `None` in records
    /// without it, and for a channel without a muscle.
    #[serde(
        default,
        deserialize_with = "known_model",
        skip_serializing_if = "Option::is_none"
    )]
    pub model: Option<String>,
    /// Whether force control acts on the channel; if so, the channel has an entry in
    /// `Sample::wanted_n`.
    #[serde(default)]
    pub force: bool,
    /// Whether the channel stimulates a muscle of an arm that shall exert a force at the hand. That
    /// force is in `Sample::hand_n`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub line: bool,
    /// Number of the joint whose angle modulates the channel's stimulation; the joint has an entry
    /// in `Sample::joint_deg`. `None` for a channel that no joint modulates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<u8>,
}

/// Reads the name of a model level. Fails for a name that this program does not know, because a
/// rerun with another model would not repeat the record.
fn known_model<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    let name = Option::<String>::deserialize(from)?;
    let is_known = |name: &&String| {
        MuscleLevel::ALL
            .iter()
            .any(|level| level_name(*level) == **name)
    };
    match name.as_ref().filter(|name| !is_known(name)) {
        Some(name) => Err(serde::de::Error::custom(format!(
            "`{name}` is not a muscle model"
        ))),
        None => Ok(name),
    }
}
