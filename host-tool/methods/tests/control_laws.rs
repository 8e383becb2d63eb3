//! Tests of the control laws: their sign, agreement with f64, and anti-windup.

use firmware::control::differentiator::{Differentiator, DifferentiatorState};
use firmware::control::{
    Effort, HoldPolicy, Joint, JointSpec, JointState, LawSpec, PointSpec, SensorSource,
};
use firmware::units::{Amplitude, Angle, Micros, us};
use fixed::types::I16F16;
use methods::control::derivative::Differentiator as Differentiating;
use methods::control::feedback::{Feedback, PAPER_RANGE_V};
use methods::control::twist::{Discretization, Push, Twist};
use std::f64::consts::TAU;

const LAWS: [LawSpec; 3] = [LawSpec::PAPER, LawSpec::ALONE, LawSpec::PID];

fn point(channel: u8, threshold: u32, max: u32) -> PointSpec {
    PointSpec {
        channel,
        threshold: Amplitude::new(threshold),
        max: Amplitude::new(max),
    }
}

fn spec(law: LawSpec, law_period_ms: u8, cutoff_mhz: u32) -> JointSpec {
    JointSpec {
        law,
        law_period_ms,
        cutoff_mhz,
        flexors: [point(0, 24_000, 28_000)].into_iter().collect(),
        extensor: point(2, 14_000, 26_000),
        hold: HoldPolicy::Hold,
        angle_min_mdeg: -90_000,
        angle_max_mdeg: 100_000,
        sensor: SensorSource::Adc {
            code_at_0: 0,
            code_at_100: 4000,
        },
        stale_after_ms: 50,
        wearer: None,
        response: None,
    }
}

fn degrees(deg: f64) -> Angle {
    Angle::new(I16F16::from_num(deg))
}

fn number(effort: Effort) -> f64 {
    match effort {
        Effort::AboveThreshold(q) | Effort::Fraction(q) => q.to_num(),
    }
}

/// Returns error and effort of a joint in each law period, with reference and angle given by `at`
/// as functions of time.
fn efforts(spec: &JointSpec, steps: u32, at: impl Fn(f64) -> (f64, f64)) -> Vec<(f64, f64)> {
    // The reference swings as widely as a limit cycle, so the joint has the law alone.
    let joint = Joint::with_full_gain(spec).unwrap();
    let mut state = JointState::default();
    let period = u32::from(spec.law_period_ms) * 1000;
    (0..steps)
        .map(|i| {
            let now = Micros::new(u32::MAX - 1_000_000) + us(i * period);
            let (target, angle) = at(f64::from(i * period) * 1e-6);
            joint
                .accept_setpoint(&mut state, now, now, degrees(target), None)
                .unwrap();
            let orders = joint.tick(&mut state, now, Some(degrees(angle))).unwrap();
            let error = orders.target.get().to_num::<f64>() - orders.measured.get().to_num::<f64>();
            (error, number(orders.effort))
        })
        .collect()
}

/// Returns a reference and an angle that sometimes saturate the law and often cross.
fn wandering(t: f64) -> (f64, f64) {
    let target = 45.0 + 40.0 * (TAU * 0.2 * t).sin();
    let angle = 45.0 + 38.0 * (TAU * 0.2 * t - 0.1).sin() + 3.0 * (TAU * 1.3 * t).sin();
    (target, angle)
}

/// The laws in f64, from `methods`; `sign` −1 gives equation (4) as printed.
struct Reference {
    feedback: Feedback<f64>,
    differentiator: Differentiating<f64>,
    sign: f64,
    integral: f64,
}

impl Reference {
    fn new(law: LawSpec, period_ms: u8, cutoff_mhz: u32, sign: f64) -> Self {
        let h = f64::from(period_ms) * 1e-3;
        let m = |milli: u32| f64::from(milli) * 1e-3;
        let feedback = match law {
            LawSpec::Paper {
                lambda_milli,
                w_milli,
            } => Feedback::Paper {
                lambda: m(lambda_milli),
                w_step: m(w_milli) * h,
            },
            LawSpec::Recommended {
                lambda_milli,
                k1_milli,
                k2_milli,
                b_milli,
                k3_milli,
                ki_milli,
            } => {
                let form = Discretization::ProperImplicit;
                Feedback::Twisting {
                    lambda: m(lambda_milli),
                    twist: Twist::new(form, m(k1_milli), m(k2_milli), m(b_milli), h)
                        .with_linear(m(k3_milli)),
                    ki_step: m(ki_milli) * h,
                }
            }
            LawSpec::Pid {
                kp_milli,
                ki_milli,
                kd_milli,
            } => Feedback::Pid {
                kp: m(kp_milli),
                ki_step: m(ki_milli) * h,
                kd: m(kd_milli),
            },
        };
        Self {
            feedback,
            differentiator: Differentiating::pseudo(m(cutoff_mhz), h),
            sign,
            integral: 0.0,
        }
    }

    fn step(&mut self, error: f64) -> f64 {
        let rate = self.differentiator.step(error.to_radians());
        let answer = self.feedback.push(error.to_radians(), rate, self.integral);
        let Push { push, growth } = answer;
        let u = self.integral + self.sign * push;
        if !self.feedback.has_anti_windup() {
            self.integral += self.sign * growth;
            // The effort of this law is in volts, and the integral grows before the output.
            return (self.integral + self.sign * push) * PAPER_RANGE_V;
        }
        if u.abs() <= 1.0 || u * growth <= 0.0 {
            self.integral += growth;
        }
        u
    }
}

