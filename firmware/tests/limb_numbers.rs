//! Errors of the device's sine, cosine and square root, bounded from both sides.

use firmware::limb::{Number, TURN_ERROR};

/// Checks over three turns the angle that sine and cosine represent, and that they lie on the unit
/// circle.
#[test]
fn an_angle_is_turned_within_its_bound() {
    let (mut worst, mut at, mut off) = (0.0_f64, 0.0_f32, 0.0_f64);
    for step in -300_000..=300_000 {
        let x = step as f32 * 3.141_592_7e-5;
        let (sine, cosine) = x.sine_and_cosine();
        let (sine, cosine) = (f64::from(sine), f64::from(cosine));
        let (s, c) = f64::from(x).sin_cos();
        // The error is the sine of the difference of the angles, at most 1e-3.
        let error = (sine * c - cosine * s).abs();
        if error > worst {
            (worst, at) = (error, x);
        }
        off = off.max((sine.hypot(cosine) - 1.0).abs());
    }
    println!("worst angle {worst:.3e} rad at {at}, off the circle {off:.1e}");
    let bound = f64::from(TURN_ERROR);
    assert!((0.9 * bound..bound).contains(&worst), "{worst} at {at}");
    assert!(off < 4e-7, "{off}");
}

#[test]
fn the_inverse_root_is_single_precision_s() {
    let mut worst = 0.0_f64;
    for step in 0..200_000 {
        let x = 10f32.powf(step as f32 * 8e-5 - 12.0);
        let exact = 1.0 / f64::from(x).sqrt();
        worst = worst.max((f64::from(x.inverse_root()) / exact - 1.0).abs());
    }
    println!("worst relative error of 1/√x: {worst:.2e}");
    assert!((1e-8..3e-7).contains(&worst), "{worst}");
    assert!(0.0_f32.inverse_root().is_finite());
}

#[test]
fn whole_numbers_saturate() {
    let given = [2.4_f32, 2.5, -1.0, 1e12, f32::NAN];
    assert_eq!(given.map(Number::to_nearest), [2, 3, 0, u32::MAX, 0]);
}
