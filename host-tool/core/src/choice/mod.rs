//! What a muscle's models cost.
//!
//! In: docs/charts/cycles.csv, as this program was built with it. Out: [`Cycles`].

use firmware::muscle::Rung;

const CYCLES_CSV: &str = include_str!("../../../../docs/charts/cycles.csv");

/// Most core clock cycles of a rung on the chip simulator, per call.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cycles {
    /// A control tick of 1 ms without a pulse.
    pub tick: u32,
    /// One with a pulse inside it.
    pub tick_with_pulse: u32,
}

/// What a rung costs; none if that was not measured.
#[must_use]
pub fn cycles(rung: Rung) -> Option<Cycles> {
    let row = match rung {
        Rung::Static => "static_tick",
        Rung::Lag => "lag_tick",
        Rung::CalciumForce => "rung_tick",
        Rung::CalciumForceFatigue => "fatigue_tick",
    };
    Some(Cycles {
        tick: most(row)?,
        tick_with_pulse: most(&format!("{row}_and_pulse"))?,
    })
}

/// The most cycles that an algorithm took.
fn most(algorithm: &str) -> Option<u32> {
    let mut reader = csv::Reader::from_reader(CYCLES_CSV.as_bytes());
    let mut column = |name| reader.headers().ok()?.iter().position(|it| it == name);
    let (name, most) = (column("algorithm")?, column("max_cycles")?);
    let mut rows = reader.records().flatten();
    rows.find(|row| row.get(name) == Some(algorithm))?
        .get(most)?
        .parse()
        .ok()
}
