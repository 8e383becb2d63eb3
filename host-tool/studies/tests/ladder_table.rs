//! The firmware's table of measured errors, the committed measurements and a
//! short new measurement are one and the same.

use hal_sim::body::muscle::SUBJECTS;
use host_core::choice::grid::{BURSTS_MS, RAMPS_MS, pair};
use host_core::choice::{DYNAMICS, Scene};
use studies::ladder::source::firmware_sources;
use studies::ladder::table::{Key, Quantity, Row, parse};
use studies::ladder::{dynamics, fatigue, force_rows, motion_rows_of, replaced};

const TABLE: &str = include_str!("../../../docs/charts/ladder.csv");
const CYCLES: &str = include_str!("../../../docs/charts/cycles.csv");
const FIRMWARE: [&str; 3] = [
    include_str!("../../core/src/choice/measured/prediction.rs"),
    include_str!("../../core/src/choice/measured/replaced.rs"),
    include_str!("../../core/src/choice/measured/tiring.rs"),
];

#[test]
fn the_firmware_has_the_committed_measurements() {
    let rows = parse(TABLE).unwrap();
    let sources = firmware_sources(&rows, CYCLES).unwrap();
    for ((name, source), committed) in sources.iter().zip(FIRMWARE) {
        assert!(
            source == committed,
            "{name}: run `flexor chart ladder --no-measuring`"
        );
    }
}

/// What was committed for a row measured now; equal but for what another
/// computer's exponential may differ in, 0.0002 %.
#[track_caller]
fn same(committed: &[Row], now: &Row) {
    let is_it = |row: &&Row| row.key() == now.key();
    let then = committed.iter().find(is_it).expect("a committed row");
    let off = (then.worst_pct - now.worst_pct).abs();
    assert!(
        off <= 2e-4,
        "{now:?} was {then:?}: run `flexor chart ladder`"
    );
}

/// One scene of each kind: a pulse, a burst, a modulated hold, a slow hold.
#[test]
fn forces_measured_anew_are_the_committed_ones() {
    let committed = parse(TABLE).unwrap();
    let wanted = [
        (1, 0, 5, 5),
        (100, 0, 40, 40),
        (1_000, 100, 20, 80),
        (3_000, 1_000, 40, 40),
    ];
    for (burst_ms, ramp_ms, slowest, fastest) in wanted {
        let scene = Scene {
            burst_ms,
            ramp_ms,
            slowest_mhz: slowest * 1000,
            fastest_mhz: fastest * 1000,
            session_s: 0,
        };
        assert!(dynamics::grid().contains(&scene), "{scene:?}");
        let cell = dynamics::measure(&scene).unwrap();
        for row in force_rows(&[scene], &[cell]) {
            same(&committed, &row);
        }
    }
}

/// A pulse, a burst, a modulated and a slow hold.
#[test]
fn changes_measured_anew_are_the_committed_ones() {
    let committed = parse(TABLE).unwrap();
    let scenes = replaced::rested_grid();
    for (burst_ms, ramp_ms, slowest_mhz, fastest_mhz) in [
        (1, 0, 5_000, 5_000),
        (100, 0, 48_000, 48_000),
        (Scene::UNBROKEN, 120, 22_000, 90_000),
        (Scene::UNBROKEN, 1_700, 48_000, 48_000),
    ] {
        let scene = Scene {
            burst_ms,
            ramp_ms,
            slowest_mhz,
            fastest_mhz,
            session_s: 0,
        };
        assert!(scenes.contains(&scene), "{scene:?}");
        for row in replaced::rested_rows(&scene).unwrap() {
            same(&committed, &row);
        }
    }
    let work = replaced::work_grid();
    for row in replaced::work_rows(work.last().unwrap()).unwrap() {
        same(&committed, &row);
    }
}

#[test]
fn fatigue_and_motion_measured_anew_are_the_committed_ones() {
    let committed = parse(TABLE).unwrap();
    for row in motion_rows_of(300).unwrap() {
        same(&committed, &row);
    }
    // The table has the worst subject: none may be worse, one must be that.
    let key = Key {
        fastest_mhz: Some(40_000),
        session_s: Some(3),
        ..Key::new(Quantity::Fatigue, "calcium-force")
    };
    let then = committed.iter().find(|row| row.key() == key).unwrap();
    let worst = SUBJECTS
        .iter()
        .map(|subject| fatigue::work(40_000, subject, 3).unwrap()[2][0].worst)
        .fold(0.0, f64::max);
    assert!(
        (worst * 100.0 - then.worst_pct).abs() <= 2e-4,
        "{worst} {then:?}"
    );
}

/// The table's axes are the grid's: a cell by its name is the same cell by its
/// place.
#[test]
fn the_table_is_in_the_order_of_the_grid() {
    let rows = parse(TABLE).unwrap();
    for (slow, fast) in [(0, 0), (1, 3), (4, 5)] {
        let rates = host_core::choice::grid::RATES_MHZ;
        let key = Key {
            burst_ms: Some(BURSTS_MS[3]),
            ramp_ms: Some(RAMPS_MS[1]),
            slowest_mhz: Some(rates[slow]),
            fastest_mhz: Some(rates[fast]),
            ..Key::new(Quantity::Force, "lag")
        };
        let row = rows.iter().find(|row| row.key() == key).unwrap();
        let share = (row.worst_pct * 100.0).ceil() as u16;
        assert_eq!(DYNAMICS[3][1][pair(rates.len(), slow, fast)][1], share);
    }
}
