//! The comparison of recruitments: what is committed is what comes out.

use std::path::Path;
use studies::limb::{Declared, Method, pace, study};

#[test]
fn the_committed_table_is_that_of_the_code_and_every_claim_is_judged() {
    let found = study(None).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/charts/limb.csv");
    let committed = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        committed == found.csv(),
        "docs/charts/limb.csv is stale: renew it with\n  flexor chart limb\n{}",
        found.csv()
    );
    let verdicts = found.verdicts();
    // On arms as drawn, and with lines over one joint each.
    assert_eq!(verdicts.len(), 2 * found.declared.claim.len());
    assert!(
        verdicts
            .iter()
            .all(|verdict| verdict.of == found.declared.arms.draws)
    );
}

/// Other arms for other seeds, the same for the same; a method misses nothing less than
/// it should: no force has no error to boast of.
#[test]
fn arms_differ_and_repeat() {
    let [few, again] = [study(Some(3)).unwrap(), study(Some(3)).unwrap()];
    assert_eq!(few.csv(), again.csv());
    let declared = Declared::read().unwrap();
    assert_eq!(few.declared.seed, declared.seed);
    for (n, method) in Method::ALL.into_iter().enumerate() {
        let missed: Vec<f64> = few
            .arms
            .iter()
            .map(|arm| arm[n].targets_rmse_percent)
            .collect();
        assert!(
            missed.windows(2).all(|pair| pair[0] != pair[1]),
            "{method:?}"
        );
        // Resting all the time misses 100 %: least squares never do worse.
        let most = if method == Method::Nearest {
            1000.0
        } else {
            100.0
        };
        assert!(
            missed.iter().all(|missed| (0.1..most).contains(missed)),
            "{missed:?}"
        );
    }
}

/// 50 µs are allowed a release build; this one may be slower.
#[test]
fn a_recruitment_takes_microseconds() {
    let pace = pace().unwrap();
    println!("{pace:?}");
    assert!(pace.n > 1000 && pace.least_squares_us < pace.with_posture_us);
    assert!(pace.least_squares_us < 500.0, "{pace:?}");
}
