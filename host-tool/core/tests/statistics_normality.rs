//! The Shapiro–Wilk and Mauchly tests and the Bonferroni correction compared with SciPy and
//! pingouin (`tests/golden/make_normality.py`).

use host_core::statistics::{StatisticsError, bonferroni, mauchly, shapiro_wilk};
use serde_json::{Value, from_value};

const GOLDEN: &str = include_str!("../../../tests/golden/normality.json");
/// Largest relative difference for results with full precision.
const TOLERANCE: f64 = 1e-10;
/// Largest relative difference for W and p of SciPy, whose normal quantiles have seven digits.
const SEVEN_DIGITS: f64 = 2e-6;

fn given<T: serde::de::DeserializeOwned>(case: &Value) -> T {
    from_value(case["given"].clone()).unwrap()
}

#[test]
fn they_agree_with_scipy_and_pingouin() {
    let cases: Vec<Value> = serde_json::from_str(GOLDEN).unwrap();
    let mut worst = [0.0_f64; 3];
    for case in &cases {
        let expected = |name: &str| case["expected"][name].as_f64().unwrap();
        let apart = |found: f64, name: &str| (found - expected(name)).abs() / expected(name);
        match case["function"].as_str().unwrap() {
            "shapiro_wilk" => {
                let found = shapiro_wilk(&given::<Vec<f64>>(case)).unwrap();
                // Far in the tail, p is a power of the error of W.
                let p = match expected("p") > 1e-6 {
                    true => apart(found.p, "p"),
                    false => (found.p.ln() / expected("p").ln() - 1.0).abs(),
                };
                worst[0] = worst[0].max(apart(found.w, "w")).max(p);
            }
            "mauchly" => {
                let found = mauchly(&given::<Vec<Vec<f64>>>(case)).unwrap();
                let numbers = [
                    (found.w, "w"),
                    (found.chi_squared, "chi_squared"),
                    (found.df as f64, "df"),
                    (found.p, "p"),
                ];
                for (found, name) in numbers {
                    worst[1] = worst[1].max(apart(found, name));
                }
            }
            "bonferroni" => {
                let found = bonferroni(&given::<Vec<f64>>(case)).unwrap();
                let expected: Vec<f64> = from_value(case["expected"]["adjusted"].clone()).unwrap();
                assert_eq!(found.len(), expected.len());
                for (found, expected) in found.iter().zip(expected) {
                    worst[2] = worst[2].max((found - expected).abs());
                }
            }
            other => panic!("{other} is not called here"),
        }
    }
    println!("Shapiro-Wilk, Mauchly, Bonferroni: {worst:?}");
    assert_eq!(cases.len(), 28);
    assert!(worst[0] < SEVEN_DIGITS, "{worst:?}");
    assert!(worst[1].max(worst[2]) < TOLERANCE, "{worst:?}");
}

#[test]
fn what_is_no_sample_is_refused() {
    let too_few =
        |result: Result<_, StatisticsError>| matches!(result, Err(StatisticsError::TooFew { .. }));
    assert!(too_few(shapiro_wilk(&[1.0, 2.0]).map(drop)));
    assert!(too_few(
        mauchly(&[vec![1.0, 2.0], vec![2.0, 1.0]]).map(drop)
    ));
    assert!(too_few(bonferroni(&[]).map(drop)));
    let same = shapiro_wilk(&[2.0; 5]).unwrap_err();
    assert!(matches!(same, StatisticsError::NoVariance { .. }), "{same}");
    let many = shapiro_wilk(&vec![1.0; 5001]).unwrap_err();
    assert!(matches!(many, StatisticsError::OutOfRange { .. }), "{many}");
    let beyond = bonferroni(&[1.5]).unwrap_err();
    assert!(
        matches!(beyond, StatisticsError::OutOfRange { .. }),
        "{beyond}"
    );
}
