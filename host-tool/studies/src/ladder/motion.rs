//! A finger in closed loop: what a slower law, or a coarser simulated body,
//! costs its tracking.

use hal_sim::body::wearer::Participant;
use hal_sim::body::{Body, Drive, Finger, FingerSpec, InvalidSpec, Pulse};
use hal_sim::random::Random;
use host_core::choice::grid::{Discretization, STEPS_MS};
use methods::control::feedback::Form;
use methods::control::{AddOns, Controller, Input, Law, ParameterError, twist};

/// Angles the wanted angle goes to and fro between, degrees: what one point
/// reaches in most wearers.
const ENDS_DEG: [f64; 2] = [20.0, 60.0];
/// Rest at each end, ms, drawn between these.
const DWELL_MS: (f64, f64) = (300.0, 700.0);
/// Each trial has this many ways to and fro, and is scored from the second on.
const WAYS: usize = 4;
/// λ in 1/s, k1, k2 in 1/rad and b in rad/s² of the device's law for a joint of whose
/// wearer nothing is known (`firmware::control::LawSpec::ALONE`), and the cutoff of
/// its differentiator, Hz.
const LAW: [f64; 5] = [10.0, 0.08, 1.08, 150.0, 17.0];
/// Pulse period, µs: 50 Hz, where the finger's torques hold.
const PERIOD_US: u64 = 20_000;
/// Participants with a seed each for noise and rests.
const TRIALS: [(Participant, u64); 6] = [
    (Participant::P, 1),
    (Participant::Q, 2),
    (Participant::S, 3),
    (Participant::P, 4),
    (Participant::Q, 5),
    (Participant::S, 6),
];

/// How a trial is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Time in which the wanted angle goes from end to end, ms.
    pub ramp_ms: u32,
    /// Period of the law, ms.
    pub law_period_ms: u8,
    /// Explicit or proper implicit.
    pub discretization: Discretization,
    /// Step of the simulated body, ms.
    pub step_ms: u8,
}

/// Why a trial cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    /// No such law.
    #[error("E574 the law's numbers: {0:?}")]
    Law(ParameterError),
    /// No such finger.
    #[error(transparent)]
    Body(#[from] InvalidSpec),
}

/// The wanted angle every millisecond, degrees, with its rate, degrees/s.
fn course(ramp_ms: u32, seed: u64) -> Vec<(f64, f64)> {
    let mut random = Random::new(seed);
    let mut all = Vec::new();
    let span = ENDS_DEG[1] - ENDS_DEG[0];
    for way in 0..WAYS {
        let (from, sign) = (ENDS_DEG[way % 2], if way % 2 == 0 { 1.0 } else { -1.0 });
        let dwell = random.log_between(DWELL_MS.0, DWELL_MS.1) as u32;
        all.extend((0..dwell).map(|_| (from, 0.0)));
        let rate = sign * span * 1e3 / f64::from(ramp_ms.max(1));
        let part = |i: u32| f64::from(i) / f64::from(ramp_ms);
        all.extend((0..ramp_ms).map(|i| (from + sign * span * part(i), rate)));
    }
    all
}

/// Root-mean-square errors of tracking, degrees, trial by trial.
pub fn errors_deg(setting: &Setting) -> Result<[f64; TRIALS.len()], MotionError> {
    let mut all = [0.0; TRIALS.len()];
    for (error, (participant, seed)) in all.iter_mut().zip(TRIALS) {
        *error = trial(setting, participant, seed)?;
    }
    Ok(all)
}

