//! Who takes part: what is known of a person before anything is drawn.

use serde::Deserialize;

/// Where searches end, V: the device's 20 mA into the 2 kΩ that the sessions declare. It
/// is the paper's greatest too (table 3).
pub(super) const DEVICE_V: f64 = 40.0;

/// A participant, as far as the paper says.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Participant {
    /// P, Q, R or S.
    pub name: String,
    /// Table 1: elbow to tip of the hand, m.
    pub reach_m: f64,
    /// Table 1: around the forearm, m.
    pub around_m: f64,
    /// Table 7: thresholds of A, B and the extensor's point, V; R has none.
    pub thresholds_v: Option<[f64; 3]>,
    /// Where the middles of A, B and the extensor's electrode lie, m: along from the
    /// elbow, around from the palmar midline. They are searched where it is not known.
    pub pads_m: Option<[[f64; 2]; 3]>,
    /// What is printed of what comes out.
    pub paper: Option<Printed>,
}

/// What the paper printed of a participant.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Printed {
    /// Table 7: greatest voltages of A, B and the extensor's point, V.
    pub most_v: [f64; 3],
    /// Table 7.
    pub r_th: f64,
    /// Table 8: mean RMSE with one point and with two, °.
    pub rmse_deg: [f64; 2],
    /// III-D6: how far the finger sank with one point and with two, °.
    pub sinks_deg: [f64; 2],
}
