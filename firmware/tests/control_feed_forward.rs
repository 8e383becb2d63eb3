//! Feed-forward from the nominal wearer's inverse, compared with the same model in floating point.

use firmware::control::{FeedForward, WearerModel};
use firmware::range::Range;
use firmware::units::{Angle, AngularRate};
use fixed::types::I16F16;
use proptest::prelude::*;

/// Finger of the earlier plant with two points (facts of this project; the torque of two points,
/// 0.484 N·m, is assumed there).
const FINGER: WearerModel = WearerModel {
    rest_mdeg: 5_000,
    stiffness_unm_per_rad: 120_000,
    damping_unm_s_per_rad: 18_000,
    flexion_unm: 484_000,
    extension_unm: 150_000,
    torque_loss_milli: 250,
    curvature_milli: 1_200,
    lead_ms: 100,
};

/// Solves the model of the docstring for the effort in floating point.
fn exact(m: &WearerModel, (low, high): (f64, f64), deg: f64, deg_per_s: f64) -> f64 {
    let micro = |v: u32| f64::from(v) * 1e-6;
    let milli = |v: u16| f64::from(v) * 1e-3;
    let angle = (deg + deg_per_s * milli(m.lead_ms)).clamp(-1024.0, 1024.0);
    let p = ((angle - low) / (high - low)).clamp(0.0, 1.0);
    let torque = micro(m.stiffness_unm_per_rad)
        * (angle - f64::from(m.rest_mdeg) * 1e-3).to_radians()
        + micro(m.damping_unm_s_per_rad) * deg_per_s.to_radians();
    let (full, loss) = if torque >= 0.0 {
        (micro(m.flexion_unm), milli(m.torque_loss_milli) * p)
    } else {
        (
            -micro(m.extension_unm),
            milli(m.torque_loss_milli) * (1.0 - p),
        )
    };
    let share = (torque / (full * (1.0 - loss))).min(1.0);
    let c = milli(m.curvature_milli);
    (share * c.exp_m1()).ln_1p() / c * torque.signum()
}

fn fixed(m: &WearerModel, range: (f64, f64), deg: f64, rate: f64) -> f64 {
    let mdeg = |deg: f64| (deg * 1e3) as i32;
    let inverse = FeedForward::new(m, mdeg(range.0), mdeg(range.1)).unwrap();
    let angle = Angle::new(I16F16::from_num(deg));
    inverse
        .effort(angle, AngularRate::new(I16F16::from_num(rate)))
        .to_num()
}

#[test]
fn it_is_the_models_inverse() {
    let mut worst = 0f64;
    for deg in 0..=1000 {
        for rate in [-300.0, -50.0, 0.0, 7.0, 50.0, 300.0] {
            let deg = f64::from(deg) * 0.1;
            let range = (0.0, 100.0);
            let off = fixed(&FINGER, range, deg, rate) - exact(&FINGER, range, deg, rate);
            worst = worst.max(off.abs());
        }
    }
    println!("feed-forward: worst error {worst:.2e} of full effort");
    assert!((2.5e-5..5e-5).contains(&worst), "{worst:e}");
}

#[test]
fn each_field_is_named() {
    type Change = fn(&mut WearerModel);
    #[rustfmt::skip]
    let cases: [(Range, i64, Change); 8] = [
        (WearerModel::REST_MDEG, 180_001, |m| m.rest_mdeg = 180_001),
        (WearerModel::STIFFNESS_UNM_PER_RAD, 50_000_001, |m| m.stiffness_unm_per_rad = 50_000_001),
        (WearerModel::DAMPING_UNM_S_PER_RAD, u32::MAX.into(), |m| m.damping_unm_s_per_rad = u32::MAX),
        (WearerModel::FLEXION_UNM, 0, |m| m.flexion_unm = 0),
        (WearerModel::EXTENSION_UNM, 999, |m| m.extension_unm = 999),
        (WearerModel::TORQUE_LOSS_MILLI, 901, |m| m.torque_loss_milli = 901),
        (WearerModel::CURVATURE_MILLI, 99, |m| m.curvature_milli = 99),
        (WearerModel::LEAD_MS, 501, |m| m.lead_ms = 501),
    ];
    for (range, value, change) in cases {
        let mut model = FINGER;
        change(&mut model);
        let refused = FeedForward::new(&model, 0, 100_000).err();
        assert_eq!(refused, range.check(value).err());
        assert!(refused.is_some());
    }
}

prop_compose! {
    fn models()(
        rest_mdeg in -180_000i32..=180_000,
        stiffness_unm_per_rad in 0u32..=50_000_000,
        damping_unm_s_per_rad in 0u32..=5_000_000,
        flexion_unm in 1_000u32..=200_000_000,
        extension_unm in 1_000u32..=200_000_000,
        torque_loss_milli in 0u16..=900,
        curvature_milli in 100u16..=11_000,
        lead_ms in 0u16..=500,
    ) -> WearerModel {
        WearerModel {
            rest_mdeg, stiffness_unm_per_rad, damping_unm_s_per_rad, flexion_unm, extension_unm,
            torque_loss_milli, curvature_milli, lead_ms,
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    /// No wearer and no angle cause a panic or an effort beyond ±1, and a larger angle gives more
    /// effort.
    #[test]
    fn any_wearer_any_target(model in models(), a: i32, b: i32, rate: i32, low in -180_000i32..179_999, span in 1i32..360_000) {
        let high = (low + span).min(180_000);
        let inverse = FeedForward::new(&model, low, high).unwrap();
        let effort = |bits| inverse.effort(Angle::new(I16F16::from_bits(bits)), AngularRate::new(I16F16::from_bits(rate)));
        let (near, far) = (effort(a.min(b)), effort(a.max(b)));
        prop_assert!((-1..=1).contains(&near) && (-1..=1).contains(&far));
        prop_assert!(near <= far, "{near} {far}");
    }
}
