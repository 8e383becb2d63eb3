//! The firmware's inverse muscle model on the simulator's own muscles, which share no code with it.
//!
//! `cargo test -p hal-sim --test suite muscle_inverse -- --nocapture` prints the errors of steady
//! forces of ten subjects, and the ripple of slow rates.

use firmware::muscle::{CalciumForceSpec, ForceLimit, Inverse, Recruitment, RecruitmentSpec};
use firmware::units::{Amplitude, Force, ForceRate};
use fixed::types::I16F16;
use hal_sim::body::muscle::reference::integrate;
use hal_sim::body::muscle::{Parameters, SUBJECTS};

/// 10–20 mA; the force at threshold is e^−3, 5 %, of that at the limit.
const RECRUITMENT: RecruitmentSpec = RecruitmentSpec {
    motor_threshold: Amplitude::new(10_000),
    limit: Amplitude::new(20_000),
    reference: Amplitude::new(20_000),
    slope_micro: 300_000,
};

/// Computes the gain by equation 6 in floating point.
fn gain(amplitude: Amplitude) -> f64 {
    (0.3e-3 * (f64::from(amplitude.get()) - 20_000.0)).exp()
}

fn spec(p: &Parameters) -> CalciumForceSpec {
    let rounded = |value: f64| value.round() as u32;
    CalciumForceSpec {
        a_mn_per_s: rounded(p.a_n_per_s * 1e3),
        k_micro: rounded(p.k * 1e6),
        tau_c_us: rounded(p.tau_c_s * 1e6),
        tau1_us: rounded(p.tau1_s * 1e6),
        tau2_us: rounded(p.tau2_s * 1e6),
    }
}

/// Forces during one period of a settled train, N.
struct Period {
    mean: f64,
    lowest: f64,
    highest: f64,
}

fn period(p: &Parameters, period_s: f64, step_s: f64) -> Period {
    let periods = (12.0 * (p.tau_c_s + p.tau1_s + p.tau2_s) / period_s).ceil();
    let pulses: Vec<f64> = (0..=periods as u32)
        .map(|i| f64::from(i) * period_s)
        .collect();
    let steps = (period_s / step_s).ceil().max(50.0) as u32;
    let end = (periods + 1.0) * period_s;
    let samples = integrate(p, &pulses, end, period_s / f64::from(steps));
    let last = &samples[samples.len() - 1 - steps as usize..];
    let sum: f64 = last
        .windows(2)
        .map(|w| 0.5 * (w[0].force_n + w[1].force_n))
        .sum();
    let forces = || last.iter().map(|sample| sample.force_n);
    Period {
        mean: sum / f64::from(steps),
        lowest: forces().fold(f64::INFINITY, f64::min),
        highest: forces().fold(0.0, f64::max),
    }
}

/// Returns the mean force over a period of a settled train, N.
fn settled(p: &Parameters, period_s: f64) -> f64 {
    period(p, period_s, 2e-3).mean
}

