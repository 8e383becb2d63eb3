//! What the choice is made from is what was measured, and a short new measurement
//! is the same.

use firmware::muscle::Rung;
use hal_sim::body::muscle::SUBJECTS;
use host_core::choice::{Scene, Share, expected_change, expected_error};
use studies::ladder::table::{COMMITTED, Quantity, RUNG_NAMES, Row, parse};
use studies::ladder::{dynamics, fatigue, force_rows, motion_rows_of, replaced};

/// At a measured scene an error is the measured one, and a change larger by a 32nd:
/// every row is found by its place, and none is missing. (A burst shorter than a
/// period is a single pulse, and an unbroken one has no longer ramps than its time
/// at work: such changes are another row's.)
#[test]
fn measured_scenes_are_what_was_measured() {
    let rows = parse(COMMITTED).unwrap();
    let of = |quantity| rows.iter().filter(move |row| row.quantity == quantity);
    let scene = |row: &Row, session_s| Scene {
        burst_ms: row.burst_ms.unwrap(),
        slowest_mhz: row.slowest_mhz.unwrap(),
        fastest_mhz: row.fastest_mhz.unwrap(),
        ramp_ms: row.ramp_ms.unwrap(),
        session_s,
    };
    let rung = |row: &Row| {
        let place = RUNG_NAMES.iter().position(|name| *name == row.candidate);
        Rung::ALL[place.unwrap()]
    };
    // A logarithm knows no 0.
    let larger = |share: Share| Share(share.0.saturating_add(share.0 / 32).max(1));
    assert_eq!(of(Quantity::Force).count(), 3 * dynamics::grid().len());
    for row in of(Quantity::Force) {
        assert_eq!(
            expected_error(&scene(row, 0), rung(row)),
            row.share(),
            "{row:?}"
        );
    }
    assert_eq!(
        of(Quantity::Change).count(),
        2 * replaced::rested_grid().len()
    );
    let is_own = |row: &&Row| {
        let burst_ms = row.burst_ms.unwrap();
        burst_ms == 1 || burst_ms > 1_000_000 / row.fastest_mhz.unwrap()
    };
    for row in of(Quantity::Change).filter(is_own) {
        let change = expected_change(&scene(row, 0), rung(row));
        assert_eq!(change, larger(row.share()), "{row:?}");
    }
    assert_eq!(
        of(Quantity::Tiring).count(),
        7 * replaced::work_grid().len()
    );
    let is_broken = |row: &&Row| row.burst_ms < Some(Scene::UNBROKEN);
    for row in of(Quantity::Tiring).filter(is_own).filter(is_broken) {
        let change = expected_change(&scene(row, row.session_s.unwrap()), rung(row));
        assert_eq!(change, larger(row.share()), "{row:?}");
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
    let committed = parse(COMMITTED).unwrap();
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
    let committed = parse(COMMITTED).unwrap();
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
    let committed = parse(COMMITTED).unwrap();
    for row in motion_rows_of(300).unwrap() {
        same(&committed, &row);
    }
    // The table has the worst subject: none may be worse, one must be that.
    let is_it = |row: &&Row| {
        let scene = [None, None, None, Some(40_000), Some(3)];
        row.key() == (Quantity::Fatigue, scene, "calcium-force")
    };
    let then = committed.iter().find(is_it).unwrap();
    let worst = SUBJECTS
        .iter()
        .map(|subject| fatigue::work(40_000, subject, 3).unwrap()[2][0].worst)
        .fold(0.0, f64::max);
    assert!(
        (worst * 100.0 - then.worst_pct).abs() <= 2e-4,
        "{worst} {then:?}"
    );
}
