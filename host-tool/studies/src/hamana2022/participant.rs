//! Participants: the facts about a person that are known before anything random is generated.

use hal_sim::random::word;
use host_core::wearer::Wearer;
use serde::Deserialize;

/// Largest voltage of the searches, V: the device's 20 mA into the 2 kΩ of the sessions. It is also
/// the largest voltage of the paper (table 3).
pub(super) const DEVICE_V: f64 = 40.0;

/// Smallest threshold, V: one step of the searches.
const LEAST_V: f64 = 2.0;

/// Returns the seed of the draws of the participant with this name, so that participants have
/// independent draws.
pub(super) fn seed_of(name: &str, seed: u64) -> u64 {
    name.bytes()
        .fold(seed, |seed, byte| word(seed, byte.into()))
}

/// A participant, as far as the paper or a wearer file describes them.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Participant {
    /// Name of the participant: P, Q, R or S, or that of a wearer file.
    pub name: String,
    /// Distance from the elbow to the tip of the hand, m. This and the next three fields come from
    /// the wearer file.
    #[serde(skip)]
    pub reach_m: f64,
    /// Circumference of the forearm, m.
    #[serde(skip)]
    pub around_m: f64,
    /// Thresholds of A, B and the extensor's point, V; R has none.
    #[serde(skip)]
    pub thresholds_v: Option<[f64; 3]>,
    /// Centres of the electrodes of A, B and the extensor, m: along from the elbow, and around from
    /// the palmar midline. If they are not known, they are searched.
    #[serde(skip)]
    pub pads_m: Option<[[f64; 2]; 3]>,
    /// Results that the paper prints for this participant; `None` for R and for the person of a
    /// wearer file.
    pub paper: Option<PrintedResults>,
}

impl Participant {
    /// Creates a participant without printed results from a wearer file.
    ///
    /// # Errors
    /// Fails if the file has no `[forearm]`, or a threshold outside the range of the searches.
    pub(super) fn from_wearer(wearer: &Wearer) -> Result<Self, String> {
        let forearm = wearer
            .forearm
            .ok_or("the file has no `[forearm]` section")?;
        let thresholds_v = wearer.forearm_thresholds_v();
        let names = ["A", "B", "the extensor's point"];
        let numbered = names.into_iter().zip(thresholds_v.into_iter().flatten());
        let wrong = numbered.filter(|(_, v)| !(LEAST_V..=DEVICE_V).contains(v));
        let wrong = wrong.map(|(name, v)| {
            format!(
                "the threshold of {name} is {v} V; allowed: {LEAST_V} to {DEVICE_V} V (the \
                 device's largest current, 20 mA, into 2 kΩ)"
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
                .map(|pads| pads.map(|at| at.map(|mm| 1e-3 * mm))),
            paper: None,
        })
    }
}

/// Results of experiment 4 and of the hold that the paper prints for one participant.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedResults {
    /// Largest voltages of A, B and the extensor's point (table 7), V.
    pub most_v: [f64; 3],
    /// Smallest fraction of both largest voltages at which both points together bend the finger
    /// (table 7).
    pub r_th: f64,
    /// Mean RMSE with one point and with two (table 8), °.
    pub rmse_deg: [f64; 2],
    /// Loss of angle during the hold with one point and with two (III-D6), °.
    pub sinks_deg: [f64; 2],
}
