//! What a record says of a channel.

use crate::session::rung_name;
use firmware::muscle::Rung;
use serde::{Deserialize, Deserializer, Serialize};

/// A channel of a trial.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ChannelInfo {
    /// 1-based.
    pub number: u8,
    /// For people: "flexor A".
    pub name: String,
    /// Of its amplitude: "V" or "mA".
    pub unit: String,
    /// The wearer's limit, in that unit.
    pub limit: f64,
    /// Whether its pulse width may change: a place in `Sample::widths_us`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub live_width: bool,
    /// Whether its muscle's force is predicted: a place in `Sample::forces_n`.
    #[serde(default)]
    pub muscle: bool,
    /// The model that predicts it, at the start.
    #[serde(
        default,
        deserialize_with = "known_model",
        skip_serializing_if = "Option::is_none"
    )]
    pub model: Option<String>,
    /// Whether that force is controlled: a place in `Sample::wanted_n`.
    #[serde(default)]
    pub force: bool,
    /// Whether its muscle is an arm's, whose hand a force is wanted of:
    /// `Sample::hand_n`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub line: bool,
    /// Number of the joint whose angle it follows: a place in `Sample::joint_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<u8>,
}

/// The name of a model that this program knows: played on another, a record would not
/// be repeated.
fn known_model<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    let name = Option::<String>::deserialize(from)?;
    let is_known = |name: &&String| Rung::ALL.iter().any(|rung| rung_name(*rung) == **name);
    match name.as_ref().filter(|name| !is_known(name)) {
        Some(name) => Err(serde::de::Error::custom(format!(
            "`{name}` is no muscle model"
        ))),
        None => Ok(name),
    }
}
