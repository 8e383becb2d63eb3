//! Recruitment against the exponential of Lee 2020, eqs. (5)–(6), in f64.

use firmware::muscle::{Gain, Recruitment, RecruitmentSpec};
use firmware::range::OutOfRange;
use firmware::units::Amplitude;
use fixed::types::{I16F16, U1F31};
use proptest::prelude::*;

fn spec(threshold: u32, limit: u32, reference: u32, slope_micro: u32) -> RecruitmentSpec {
    RecruitmentSpec {
        motor_threshold: Amplitude::new(threshold),
        limit: Amplitude::new(limit),
        reference: Amplitude::new(reference),
        slope_micro,
    }
}

/// Subject K01 of Lee's table 2: 8…12 mA; b from its two peaks at 20 Hz.
const K01: [u32; 4] = [8_000, 12_000, 12_000, 451_600];

fn k01() -> Recruitment {
    let [threshold, limit, reference, slope] = K01;
    Recruitment::new(spec(threshold, limit, reference, slope)).unwrap()
}

fn gain_value(gain: Gain) -> f64 {
    gain.get().to_num()
}

/// Computes A(I)/A(I_0) by eq. (6).
fn truth(spec: &RecruitmentSpec, amplitude: u32) -> f64 {
    let below = f64::from(spec.reference.get()) - f64::from(amplitude);
    (-f64::from(spec.slope_micro) * 1e-9 * below).exp()
}

/// Generates every curve that the constructor accepts, by span and by the part of the 16 octaves
/// that it uses.
fn any_spec() -> impl Strategy<Value = RecruitmentSpec> {
    (1u32..500_000, 1u32..200_000, 0u32..200_000, 0.0f64..1.0).prop_map(
        |(threshold, range, beyond, steepness)| {
            let limit = threshold + range;
            let span = f64::from(range + beyond);
            let steepest = (16.0 * 2f64.ln() * 1e9 / span).floor().min(5e6);
            let slope = 10_000.0 + steepness * (steepest - 10_000.0);
            spec(threshold, limit, limit + beyond, slope as u32)
        },
    )
}

#[test]
fn k01_is_the_papers_curve() {
    let curve = k01();
    assert_eq!(curve.gain(Amplitude::new(12_000)), Gain::FULL);
    // 1.47 N at 8 mA, 8.95 N at 12 mA (table 2, 20 Hz).
    assert!((gain_value(curve.gain(Amplitude::new(8_000))) - 1.47 / 8.95).abs() < 1e-4);
    assert_eq!(curve.gain(Amplitude::new(7_999)), Gain::ZERO);
    assert_eq!(curve.gain(Amplitude::new(u32::MAX)), Gain::FULL);
    assert_eq!(curve.amplitude_for_gain(Gain::FULL), Amplitude::new(12_000));
    assert_eq!(curve.amplitude_for_gain(Gain::ZERO), Amplitude::ZERO);
}

#[test]
fn gain_rises_with_every_microampere_and_comes_back() {
    let curve = k01();
    let mut last = Gain::ZERO;
    for amplitude in (8_000..=12_000).map(Amplitude::new) {
        let gain = curve.gain(amplitude);
        assert!(gain > last, "{amplitude:?}");
        assert_eq!(curve.amplitude_for_gain(gain), amplitude);
        last = gain;
    }
}

#[test]
fn worst_errors_are_as_stated_from_both_sides() {
    let (mut of_gain, mut of_amplitude) = (0f64, 0f64);
    for slope in (10_000..=1_000_000).step_by(9_000) {
        let curve = Recruitment::new(spec(2_000, 12_000, 13_000, slope)).unwrap();
        for amplitude in (2_000..12_000).step_by(7) {
            let gain = curve.gain(Amplitude::new(amplitude));
            let exact = truth(curve.spec(), amplitude);
            of_gain = of_gain.max(((gain_value(gain) - exact).abs() - 2f64.powi(-31)) / exact);
            // An arbitrary gain in between, not returned by `gain()`.
            let asked = Gain::new(gain.get() + U1F31::from_bits(9_999));
            let below = -gain_value(asked).ln() / f64::from(slope) * 1e9;
            let inverse = (13_000.0 - below).clamp(2_000.0, 12_000.0);
            let got = f64::from(curve.amplitude_for_gain(asked).get());
            of_amplitude = of_amplitude.max((got - inverse).abs());
        }
    }
    println!("gain: {of_gain:.2e} relative; amplitude: {of_amplitude:.4} µA");
    assert!((4.6e-9..9.2e-9).contains(&of_gain), "{of_gain:e}");
    assert!((0.5..0.6).contains(&of_amplitude), "{of_amplitude}");
}