fn trial(setting: &Setting, participant: Participant, seed: u64) -> Result<f64, MotionError> {
    let h = f64::from(setting.law_period_ms) * 1e-3;
    let (discretization, numbers): (_, &[f64]) = match setting.discretization {
        // The explicit form has no use for b.
        Discretization::Explicit => (
            twist::Discretization::Explicit,
            &[LAW[0], LAW[1], LAW[2], LAW[4]],
        ),
        Discretization::Implicit => (twist::Discretization::ProperImplicit, &LAW),
    };
    let form = Form::Twisting(discretization);
    let mut law =
        Controller::from_parameters(form, AddOns::NONE, h, numbers).map_err(MotionError::Law)?;
    let mut hand = Hand::new(participant, setting.step_ms, seed)?;
    let course = course(setting.ramp_ms, seed);
    let scored_from = course.len() / WAYS;
    let mut effort = 0.0;
    let mut sum = 0.0;
    for (ms, &(wanted, rate)) in course.iter().enumerate() {
        if ms.is_multiple_of(setting.law_period_ms.into()) {
            effort = law.step(&Input {
                target: wanted.to_radians(),
                target_rate: rate.to_radians(),
                measured: hand.finger.sensed_deg().to_radians(),
                feed_forward: 0.0,
            });
        }
        hand.millisecond(ms as u64, effort);
        if ms >= scored_from {
            sum += (wanted - hand.finger.angle_deg()).powi(2);
        }
    }
    Ok((sum / (course.len() - scored_from) as f64).sqrt())
}

/// A finger and the pulses it gets.
struct Hand {
    finger: Finger,
    /// Threshold and maximum of A, B together and the extensor, V.
    volts: [(f64, f64); 3],
}

impl Hand {
    fn new(participant: Participant, step_ms: u8, seed: u64) -> Result<Self, InvalidSpec> {
        let spec = FingerSpec {
            step_us: u32::from(step_ms) * 1000,
            ..FingerSpec::participant(participant)
        };
        let [a, b, extensor] = participant.voltages();
        let paired = |(_, max): (f64, f64)| (spec.two_point_threshold_ratio * max, max);
        Ok(Self {
            volts: [paired(a), paired(b), extensor],
            finger: Finger::new(spec, seed)?,
        })
    }

    /// One millisecond at an effort: flexors above 0, the extensor below.
    fn millisecond(&mut self, ms: u64, effort: f64) {
        self.pulses(ms, effort);
        self.finger.advance((ms + 1) * 1000);
    }

    fn pulses(&mut self, ms: u64, effort: f64) {
        let start_us = ms * 1000;
        for (channel, (threshold, max)) in self.volts.into_iter().enumerate() {
            let share = if channel == 2 { -effort } else { effort };
            // Channels 1 ms apart, all at 50 Hz.
            if share > 0.0 && start_us % PERIOD_US == channel as u64 * 1000 {
                self.finger.pulse(&Pulse {
                    t_us: start_us,
                    channel,
                    drive: Drive::Volts(threshold + share.min(1.0) * (max - threshold)),
                    width_us: 200,
                    conducted: true,
                });
            }
        }
    }
}

/// What `setting` costs against `best`, as a part of the way the angle goes:
/// the worst trial's rise of the error of tracking, at least 0.
pub fn loss(setting: &Setting, best: &[f64]) -> Result<f64, MotionError> {
    worst(setting, best, |rise| rise)
}

/// What `setting` changes against `fine`, either way, as a part of the way.
pub fn change(setting: &Setting, fine: &[f64]) -> Result<f64, MotionError> {
    worst(setting, fine, f64::abs)
}

fn worst(setting: &Setting, best: &[f64], of: fn(f64) -> f64) -> Result<f64, MotionError> {
    let errors = errors_deg(setting)?;
    let rises = errors.iter().zip(best).map(|(now, best)| of(now - best));
    Ok(rises.fold(0.0, f64::max) / (ENDS_DEG[1] - ENDS_DEG[0]))
}

/// How many times faster than real time the simulated finger alone runs on this
/// computer at a step of the grid, both flexors and the extensor pulsed: the
/// best of ten tries, as other work only slows it. Differs from run to run.
pub fn speed(step_ms: u8) -> Result<f64, MotionError> {
    const SECONDS: u64 = 10;
    let longest = usize::from(STEPS_MS[STEPS_MS.len() - 1]);
    let mut best = 0f64;
    for _ in 0..10 {
        let mut hand = Hand::new(Participant::P, step_ms, 1)?;
        let begin = std::time::Instant::now();
        for ms in (0..SECONDS * 1000).step_by(longest) {
            hand.pulses(ms, if ms % 40 == 0 { 0.5 } else { -0.5 });
            hand.finger.advance(ms * 1000);
        }
        std::hint::black_box(hand.finger.angle_deg());
        best = best.max(SECONDS as f64 / begin.elapsed().as_secs_f64().max(1e-9));
    }
    Ok(best)
}
