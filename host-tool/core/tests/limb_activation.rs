//! Static optimisation compared with an enumeration of all active sets, and fits of quartics.

use hal_sim::random::Random;
use host_core::limb::{Muscles, Quartic};
use nalgebra::{Matrix2, Vector2};

/// Activation of a muscle relative to its bounds.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Least,
    Free,
    Most,
}

/// Returns the best of all 3ⁿ assignments of muscles to a bound or between the bounds: an
/// independent algorithm, exact for non-degenerate problems.
fn by_enumeration(muscles: &Muscles<2>, wanted: Vector2<f64>) -> Option<Vec<f64>> {
    let n = muscles.full_nm.len();
    let mut best: Option<(f64, Vec<f64>)> = None;
    for number in 0..3_usize.pow(n as u32) {
        let place = |at: usize| match number / 3_usize.pow(at as u32) % 3 {
            0 => Place::Least,
            1 => Place::Free,
            _ => Place::Most,
        };
        let row = |at: usize| Vector2::from(muscles.full_nm[at]);
        let (mut left, mut square) = (wanted, Matrix2::zeros());
        for at in 0..n {
            match place(at) {
                Place::Least => left -= row(at) * muscles.least[at],
                Place::Most => left -= row(at),
                Place::Free => square += row(at) * row(at).transpose(),
            }
        }
        let Some(inverse) = square.try_inverse() else {
            continue;
        };
        let dual = inverse * left;
        let value = |at: usize| match place(at) {
            Place::Least => muscles.least[at],
            Place::Most => 1.0,
            Place::Free => row(at).dot(&dual),
        };
        let activations: Vec<f64> = (0..n).map(value).collect();
        let within = |(k, least): (&f64, &f64)| (*least - 1e-12..=1.0 + 1e-12).contains(k);
        // A single free muscle cannot produce both wanted torques, whatever rounding leaves of its
        // square.
        let given: Vector2<f64> = (0..n).map(|at| row(at) * activations[at]).sum();
        let gives = (given - wanted).norm() < 1e-9;
        if gives && activations.iter().zip(&muscles.least).all(within) {
            let cost: f64 = activations.iter().map(|k| k * k).sum();
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, activations));
            }
        }
    }
    best.map(|(_, solution)| solution)
}

/// Two hundred arms with seven muscles, with and without minimum activations.
#[test]
fn the_least_activations_are_those_of_the_best_active_set() {
    let mut random = Random::new(11);
    let (mut worst, mut refused, mut bounded) = (0.0_f64, 0, 0);
    for _ in 0..200 {
        let mut row = || [random.between(-20.0, 30.0), random.between(-30.0, 40.0)];
        let full_nm: Vec<[f64; 2]> = (0..7).map(|_| row()).collect();
        let least = (0..7).map(|_| random.between(0.0, 0.1)).collect();
        let wanted = [random.between(-40.0, 90.0), random.between(-40.0, 90.0)];
        let muscles = Muscles { full_nm, least };
        let found = muscles.activations(wanted);
        match (by_enumeration(&muscles, wanted.into()), found) {
            (Some(best), Ok(found)) => {
                bounded += usize::from(found.iter().any(|value| *value >= 1.0));
                for (a, b) in best.iter().zip(&found) {
                    worst = worst.max((a - b).abs());
                }
            }
            (None, Err(_)) => refused += 1,
            (best, found) => panic!("{muscles:?} {wanted:?}: {best:?}, {found:?}"),
        }
    }
    println!("farthest apart {worst:e}; {bounded} at full activation, {refused} out of reach");
    assert!(worst < 1e-6, "{worst}");
    assert!(bounded > 20 && refused > 5, "{bounded} {refused}");
}

/// Calculated by hand: two flexors of 10 and 20 N·m and an extensor of 10 N·m. For 6 N·m the
/// activations are 0.12 and 0.24; if the extensor has at least 0.1, the flexors must produce 7 N·m.
#[test]
fn a_joint_by_hand() {
    let muscles = |least: f64| Muscles {
        full_nm: vec![[10.0], [20.0], [-10.0]],
        least: vec![0.0, 0.0, least],
    };
    let close = |found: Vec<f64>, meant: [f64; 3]| {
        for (a, b) in found.iter().zip(meant) {
            assert!((a - b).abs() < 1e-9, "{found:?} {meant:?}");
        }
    };
    close(muscles(0.0).activations([6.0]).unwrap(), [0.12, 0.24, 0.0]);
    close(muscles(0.1).activations([6.0]).unwrap(), [0.14, 0.28, 0.1]);
    let refused = muscles(0.0).activations([31.0]).unwrap_err();
    assert!(refused.to_string().starts_with("E761"), "{refused}");
    // All agonists together have the activation 6 / 30, and the antagonist half of that.
    let result = muscles(0.0).with_co_contraction(0.5, [6.0]);
    assert!((result.least[2] - 0.1).abs() < 1e-12 && result.least[0] == 0.0);
}

#[test]
fn a_quartic_is_found_again_and_tells_what_is_left() {
    let true_at = |deg: f64| 0.3 + 2e-3 * deg - 4e-5 * deg * deg + 1e-9 * deg.powi(4);
    let points: Vec<(f64, f64)> = (30..=90)
        .map(|n| (f64::from(n), true_at(f64::from(n))))
        .collect();
    let found = Quartic::fit(&points).unwrap();
    assert!(found.most < 1e-12, "{found:?}");
    let [a0, a1, a2, a3, a4] = found.degree_coefficients();
    for (a, b) in [(a0, 0.3), (a1, 2e-3), (a2, -4e-5), (a3, 0.0), (a4, 1e-9)] {
        assert!((a - b).abs() < 1e-9 * b.abs().max(1e-3), "{a} {b}");
    }
    let mut bent = points;
    bent[30].1 += 0.1;
    let found = Quartic::fit(&bent).unwrap();
    assert!(found.most > 0.08 && found.rms < 0.02, "{found:?}");
    assert!(Quartic::fit(&bent[..4]).is_err());
    assert!(Quartic::fit(&[(1.0, 0.0); 9]).is_err());
}