/// Returns the largest difference between device and f64 over 20 s.
fn worst(law: LawSpec, period_ms: u8, cutoff_mhz: u32) -> f64 {
    let mut reference = Reference::new(law, period_ms, cutoff_mhz, 1.0);
    let run = efforts(
        &spec(law, period_ms, cutoff_mhz),
        20_000 / u32::from(period_ms),
        wandering,
    );
    run.iter()
        .map(|(e, u)| (u - reference.step(*e)).abs())
        .fold(0.0, f64::max)
}

/// The bounds were measured over 20 s and must hold within a factor of two in both directions.
/// Differences above 1e-4 come from a switch (sgn S of the paper, the anti-windup of the others)
/// that the two arithmetics change one step apart: the integrals then differ by that step.
#[test]
fn fixed_point_agrees_with_f64() {
    for (name, law, bounds) in [
        ("paper, V", LawSpec::PAPER, [7.4e-4, 5.2e-3]),
        ("recommended", LawSpec::ALONE, [1.3e-5, 2.1e-3]),
        ("pid", LawSpec::PID, [6.1e-5, 2.8e-3]),
    ] {
        for (period, bound) in [11, 2].into_iter().zip(bounds) {
            let worst = worst(law, period, 6000);
            println!("{name:12} {period:2} ms: worst |fixed - f64| {worst:.2e}");
            assert!(
                worst < 2.0 * bound && worst > 0.5 * bound,
                "{name} {period} ms: {worst:e}"
            );
        }
    }
}

#[test]
fn a_finger_too_straight_is_flexed_by_every_law() {
    for law in LAWS {
        for (error, side) in [(10.0, 0), (-10.0, 1)] {
            let joint = Joint::new(&spec(law, 11, 3000)).unwrap();
            let mut state = JointState::default();
            let now = Micros::new(5);
            joint
                .accept_setpoint(&mut state, now, now, degrees(40.0 + error), None)
                .unwrap();
            let orders = joint.tick(&mut state, now, Some(degrees(40.0))).unwrap();
            let above = [24_000, 14_000];
            let lifted: Vec<bool> = orders
                .amplitudes
                .iter()
                .zip(above)
                .map(|(a, th)| a.1.get() > th)
                .collect();
            assert_eq!(
                lifted,
                [side == 0, side == 1],
                "{law:?} at an error of {error}°"
            );
        }
    }
}

/// Equation (4) as printed gives the same magnitude with the opposite sign. The test documents
/// this.
#[test]
fn the_law_as_printed_pushes_away() {
    let mut printed = Reference::new(LawSpec::PAPER, 11, 3000, -1.0);
    for (error, ours) in efforts(&spec(LawSpec::PAPER, 11, 3000), 500, wandering) {
        let theirs = printed.step(error);
        assert!((ours + theirs).abs() < 0.1, "{ours} and {theirs}");
        assert!(ours.abs() < 1.0 || ours * theirs < 0.0);
    }
}

/// After 5 s of an unreachable reference and then one that is reached, our laws release at once,
/// while the paper's has wound up by W·t = 5 V.
#[test]
fn only_the_paper_winds_up() {
    let blocked = |t: f64| if t < 5.0 { (90.0, 40.0) } else { (40.0, 40.0) };
    let steps = 5_000 / 11 + 200;
    for (law, left) in [
        (LawSpec::PAPER, true),
        (LawSpec::ALONE, false),
        (LawSpec::PID, false),
    ] {
        let run = efforts(&spec(law, 11, 3000), steps, blocked);
        // 2 s after the release, the derivative's response to the step of −50° has decayed.
        let at_rest = run[5_000 / 11 + 185].1;
        if left {
            assert!(at_rest > 2.0, "{at_rest} V");
        } else {
            assert!(at_rest < 1.0, "{law:?}: {at_rest}");
        }
    }
}

#[test]
fn a_ramp_is_differentiated_exactly() {
    for step_ms in 1..=20_u8 {
        for cutoff in [500, 3000, 8000, 20_000] {
            let d = Differentiator::new(cutoff, step_ms).unwrap();
            let mut state = DifferentiatorState::default();
            let h = f64::from(step_ms) * 1e-3;
            let steps = (3.0 / h) as u32;
            let mut rate = 0.0;
            for i in 0..steps {
                let x = degrees(-40.0 + 30.0 * f64::from(i) * h);
                rate = d.step(&mut state, x).get().to_num();
            }
            // Tolerance: one bit of the input, 1.5e-5°, over one step, and the 2^-20 of the gain.
            assert!(
                (rate - 30.0_f64).abs() < 0.02,
                "{step_ms} ms, {cutoff} mHz: {rate}"
            );
        }
    }
}

#[test]
fn a_step_decays_as_the_low_pass_says() {
    for (cutoff, step_ms) in [(500, 1), (3000, 1), (3000, 11), (8000, 5), (20_000, 20)] {
        let d = Differentiator::new(cutoff, step_ms).unwrap();
        let mut state = DifferentiatorState::default();
        d.step(&mut state, degrees(0.0));
        let h = f64::from(step_ms) * 1e-3;
        let pole = (-TAU * f64::from(cutoff) * 1e-3 * h).exp();
        let mut worst = 0.0_f64;
        for i in 0..200 {
            let rate: f64 = d.step(&mut state, degrees(10.0)).get().to_num();
            let exact = 10.0 * (1.0 - pole) / h * pole.powi(i);
            worst = worst.max((rate - exact).abs());
        }
        assert!(worst < 2e-3, "{cutoff} mHz, {step_ms} ms: {worst} °/s");
    }
}

#[test]
fn a_differentiator_outside_its_ranges_is_refused() {
    for (cutoff, step_ms) in [
        (499, 1),
        (20_001, 1),
        (3000, 0),
        (3000, 21),
        (u32::MAX, 255),
    ] {
        assert!(Differentiator::new(cutoff, step_ms).is_err());
    }
}
