//! Tests of which electrodes serve a requested force: sets of electrodes against another method.

use nalgebra::Vector3;
use studies::sierotowicz2023::electrodes::{
    DECLARED, RunInfo, SETS, Study, Wearer, best, directions, missed_forces, outcome, squares,
};

/// Computes the smallest error in another way, by coordinate descent.
fn by_search(forces: &[Vector3<f64>], wanted: Vector3<f64>) -> f64 {
    let mut parts = vec![0.5; forces.len()];
    let off = |parts: &[f64]| {
        let given: Vector3<f64> = forces.iter().zip(parts).map(|(f, u)| f * *u).sum();
        (given - wanted).norm()
    };
    // Optimizes one part after the other (the squared error is convex, so this converges to the
    // minimum).
    for _ in 0..20_000 {
        for at in 0..parts.len() {
            parts[at] = 0.0;
            let given: Vector3<f64> = forces.iter().zip(&parts).map(|(f, u)| f * *u).sum();
            let best = forces[at].dot(&(wanted - given)) / forces[at].norm_squared();
            parts[at] = best.clamp(0.0, 1.0);
        }
    }
    off(&parts) / wanted.norm()
}

#[test]
fn sets_miss_what_a_search_misses() {
    let wearer = Wearer::random(5, 0).unwrap();
    for (number, direction) in directions().into_iter().enumerate().step_by(5) {
        for size in [2.0, 20.0] {
            let wanted = size * direction;
            let parts = squares(&wearer.forces_n, wanted).unwrap();
            assert_eq!(parts.len(), SETS);
            assert!((parts[0] - 1.0).abs() < 1e-6);
            for set in (1..SETS).step_by(97) {
                let own: Vec<_> = (0..10).filter(|at| set >> at & 1 == 1).collect();
                let forces: Vec<_> = own.iter().map(|at| wearer.forces_n[*at]).collect();
                let (ours, theirs) = (f64::from(parts[set]), by_search(&forces, wanted));
                assert!(
                    (ours - theirs).abs() < 2e-3,
                    "{number} {set}: {ours} {theirs}"
                );
                // An additional electrode never increases the error.
                for at in 0..10 {
                    assert!(parts[set | 1 << at] <= parts[set] + 1e-4);
                }
            }
        }
    }
}

#[test]
fn the_best_set_is_the_best_of_its_size() {
    let mut parts = vec![1.0; SETS];
    (parts[0b101], parts[0b111], parts[0b1_0000]) = (0.3, 0.1, 0.9);
    assert_eq!(
        [1, 2, 3].map(|count| best(&parts, count)),
        [0b1_0000, 0b101, 0b111]
    );
}

#[test]
fn the_declaration_of_electrodes_tells_all_that_is_wrong() {
    let text = DECLARED
        .replace("made = 0.1", "made = 1.1")
        .replace("shown = 4", "shown = 10")
        .replace("sizes_n = [2.0, 5.0]", "sizes_n = [0]");
    let error = Study::parse(&text).unwrap_err().to_string();
    for said in ["E732", "judged.made", "judged.shown", "wanted.sizes_n"] {
        assert!(error.contains(said), "{error}");
    }
}

/// A short run is complete and repeatable; with all ten electrodes nothing is left to choose.
#[test]
fn a_short_choice_of_electrodes_is_whole() {
    let mut study = Study::load_embedded().unwrap();
    study.wanted.sizes_n = vec![3.0];
    let run = || {
        let all: Vec<_> = (0..2)
            .map(|index| missed_forces(&study, &Wearer::random(3, index).unwrap()).unwrap())
            .collect();
        let told = RunInfo {
            seed: 3,
            draws: 2,
            cut_short: None,
        };
        outcome(&study, &all, told)
    };
    let first = run();
    assert_eq!(first, run());
    for method in ["squares", "nearest"] {
        let of = |id: &str| {
            let id = format!("{method}/{id}");
            first
                .rows
                .iter()
                .find(|row| row.id == id)
                .unwrap()
                .ours
                .unwrap()
        };
        assert_eq!(of("10/another"), 100.0);
        assert_eq!(of("10/another-set"), 0.0);
        assert!(of("1/missed") >= of("4/missed") && of("4/made") >= of("1/made"));
    }
    assert_eq!(first.sheets.len(), 5);
    assert!(!first.declared.as_declared);
}
