//! Stimulation that follows a joint: its amplitude at every angle against the paper's formula in
//! floating point, and all refused specifications.

use firmware::haptics::{
    Form, ModulatedSpec, Modulation, ModulationError, ModulationSpec, MotionPhase, PhaseState,
    QuarticSpec,
};
use firmware::safety::StageSpec;
use firmware::units::{Amplitude, Angle};
use proptest::prelude::*;

/// Quartic from 0.1 up to 0.9 and down to 0.4.
const HUMP: QuarticSpec = QuarticSpec([100_000, 700_000, 1_300_000, 900_000, 400_000]);
const RISE: QuarticSpec = QuarticSpec([0, 20_000, 150_000, 600_000, 1_000_000]);

const ELBOW: ModulationSpec = ModulationSpec {
    joint: 0,
    phase_joint: 0,
    dead_band_centideg_per_s: 800,
    cutoff_mhz: 2_000,
    angle_min_mdeg: -5_000,
    angle_max_mdeg: 145_000,
    stale_after_ms: 50,
    max_hold_ms: 10_000,
    flexor: ModulatedSpec {
        channel: 0,
        base: Amplitude::new(38_700),
        form: Form::Scaled,
        lift: Some(HUMP),
        drop: None,
    },
    extensor: ModulatedSpec {
        channel: 1,
        base: Amplitude::new(31_300),
        form: Form::AboveThreshold {
            threshold: Amplitude::new(9_100),
        },
        lift: None,
        drop: Some(RISE),
    },
};

/// Computes C at u in floating point, by the definition of Bernstein's form.
fn share(quartic: &QuarticSpec, u: f64) -> f64 {
    let terms = quartic.0.iter().zip([1.0, 4.0, 6.0, 4.0, 1.0]).zip(0..);
    let terms =
        terms.map(|((&b, over), k)| f64::from(b) / 1e6 * over * u.powi(k) * (1.0 - u).powi(4 - k));
    terms.sum()
}

/// Computes the formula's intensity at an angle in floating point.
fn expected_intensity(
    spec: &ModulationSpec,
    muscle: &ModulatedSpec,
    phase: MotionPhase,
    degrees: f64,
) -> f64 {
    let (low, high) = (spec.angle_min_mdeg, spec.angle_max_mdeg);
    let (low, high) = (f64::from(low) / 1e3, f64::from(high) / 1e3);
    let u = ((degrees - low) / (high - low)).clamp(0.0, 1.0);
    let base = f64::from(muscle.base.get());
    match (muscle.share(phase), muscle.form) {
        (None, _) => 0.0,
        (Some(quartic), Form::Scaled) => share(quartic, u) * base,
        (Some(quartic), Form::AboveThreshold { threshold }) => {
            let threshold = f64::from(threshold.get());
            threshold + share(quartic, u) * (base - threshold)
        }
    }
}

const PHASES: [MotionPhase; 2] = [MotionPhase::Lift, MotionPhase::Drop];

/// Returns the largest errors of both muscles in both phases at all angles of 0.01°, from 5°
/// outside the range on either side: of the amplitude, and in DAC codes of a stage. The bound is
/// the sum of the roundings: half an amplitude unit, 7.5·10^-8 of the base in the quartic, and
/// 2·2^-16° between two angles.
fn worst_errors(spec: &ModulationSpec, full_scale_ua: u32) -> (f64, u16) {
    let stage = StageSpec::Current { full_scale_ua }.validate().unwrap();
    let joint = Modulation::new(spec).unwrap();
    let mut worst = (0.0_f64, 0_u16);
    for centideg in spec.angle_min_mdeg / 10 - 500..=spec.angle_max_mdeg / 10 + 500 {
        let angle = Angle::from_centideg(centideg as i16);
        for phase in PHASES {
            let orders = joint.amplitudes(angle, Some(phase));
            for (muscle, (channel, amplitude)) in spec.muscles().zip(orders) {
                assert_eq!(channel, muscle.channel);
                let exactly = expected_intensity(spec, muscle, phase, f64::from(centideg) / 100.0);
                let error = (f64::from(amplitude.get()) - exactly).abs();
                let beside = [-2.0, 2.0].map(|bits| {
                    let at = f64::from(centideg) / 100.0 + bits / 65_536.0;
                    (expected_intensity(spec, muscle, phase, at) - exactly).abs()
                });
                let proven = 0.5 + 7.5e-8 * 200_000.0 + beside[0].max(beside[1]);
                assert!(error <= proven, "{centideg}: {error} > {proven}");
                let exact = (exactly.max(0.0) * 65_535.0 / f64::from(full_scale_ua)) as u16;
                let codes = stage.code(amplitude).get().abs_diff(exact);
                worst = (worst.0.max(error), worst.1.max(codes));
            }
        }
    }
    worst
}

