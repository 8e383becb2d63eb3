//! Who is drawn: the ranges of `population.toml`, and a person of them.

use super::error::TwoPointsError;
use crate::laboratory::Range;
use hal_sim::body::hand::{HandSpec, Rule, SkinSpec, membrane::Membrane};
use hal_sim::random;
use serde::Deserialize;

/// The declaration, as the program has it.
pub const DECLARED: &str = include_str!("../../../experiments/hamana-population.toml");

/// What is drawn, tried and judged.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Population {
    /// The page's heading.
    pub title: String,
    /// Paper and sections.
    pub source: String,
    /// Of every draw.
    pub seed: u64,
    /// Wearers in each cell.
    pub draws: u64,
    /// Trials of each pattern.
    pub trials: u64,
    /// Standard deviation of the skin's place over the muscles, mm.
    pub jitter_mm: f64,
    /// The same of a contraction's strength, as a part.
    pub force_noise: f64,
    /// What is crossed.
    pub cells: Cells,
    /// What is taken away.
    pub ablations: Ablations,
    /// Cells whose two points are alike.
    pub balanced: Balanced,
    /// What is drawn.
    #[serde(rename = "range")]
    pub ranges: Vec<Range>,
    /// What is judged.
    #[serde(rename = "claim")]
    pub claims: Vec<Claim>,
}

/// Levels that are crossed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cells {
    /// By name.
    pub rules: Vec<String>,
    /// Of the return's impedance.
    pub return_factors: Vec<f64>,
    /// Parts above threshold; 0 as searched.
    pub volts: Vec<f64>,
}

/// Names of what is taken away.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ablations {
    /// In the default cell.
    pub names: Vec<String>,
}

/// Cells in which B's threshold is drawn as A's is, at every ground of the default rule.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Balanced {
    /// How many times the skin's impedance.
    pub skins: Vec<f64>,
}

/// What is judged.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// For machines.
    pub id: String,
    /// For people.
    pub says: String,
}

/// A drawn wearer.
#[derive(Clone, Debug)]
pub struct DrawnHand {
    /// The hand.
    pub spec: HandSpec,
    /// The voltage at which point A first moves a finger, V.
    pub threshold_v: f64,
}

impl Population {
    /// The program's own.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn load_embedded() -> Result<Self, TwoPointsError> {
        toml::from_str(DECLARED).map_err(|e| TwoPointsError::Declaration(e.to_string()))
    }

    /// What is drawn for person `index`, a number for each range in their order: every one
    /// of the same seed has the same numbers, whatever is drawn beside.
    #[must_use]
    pub fn draw_values(&self, seed: u64, index: u64) -> Vec<f64> {
        Range::draw_values(&self.ranges, seed, index)
    }

    /// What is `draw_values` for the range of this field.
    fn value(&self, drawn: &[f64], field: &str) -> Result<f64, TwoPointsError> {
        Range::value(&self.ranges, drawn, field).ok_or_else(|| TwoPointsError::missing(field))
    }

    /// Thresholds of A, B and the extensor's point of person `index`, V, where nobody
    /// measured them.
    ///
    /// # Errors
    /// A range is missing.
    pub fn thresholds_v(&self, seed: u64, index: u64) -> Result<[f64; 3], TwoPointsError> {
        let drawn = self.draw_values(seed, index);
        let of = |field| self.value(&drawn, field);
        Ok([of("threshold_v")?, of("other_v")?, of("extensor_v")?])
    }

    /// Person `index`, of the numbers that are [drawn](Self::drawn) for it.
    ///
    /// # Errors
    /// A range's field is unknown, or one is missing.
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

/// The rule of this name.
///
/// # Errors
/// There is none.
pub fn rule(name: &str) -> Result<Rule, TwoPointsError> {
    match name {
        "potential" => Ok(Rule::Potential),
        "curvature" => Ok(Rule::Curvature),
        "field" => Ok(Rule::Field),
        _ => Err(TwoPointsError::Declaration(format!(
            "no rule `{name}`: potential, curvature or field"
        ))),
    }
}

/// `spec` without one of its mechanisms.
///
/// # Errors
/// There is no such ablation.
pub fn ablate(mut spec: HandSpec, name: &str) -> Result<HandSpec, TwoPointsError> {
    match name {
        "capacitance" => spec.skin.farad_per_cm2 = 0.0,
        "limiter" => spec.limiter_a = f64::INFINITY,
        "nonlinearity" => spec.skin.half_a_per_cm2 = f64::INFINITY,
        "refractoriness" => (spec.membrane.absolute_s, spec.membrane.relative_s) = (0.0, 0.0),
        "summation" => spec.sums = false,
        _ => {
            let what = format!("no ablation `{name}`");
            return Err(TwoPointsError::Declaration(what));
        }
    }
    Ok(spec)
}
