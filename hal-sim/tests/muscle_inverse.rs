//! The firmware's inverse muscle model on the simulator's own muscles, which
//! share no code with it.
//!
//! `cargo test -p hal-sim --test suite muscle_inverse -- --nocapture`
//! prints the errors: steady force of ten subjects, and force that changes.

use firmware::muscle::{CalciumForceSpec, Inverse, Recruitment, RecruitmentSpec};
use firmware::units::{Amplitude, Force};
use fixed::types::I16F16;
use hal_sim::body::muscle::reference::integrate;
use hal_sim::body::muscle::{Parameters, SUBJECTS};

/// 10–20 mA; force at threshold is e^−3, 5 %, of that at the limit.
const RECRUITMENT: RecruitmentSpec = RecruitmentSpec {
    motor_threshold: Amplitude(10_000),
    limit: Amplitude(20_000),
    reference: Amplitude(20_000),
    slope_micro: 300_000,
};

/// Equation 6 in floating point.
fn gain(amplitude: Amplitude) -> f64 {
    (0.3e-3 * (f64::from(amplitude.0) - 20_000.0)).exp()
}

fn spec(p: &Parameters) -> CalciumForceSpec {
    let whole = |value: f64| value.round() as u32;
    CalciumForceSpec {
        a_mn_per_s: whole(p.a_n_per_s * 1e3),
        k_micro: whole(p.k * 1e6),
        tau_c_us: whole(p.tau_c_s * 1e6),
        tau1_us: whole(p.tau1_s * 1e6),
        tau2_us: whole(p.tau2_s * 1e6),
    }
}

/// Mean force over a period once a train has settled, N.
fn settled(p: &Parameters, period_s: f64) -> f64 {
    let periods = (12.0 * (p.tau_c_s + p.tau1_s + p.tau2_s) / period_s).ceil();
    let pulses: Vec<f64> = (0..=periods as u32)
        .map(|i| f64::from(i) * period_s)
        .collect();
    let steps = 50;
    let end = (periods + 1.0) * period_s;
    let samples = integrate(p, &pulses, end, period_s / f64::from(steps));
    let last = &samples[samples.len() - 1 - steps as usize..];
    let sum: f64 = last
        .windows(2)
        .map(|w| 0.5 * (w[0].force_n + w[1].force_n))
        .sum();
    sum / f64::from(steps)
}

#[test]
fn ten_subjects_settle_at_the_force_wanted() {
    let recruitment = Recruitment::new(RECRUITMENT).unwrap();
    for (slowest, fastest, bound) in [(50_000, 16_667, 6e-4), (100_000, 10_000, 1e-2)] {
        let mut worst = 0f64;
        for (number, p) in (1..).zip(&SUBJECTS) {
            let inverse = Inverse::new(spec(p), &recruitment, slowest, fastest).unwrap();
            let (least, most) = inverse.reach();
            let (least, most) = (least.0.to_num::<f64>(), most.0.to_num::<f64>());
            let mut own = 0f64;
            for i in 0..=40 {
                let wanted = least + (most - least) * f64::from(i) / 40.0;
                let drive = inverse.drive(&recruitment, Force(I16F16::from_num(wanted)));
                let driven = Parameters {
                    a_n_per_s: p.a_n_per_s * gain(drive.amplitude),
                    ..*p
                };
                let got = settled(&driven, f64::from(drive.period_us) * 1e-6);
                own = own.max((got / wanted - 1.0).abs());
            }
            println!(
                "K{number:02} {slowest}–{fastest} µs, {least:.3}–{most:.3} N: worst {:.3} %",
                own * 1e2
            );
            worst = worst.max(own);
        }
        println!("all ten: {:.3} %", worst * 1e2);
        assert!((bound / 2.0..bound).contains(&worst), "{worst:e}");
    }
}
