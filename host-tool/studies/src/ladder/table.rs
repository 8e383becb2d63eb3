//! The measurements as a file for people, and for `host_core::choice`.

use host_core::choice::Scene;
pub use host_core::choice::measured::{
    COMMITTED, DISCRETIZATION_NAMES, Quantity, RUNG_NAMES, Row, parse,
};

/// A row without a scene of this worst error, a part of the peak; to four decimals
/// of a percent.
pub fn row(quantity: Quantity, candidate: impl Into<String>, worst: f64) -> Row {
    Row {
        quantity,
        burst_ms: None,
        ramp_ms: None,
        slowest_mhz: None,
        fastest_mhz: None,
        session_s: None,
        candidate: candidate.into(),
        worst_pct: percent(worst),
        rms_pct: None,
        against_top_pct: None,
    }
}

/// The same in a scene, whose time at work is left out.
pub fn row_in(scene: &Scene, quantity: Quantity, candidate: impl Into<String>, worst: f64) -> Row {
    Row {
        burst_ms: Some(scene.burst_ms),
        ramp_ms: Some(scene.ramp_ms),
        slowest_mhz: Some(scene.slowest_mhz),
        fastest_mhz: Some(scene.fastest_mhz),
        ..row(quantity, candidate, worst)
    }
}

/// A part in percent, to four decimals.
pub fn percent(part: f64) -> f64 {
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
