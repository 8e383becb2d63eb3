//! Each model level against the same equations in f64.

use super::twins::{self, Fatigue, FatigueMode, Pulse};
use super::{error_pct, ladder, modulated, peak, rms_pct, run, spec, subjects, train};
use firmware::muscle::{FatigueSpec, MuscleLevel};

/// Returns test cases: name, pulses, length in ms.
fn scenes() -> Vec<(&'static str, Vec<Pulse>, u64)> {
    let gains = |pulses: Vec<Pulse>| {
        let gain = |i: usize| 0.2 + 0.8 * (i as f64 * 0.7).sin().abs();
        (0..)
            .zip(pulses)
            .map(|(i, (at, _))| (at, gain(i)))
            .collect()
    };
    let twice = |pulses: Vec<Pulse>| {
        pulses
            .iter()
            .flat_map(|&(at, g)| [(at, g), (at + 6_000, g)])
            .collect()
    };
    vec![
        ("one pulse", vec![(337, 1.0)], 600),
        ("10 Hz", train(10.0, 0, 1000), 1600),
        ("20 Hz", train(20.0, 0, 1000), 1600),
        ("40 Hz", train(40.0, 0, 1000), 1600),
        ("100 Hz", train(100.0, 0, 1000), 1600),
        ("200 Hz", train(200.0, 0, 500), 1200),
        ("100 ms at 40 Hz", train(40.0, 0, 100), 700),
        ("300 ms at 40 Hz", train(40.0, 0, 300), 900),
        ("20-50 Hz at 0.5 Hz", modulated(20.0, 50.0, 0.5, 4000), 4600),
        ("10-50 Hz at 0.5 Hz", modulated(10.0, 50.0, 0.5, 4000), 4600),
        ("40 Hz, gains", gains(train(40.0, 0, 1000)), 1600),
        ("15 Hz doublets", twice(train(15.0, 0, 1000)), 1600),
    ]
}

/// Prints and bounds the errors of the calcium–force level in every case: rms, worst and of the
/// peak.
#[test]
fn calcium_force_is_its_equations() {
    println!("worst of ten subjects, % of peak: rms / worst / peak's error");
    for (name, pulses, ms) in scenes() {
        let (mut rms, mut worst, mut top) = (0f64, 0f64, 0f64);
        for (_, m) in subjects() {
            let (truth, _) = twins::tiring(&m, FatigueMode::Never, &pulses, ms);
            let model = run(
                &ladder(&m, MuscleLevel::CalciumForce),
                &pulses,
                ms,
                |_, _| (),
            );
            rms = rms.max(rms_pct(&truth, &model));
            worst = worst.max(error_pct(&truth, &model));
            top = top.max((peak(&model) / peak(&truth) - 1.0).abs() * 100.0);
        }
        println!("{name:20} {rms:7.3} {worst:7.3} {top:7.3}");
        assert!(rms <= 0.012 && top <= 0.012, "{name}");
    }
}

/// A minute of 1 s on and 1 s off, a minute of rest, 1 s on.
#[test]
fn fatigue_is_its_equations() {
    let mut worst = [0f64; 3];
    for (name, m) in subjects() {
        let f = FatigueSpec::scaled_to(spec(&m).a_mn_per_s);
        let fatigue = Fatigue {
            alpha_a: f64::from(f.alpha_a_milli_per_s2) * 1e-3,
            alpha_k: f64::from(f.alpha_k_nano_per_n_s) * 1e-9,
            alpha_tau1: f64::from(f.alpha_tau1_nano_per_n) * 1e-9,
            tau_fat: f64::from(f.tau_fat_ms) * 1e-3,
        };
        let bouts = (0..30).map(|i| 2000 * i).chain([120_000]);
        let pulses: Vec<Pulse> = bouts.flat_map(|ms| train(40.0, ms, ms + 1000)).collect();
        let ms = 122_000;
        let (twin, left) = twins::tiring(&m, FatigueMode::EverySecond(fatigue), &pulses, ms);
        let (truth, truly_left) = twins::tiring(&m, FatigueMode::Always(fatigue), &pulses, ms);
        let (fresh, _) = twins::tiring(&m, FatigueMode::Never, &pulses, ms);
        let mut strength = 1.0;
        let model = run(
            &ladder(&m, MuscleLevel::CalciumForceFatigue),
            &pulses,
            ms,
            |_, s| {
                strength = s.strength().to_num();
            },
        );
        let errors = [
            error_pct(&twin, &model),
            error_pct(&truth, &model),
            (strength - left).abs() * 100.0,
        ];
        let late = 58_000..60_000;
        println!(
            "{name}: {:.4} % of peak off the twin, {:.2} % off continuous fatigue; A/A₀ in the end \
             {strength:.5} ({left:.5}, {truly_left:.5}); after a minute force peaks at {:.0} % of fresh",
            errors[0],
            errors[1],
            peak(&truth[late.clone()]) / peak(&fresh[late]) * 100.0,
        );
        worst = std::array::from_fn(|i| worst[i].max(errors[i]));
    }
    println!("worst: {worst:.4?} %");
    assert!(worst[0] < 0.03, "fixed point: {worst:?}");
    assert!(worst[1] < 3.0, "one update a second: {worst:?}");
    assert!(worst[2] < 0.01, "A/A₀: {worst:?}");
}
