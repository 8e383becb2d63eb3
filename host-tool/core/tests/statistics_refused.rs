//! Samples that the statistics refuse with a named error, without NaN or panic.

use host_core::statistics::*;
use proptest::prelude::*;

const NAN: f64 = f64::NAN;

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the message of a call that must fail.
fn said<T: std::fmt::Debug>(result: Result<T, StatisticsError>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn too_few_are_refused_by_name() {
    let none: &[f64] = &[];
    assert_eq!(
        said(paired_t(&[1.0], &[2.0])),
        "pairs: 1 given, at least 2 needed"
    );
    assert_eq!(
        said(wilcoxon(none, none)),
        "pairs: 0 given, at least 1 needed"
    );
    assert_eq!(
        said(mann_whitney(&[1.0], none)),
        "second sample: 0 given, at least 1 needed"
    );
    assert_eq!(
        said(cohens_d_pooled(&[1.0], &[1.0, 2.0])),
        "first sample: 1 given, at least 2 needed"
    );
    assert_eq!(said(holm(none)), "p-values: 0 given, at least 1 needed");
    assert_eq!(said(friedman(&[])), "subjects: 0 given, at least 2 needed");
    assert_eq!(
        said(friedman(&[vec![1.0, 2.0], vec![2.0, 1.0]])),
        "conditions: 2 given, at least 3 needed"
    );
    assert_eq!(
        said(repeated_measures(&[vec![1.0, 2.0]])),
        "subjects: 1 given, at least 2 needed"
    );
    assert_eq!(
        said(repeated_measures(&[vec![], vec![]])),
        "conditions: 0 given, at least 2 needed"
    );
    let lone_subject = vec![vec![vec![1.0, 2.0], vec![3.0, 5.0]]];
    assert_eq!(
        said(two_way_repeated(&lone_subject)),
        "subjects: 1 given, at least 2 needed"
    );
    assert_eq!(
        said(two_way_repeated(&[])),
        "subjects: 0 given, at least 2 needed"
    );
    assert_eq!(
        said(two_way(&[])),
        "first factor: 0 given, at least 2 needed"
    );
    assert_eq!(
        said(two_way(&[vec![], vec![]])),
        "second factor: 0 given, at least 2 needed"
    );
    assert_eq!(
        said(wilson_share(0.0, 0, 0.95)),
        "trials: 0 given, at least 1 needed"
    );
    assert_eq!(
        said(kabsch(&[[0.0; 3]; 2], &[[0.0; 3]; 2])),
        "points: 2 given, at least 3 needed"
    );
    assert_eq!(
        said(bootstrap_bca(&[1.0], mean, 2000, 0.95, 1)),
        "sample: 1 given, at least 2 needed"
    );
    assert_eq!(
        said(bootstrap_bca(&[1.0, 2.0], mean, 0, 0.95, 1)),
        "resamples: 0 given, at least 100 needed"
    );
}

#[test]
fn unequal_lengths_are_refused_by_name() {
    assert_eq!(
        said(paired_t(&[1.0, 2.0], &[1.0])),
        "second values of the pairs: 1 given, 2 expected"
    );
    assert_eq!(
        said(wilcoxon(&[1.0], &[])),
        "second values of the pairs: 0 given, 1 expected"
    );
    assert_eq!(
        said(friedman(&[vec![1.0; 3], vec![1.0; 4]])),
        "conditions: 4 given, 3 expected"
    );
    let hole = [
        vec![vec![1.0, 2.0], vec![2.0]],
        vec![vec![1.0, 2.0], vec![3.0, 4.0]],
    ];
    assert_eq!(said(two_way(&hole)), "trials: 1 given, 2 expected");
    assert_eq!(
        said(two_way_repeated(&hole)),
        "second factor: 1 given, 2 expected"
    );
    assert_eq!(
        said(kabsch(&[[0.0; 3]; 3], &[[0.0; 3]; 4])),
        "second set of points: 4 given, 3 expected"
    );
}

#[test]
fn what_is_no_number_is_refused_with_its_place() {
    let place = "second values of the pairs: value 1 (counted from 0) is not finite or its \
                 magnitude exceeds 1e60";
    assert_eq!(said(paired_t(&[1.0, 2.0], &[1.0, NAN])), place);
    assert_eq!(said(wilcoxon(&[1.0, 2.0], &[1.0, 1e61])), place);
    assert_eq!(
        said(mann_whitney(&[NAN], &[1.0])),
        "samples: value 0 (counted from 0) is not finite or its magnitude exceeds 1e60"
    );
    assert_eq!(
        said(holm(&[0.5, NAN])),
        "p-values: value 1 (counted from 0) is not finite or its magnitude exceeds 1e60"
    );
    let rows = [vec![1.0, 2.0, 3.0], vec![2.0, NAN, 1.0]];
    assert_eq!(
        said(friedman(&rows)),
        "subjects: value 4 (counted from 0) is not finite or its magnitude exceeds 1e60"
    );
    assert_eq!(
        said(repeated_measures(&rows)),
        "subjects: value 4 (counted from 0) is not finite or its magnitude exceeds 1e60"
    );
    assert_eq!(
        said(student_t_p(NAN, 3.0)),
        "the statistic is outside [0, ∞)"
    );
    let nothing = |_: &[f64]| NAN;
    assert_eq!(
        said(bootstrap_bca(&[1.0, 2.0], nothing, 100, 0.95, 1)),
        "statistic: value 0 (counted from 0) is not finite or its magnitude exceeds 1e60"
    );
}

/// 0.3 − 0.1 and 0.2 differ by rounding only, which is no variance.
#[test]
fn what_does_not_vary_is_refused_by_name() {
    let (a, b) = ([0.3, 0.2, 7.3], [0.1, 0.0, 7.1]);
    assert_eq!(said(paired_t(&a, &b)), "differences do not vary");
    assert_eq!(said(cohens_d_paired(&a, &b)), "differences do not vary");
    assert_eq!(
        said(cohens_d_pooled(&[0.1; 3], &[0.2; 4])),
        "samples do not vary"
    );
    assert_eq!(said(wilcoxon(&a, &a)), "pairs do not vary");
    assert_eq!(
        said(mann_whitney(&[1.0; 3], &[1.0; 2])),
        "samples do not vary"
    );
    assert_eq!(
        said(friedman(&[vec![1.0; 3], vec![2.0; 3]])),
        "conditions do not vary"
    );
    let shifted = [vec![0.1, 0.3, 7.1], vec![0.2, 0.4, 7.2]];
    assert_eq!(
        said(repeated_measures(&shifted)),
        "differences between subjects do not vary"
    );
    let cells = [
        vec![vec![0.1; 2], vec![0.7; 2]],
        vec![vec![0.2; 2], vec![0.9; 2]],
    ];
    assert_eq!(said(two_way(&cells)), "trials do not vary");
    assert_eq!(
        said(two_way_repeated(&cells)),
        "differences between subjects do not vary"
    );
    assert_eq!(
        said(bootstrap_bca(&[0.1; 9], mean, 100, 0.95, 1)),
        "statistics of the jackknife samples do not vary"
    );
    let line = [[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [3.0, 6.0, 9.0]];
    assert_eq!(
        said(kabsch(&line, &line)),
        "the directions of the points do not vary"
    );
    assert_eq!(
        said(kabsch(&[[1.0; 3]; 4], &line)),
        "the directions of the points do not vary"
    );
}

#[test]
fn parameters_outside_their_range_are_refused_by_name() {
    assert_eq!(
        said(student_t_p(1.0, 0.0)),
        "the number of degrees of freedom is outside (0, 5000]"
    );
    assert_eq!(
        said(fisher_f_p(1.0, 2.0, 5001.0)),
        "the number of degrees of freedom is outside (0, 5000]"
    );
    assert_eq!(
        said(fisher_f_p(-1.0, 2.0, 3.0)),
        "the statistic is outside [0, ∞)"
    );
    assert_eq!(
        said(chi_squared_p(1.0, NAN)),
        "the number of degrees of freedom is outside (0, 5000]"
    );
    assert_eq!(said(holm(&[0.5, 1.1])), "a p-value is outside [0, 1]");
    for successes in [3.0, -0.5, NAN] {
        let refused = said(wilson_share(successes, 2, 0.95));
        assert_eq!(
            refused,
            "the number of successes is outside 0 to the number of trials"
        );
    }
    assert_eq!(
        said(wilson_share(1.0, 2, 1.0)),
        "the confidence level is outside (0, 1)"
    );
    assert_eq!(
        said(wilson_share(1.0, 2, NAN)),
        "the confidence level is outside (0, 1)"
    );
    let sample = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
    let least = |values: &[f64]| if values == sample { -1.0 } else { mean(values) };
    let found = bootstrap_bca(&sample, least, 100, 0.95, 2);
    assert!(said(found).starts_with("statistic is outside the range of its resamples"));
}

/// The same seed gives the same interval, another seed another one.
#[test]
fn a_bootstrap_is_a_function_of_its_seed() {
    let sample = [3.1, 2.7, 9.4, 4.4, 1.2, 5.0, 2.2];
    let interval = |seed| bootstrap_bca(&sample, mean, 500, 0.9, seed).unwrap();
    assert_eq!(interval(3), interval(3));
    assert_ne!(interval(3), interval(4));
}

fn values() -> impl Strategy<Value = Vec<f64>> {
    let value = prop_oneof![any::<f64>(), (-3i32..4).prop_map(f64::from), -1e3..1e3];
    prop::collection::vec(value, 0..12)
}

fn is_p(p: f64) -> bool {
    (0.0..=1.0).contains(&p)
}

proptest! {
    /// Any input gives either a p between 0 and 1 or an error.
    #[test]
    fn any_sample_has_a_p_or_is_refused(a in values(), b in values()) {
        let p = [
            paired_t(&a, &b).map(|found| found.p),
            wilcoxon(&a, &b).map(|found| found.p),
            mann_whitney(&a, &b).map(|found| found.p),
            friedman(&[a.clone(), b.clone()]).map(|found| found.p),
            repeated_measures(&[a.clone(), b.clone()]).map(|found| found.huynh_feldt.p),
            two_way(&[vec![a.clone(), b.clone()], vec![b.clone(), a.clone()]]).map(|found| found.first.p),
        ];
        for p in p.into_iter().flatten() {
            prop_assert!(is_p(p), "{p} {a:?} {b:?}");
        }
        for d in [cohens_d_paired(&a, &b), cohens_d_pooled(&a, &b)].into_iter().flatten() {
            prop_assert!(d.is_finite());
        }
        if let Ok(found) = bootstrap_bca(&a, mean, 100, 0.95, 1) {
            prop_assert!(found.low <= found.high);
        }
    }

    /// The alignment recovers a rotation and a shift; for a mirror image it still returns a proper
    /// rotation.
    #[test]
    fn an_alignment_is_a_proper_rotation(flat in prop::collection::vec(-10.0..10.0, 12), mirror: bool) {
        let points: Vec<[f64; 3]> = flat.chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
        let sign = if mirror { -1.0 } else { 1.0 };
        let turn = |p: &[f64; 3]| [-p[1] + 4.0, p[0] - 2.0, sign * p[2] + 1.0];
        let turned: Vec<[f64; 3]> = points.iter().map(turn).collect();
        let found = kabsch(&points, &turned);
        if let Ok(Alignment { rotation: [a, b, c], rmsd, .. }) = found {
            let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
            let determinant = a[0] * minor(1, 2) - a[1] * minor(0, 2) + a[2] * minor(0, 1);
            prop_assert!((determinant - 1.0).abs() < 1e-9);
            prop_assert!(mirror || rmsd < 1e-9);
        }
    }
}