#[test]
fn ten_subjects_settle_at_the_force_wanted() {
    let recruitment = Recruitment::new(RECRUITMENT).unwrap();
    for (slowest, fastest, bound) in [(50_000, 16_667, 6e-4), (100_000, 10_000, 1e-2)] {
        let mut worst = 0f64;
        for (number, p) in (1..).zip(&SUBJECTS) {
            let inverse = Inverse::new(spec(p), &recruitment, slowest, fastest, slowest).unwrap();
            let (least, most) = inverse.force_range();
            let (least, most) = (least.get().to_num::<f64>(), most.get().to_num::<f64>());
            let mut own = 0f64;
            for i in 0..=40 {
                let wanted = least + (most - least) * f64::from(i) / 40.0;
                let drive = inverse.drive(&recruitment, Force::new(I16F16::from_num(wanted)));
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

/// Without a slowest rate every order is the same as before that setting existed: the digest is
/// from commit e7c6abd. Covers ten subjects, three ranges of rates, and forces from zero to beyond
/// reach, constant and rising.
#[test]
fn without_a_slowest_rate_no_order_changes() {
    let recruitment = Recruitment::new(RECRUITMENT).unwrap();
    let mut digest = 0xcbf2_9ce4_8422_2325u64; // FNV-1a
    let mut fold = |word: u64| {
        for byte in word.to_le_bytes() {
            digest = (digest ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for p in &SUBJECTS {
        for (train, fastest) in [(50_000, 16_667), (100_000, 5_000), (20_000, 20_000)] {
            let inverse = Inverse::new(spec(p), &recruitment, train, fastest, train).unwrap();
            let (least, most) = inverse.force_range();
            fold(u64::from(least.get().to_bits().cast_unsigned()));
            fold(u64::from(most.get().to_bits().cast_unsigned()));
            for i in -100..1900 {
                // Half of the forces are near the smallest.
                let top = if i % 2 == 0 { least } else { most };
                let force = top.get().to_num::<f64>() * f64::from(i) / 1500.0;
                for rate in [0, 20] {
                    let force = Force::new(I16F16::from_num(force));
                    let ahead =
                        inverse.compensate_lag(force, ForceRate::new(I16F16::from_num(rate)));
                    let drive = inverse.drive(&recruitment, ahead);
                    fold(u64::from(drive.amplitude.get()) << 32 | u64::from(drive.period_us));
                }
            }
        }
    }
    println!("orders of forces: {digest:#018x}");
    assert_eq!(digest, 0xf5d5_71fa_5b5a_b6be);
}

/// For ten subjects, compares the force given with the force requested, from zero to the largest,
/// when the rate may fall to half a pulse, one or two per second.
#[test]
fn a_slow_rate_closes_the_gap_below_threshold() {
    let recruitment = Recruitment::new(RECRUITMENT).unwrap();
    let mut worst = 0f64;
    for slowest in [2_000_000, 1_000_000, 500_000] {
        for (number, p) in (1..).zip(&SUBJECTS) {
            let inverse = Inverse::new(spec(p), &recruitment, 50_000, 16_667, slowest).unwrap();
            let fixed = Inverse::new(spec(p), &recruitment, 50_000, 16_667, 50_000).unwrap();
            let newtons = |force: Force| force.get().to_num::<f64>();
            let (least, most) = inverse.force_range();
            let (least, most) = (newtons(least), newtons(most));
            let at_threshold = newtons(fixed.force_range().0);
            let given = |wanted: f64| {
                let drive = inverse.drive(&recruitment, Force::new(I16F16::from_num(wanted)));
                let driven = Parameters {
                    a_n_per_s: p.a_n_per_s * gain(drive.amplitude),
                    ..*p
                };
                let settled = settled(&driven, f64::from(drive.period_us) * 1e-6);
                match drive.amplitude {
                    Amplitude::ZERO => (0.0, drive),
                    _ => (settled, drive),
                }
            };
            // Below the smallest force, the nearer of both is given and reported.
            for part in [0.1, 0.49, 0.51, 0.9] {
                let (force, drive) = given(part * least);
                assert_eq!(drive.limiting, Some(ForceLimit::BelowLeast), "K{number:02}");
                assert!((force - part * least).abs() <= 0.51 * least, "K{number:02}");
            }
            // From there on the requested force is given.
            let mut own = 0f64;
            for i in 0..=40 {
                // Half of the forces are below that of threshold at the train's rate.
                let (from, to) = if i % 2 == 0 {
                    (least, at_threshold)
                } else {
                    (least, most)
                };
                let wanted = from + (to - from) * f64::from(i) / 40.0;
                let (force, drive) = given(wanted.max(least + 2e-5));
                assert_eq!(drive.limiting, None, "K{number:02}, {wanted} N");
                own = own.max((force / wanted - 1.0).abs());
            }
            println!(
                "K{number:02} down to {} Hz: none, and {least:.4} to {most:.3} N ({:.3} N at 20 Hz); \
                 worst {:.2} %",
                1e6 / f64::from(slowest),
                at_threshold,
                own * 1e2
            );
            assert!(least < at_threshold / 8.0, "K{number:02}: {least} N");
            worst = worst.max(own);
        }
    }
    println!("all ten: {:.2} %", worst * 1e2);
    assert!((1e-2..2e-2).contains(&worst), "{worst:e}");
}

/// Prints the table of ripple in docs/how/muscle.md and compares the document with it.
#[test]
fn the_ripple_of_slow_rates_is_what_the_document_says() {
    let text = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/how/muscle.md");
    let text = std::fs::read_to_string(text).unwrap();
    for hz in [20.0, 10.0, 8.0, 5.0, 3.0, 2.0, 1.0, 0.5] {
        let ripple = |p: &Parameters| {
            let period = period(p, 1.0 / hz, 2e-4);
            (period.highest - period.lowest) / period.mean
        };
        let mut ripples: Vec<f64> = SUBJECTS.iter().map(ripple).collect();
        ripples.sort_by(f64::total_cmp);
        let [least, median, most] =
            [ripples[0], 0.5 * (ripples[4] + ripples[5]), ripples[9]].map(|r| (100.0 * r).round());
        let row = format!("| {hz} Hz | {least} % | {median} % | {most} % |");
        println!("{row}");
        assert!(text.contains(&row), "docs/how/muscle.md has no row {row}");
    }
}
