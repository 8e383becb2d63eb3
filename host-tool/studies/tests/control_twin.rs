//! Compares the default controller with its twin in f64, in closed loop.

use firmware::control::JointSpec;
use methods::control::parameters::parameters;
use methods::control::{AddOns, Controller, DelayCompensation, DerivativeKind, Form, Parameter};
use studies::tracking::candidate::numbers_of;
use studies::tracking::driver::{Device, Floating};
use studies::tracking::plant::Plant;
use studies::tracking::reach::Reachable;
use studies::tracking::target::Course;
use studies::tracking::trial::{TRIAL_MS, rmse, run};
use studies::tracking::wearer::{KnownWearer, Points, shipped};

/// Seed that no search and no chart uses.
const SEED: u64 = 0x7715;
const PLANTS: u64 = 24;

/// Returns the same law with the same parameters, from `methods`.
fn twin(spec: &JointSpec) -> Controller<f64> {
    let known = numbers_of(spec);
    // The twin's b is constant.
    assert!(known.contains(&("b_rad_per_s2", 100.0)));
    let add_ons = AddOns {
        derivative: DerivativeKind::PseudoOfError,
        feed_forward: true,
        delay: DelayCompensation::Smith,
        adaptation: true,
    };
    let form = Form::TwistingWithLinear;
    let number = |p: &Parameter| known.iter().find(|(name, _)| *name == p.name).unwrap().1;
    let values: Vec<f64> = parameters(form, add_ons).iter().map(number).collect();
    let h = f64::from(spec.law_period_ms) * 1e-3;
    Controller::from_parameters(form, add_ons, h, &values).unwrap()
}

#[test]
fn fixed_point_follows_within_one_per_cent_of_f64() {
    let wanted = Course::Sine.angles(TRIAL_MS);
    for points in Points::ALL {
        let spec = shipped(points);
        let (mut sums, mut widest) = ([0.0; 2], 0.0_f64);
        for index in 0..PLANTS {
            let plant = Plant::random(SEED, index);
            let target = Reachable::new(&plant, points, &wanted).unwrap().angles;
            let mut device = Device::new(&spec).unwrap();
            let period_ms = u32::from(spec.law_period_ms);
            let mut float = Floating::new(
                twin(&spec),
                period_ms,
                spec.hold,
                &KnownWearer::nominal(points),
            )
            .unwrap();
            let fixed = rmse(&run(&plant, &mut device, &wanted).unwrap().angles, &target);
            let exact = rmse(&run(&plant, &mut float, &wanted).unwrap().angles, &target);
            widest = widest.max((fixed / exact - 1.0).abs());
            sums[0] += fixed;
            sums[1] += exact;
        }
        let [fixed, exact] = sums.map(|s| s / PLANTS as f64);
        println!(
            "{}: {PLANTS} plants, fixed {fixed:.4}°, f64 {exact:.4}°, mean apart {:.3} %, \
             widest pair {:.3} %",
            points.name(),
            100.0 * (fixed / exact - 1.0).abs(),
            100.0 * widest
        );
        assert!((fixed / exact - 1.0).abs() < 0.01);
    }
}

/// The gains are in SI units, and the law's coefficients follow from the period. At 11 ms an effort
/// is held 4.5 ms longer on average; a tolerance of a tenth covers that.
#[test]
fn another_period_is_as_good() {
    let wanted = Course::Sine.angles(TRIAL_MS);
    for points in Points::ALL {
        let means = [2, 5, 11].map(|law_period_ms| {
            let spec = JointSpec {
                law_period_ms,
                ..shipped(points)
            };
            let sum: f64 = (0..PLANTS)
                .map(|index| {
                    let plant = Plant::random(SEED, index);
                    let target = Reachable::new(&plant, points, &wanted).unwrap().angles;
                    let mut device = Device::new(&spec).unwrap();
                    rmse(&run(&plant, &mut device, &wanted).unwrap().angles, &target)
                })
                .sum();
            sum / PLANTS as f64
        });
        let [at_2, at_5, at_11] = means;
        println!(
            "{}: {at_2:.3}° at 2 ms, {at_5:.3}° at 5 ms, {at_11:.3}° at 11 ms",
            points.name()
        );
        assert!(at_5 < 1.1 * at_2 && at_11 < 1.1 * at_2, "{means:?}");
    }
}
