//! Tests of every law with every add-on.

use methods::control::derivative::Differentiator;
use methods::control::parameters::parameters;
use methods::control::{
    AddOns, Controller, DelayCompensation, DerivativeKind, Form, Input, Law, ParameterError,
};
use methods::real::{Micro, Real};
use std::f64::consts::TAU;

/// Returns the middle of the bounds of every parameter.
fn middle<R: Real>(form: Form, add_ons: AddOns) -> Vec<R> {
    parameters(form, add_ons)
        .iter()
        .map(|p| {
            R::from_f64(if p.is_log {
                (p.low * p.high).sqrt()
            } else {
                0.5 * (p.low + p.high)
            })
        })
        .collect()
}

/// Drives a first-order joint along a sine for 20 s and returns the RMSE of the second half,
/// degrees.
fn tracked<R: Real>(form: Form, add_ons: AddOns) -> f64 {
    let h = 2e-3;
    let mut law =
        Controller::from_parameters(form, add_ons, R::from_f64(h), &middle(form, add_ons)).unwrap();
    let (mut angle, mut sum) = (0.1, 0.0);
    for i in 0..10_000 {
        let t = f64::from(i) * h;
        let (target, target_rate) = (
            0.8 + 0.5 * (TAU * 0.2 * t).sin(),
            0.5 * TAU * 0.2 * (TAU * 0.2 * t).cos(),
        );
        let effort = law.step(&Input {
            target: R::from_f64(target),
            target_rate: R::from_f64(target_rate),
            measured: R::from_f64(angle),
            feed_forward: R::from_f64(0.8 * target / 1.6),
        });
        let effort = effort.to_f64().clamp(-1.0, 1.0);
        angle += h * (1.6 * effort - angle) / 0.15;
        if i >= 5000 {
            sum += (target - angle).powi(2);
        }
    }
    (sum / 5000.0).sqrt().to_degrees()
}

#[test]
fn every_law_with_every_add_on_follows_a_simple_joint() {
    for form in Form::ALL {
        let mut worst = (0.0, AddOns::NONE);
        for add_ons in AddOns::all() {
            let rmse = tracked::<f64>(form, add_ons);
            assert!(rmse.is_finite());
            if rmse > worst.0 {
                worst = (rmse, add_ons);
            }
        }
        println!("{:20} worst {:5.2}° {:?}", form.name(), worst.0, worst.1);
        // The swing is 45°: a law with the wrong sign has an error of more than 40°.
        assert!(worst.0 < 12.0, "{form:?}");
    }
}

#[test]
fn single_precision_does_the_same() {
    for form in Form::ALL {
        let add_ons = AddOns {
            derivative: DerivativeKind::Pseudo,
            feed_forward: true,
            delay: DelayCompensation::None,
            adaptation: false,
        };
        let exact = tracked::<f64>(form, add_ons);
        let [single, micro] = [
            tracked::<f32>(form, add_ons),
            tracked::<Micro>(form, add_ons),
        ];
        println!("{:20} {exact:.4}° {single:.4}° {micro:.4}°", form.name());
        assert!((single - exact).abs() < 0.05 * exact + 0.01, "{form:?}");
        assert!((micro - exact).abs() < 0.2 * exact + 0.01, "{form:?}");
    }
}

#[test]
fn numbers_that_make_no_law_are_named() {
    let make = |values: &[f64]| {
        Controller::from_parameters(Form::Pid, AddOns::NONE, 0.01, values).map(|_| ())
    };
    assert_eq!(make(&[1.0, 2.0]), Err(ParameterError::Count { wanted: 4 }));
    let name = "ki_per_rad_s";
    for bad in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        let values = [1.0, bad, 0.1, 3.0];
        assert_eq!(make(&values), Err(ParameterError::Value { name }));
    }
    assert_eq!(make(&[1.0, 2.0, 0.1, 3.0]), Ok(()));
}

/// Returns the largest error of the rate, rad/s, over 2…4 s of a sine of 0.7 rad at 0.2 Hz with
/// additional `noise` (rad, alternating).
fn differentiated(mut d: Differentiator<f64>, h: f64, noise: f64) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..(4.0 / h) as u32 {
        let t = f64::from(i) * h;
        let side = if i % 2 == 0 { noise } else { -noise };
        let rate = d.step(0.7 * (TAU * 0.2 * t).sin() + side);
        if t > 2.0 {
            worst = worst.max((rate - 0.7 * TAU * 0.2 * (TAU * 0.2 * t).cos()).abs());
        }
    }
    worst
}

/// The robust exact differentiators are exact except for sampling; the pseudo-differentiator lags.
#[test]
fn robust_exact_differentiators_are() {
    for h in [1e-3, 2e-3, 11e-3] {
        let [pseudo, first, second] = [
            Differentiator::pseudo(6.0, h),
            Differentiator::robust_exact(5.0, h),
            Differentiator::robust_exact_second_order(10.0, h),
        ]
        .map(|d| [0.0, 0.005].map(|noise| differentiated(d, h, noise)));
        println!("h {h}: pseudo {pseudo:.4?}, 1st {first:.4?}, 2nd {second:.4?}");
        // The acceleration of the sine is at most 1.1 rad/s², and the delay half a period.
        assert!(
            first[0] < 1.2 * h && second[0] < 1.2 * h,
            "{first:?} {second:?}"
        );
        assert!(pseudo[0] > 0.02);
    }
}
