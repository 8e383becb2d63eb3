//! Ablations of the studies of Hamana 2022, by name.

use hal_sim::body::hand::HandSpec;
use serde::Deserialize;

/// Ablation of the default forearm and points (`host-tool/experiments/hamana-wearers.toml`).
/// Missing fields keep their default.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Departure {
    /// Name on the command line.
    pub name: String,
    /// Description for the report: the change and its justification.
    pub says: String,
    /// Largest current that the limiter of an output stage lets through, mA.
    pub limiter_ma: Option<f64>,
    /// Replaces [`HandSpec::return_factor`], the factor of the return electrode's skin impedance.
    pub return_factor: Option<f64>,
    /// Replaces [`HandSpec::scatter`], the factor of the spread of thresholds within a pool of
    /// motor units.
    pub scatter: Option<f64>,
    /// Factor of the skin's impedance in the population: of its resistances and of the reactance of
    /// its capacitance.
    pub skin: Option<f64>,
    /// Whether A and B lie at the first selective places that a person finds, instead of at the
    /// most selective places of the forearm.
    #[serde(default)]
    pub first_found: bool,
}

impl Departure {
    /// Returns `spec` with the values of the forearm that this ablation changes.
    #[must_use]
    pub fn apply_to(&self, mut spec: HandSpec) -> HandSpec {
        spec.limiter_a = self.limiter_ma.map_or(spec.limiter_a, |ma| 1e-3 * ma);
        spec.return_factor = self.return_factor.unwrap_or(spec.return_factor);
        spec.scatter = self.scatter.unwrap_or(spec.scatter);
        spec.skin = spec.skin.times(self.skin.unwrap_or(1.0));
        spec
    }
}
