//! What a rung costs, as docs/charts/cycles.csv had it when this program was built.

use crate::session::rung_name;
use firmware::muscle::Rung;
use std::sync::LazyLock;

const CYCLES_CSV: &str = include_str!("../../../../docs/charts/cycles.csv");

/// Rungs by name, and the algorithm that is a tick of one without a pulse; a rung
/// that no algorithm computes costs nothing.
const ROWS: [(&str, Option<&str>); 3] = [
    ("none", None),
    ("calcium-force", Some("rung_tick")),
    ("calcium-force-fatigue", Some("fatigue_tick")),
];

/// Most core clock cycles of a rung on the chip simulator, per call.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cycles {
    /// A control tick of 1 ms without a pulse.
    pub tick: u32,
    /// One with a pulse inside it.
    pub tick_with_pulse: u32,
}

impl Cycles {
    /// A second of these pulses.
    #[must_use]
    pub fn per_second(&self, pulses_per_s: f64) -> f64 {
        let more = f64::from(self.tick_with_pulse) - f64::from(self.tick);
        1_000.0 * f64::from(self.tick) + pulses_per_s * more
    }
}

/// What a rung costs; none if that was not measured.
#[must_use]
pub fn cycles(rung: Rung) -> Option<Cycles> {
    let (_, row) = ROWS.iter().find(|(name, _)| *name == rung_name(rung))?;
    let Some(row) = row else {
        return Some(Cycles {
            tick: 0,
            tick_with_pulse: 0,
        });
    };
    Some(Cycles {
        tick: most(row)?,
        tick_with_pulse: most(&format!("{row}_and_pulse"))?,
    })
}

/// The rungs that are chosen from, the fullest last.
pub fn rungs() -> impl Iterator<Item = Rung> {
    let is_known = |rung: &Rung| ROWS.iter().any(|(name, _)| *name == rung_name(*rung));
    Rung::ALL.into_iter().filter(is_known)
}

/// The most cycles that an algorithm took.
fn most(algorithm: &str) -> Option<u32> {
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
