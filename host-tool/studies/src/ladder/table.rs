//! The measurements as a file for people.

use serde::{Deserialize, Serialize};

/// What a row of the table is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Force of a rested muscle by a rung.
    Force,
    /// Force of a muscle at work, without or with fatigue in the model.
    Fatigue,
    /// Force drawn again from telemetry.
    Telemetry,
    /// Tracking of an angle, by law period and discretization.
    Law,
    /// Motion of the simulated body, by its step.
    Body,
    /// True force of a rested muscle in closed loop, if the top rung takes a
    /// rung's place.
    Change,
    /// The same of a muscle at work, for want of fatigue in the model.
    Tiring,
}

/// Where a row belongs: its quantity, its scene and who was measured.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Key {
    /// What is measured.
    pub quantity: Quantity,
    /// Burst, ms.
    pub burst_ms: Option<u32>,
    /// Ramp, ms.
    pub ramp_ms: Option<u32>,
    /// Lowest pulse rate, mHz.
    pub slowest_mhz: Option<u32>,
    /// Highest pulse rate, mHz.
    pub fastest_mhz: Option<u32>,
    /// Time at work, s.
    pub session_s: Option<u32>,
    /// Rung, period, discretization or step.
    pub candidate: String,
}

impl Key {
    /// A key without a scene.
    #[must_use]
    pub fn new(quantity: Quantity, candidate: impl Into<String>) -> Self {
        Self {
            quantity,
            burst_ms: None,
            ramp_ms: None,
            slowest_mhz: None,
            fastest_mhz: None,
            session_s: None,
            candidate: candidate.into(),
        }
    }

    /// Another quantity and candidate in the same scene.
    #[must_use]
    pub fn of(&self, quantity: Quantity, candidate: impl Into<String>) -> Self {
        Self {
            quantity,
            candidate: candidate.into(),
            ..self.clone()
        }
    }
}

/// One measurement, in percent of the scene's peak, to four decimals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// What is measured.
    pub quantity: Quantity,
    /// Burst, ms.
    pub burst_ms: Option<u32>,
    /// Ramp, ms.
    pub ramp_ms: Option<u32>,
    /// Lowest pulse rate, mHz.
    pub slowest_mhz: Option<u32>,
    /// Highest pulse rate, mHz.
    pub fastest_mhz: Option<u32>,
    /// Time at work, s.
    pub session_s: Option<u32>,
    /// Rung, period, discretization or step.
    pub candidate: String,
    /// Worst error over subjects and seeds.
    pub worst_pct: f64,
    /// Worst root-mean-square error.
    pub rms_pct: Option<f64>,
    /// Worst difference from the top rung's prediction.
    pub against_top_pct: Option<f64>,
}

impl Row {
    /// A row from parts of one.
    #[must_use]
    pub fn new(key: Key, worst: f64, rms: Option<f64>, against_top: Option<f64>) -> Self {
        Self {
            quantity: key.quantity,
            burst_ms: key.burst_ms,
            ramp_ms: key.ramp_ms,
            slowest_mhz: key.slowest_mhz,
            fastest_mhz: key.fastest_mhz,
            session_s: key.session_s,
            candidate: key.candidate,
            worst_pct: rounded(worst),
            rms_pct: rms.map(rounded),
            against_top_pct: against_top.map(rounded),
        }
    }

    /// Where it belongs.
    #[must_use]
    pub fn key(&self) -> Key {
        Key {
            quantity: self.quantity,
            burst_ms: self.burst_ms,
            ramp_ms: self.ramp_ms,
            slowest_mhz: self.slowest_mhz,
            fastest_mhz: self.fastest_mhz,
            session_s: self.session_s,
            candidate: self.candidate.clone(),
        }
    }
}

/// A part in percent, to four decimals.
fn rounded(part: f64) -> f64 {
    (part * 1e6).round() / 1e4
}

/// The committed table, `docs/charts/ladder.csv`.
///
/// # Errors
/// The writer's; none for rows of this module.
pub fn csv(rows: &[Row]) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// The rows of a table.
///
/// # Errors
/// What cannot be read, with its line.
pub fn parse(text: &str) -> anyhow::Result<Vec<Row>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    Ok(reader.deserialize().collect::<Result<_, _>>()?)
}

/// Names of the rungs in rows.
pub const RUNG_NAMES: [&str; 4] = ["static", "lag", "calcium-force", "calcium-force-fatigue"];
/// Names of the discretizations in rows, in the order of the firmware's table.
pub const DISCRETIZATION_NAMES: [&str; 2] = ["explicit", "implicit"];
