//! One 30 s trial of Hamana 2022 experiment 4 with the device's own joint code.

use crate::control_finger::plant::{Body, Finger, Random, STEP_S};
use firmware::control::{
    HoldPolicy, Joint, JointSpec, JointState, LawSpec, PointSpec, SensorSource,
};
use firmware::units::{Amplitude, Angle, Micros, us};
use std::f64::consts::TAU;

/// Stimulation points of participant P's flexor (table 7).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Points {
    A,
    B,
    Both,
}

fn point(channel: u8, threshold: u32, max: u32) -> PointSpec {
    PointSpec {
        channel,
        threshold: Amplitude::new(threshold),
        max: Amplitude::new(max),
    }
}

/// Returns participant P's joint.
pub fn spec(law: LawSpec, law_period_ms: u8, cutoff_mhz: u32, points: Points) -> JointSpec {
    let pair = [
        PointSpec::of_pair(0, Amplitude::new(28_000), 700),
        PointSpec::of_pair(1, Amplitude::new(36_000), 700),
    ];
    let flexors = match points {
        Points::A => [point(0, 24_000, 28_000)].into_iter().collect(),
        Points::B => [point(1, 28_000, 36_000)].into_iter().collect(),
        Points::Both => pair.into_iter().collect(),
    };
    JointSpec {
        law,
        law_period_ms,
        cutoff_mhz,
        flexors,
        extensor: point(2, 14_000, 26_000),
        hold: HoldPolicy::Extrapolate { max_ms: 100 },
        angle_min_mdeg: 0,
        angle_max_mdeg: 100_000,
        sensor: SensorSource::Host,
        stale_after_ms: 100,
        wearer: None,
        response: None,
    }
}

fn angle(deg: f64) -> Angle {
    Angle::from_centideg((deg * 100.0).round() as i16)
}

fn reference_deg(t: f64) -> f64 {
    45.0 + 40.0 * (TAU * 0.2 * t).sin()
}

/// Result of one trial.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// RMSE against the reference over 10…30 s, degrees.
    pub rmse: f64,
    /// RMSE against the part of the reference that the finger can reach, degrees.
    pub rmse_reachable: f64,
    /// Share of ticks whose effort was limited.
    pub limiting: f64,
}

/// Disturbance of a trial.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wire {
    Sound,
    /// 54 of 100 setpoints are lost.
    LosesSetpoints,
    /// The controller's output has the opposite sign, as equation (4) is printed.
    PrintedSign,
}

/// Runs one trial with the noise of `seed`.
pub fn run(spec: &JointSpec, finger: Finger, seed: u64, wire: Wire) -> Outcome {
    let joint = Joint::new(spec).expect("a valid spec");
    let mut state = JointState::default();
    let mut body = Body::new(finger, seed);
    let two_point = spec.flexors.len() == 2;
    let reach = finger.reach_deg(two_point);
    let start = Micros::new(u32::MAX - 15_000_000);
    let per_tick = (0.001 / STEP_S).round() as usize;
    let (mut flex, mut extend) = (0.0, 0.0);
    let (mut sum, mut sum_reachable, mut limiting, mut samples) = (0.0, 0.0, 0u32, 0u32);
    let mut glove: Option<(Micros, f64)> = None;
    let mut frames = 0;
    let mut luck = Random(seed ^ 0x5E7);
    for ms in 0..30_000_u32 {
        let t = f64::from(ms) / 1000.0;
        let now = start + us(ms * 1000);
        // The host sends a frame at 90 Hz: the present angle, delayed 2 ms by the link.
        if t * 90.0 >= f64::from(frames) {
            frames += 1;
            glove = Some((now, body.glove_deg()));
            if frames == 1 || wire != Wire::LosesSetpoints || luck.uniform() >= 0.54 {
                joint
                    .accept_setpoint(&mut state, now, now, angle(reference_deg(t)), None)
                    .expect("a setpoint");
            }
        }
        if let Some((at, deg)) = glove.filter(|(at, _)| ms == 0 || (now - *at).us() >= 2000) {
            glove = None;
            // Mirroring the joint about the reference reverses the controller's sign.
            let deg = if wire == Wire::PrintedSign {
                2.0 * reference_deg(t) - deg
            } else {
                deg
            };
            joint
                .accept_measurement(&mut state, now, at, angle(deg))
                .expect("a measurement");
        }
        let orders = joint.tick(&mut state, now, None).expect("a sound sensor");
        flex = amplitude(spec, &orders.amplitudes[..spec.flexors.len()]).unwrap_or(flex);
        extend = amplitude(spec, &orders.amplitudes[spec.flexors.len()..]).unwrap_or(extend);
        for _ in 0..per_tick {
            body.step(flex, extend, two_point);
        }
        if ms >= 10_000 {
            let t = t + 0.001;
            samples += 1;
            sum += (reference_deg(t) - body.angle_deg()).powi(2);
            sum_reachable += (reference_deg(t).min(reach) - body.angle_deg()).powi(2);
            limiting += u32::from(orders.limiting);
        }
    }
    let n = f64::from(samples);
    Outcome {
        rmse: (sum / n).sqrt(),
        rmse_reachable: (sum_reachable / n).sqrt(),
        limiting: f64::from(limiting) / n,
    }
}

/// Returns the mean amplitude of the points in `orders`: 0 at threshold, 1 at maximum.
fn amplitude(spec: &JointSpec, orders: &[(u8, Amplitude)]) -> Option<f64> {
    let points = || spec.flexors.iter().chain([&spec.extensor]);
    let shares = orders.iter().map(|(channel, a)| {
        let p = points()
            .find(|p| p.channel == *channel)
            .expect("a known channel");
        (f64::from(a.get()) - f64::from(p.threshold.get()))
            / f64::from(p.max.get() - p.threshold.get())
    });
    (!orders.is_empty()).then(|| shares.sum::<f64>() / orders.len() as f64)
}
