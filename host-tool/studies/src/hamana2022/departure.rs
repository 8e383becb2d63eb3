//! Ablations of the studies of Hamana 2022, by name.

use hal_sim::body::hand::HandSpec;
use serde::Deserialize;

/// A departure from the default forearm and points (`two_points/wearers.toml`). What it
/// leaves out stays.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Departure {
    /// For commands.
    pub name: String,
    /// For people: what is otherwise, and why it may be.
    pub says: String,
    /// What a stage's limiter lets through, mA.
    pub limiter_ma: Option<f64>,
    /// [`HandSpec::return_factor`].
    pub return_factor: Option<f64>,
    /// [`HandSpec::scatter`].
    pub scatter: Option<f64>,
    /// How many times the skin's impedance of the population: its resistances, and what its
    /// capacitance has.
    pub skin: Option<f64>,
    /// Whether A and B lie where a person first finds selective places, instead of where a
    /// forearm's most selective ones are.
    #[serde(default)]
    pub first_found: bool,
}

impl Departure {
    /// `spec`, otherwise.
    #[must_use]
    pub fn apply_to(&self, mut spec: HandSpec) -> HandSpec {
        spec.limiter_a = self.limiter_ma.map_or(spec.limiter_a, |ma| 1e-3 * ma);
        spec.return_factor = self.return_factor.unwrap_or(spec.return_factor);
        spec.scatter = self.scatter.unwrap_or(spec.scatter);
        spec.skin = spec.skin.times(self.skin.unwrap_or(1.0));
        spec
    }
}
