//! Who takes part: what is known of a person before anything is drawn.

use host_core::wearer::Wearer;
use serde::Deserialize;

/// Where searches end, V: the device's 20 mA into the 2 kΩ that the sessions declare. It
/// is the paper's greatest too (table 3).
pub(super) const DEVICE_V: f64 = 40.0;

/// Lowest threshold, V: a step of the searches.
const LEAST_V: f64 = 2.0;

/// A participant, as far as the paper says.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Participant {
    /// P, Q, R or S.
    pub name: String,
    /// Elbow to tip of the hand, m; of the wearer file, as the three that follow.
    #[serde(skip)]
    pub reach_m: f64,
    /// Around the forearm, m.
    #[serde(skip)]
    pub around_m: f64,
    /// Thresholds of A, B and the extensor's point, V; R has none.
    #[serde(skip)]
    pub thresholds_v: Option<[f64; 3]>,
    /// Where the middles of A, B and the extensor's electrode lie, m: along from the
    /// elbow, around from the palmar midline. They are searched where it is not known.
    #[serde(skip)]
    pub pads_m: Option<[[f64; 2]; 3]>,
    /// What is printed of what comes out.
    pub paper: Option<PrintedResults>,
}

impl Participant {
    /// Whoever a wearer file describes: of their forearm what the file says.
    ///
    /// # Errors
    /// Why there is no such forearm: the file has no `[forearm]`, or a threshold at which
    /// no search arrives.
    pub(super) fn from_wearer(wearer: &Wearer) -> Result<Self, String> {
        let forearm = wearer.forearm.ok_or("it has no `[forearm]`")?;
        let thresholds_v = wearer.forearm_thresholds_v();
        let names = ["A", "B", "the extensor's point"];
        let numbered = names.into_iter().zip(thresholds_v.into_iter().flatten());
        let wrong = numbered.filter(|(_, v)| !(LEAST_V..=DEVICE_V).contains(v));
        let wrong = wrong.map(|(name, v)| {
            format!(
                "the threshold of {name} is {v} V, searches go from {LEAST_V} to {DEVICE_V} V, \
                 the device's 20 mA into 2 kΩ"
            )
        });
        let wrong: Vec<String> = wrong.collect();
        if !wrong.is_empty() {
            return Err(wrong.join("; "));
        }
        Ok(Self {
            name: wearer.name.clone(),
            reach_m: forearm.reach_m,
            around_m: forearm.around_m,
            thresholds_v,
            pads_m: forearm
                .pads_mm
                .map(|all| all.map(|at| at.map(|mm| 1e-3 * mm))),
            paper: None,
        })
    }
}

/// What the paper printed of a participant.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedResults {
    /// Table 7: greatest voltages of A, B and the extensor's point, V.
    pub most_v: [f64; 3],
    /// Table 7.
    pub r_th: f64,
    /// Table 8: mean RMSE with one point and with two, °.
    pub rmse_deg: [f64; 2],
    /// III-D6: how far the finger sank with one point and with two, °.
    pub sinks_deg: [f64; 2],
}