/// Four joints as in two arms, at every angle of 0.01° in and around their ranges.
#[test]
fn every_amplitude_is_within_one_dac_code_of_its_quartic() {
    let joint = |joint, low, high, lift, drop| ModulationSpec {
        joint,
        angle_min_mdeg: low,
        angle_max_mdeg: high,
        flexor: ModulatedSpec {
            lift,
            ..ELBOW.flexor
        },
        extensor: ModulatedSpec {
            drop,
            ..ELBOW.extensor
        },
        ..ELBOW
    };
    let steep = QuarticSpec([1_000_000, -1_000_000, 2_000_000, -1_000_000, 1_000_000]);
    let joints = [
        ELBOW,
        joint(1, -60_000, 180_000, Some(RISE), Some(HUMP)),
        joint(2, 12_340, 98_760, Some(steep), Some(HUMP)),
        joint(3, -180_000, 180_000, Some(HUMP), Some(steep)),
    ];
    for spec in joints {
        let (error, codes) = worst_errors(&spec, 40_000);
        println!(
            "joint {}: {error:.4} µA, {codes} code of 0.61 µA",
            spec.joint
        );
        assert!(codes == 1, "{codes}"); // one code more where it rounds up, and no more
    }
}

prop_compose! {
    /// Generates quartics that mostly stay in 0…1, over any range.
    fn any_joint()(
        low in -180_000..179_000_i32,
        length in 1..360_000_i32,
        b in prop::array::uniform5(-300_000..1_300_000_i32),
        base in 1..=200_000_u32,
        is_scaled: bool,
    ) -> ModulationSpec {
        let form = if is_scaled {
            Form::Scaled
        } else {
            Form::AboveThreshold { threshold: Amplitude::new(base / 3) }
        };
        let base = Amplitude::new(base);
        let lift = Some(QuarticSpec(b));
        ModulationSpec {
            angle_min_mdeg: low,
            angle_max_mdeg: (low + length).min(180_000),
            flexor: ModulatedSpec { base, form, lift, ..ELBOW.flexor },
            ..ELBOW
        }
    }
}

proptest! {
    /// An accepted quartic keeps to its formula and below its peak at every angle; a refused one
    /// has an angle where C is outside 0…1.
    #[test]
    fn an_accepted_quartic_passes_its_peak_at_no_angle(spec in any_joint()) {
        let quartic = spec.flexor.lift.unwrap();
        let angles = (0..=20_000).map(|i| f64::from(i) / 20_000.0);
        let shares = angles.clone().map(|u| share(&quartic, u));
        let (low, high) = shares.fold((f64::MAX, f64::MIN), |(low, high), c| {
            (low.min(c), high.max(c))
        });
        let found = (quartic.lowest(), quartic.highest());
        // Every extreme is found at its reported place, and none is missed.
        for (extreme, sampled) in [(found.0, low), (found.1, high)] {
            let there = share(&quartic, f64::from(extreme.at) / 16_384.0) * 1e6;
            prop_assert!((f64::from(extreme.millionths()) - there).abs() <= 1.001);
            prop_assert!((sampled * 1e6 - there).abs() <= 0.3);
        }
        let Ok(joint) = Modulation::new(&spec) else {
            prop_assert!(low < 0.0 || high > 1.0, "{low} {high}");
            return Ok(());
        };
        prop_assert!(low > -1e-6 && high < 1.0 + 1e-6, "{low} {high}");
        let peak = spec.flexor.peak(MotionPhase::Lift).unwrap();
        let mut reached = Amplitude::ZERO;
        for u in angles {
            let mdeg = f64::from(spec.angle_min_mdeg)
                + u * f64::from(spec.angle_max_mdeg - spec.angle_min_mdeg);
            let angle = Angle::from_millideg(mdeg as i32);
            let [(_, amplitude), _] = joint.amplitudes(angle, Some(MotionPhase::Lift));
            reached = reached.max(amplitude);
        }
        prop_assert!(reached <= peak && peak <= spec.flexor.base);
        // The peak is also tight: over 20 001 angles of 1 m° or more.
        if spec.angle_max_mdeg - spec.angle_min_mdeg > 20_000 {
            prop_assert!(peak.get() - reached.get() <= 1, "{peak:?} {reached:?}");
        }
    }
}