#[test]
fn every_parameter_is_refused_with_what_the_others_leave_it() {
    let [threshold, limit, reference, slope] =
        ["motor_threshold", "limit", "reference", "slope_micro"];
    #[rustfmt::skip]
    let cases = [
        ((0, 10, 20, 10_000), threshold, 0, 1, 999_999),
        ((8_000, 8_000, 12_000, 10_000), limit, 8_000, 8_001, 1_000_000),
        ((8_000, 12_000, 11_999, 10_000), reference, 11_999, 12_000, 1_000_000),
        ((8_000, 12_000, 1_000_001, 10_000), reference, 1_000_001, 12_000, 1_000_000),
        ((8_000, 12_000, 12_000, 9_999), slope, 9_999, 10_000, 2_772_588),
        ((8_000, 12_000, 12_000, 2_772_589), slope, 2_772_589, 10_000, 2_772_588),
        ((8_000, 9_000, 9_000, 5_000_001), slope, 5_000_001, 10_000, 5_000_000),
    ];
    for ((a, b, c, d), field, value, min, max) in cases {
        let refusal = OutOfRange {
            field,
            value,
            min,
            max,
        };
        assert_eq!(Recruitment::new(spec(a, b, c, d)).unwrap_err(), refusal);
    }
}

proptest! {
    #[test]
    fn gain_is_the_exponential(spec in any_spec(), where_in in 0.0f64..1.0) {
        let curve = Recruitment::new(spec).unwrap();
        let (low, high) = (spec.motor_threshold.get(), spec.limit.get());
        let amplitude = low + (f64::from(high - low) * where_in) as u32;
        let exact = truth(&spec, amplitude);
        let got = gain_value(curve.gain(Amplitude::new(amplitude)));
        prop_assert!((got - exact).abs() <= 9.2e-9 * exact + 2f64.powi(-31), "{} {}", got, exact);
    }

    /// The inverse returns the original amplitude, except for half a step and one unit of the
    /// gain's resolution.
    #[test]
    fn amplitude_comes_back(spec in any_spec(), where_in in 0.0f64..1.0) {
        let curve = Recruitment::new(spec).unwrap();
        let (low, high) = (spec.motor_threshold.get(), spec.limit.get());
        let amplitude = low + (f64::from(high - low) * where_in) as u32;
        let gain = curve.gain(Amplitude::new(amplitude));
        let back = curve.amplitude_for_gain(gain).get();
        let unit = 2f64.powi(-31) / gain_value(gain) * 1e9 / f64::from(spec.slope_micro);
        prop_assert!(f64::from(back.abs_diff(amplitude)) <= 0.6 + unit, "{} {}", back, amplitude);
    }

    #[test]
    fn amplitude_is_zero_or_within_the_wearers_range(
        spec in any_spec(), bits in any::<u32>(), effort in any::<i32>(),
    ) {
        let curve = Recruitment::new(spec).unwrap();
        for amplitude in [
            curve.amplitude_for_gain(Gain::new(U1F31::from_bits(bits))),
            curve.amplitude_for_effort(I16F16::from_bits(effort)),
            curve.amplitude_for_effort(I16F16::from_bits(effort >> 15)),
        ] {
            prop_assert!(amplitude == Amplitude::ZERO
                || (spec.motor_threshold..=spec.limit).contains(&amplitude));
        }
    }

    /// More effort never gives a smaller amplitude, and force is proportional to effort, to within
    /// the amplitude's step and 2^-16 of the range.
    #[test]
    fn force_follows_effort(spec in any_spec(), one in 1i32..=65_536, other in 1i32..=65_536) {
        let curve = Recruitment::new(spec).unwrap();
        let amplitude = |bits: i32| curve.amplitude_for_effort(I16F16::from_bits(bits));
        let (less, more) = (one.min(other), one.max(other));
        prop_assert!(amplitude(less) <= amplitude(more));
        prop_assert_eq!(amplitude(0), Amplitude::ZERO);
        prop_assert_eq!(amplitude(65_536), spec.limit);

        let low = gain_value(curve.gain(spec.motor_threshold));
        let high = gain_value(curve.gain(spec.limit));
        let wanted = low + (high - low) * f64::from(one) / 65_536.0;
        let got = gain_value(curve.gain(amplitude(one)));
        let step = 0.6e-9 * f64::from(spec.slope_micro);
        prop_assert!((got - wanted).abs() <= step * wanted + 2e-9, "{} {}", got, wanted);
    }

    #[test]
    fn gain_never_falls(spec in any_spec(), one in any::<u32>(), other in any::<u32>()) {
        let curve = Recruitment::new(spec).unwrap();
        let inside = |a: u32| Amplitude::new(a % (spec.limit.get() + 10));
        let (less, more) = (inside(one).min(inside(other)), inside(one).max(inside(other)));
        prop_assert!(curve.gain(less) <= curve.gain(more));
    }
}
