//! The rows that `docs/charts/ladder.svg` shows.

use super::table::{Key, Quantity, RUNG_NAMES, Row};
use crate::report::{LadderCourse, LadderPanel, ladder_picture};
use firmware::muscle::choice::grid::{BURSTS_MS, HOLD_MS, RAMPS_MS, RATES_MHZ, SESSIONS_S};

/// The picture of a table.
#[must_use]
pub fn picture(rows: &[Row]) -> String {
    ladder_picture(&[bursts(rows), ramps(rows), rates(rows), work(rows)])
}

/// Courses of some rungs over an axis.
fn courses(rows: &[Row], rungs: std::ops::Range<usize>, keys: &[Key]) -> Vec<LadderCourse> {
    rungs
        .map(|rung| LadderCourse {
            rung,
            worst_pct: keys
                .iter()
                .map(|key| {
                    let candidate = RUNG_NAMES[rung].to_owned();
                    let key = Key {
                        candidate,
                        ..key.clone()
                    };
                    let row = rows.iter().find(|row| row.key() == key)?;
                    Some(row.worst_pct)
                })
                .collect(),
        })
        .collect()
}

fn force(burst_ms: u32, ramp_ms: u32, slowest_mhz: u32, fastest_mhz: u32) -> Key {
    Key {
        burst_ms: Some(burst_ms),
        ramp_ms: Some(ramp_ms),
        slowest_mhz: Some(slowest_mhz),
        fastest_mhz: Some(fastest_mhz),
        ..Key::new(Quantity::Force, "")
    }
}

/// "300 ms", "3 s".
fn time(ms: u32) -> String {
    if ms >= 1000 {
        format!("{} s", ms / 1000)
    } else {
        format!("{ms} ms")
    }
}

fn bursts(rows: &[Row]) -> LadderPanel {
    let keys = BURSTS_MS.map(|burst| force(burst, 0, 40_000, 40_000));
    let name = |ms| match ms {
        HOLD_MS => "hold".to_owned(),
        _ => time(ms),
    };
    LadderPanel {
        title: "Bursts of 40 Hz, at once",
        axis: "length of a burst",
        places: BURSTS_MS.map(name).to_vec(),
        courses: courses(rows, 0..3, &keys),
    }
}

fn ramps(rows: &[Row]) -> LadderPanel {
    let keys = RAMPS_MS.map(|ramp| force(HOLD_MS, ramp, 40_000, 40_000));
    LadderPanel {
        title: "A hold of 40 Hz, ramped",
        axis: "time of the ramp",
        places: RAMPS_MS.map(time).to_vec(),
        courses: courses(rows, 0..3, &keys),
    }
}

fn rates(rows: &[Row]) -> LadderPanel {
    let keys: Vec<_> = RATES_MHZ
        .iter()
        .map(|&rate| force(HOLD_MS, 300, rate.min(40_000), rate.max(40_000)))
        .collect();
    LadderPanel {
        title: "A hold whose pulse rate changes in 300 ms",
        axis: "between 40 Hz and",
        places: RATES_MHZ.map(|mhz| format!("{} Hz", mhz / 1000)).to_vec(),
        courses: courses(rows, 0..3, &keys),
    }
}

fn work(rows: &[Row]) -> LadderPanel {
    let sessions = &SESSIONS_S[1..];
    let keys: Vec<_> = sessions
        .iter()
        .map(|&session_s| Key {
            fastest_mhz: Some(40_000),
            session_s: Some(session_s),
            ..Key::new(Quantity::Fatigue, "")
        })
        .collect();
    LadderPanel {
        title: "Work at 40 Hz without a pause, muscle tiring",
        axis: "time at work",
        places: sessions.iter().map(|s| format!("{s} s")).collect(),
        courses: courses(rows, 2..4, &keys),
    }
}
