//! Reads the population of `hamana-population.toml` and generates wearers from it.

use super::error::TwoPointsError;
use crate::laboratory::Range;
use hal_sim::body::hand::{HandSpec, Rule, SkinSpec, membrane::Membrane};
use hal_sim::random;
use serde::Deserialize;

/// Text of the declaration `host-tool/experiments/hamana-population.toml`.
pub const DECLARED: &str = include_str!("../../../experiments/hamana-population.toml");

/// Content of the declaration: random ranges, cells and claims.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Population {
    /// Heading of the report page.
    pub title: String,
    /// Paper and sections on which the study is based.
    pub source: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of wearers in each cell.
    pub draws: u64,
    /// Number of trials of each pattern.
    pub trials: u64,
    /// Standard deviation of the skin's shift over the muscles between trials, mm.
    pub jitter_mm: f64,
    /// Relative standard deviation of a contraction's strength.
    pub force_noise: f64,
    /// Factors of the study; every combination of their values is a cell.
    pub cells: Cells,
    /// Cells that each lack one mechanism of the model.
    pub ablations: Ablations,
    /// Cells in which B's threshold has the same random range as A's.
    pub balanced: Balanced,
    /// Ranges of the wearers' random parameters.
    #[serde(rename = "range")]
    pub ranges: Vec<Range>,
    /// Claims that are judged for each wearer.
    #[serde(rename = "claim")]
    pub claims: Vec<Claim>,
}

/// Factors of the study and their values. Every combination of values is a cell.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cells {
    /// Names of the recruitment rules: `potential`, `curvature` or `field`.
    pub rules: Vec<String>,
    /// Factors of the return electrode's impedance.
    pub return_factors: Vec<f64>,
    /// Voltages as fractions above the threshold; 0 stands for the searched voltages.
    pub volts: Vec<f64>,
}

/// Mechanisms of the model that are removed one at a time.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ablations {
    /// Names of the ablations, each applied to the default cell.
    pub names: Vec<String>,
}

/// Additional cells in which B's threshold has the same random range as A's. They have the default
/// rule and every return factor.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Balanced {
    /// Factors of the skin's impedance; each gives one cell for every return factor.
    pub skins: Vec<f64>,
}

/// Statement of the paper that is judged for each wearer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Identifier in `result.json` and in the columns of `draws.csv`.
    pub id: String,
    /// Wording for the report.
    pub says: String,
}

/// Hand and threshold of a random wearer.
#[derive(Clone, Debug)]
pub struct DrawnHand {
    /// Parameters of the forearm and hand: random where the population has a range, otherwise
    /// nominal.
    pub spec: HandSpec,
    /// Smallest voltage at which point A visibly bends the index finger, V.
    pub threshold_v: f64,
}

impl Population {
    /// Parses the declaration `hamana-population.toml` that is part of the program.
    ///
    /// # Errors
    /// Fails if the declaration cannot be parsed.
    pub fn load_embedded() -> Result<Self, TwoPointsError> {
        toml::from_str(DECLARED).map_err(|e| TwoPointsError::Declaration(e.to_string()))
    }

    /// Generates the random parameters of wearer `index`, one for each range in their order. They
    /// depend only on the seed and the index.
    #[must_use]
    pub fn draw_values(&self, seed: u64, index: u64) -> Vec<f64> {
        Range::draw_values(&self.ranges, seed, index)
    }

    /// Returns the value in `drawn` that belongs to the range `field`.
    fn value(&self, drawn: &[f64], field: &str) -> Result<f64, TwoPointsError> {
        Range::value(&self.ranges, drawn, field).ok_or_else(|| TwoPointsError::missing(field))
    }

    /// Returns random thresholds of A, B and the extensor's point of wearer `index`, V, for a
    /// wearer without measured ones.
    ///
    /// # Errors
    /// Fails if a range is missing.
    pub fn thresholds_v(&self, seed: u64, index: u64) -> Result<[f64; 3], TwoPointsError> {
        let drawn = self.draw_values(seed, index);
        let value = |field| self.value(&drawn, field);
        Ok([
            value("threshold_v")?,
            value("other_v")?,
            value("extensor_v")?,
        ])
    }

    /// Generates wearer `index` with the parameters of [`Self::draw_values`].
    ///
    /// # Errors
    /// Fails if a range is missing.
    pub fn draw_person(&self, seed: u64, index: u64) -> Result<DrawnHand, TwoPointsError> {
        let stream = random::word(seed, index);
        let drawn = self.draw_values(seed, index);
        let value = |field| self.value(&drawn, field);
        let mut spec = HandSpec::nominal(value("reach_m")?, value("around_m")?, stream);
        spec.tissue.fat_m = 1e-3 * value("fat_mm")?;
        spec.skin = SkinSpec {
            farad_per_cm2: 1e-9 * value("skin_nf_per_cm2")?,
            ohm_cm2: 1e3 * value("skin_kohm_cm2")?,
            series_ohm: value("skin_series_ohm")?,
            half_a_per_cm2: 1e-3 * value("skin_half_ma_per_cm2")?,
        };
        spec.membrane = Membrane {
            leak_s: 1e-6 * value("leak_us")?,
            absolute_s: 1e-3 * value("absolute_ms")?,
            ..spec.membrane
        };
        spec.threshold_spread = value("threshold_spread")?;
        spec.shift_m_per_deg = 1e-3 * value("shift_mm_per_90_deg")? / 90.0;
        spec.flexor_nm = value("flexor_nm")?;
        spec.stiffness_nm_per_rad = value("stiffness_nm_per_rad")?;
        spec.extensor_nm = value("extensor_nm")?;
        spec.motion.fatigue_floor = value("fatigue_floor")?;
        spec.motion.fatigue_time_s = value("fatigue_time_s")?;
        Ok(DrawnHand {
            spec,
            threshold_v: value("threshold_v")?,
        })
    }
}

/// Returns the recruitment rule with this name.
///
/// # Errors
/// Fails if there is no such rule.
pub fn rule(name: &str) -> Result<Rule, TwoPointsError> {
    match name {
        "potential" => Ok(Rule::Potential),
        "curvature" => Ok(Rule::Curvature),
        "field" => Ok(Rule::Field),
        _ => Err(TwoPointsError::Declaration(format!(
            "there is no rule `{name}`; allowed: potential, curvature, field"
        ))),
    }
}

/// Removes one mechanism from `spec`.
///
/// # Errors
/// Fails if there is no such ablation.
pub fn ablate(mut spec: HandSpec, name: &str) -> Result<HandSpec, TwoPointsError> {
    match name {
        "capacitance" => spec.skin.farad_per_cm2 = 0.0,
        "limiter" => spec.limiter_a = f64::INFINITY,
        "nonlinearity" => spec.skin.half_a_per_cm2 = f64::INFINITY,
        "refractoriness" => (spec.membrane.absolute_s, spec.membrane.relative_s) = (0.0, 0.0),
        "summation" => spec.sums = false,
        _ => {
            let message = format!(
                "there is no ablation `{name}`; allowed: capacitance, limiter, nonlinearity, \
                 refractoriness, summation"
            );
            return Err(TwoPointsError::Declaration(message));
        }
    }
    Ok(spec)
}