fn validation_errors(edit: impl FnOnce(&mut ModulationSpec)) -> Vec<ModulationError> {
    let mut spec = ELBOW;
    edit(&mut spec);
    let mut mistakes = Vec::new();
    spec.report_mistakes(&mut |mistake| mistakes.push(mistake));
    assert_eq!(Modulation::new(&spec).err(), mistakes.first().copied());
    mistakes
}

#[test]
fn a_quartic_that_leaves_0_to_1_at_one_angle_only_is_refused_with_that_angle() {
    // (u − 1/3)²·k + c has its minimum at a third, between any two bisections.
    let dip = |foot: f64| {
        let power = [1.0 / 9.0, -2.0 / 3.0, 1.0].map(|a| a * 0.9);
        let [a0, a1, a2] = power;
        let b = [a0, a0 + a1 / 4.0, a0 + a1 / 2.0 + a2 / 6.0];
        let more = [a0 + a1 * 0.75 + a2 / 2.0, a0 + a1 + a2];
        let coefficients = [b[0], b[1], b[2], more[0], more[1]];
        QuarticSpec(coefficients.map(|b| ((b + foot) * 1e6).round() as i32))
    };
    assert_eq!(
        validation_errors(|spec| spec.flexor.lift = Some(dip(0.000_001))),
        []
    );
    let found = validation_errors(|spec| spec.flexor.lift = Some(dip(-0.000_002)));
    let [
        ModulationError::Share {
            channel: 0,
            phase: MotionPhase::Lift,
            extreme,
        },
    ] = found[..]
    else {
        panic!("{found:?}");
    };
    assert!((-3..=-2).contains(&extreme.millionths()), "{extreme:?}");
    assert!((f64::from(extreme.at) / 16_384.0 - 1.0 / 3.0).abs() < 0.01);
    // The same curve upside down is above 1 at one angle.
    let QuarticSpec(b) = dip(-0.000_002);
    let found =
        validation_errors(|spec| spec.extensor.drop = Some(QuarticSpec(b.map(|b| 1_000_000 - b))));
    let [
        ModulationError::Share {
            channel: 1,
            phase: MotionPhase::Drop,
            extreme,
        },
    ] = found[..]
    else {
        panic!("{found:?}");
    };
    assert!(
        (1_000_002..=1_000_003).contains(&extreme.millionths()),
        "{extreme:?}"
    );
}

#[test]
fn every_field_is_refused_beyond_its_range() {
    type Edit = fn(&mut ModulationSpec);
    let edits: [(&str, Edit); 15] = [
        ("joint", |s| s.joint = 4),
        ("phase_joint", |s| s.phase_joint = 4),
        ("dead_band_centideg_per_s", |s| {
            s.dead_band_centideg_per_s = 0
        }),
        ("dead_band_centideg_per_s", |s| {
            s.dead_band_centideg_per_s = 20_001
        }),
        ("cutoff_mhz", |s| s.cutoff_mhz = 499),
        ("cutoff_mhz", |s| s.cutoff_mhz = 20_001),
        ("angle_max_mdeg", |s| s.angle_max_mdeg = s.angle_min_mdeg),
        ("angle_min_mdeg", |s| s.angle_min_mdeg = i32::MIN),
        ("stale_after_ms", |s| s.stale_after_ms = 501),
        ("max_hold_ms", |s| s.max_hold_ms = 99),
        ("channel", |s| s.flexor.channel = 10),
        ("base", |s| s.flexor.base = Amplitude::ZERO),
        ("threshold", |s| {
            let threshold = s.extensor.base;
            s.extensor.form = Form::AboveThreshold { threshold };
        }),
        ("lift", |s| {
            s.flexor.lift = Some(QuarticSpec([0, 0, 8_000_001, 0, 0]))
        }),
        ("drop", |s| {
            s.extensor.drop = Some(QuarticSpec([i32::MIN, 0, 0, 0, 0]))
        }),
    ];
    for (field, edit) in edits {
        let found = validation_errors(edit);
        let [ModulationError::Range(range)] = found[..] else {
            panic!("{field}: {found:?}");
        };
        assert_eq!(range.field, field);
    }
    let twice = validation_errors(|s| s.extensor.channel = 0);
    assert_eq!(twice, [ModulationError::ChannelTwice { channel: 0 }]);
    // All mistakes at once are reported in the order of the fields.
    let errors = validation_errors(|s| {
        (s.joint, s.max_hold_ms, s.extensor.channel) = (4, 0, 0);
        s.flexor.base = Amplitude::ZERO;
    });
    assert_eq!(errors.len(), 4, "{errors:?}");
}

