//! The choice of a muscle model on scenes that nobody measured, in closed loop.
//!
//! `cargo test --release -p host-tool --test ladder_adequacy -- --nocapture`
//! prints every scene that breaks a half of the promise.

use firmware::muscle::Rung;
use firmware::muscle::choice::{Share, choose, grid};
use host_tool::ladder::adequacy::{Summary, campaign, held_out};

/// Another seed than the committed table's.
const SEED: u64 = 20;
const PER_RUNG: usize = 6;
const TOLERANCE: Share = Share::JUST_NOTICEABLE;

#[test]
fn the_chosen_rung_is_sufficient_where_nobody_measured() {
    let verdicts = campaign(SEED, PER_RUNG, TOLERANCE, |_| ()).unwrap();
    assert_eq!(verdicts.len(), 4 * PER_RUNG);
    for v in &verdicts {
        let lower = v.lower.map_or(f64::NAN, |l| l.force * 100.0);
        println!(
            "{:?} for {:?}: expects {}, has {:.2} %, changes force by {:.2} %, next lower by {lower:.2} %",
            v.choice.rung,
            v.scene,
            v.choice.error,
            v.found * 100.0,
            v.chosen.force * 100.0,
        );
    }
    let sum = Summary::of(&verdicts, TOLERANCE);
    println!("{sum:?}");
    // The first half of the promise, for every scene.
    assert_eq!(sum.sufficient, sum.scenes, "{sum:?}");
    // The expected error is the grid's; between its points a scene may exceed it
    // a little, but not the tolerance.
    assert!(verdicts.iter().all(|v| v.found <= 0.1), "{sum:?}");
    // The second half does not hold for every scene, and it is no use to say
    // so: docs/muscle.md tells the shares and why. Here only that a lower rung
    // does fail by a tolerance's worth in a good part of them.
    assert!(sum.lower_fails * 4 >= sum.with_lower, "{sum:?}");
    let failing = |rung: Rung| {
        let of_rung = verdicts.iter().filter(move |v| v.choice.rung == rung);
        of_rung
            .filter(|v| v.lower.is_some_and(|l| l.force >= 0.1))
            .count()
    };
    for rung in [Rung::Lag, Rung::CalciumForce, Rung::CalciumForceFatigue] {
        assert!(failing(rung) > 0, "{rung:?} is never needed: {sum:?}");
    }
}

#[test]
fn held_out_scenes_are_off_the_grid() {
    for index in 0..500 {
        let scene = held_out(SEED, index);
        assert!(!grid::RATES_MHZ.contains(&scene.slowest_mhz), "{scene:?}");
        assert!(choose(&scene, TOLERANCE).is_ok(), "{scene:?}");
    }
}

#[test]
fn a_tolerance_that_no_rung_meets_names_the_least_possible() {
    let scene = held_out(SEED, 1);
    let none = choose(&scene, Share(1)).unwrap_err();
    assert!(scene.session_s > 0 && none.least > Share(1), "{none:?}");
    let text = none.to_string();
    assert!(
        text.contains("0.01 %") && text.contains(&none.least.to_string()),
        "{text}"
    );
    assert_eq!(choose(&scene, none.least).unwrap().rung, none.best);
}
