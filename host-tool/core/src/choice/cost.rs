//! Cost of a model level, from docs/charts/cycles.csv as of the build of this program.

use crate::session::level_name;
use firmware::muscle::MuscleLevel;
use std::sync::LazyLock;

const CYCLES_CSV: &str = include_str!("../../../../docs/charts/cycles.csv");

/// Model levels by name. Each has the name of the algorithm in `cycles.csv` that computes one tick
/// without a pulse; `None` for a level that computes nothing and costs nothing.
const ROWS: [(&str, Option<&str>); 3] = [
    ("none", None),
    ("calcium-force", Some("rung_tick")),
    ("calcium-force-fatigue", Some("fatigue_tick")),
];

/// Largest number of processor cycles that one tick of a model level took on the chip simulator.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cycles {
    /// Cycles of a control tick of 1 ms in which no pulse occurs.
    pub tick: u32,
    /// Cycles of a control tick of 1 ms in which a pulse occurs.
    pub tick_with_pulse: u32,
}

impl Cycles {
    /// Returns the cycles that the level needs per second of stimulation at this pulse rate.
    #[must_use]
    pub fn per_second(&self, pulses_per_s: f64) -> f64 {
        let more = f64::from(self.tick_with_pulse) - f64::from(self.tick);
        1_000.0 * f64::from(self.tick) + pulses_per_s * more
    }
}

/// Returns the measured cycles of a model level; `None` if they were not measured.
#[must_use]
pub fn cycles(level: MuscleLevel) -> Option<Cycles> {
    let (_, row) = ROWS.iter().find(|(name, _)| *name == level_name(level))?;
    let Some(row) = row else {
        return Some(Cycles {
            tick: 0,
            tick_with_pulse: 0,
        });
    };
    Some(Cycles {
        tick: max_cycles(row)?,
        tick_with_pulse: max_cycles(&format!("{row}_and_pulse"))?,
    })
}

/// Returns the model levels that can be chosen because their cost is known, the most detailed last.
pub fn measured_levels() -> impl Iterator<Item = MuscleLevel> {
    let is_known = |level: &MuscleLevel| ROWS.iter().any(|(name, _)| *name == level_name(*level));
    MuscleLevel::ALL.into_iter().filter(is_known)
}

/// Returns the largest number of cycles that `cycles.csv` has for an algorithm; `None` if it was
/// not measured.
fn max_cycles(algorithm: &str) -> Option<u32> {
    static ROWS: LazyLock<Vec<(String, u32)>> = LazyLock::new(|| {
        let mut reader = csv::Reader::from_reader(CYCLES_CSV.as_bytes());
        let headers = reader.headers().cloned().unwrap_or_default();
        let column = |name| headers.iter().position(|header| header == name);
        let (name, most) = (column("algorithm"), column("max_cycles"));
        let rows = reader
            .records()
            .flatten()
            .filter_map(|row| Some((row.get(name?)?.to_owned(), row.get(most?)?.parse().ok()?)));
        rows.collect()
    });
    let row = ROWS.iter().find(|(name, _)| name == algorithm)?;
    Some(row.1)
}
