//! The measurements as a file for people, and as the firmware's table.

use firmware::muscle::choice::grid::{
    BURSTS_MS, LAW_PERIODS_MS, PAIRS, RAMPS_MS, RATES_MHZ, SESSIONS_S, STEPS_MS, TELEMETRY_MS,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write;

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

/// The algorithms of `docs/charts/cycles.csv` that are a rung's tick without
/// and with a pulse, as the device runs it.
const CYCLE_ROWS: [[&str; 2]; 4] = [
    ["static_tick", "static_tick_and_pulse"],
    ["lag_tick", "lag_tick_and_pulse"],
    ["rung_tick", "rung_tick_and_pulse"],
    ["fatigue_tick", "fatigue_tick_and_pulse"],
];

/// The head of the firmware's file.
const HEAD: &str = "\
//! Written by `flexor chart ladder` from docs/charts/ladder.csv and
//! docs/charts/cycles.csv; docs/muscle.md says how it was measured. Errors are
//! in hundredths of a percent, rounded up; 65 535 is 655.35 % or more, and for
//! cycles not measured.

use super::Cycles;
";

/// `firmware/src/muscle/choice/measured.rs`, from a campaign's rows and the
/// text of `docs/charts/cycles.csv`.
///
/// # Errors
/// A measurement is missing; says which.
pub fn firmware_source(rows: &[Row], cycles: &str) -> anyhow::Result<String> {
    let table = Table(rows.iter().map(|row| (row.key(), row.worst_pct)).collect());
    let mut out = HEAD.to_owned();
    table.write_dynamics(&mut out)?;
    table.write_fatigue(&mut out)?;
    table.write_law(&mut out)?;
    table.write_telemetry(&mut out)?;
    table.write_body(&mut out)?;
    write_cycles(&mut out, cycles)?;
    Ok(out)
}

/// Worst errors in percent by key.
struct Table(BTreeMap<Key, f64>);

impl Table {
    /// Hundredths of a percent, rounded up.
    fn share(&self, key: Key) -> anyhow::Result<u16> {
        let Some(pct) = self.0.get(&key) else {
            anyhow::bail!("E550 the ladder's table lacks {key:?}: run `flexor chart ladder`");
        };
        // Rows have four decimals, so that 0.0100 is not rounded up to 0.02.
        let tenthousandths = (pct * 1e4).round().clamp(0.0, 6_553_500.0) as u32;
        Ok(tenthousandths.div_ceil(100) as u16) // at most 65 535
    }

    fn write_dynamics(&self, out: &mut String) -> anyhow::Result<()> {
        out.push_str(
            "\n/// Error of static, lag and calcium-force by burst, ramp and pair of rates,\n\
             /// seven a line, in the order of [`super::grid::pair`].\n\
             #[rustfmt::skip]\npub static DYNAMICS: [[[[u16; 3]; 21]; 6]; 7] = [\n",
        );
        for burst_ms in BURSTS_MS {
            writeln!(out, "[ // bursts of {burst_ms} ms")?;
            for ramp_ms in RAMPS_MS {
                writeln!(out, "  [ // ramps of {ramp_ms} ms")?;
                let mut row = Vec::with_capacity(PAIRS);
                for (slow, slowest) in RATES_MHZ.iter().enumerate() {
                    for fastest in &RATES_MHZ[slow..] {
                        let key = |rung: &str| Key {
                            burst_ms: Some(burst_ms),
                            ramp_ms: Some(ramp_ms),
                            slowest_mhz: Some(*slowest),
                            fastest_mhz: Some(*fastest),
                            ..Key::new(Quantity::Force, rung)
                        };
                        let [a, b, c] = [0, 1, 2].map(|i| self.share(key(RUNG_NAMES[i])));
                        row.push([a?, b?, c?]);
                    }
                }
                for part in row.chunks(7) {
                    let part: Vec<_> = part.iter().map(|cell| format!("{cell:?}")).collect();
                    writeln!(out, "    {},", part.join(", "))?;
                }
                out.push_str("  ],\n");
            }
            out.push_str("],\n");
        }
        out.push_str("];\n");
        Ok(())
    }

    fn write_fatigue(&self, out: &mut String) -> anyhow::Result<()> {
        out.push_str(
            "\n/// Error without and with fatigue in the model, by time at work and rate.\n\
             #[rustfmt::skip]\npub static FATIGUE: [[[u16; 2]; 6]; 8] = [\n",
        );
        for session_s in SESSIONS_S {
            let row = RATES_MHZ.map(|rate| {
                let key = |rung: usize| Key {
                    fastest_mhz: Some(rate),
                    session_s: Some(session_s),
                    ..Key::new(Quantity::Fatigue, RUNG_NAMES[rung])
                };
                anyhow::Ok([self.share(key(2))?, self.share(key(3))?])
            });
            let row: Vec<_> = row.into_iter().collect::<Result<_, _>>()?;
            writeln!(out, "    {row:?}, // {session_s} s")?;
        }
        out.push_str("];\n");
        Ok(())
    }

    fn write_law(&self, out: &mut String) -> anyhow::Result<()> {
        out.push_str(
            "\n/// Loss of tracking by ramp, discretization (explicit, implicit) and law period.\n\
             #[rustfmt::skip]\npub static LAW: [[[u16; 5]; 2]; 6] = [\n",
        );
        for ramp_ms in RAMPS_MS {
            let row = DISCRETIZATION_NAMES.map(|name| {
                let key = |period: u8| Key {
                    ramp_ms: Some(ramp_ms),
                    ..Key::new(Quantity::Law, format!("{name} {period} ms"))
                };
                LAW_PERIODS_MS
                    .map(|period| self.share(key(period)))
                    .into_iter()
                    .collect::<anyhow::Result<Vec<_>>>()
            });
            let row: Vec<_> = row.into_iter().collect::<Result<_, _>>()?;
            writeln!(out, "    {row:?}, // ramps of {ramp_ms} ms")?;
        }
        out.push_str("];\n");
        Ok(())
    }

    fn write_telemetry(&self, out: &mut String) -> anyhow::Result<()> {
        out.push_str(
            "\n/// Error of a force drawn from telemetry by burst, slowest rate\n\
             /// and period.\n\
             #[rustfmt::skip]\npub static TELEMETRY: [[[u16; 7]; 6]; 7] = [\n",
        );
        for burst_ms in BURSTS_MS {
            writeln!(out, "  [ // bursts of {burst_ms} ms")?;
            for slowest_mhz in RATES_MHZ {
                let key = |period: u16| Key {
                    burst_ms: Some(burst_ms),
                    slowest_mhz: Some(slowest_mhz),
                    ..Key::new(Quantity::Telemetry, format!("{period} ms"))
                };
                let row: Vec<_> = TELEMETRY_MS
                    .iter()
                    .map(|&period| self.share(key(period)))
                    .collect::<Result<_, _>>()?;
                writeln!(out, "    {row:?},")?;
            }
            out.push_str("  ],\n");
        }
        out.push_str("];\n");
        Ok(())
    }

    fn write_body(&self, out: &mut String) -> anyhow::Result<()> {
        out.push_str(
            "\n/// Change of the simulated body's motion by ramp and step.\n\
             #[rustfmt::skip]\npub static BODY: [[u16; 4]; 6] = [\n",
        );
        for ramp_ms in RAMPS_MS {
            let key = |step: u8| Key {
                ramp_ms: Some(ramp_ms),
                ..Key::new(Quantity::Body, format!("{step} ms"))
            };
            let row: Vec<_> = STEPS_MS
                .iter()
                .map(|&step| self.share(key(step)))
                .collect::<Result<_, _>>()?;
            writeln!(out, "    {row:?}, // ramps of {ramp_ms} ms")?;
        }
        out.push_str("];\n");
        Ok(())
    }
}

/// The columns `algorithm` and `max_cycles` of the cycles' table.
#[derive(Deserialize)]
struct CycleRow {
    algorithm: String,
    max_cycles: u32,
}

fn write_cycles(out: &mut String, cycles: &str) -> anyhow::Result<()> {
    let mut reader = csv::Reader::from_reader(cycles.as_bytes());
    let rows: Vec<CycleRow> = reader.deserialize().collect::<Result<_, _>>()?;
    let most = |name: &str| {
        let row = rows.iter().find(|row| row.algorithm == name);
        row.map_or(u32::from(u16::MAX), |row| row.max_cycles)
    };
    out.push_str(
        "\n/// Most cycles of each rung's tick on the chip simulator, cheapest rung first.\n\
         #[rustfmt::skip]\npub const CYCLES: [Cycles; 4] = [\n",
    );
    for [tick, with_pulse] in CYCLE_ROWS {
        let (tick, tick_with_pulse) = (most(tick), most(with_pulse));
        writeln!(
            out,
            "    Cycles {{ tick: {tick}, tick_with_pulse: {tick_with_pulse} }},"
        )?;
    }
    out.push_str("];\n");
    Ok(())
}
