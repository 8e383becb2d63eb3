//! Error of each rung of the muscle ladder over four kinds of scene.

use crate::ladder::table::{Quantity, RUNG_NAMES, Row, row, row_in};
use host_core::choice::Scene;
use host_core::choice::grid::{BURSTS_MS, HOLD_MS, RAMPS_MS, RATES_MHZ, SESSIONS_S};
use host_core::plot::ink::{INK, PALETTE, stroke};
use host_core::plot::{At, Axis, Figure, Key, Mark, Paint, Panel, Scale, Shape};
use std::ops::Range;

const NAMES: [&str; 4] = [
    "static",
    "lag",
    "calcium–force",
    "calcium–force with fatigue",
];
/// Where a ramp of no time stands, ms.
const AT_ONCE_MS: f64 = 30.0;
/// The scale's ends, powers of ten of a percent.
const DECADES: (i32, i32) = (-3, 2);

/// The picture of a table, a file of its own.
pub fn picture(rows: &[Row]) -> String {
    let force = |burst_ms, ramp_ms, slowest_mhz, fastest_mhz| {
        let session_s = 0;
        let scene = Scene {
            burst_ms,
            slowest_mhz,
            fastest_mhz,
            ramp_ms,
            session_s,
        };
        row_in(&scene, Quantity::Force, "", 0.0)
    };
    let bursts = BURSTS_MS.map(|ms| {
        let name = if ms == HOLD_MS {
            "hold".to_owned()
        } else {
            time(ms)
        };
        (f64::from(ms), name, force(ms, 0, 40_000, 40_000))
    });
    let ramps = RAMPS_MS.map(|ms| {
        let at = f64::from(ms).max(AT_ONCE_MS);
        (at, time(ms), force(HOLD_MS, ms, 40_000, 40_000))
    });
    let rates = RATES_MHZ.map(|mhz| {
        let hz = f64::from(mhz) / 1000.0;
        let key = force(HOLD_MS, 300, mhz.min(40_000), mhz.max(40_000));
        (hz, format!("{hz}"), key)
    });
    let work = SESSIONS_S.into_iter().skip(1).map(|session_s| {
        let key = Row {
            fastest_mhz: Some(40_000),
            session_s: Some(session_s),
            ..row(Quantity::Fatigue, "", 0.0)
        };
        (f64::from(session_s), session_s.to_string(), key)
    });
    let work: Vec<_> = work.collect();
    let panel = |title, axis, rungs, places: &[_]| panel(rows, title, axis, rungs, places);
    let marked = |(n, name): (usize, &&str)| {
        let key = Key::Marked(stroke(PALETTE[n], 2.0), Shape::SERIES[n]);
        (key, (*name).to_owned())
    };
    Figure {
        description: "Worst error of each muscle model in four kinds of scene".to_owned(),
        legend: NAMES.iter().enumerate().map(marked).collect(),
        rows: vec![
            vec![
                panel(
                    "Bursts of 40 Hz, at once",
                    "length of a burst",
                    0..3,
                    &bursts,
                ),
                panel("A hold of 40 Hz, ramped", "time of the ramp", 0..3, &ramps),
            ],
            vec![
                panel(
                    "A hold whose pulse rate changes in 300 ms",
                    "rate that it changes to from 40 Hz, or back (Hz)",
                    0..3,
                    &rates,
                ),
                panel(
                    "Work at 40 Hz without a pause, muscle tiring",
                    "time at work (s)",
                    2..4,
                    &work,
                ),
            ],
        ],
        ..Figure::default()
    }
    .file()
}

/// A panel of some rungs over places with their names and rows.
fn panel(
    rows: &[Row],
    title: &str,
    axis: &str,
    rungs: Range<usize>,
    places: &[(f64, String, Row)],
) -> Panel {
    let ends = (places[0].0 * 0.7, places[places.len() - 1].0 * 1.4);
    let ticks = places.iter().map(|(at, name, _)| (*at, name.clone()));
    let x = Axis::new(axis, Scale::Log(ends.0, ends.1)).ticks(ticks.collect());
    let worst = |rung: usize, scene: &Row| {
        let candidate = RUNG_NAMES[rung].to_owned();
        let wanted = Row {
            candidate,
            ..scene.clone()
        };
        let row = rows.iter().find(|row| row.key() == wanted.key())?;
        Some(row.worst_pct)
    };
    let marks = rungs.flat_map(|rung| {
        let known = places.iter();
        let points: Vec<At> = known
            .filter_map(|(at, _, key)| Some((*at, worst(rung, key)?)))
            .collect();
        let dot = |at: &At| Mark::Dot(*at, Shape::SERIES[rung], 4.0, Paint::Full(PALETTE[rung]));
        let dots: Vec<Mark> = points.iter().map(dot).collect();
        dots.into_iter()
            .chain([Mark::Line(points, stroke(PALETTE[rung], 2.0))])
    });
    let y = Axis::decades("worst error (% of peak)", DECADES);
    Panel {
        marks: marks.collect(),
        ..Panel::new(title, x, y.rule(10.0, "noticed", INK), 200.0)
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
