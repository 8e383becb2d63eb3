//! The measurements as the firmware's tables.

use super::table::{DISCRETIZATION_NAMES, Key, Quantity, RUNG_NAMES, Row};
use host_core::choice::grid::{
    BURSTS_MS, LAW_PERIODS_MS, LOOP_BURSTS_MS, LOOP_RAMPS_MS, LOOP_RATES_MHZ, RAMPS_MS, RATES_MHZ,
    SESSIONS_S, STEPS_MS, TELEMETRY_MS, WORK_BURSTS_MS, WORK_RAMPS_MS, WORK_RATES_MHZ,
    WORK_SESSIONS_S,
};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The algorithms of `docs/charts/cycles.csv` that are a rung's tick without
/// and with a pulse, as the device runs it.
const CYCLE_ROWS: [[&str; 2]; 4] = [
    ["static_tick", "static_tick_and_pulse"],
    ["lag_tick", "lag_tick_and_pulse"],
    ["rung_tick", "rung_tick_and_pulse"],
    ["fatigue_tick", "fatigue_tick_and_pulse"],
];

/// The head of each of the firmware's files.
const HEAD: &str = "\
//! Written by `flexor chart ladder` from docs/charts/ladder.csv and
//! docs/charts/cycles.csv; docs/muscle.md says how it was measured. Errors are
//! in hundredths of a percent, rounded up; 65 535 is 655.35 % or more, and for
//! cycles not measured.
";

/// The files of `host-tool/core/src/choice/measured`, from a campaign's rows and
/// the text of `docs/charts/cycles.csv`: name and text.
///
/// # Errors
/// A measurement is missing; says which.
pub fn firmware_sources(rows: &[Row], cycles: &str) -> anyhow::Result<[(&'static str, String); 3]> {
    let table = Table(rows.iter().map(|row| (row.key(), row.worst_pct)).collect());
    let [mut prediction, mut replaced, mut tiring] = [(); 3].map(|()| HEAD.to_owned());
    prediction.push_str("\nuse crate::choice::Cycles;\n");
    table.write_dynamics(&mut prediction)?;
    table.write_fatigue(&mut prediction)?;
    table.write_law(&mut prediction)?;
    table.write_telemetry(&mut prediction)?;
    table.write_body(&mut prediction)?;
    write_cycles(&mut prediction, cycles)?;
    table.write_change(&mut replaced)?;
    table.write_tiring(&mut tiring)?;
    Ok([
        ("prediction.rs", prediction),
        ("replaced.rs", replaced),
        ("tiring.rs", tiring),
    ])
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
            "\n/// Error of the prediction of static, lag and calcium-force by burst, ramp and pair of rates,\n\
             /// seven a line, in the order of [`crate::choice::grid::pair`].\n\
             #[rustfmt::skip]\npub static DYNAMICS: [[[[u16; 3]; 21]; 6]; 7] = [\n",
        );
        let errors = |scene: &Key| {
            let rungs = &RUNG_NAMES[..3];
            let keys = rungs.iter().map(|rung| scene.of(Quantity::Force, *rung));
            self.shares(keys)
        };
        write_scenes(out, [&BURSTS_MS, &RAMPS_MS, &RATES_MHZ], 7, errors)
    }

    fn write_change(&self, out: &mut String) -> anyhow::Result<()> {
        out.push_str(
            "\n/// Change of the true force in closed loop if the top rung replaces static\n\
             /// or lag, by burst, ramp and pair of rates, fifteen a line.\n\
             #[rustfmt::skip]\npub static CHANGE: [[[[u16; 2]; 45]; 8]; 9] = [\n",
        );
        let changes = |scene: &Key| {
            let rungs = &RUNG_NAMES[..2];
            let keys = rungs.iter().map(|rung| scene.of(Quantity::Change, *rung));
            self.shares(keys)
        };
        let axes = [&LOOP_BURSTS_MS[..], &LOOP_RAMPS_MS, &LOOP_RATES_MHZ];
        write_scenes(out, axes, 15, changes)
    }

    fn write_tiring(&self, out: &mut String) -> anyhow::Result<()> {
        out.push_str(
            "\n/// Change of the true force of a muscle that tires, in closed loop, if the top\n\
             /// rung replaces calcium-force, by burst, ramp, pair of rates (two a line) and\n\
             /// time at work.\n\
             #[rustfmt::skip]\npub static TIRING: [[[[u16; 7]; 28]; 2]; 7] = [\n",
        );
        let changes = |scene: &Key| {
            let keys = WORK_SESSIONS_S.iter().map(|&session_s| Key {
                session_s: Some(session_s),
                ..scene.of(Quantity::Tiring, RUNG_NAMES[2])
            });
            self.shares(keys)
        };
        let axes = [&WORK_BURSTS_MS[..], &WORK_RAMPS_MS, &WORK_RATES_MHZ];
        write_scenes(out, axes, 2, changes)
    }

    /// [`Self::share`] of each.
    fn shares(&self, keys: impl Iterator<Item = Key>) -> anyhow::Result<Vec<u16>> {
        keys.map(|key| self.share(key)).collect()
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

/// The rest of a table of scenes, by burst, ramp and pair of rates, so many cells a
/// line: `cell` gives those of a scene.
fn write_scenes(
    out: &mut String,
    [bursts, ramps, rates]: [&[u32]; 3],
    per_line: usize,
    cell: impl Fn(&Key) -> anyhow::Result<Vec<u16>>,
) -> anyhow::Result<()> {
    for &burst_ms in bursts {
        writeln!(out, "[ // bursts of {burst_ms} ms")?;
        for &ramp_ms in ramps {
            writeln!(out, "  [ // ramps of {ramp_ms} ms")?;
            let scenes = pairs(rates).map(|(slowest, fastest)| Key {
                burst_ms: Some(burst_ms),
                ramp_ms: Some(ramp_ms),
                slowest_mhz: Some(slowest),
                fastest_mhz: Some(fastest),
                ..Key::new(Quantity::Force, "")
            });
            let cells = scenes.map(|scene| Ok(format!("{:?}", cell(&scene)?)));
            let cells: Vec<String> = cells.collect::<anyhow::Result<_>>()?;
            for line in cells.chunks(per_line) {
                writeln!(out, "    {},", line.join(", "))?;
            }
            out.push_str("  ],\n");
        }
        out.push_str("],\n");
    }
    out.push_str("];\n");
    Ok(())
}

/// All pairs of some rates, in the order of `grid::pair`.
fn pairs(rates: &[u32]) -> impl Iterator<Item = (u32, u32)> {
    let from = rates.iter().enumerate();
    from.flat_map(|(slow, &slowest)| rates[slow..].iter().map(move |&fastest| (slowest, fastest)))
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