/// Returns an elbow's angle at `t` s and its phase of motion, `None` at rest. The elbow rests,
/// flexes by 80° in 1.6 s of minimum jerk, rests for 1 s, extends, and rests.
fn lift_and_drop(t: f64) -> (f64, Option<MotionPhase>) {
    let way = |u: f64| 80.0 * (10.0 * u.powi(3) - 15.0 * u.powi(4) + 6.0 * u.powi(5));
    match t {
        ..1.0 => (20.0, None),
        1.0..2.6 => (20.0 + way((t - 1.0) / 1.6), Some(MotionPhase::Lift)),
        2.6..3.6 => (100.0, None),
        3.6..5.2 => (100.0 - way((t - 3.6) / 1.6), Some(MotionPhase::Drop)),
        _ => (20.0, None),
    }
}

/// Returns the times of every change of phase in `lift_and_drop`, measured each `every_ms` with
/// noise and rounding to steps, ms.
fn switches(seed: u64, noise: f64, step: f64, every_ms: u64) -> Vec<(u64, MotionPhase)> {
    let joint = Modulation::new(&ELBOW).unwrap();
    let mut random = seed | 1;
    let mut uniform = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (mut state, mut changes) = (PhaseState::default(), Vec::new());
    let mut angle = Angle::default();
    for ms in 0..6_200 {
        if ms % every_ms == 0 {
            // The sum of twelve uniform numbers is nearly normal and stays within six standard
            // deviations.
            let normal = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            let measured = lift_and_drop(ms as f64 / 1e3).0 + noise * normal;
            let measured = (measured / step).round() * step;
            angle = Angle::from_centideg((measured * 100.0).round() as i16);
        }
        let before = state.phase();
        match joint.detector().step(&mut state, angle) {
            Some(now) if before != Some(now) => changes.push((ms, now)),
            _ => {}
        }
    }
    changes
}

/// At the specified noise (0.05 and 0.1°, in steps of 0.01 and 0.1°, at 100 and 200 Hz) the phase
/// changes once with each motion of the elbow, and never at rest.
#[test]
fn the_phase_does_not_chatter_and_its_delay_is_known() {
    let mut delays = Vec::new();
    for (noise, step) in [(0.05, 0.01), (0.05, 0.1), (0.1, 0.01), (0.1, 0.1)] {
        for every_ms in [5, 10] {
            let mut of_these = Vec::new();
            for seed in 1..=500 {
                let found = switches(seed * 7_919, noise, step, every_ms);
                let [(lift, MotionPhase::Lift), (drop, MotionPhase::Drop)] = found[..] else {
                    panic!("noise {noise}, step {step}, seed {seed}: {found:?}");
                };
                // No change before the motion begins.
                assert!(lift >= 1_000 && drop >= 3_600, "{found:?}");
                of_these.extend([lift - 1_000, drop - 3_600]);
            }
            of_these.sort_unstable();
            let (median, last) = (of_these[500], *of_these.last().unwrap());
            println!("noise {noise}°, steps {step}°, {every_ms} ms: {median} ms, {last} at most");
            delays.extend(of_these);
        }
    }
    let worst = delays.iter().max().unwrap();
    assert!((100..=260).contains(worst), "{worst}");
}
