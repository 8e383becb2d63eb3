//! Simulates one lift from grasp to release: body, device, virtual object and participant together.

use super::calibration::{ARMS, CHANNELS};
use super::control::{Control, LearntTorque};
use super::declaration::Study;
use super::device::Device;
use super::error::LiftError;
use super::person::LiftWearer;
use super::scene::Object;
use super::way::{LiftTrajectory, RATE_HZ, waypoints};
use firmware::haptics::MotionPhase;
use firmware::units::Amplitude;
use hal_sim::body::sagittal::{
    ELBOW, ELECTRODES, Intent, JOINTS, Links, MUSCLES, SHOULDER, SagittalArm,
};
use hal_sim::random;
use host_core::analysis::{SavitzkyGolay, Sparc, matching_error};

/// Time step of the participant, the object and the recording, ms.
const STEP_MS: usize = 5;
/// Resolution of the encoders, degrees.
const ENCODER_DEG: f64 = 0.01;
/// Random stream of the perceived target position in a lift.
const AIM: u64 = 0;
/// Random stream of the encoders' noise in a lift.
const ENCODER: u64 = 1;
/// Random stream of the noise of muscle drives in a lift.
const DRIVE: u64 = 2;

/// Accuracy, smoothness, energy and duration of one lift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LiftResult {
    /// Distance of the hands from their targets at the release, m, mean of both.
    pub error_m: f64,
    /// SPARC of the hands' speed, mean of both.
    pub sparc: f64,
    /// Energy that the muscles of both arms consume, J.
    pub used_j: f64,
    /// Duration of the lift, s.
    pub duration_s: f64,
    /// Time in the lifting and in the dropping phase, s, mean of both arms.
    pub phases_s: [f64; 2],
    /// Largest torque of stimulated fibres about elbow and shoulder, N m, over both arms.
    pub stimulated_nm: [f64; JOINTS],
    /// Number of steps in which no drives could produce the required torque.
    pub weak: u64,
}

/// Recording of a lift, for figures and for the comparison with the whole device.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Position of both hands, m from the shoulder, 200 times per second.
    pub hands_m: Vec<[[f64; 2]; ARMS]>,
    /// Encoder readings of elbow and shoulder of both arms, degrees, each millisecond.
    pub encoders_deg: Vec<[[f64; JOINTS]; ARMS]>,
    /// Time of each pulse, µs from the grasp, and each channel's amplitude.
    pub pulses: Vec<(u64, [Amplitude; CHANNELS])>,
}

/// Simulation of one participant's arms, which is reused for successive lifts.
#[derive(Clone, Debug)]
pub struct Worker<'a> {
    study: &'a Study,
    person: &'a LiftWearer,
    arms: [SagittalArm; ARMS],
    links: Links,
    held: [f64; MUSCLES],
    filter: SavitzkyGolay,
}

impl<'a> Worker<'a> {
    /// Creates the arms of a participant.
    ///
    /// # Errors
    /// Fails if an arm or a filter is invalid.
    pub fn new(study: &'a Study, person: &'a LiftWearer) -> Result<Self, LiftError> {
        let judged = &study.judged;
        let [left, right] = person.arms.clone();
        let (left, right) = (
            SagittalArm::new(left, [1.0; 2])?,
            SagittalArm::new(right, [1.0; 2])?,
        );
        let links = *left.links();
        Ok(Self {
            study,
            person,
            arms: [left, right],
            links,
            held: [0.0; MUSCLES],
            filter: SavitzkyGolay::with_cutoff(
                judged.filter_order,
                judged.filter_hz,
                f64::from(judged.rate_hz),
            )?,
        })
    }

    /// Returns the length of the straight arm from shoulder to hand, m.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        self.links.reach_m()
    }

    /// Returns the intended movement to a height. Its target is `off_m` from the true target, m
    /// forward and up.
    #[must_use]
    pub fn planned_trajectory(&self, height: usize, off_m: [f64; 2]) -> LiftTrajectory {
        let mut places = waypoints(self.study, self.links.reach_m(), height);
        for axis in 0..2 {
            places[2][axis] += off_m[axis];
        }
        LiftTrajectory::new(&self.links, places, self.person.will.timing)
    }

    /// Simulates a lift to a height. `seed` determines all randomness of the lift and `day_m` the
    /// error of the perceived target position on this day; `learnt` is each arm's feed-forward
    /// torque for this movement, which the lift updates.
    ///
    /// # Errors
    /// Fails if the movement cannot be judged.
    pub fn lift(
        &mut self,
        device: &mut Device,
        (height, seed): (usize, u64),
        day_m: [f64; 2],
        learnt: &mut [LearntTorque; ARMS],
        mut trace: Option<&mut Trace>,
    ) -> Result<LiftResult, LiftError> {
        let will = self.person.will;
        let aim = random::word(seed, AIM);
        let off =
            |axis: usize| day_m[axis] + will.aim_m[1] * random::standard_normal(aim, axis as u64);
        let way = self.planned_trajectory(height, [off(0), off(1)]);
        let start = way.flexions[0];
        self.begin(&way);
        device.reset();
        let mut object = Object::grasped(self.person.object, self.links.hand_m(start));
        let drive = |arm: u64| random::word(random::word(seed, DRIVE), arm);
        let mut controls =
            [0, 1].map(|arm| Control::new(will, self.person.object.mass_kg, drive(arm)));
        let encoder = random::word(seed, ENCODER);
        let steps = way.len() + (will.settle_s * RATE_HZ).round() as usize;
        let mut record = Record::default();
        let mut due_us = 0;
        for n in 0..steps {
            let hands = [0, 1].map(|arm| self.arms[arm].hand_motion());
            if n > 0 {
                object.step(1.0 / RATE_HZ, &hands);
            }
            let intents: [Intent; ARMS] = std::array::from_fn(|arm| {
                let own = &self.arms[arm];
                let state = (own.flexions(), own.rates());
                controls[arm].step((&way, &self.links, &learnt[arm]), n, state, &own.full_nm())
            });
            record.note(&hands, device);
            for tick in n * STEP_MS..(n + 1) * STEP_MS {
                let elbows = [0, 1].map(|arm| self.encoder(encoder, tick, (arm, ELBOW)));
                device.tick(elbows);
                let now_us = 1000 * tick as u64;
                if now_us >= due_us {
                    let shoulder = |arm| self.encoder(encoder, tick, (arm, SHOULDER));
                    let amplitudes =
                        device.amplitudes([0, 1].map(|arm| [elbows[arm], shoulder(arm)]));
                    self.pulse(now_us, &amplitudes);
                    if let Some(trace) = trace.as_deref_mut() {
                        trace.pulses.push((now_us, amplitudes));
                    }
                    due_us += self.study.period_us();
                }
                if let Some(trace) = trace.as_deref_mut() {
                    let shoulder = |arm| self.encoder(encoder, tick, (arm, SHOULDER));
                    trace
                        .encoders_deg
                        .push([0, 1].map(|arm| [elbows[arm], shoulder(arm)]));
                }
                for (arm, intent) in self.arms.iter_mut().zip(&intents) {
                    let force = object.force_n(arm.hand_motion());
                    arm.step(intent, force);
                    let most = record.stimulated_nm.iter_mut();
                    for (most, pulled) in most.zip(arm.stimulated_nm()) {
                        *most = most.max(pulled.abs());
                    }
                }
            }
        }
        for (control, learnt) in controls.iter().zip(learnt) {
            control.learn(learnt);
        }
        if let Some(trace) = trace {
            trace.hands_m.clone_from(&record.hands_m);
        }
        let weak = controls.iter().map(Control::infeasible_steps).sum();
        self.judge_lift(&record, height, weak)
    }

    /// Places the arms at rest on the table, where they hold their own weight.
    fn begin(&mut self, way: &LiftTrajectory) {
        let start = way.flexions[0];
        let weight = self
            .links
            .torques_nm(start, [0.0; JOINTS], [0.0; JOINTS], [0.0; 2]);
        for arm in &mut self.arms {
            arm.reset_to_rest(start, self.held);
            let muscles = host_core::limb::Muscles {
                full_nm: arm.full_nm().to_vec(),
                least: vec![0.0; MUSCLES],
            };
            // If the muscles cannot hold the arm, the lift starts without activation.
            if let Ok(found) = muscles.activations(weight) {
                arm.reset_to_rest(start, std::array::from_fn(|muscle| found[muscle]));
            }
        }
    }

    /// Returns the reading of an encoder with noise and limited resolution at millisecond `tick`,
    /// degrees.
    fn encoder(&self, seed: u64, tick: usize, (arm, joint): (usize, usize)) -> f64 {
        let place = (tick * ARMS + arm) * JOINTS + joint;
        let noise = self.person.encoder_deg * random::standard_normal(seed, place as u64);
        let deg = self.arms[arm].flexions()[joint].to_degrees() + noise;
        (deg / ENCODER_DEG).round() * ENCODER_DEG
    }

    fn pulse(&mut self, at_us: u64, amplitudes: &[Amplitude; CHANNELS]) {
        let width_us = self.study.protocol.width_us;
        for (channel, amplitude) in amplitudes.iter().enumerate() {
            let current_ma = 1e-3 * f64::from(amplitude.get());
            if current_ma > 0.0 {
                let arm = &mut self.arms[channel / ELECTRODES];
                arm.pulse(channel % ELECTRODES, at_us, current_ma, width_us);
            }
        }
    }

    fn judge_lift(
        &self,
        record: &Record,
        height: usize,
        weak: u64,
    ) -> Result<LiftResult, LiftError> {
        let [_, _, target] = waypoints(self.study, self.links.reach_m(), height);
        let released = [0, 1].map(|arm| (self.arms[arm].hand_motion().0, target));
        let rate_hz = f64::from(self.study.judged.rate_hz);
        let mut sparc = 0.0;
        for arm in 0..ARMS {
            let axis = |axis: usize| -> Result<Vec<f64>, LiftError> {
                let at: Vec<f64> = record
                    .hands_m
                    .iter()
                    .map(|hands_m| hands_m[arm][axis])
                    .collect();
                Ok(self.filter.smooth(&at)?)
            };
            let (x, z) = (axis(0)?, axis(1)?);
            let speed = |n: usize| libm::hypot(x[n + 1] - x[n], z[n + 1] - z[n]) * rate_hz;
            let speed: Vec<f64> = (0..x.len() - 1).map(speed).collect();
            sparc += Sparc::USUAL.arc_length(&speed, rate_hz)? / ARMS as f64;
        }
        Ok(LiftResult {
            error_m: matching_error(&released).unwrap_or(f64::NAN),
            sparc,
            used_j: self.arms.iter().map(SagittalArm::energy_used_j).sum(),
            duration_s: record.hands_m.len() as f64 / RATE_HZ,
            phases_s: record
                .phases
                .map(|phase| f64::from(phase) / (RATE_HZ * ARMS as f64)),
            stimulated_nm: record.stimulated_nm,
            weak,
        })
    }

    /// Returns the energy, J, of both arms and the duration, s, of the return to the table with
    /// empty hands, during which the muscles hold each posture of the path.
    #[must_use]
    pub fn return_cost(&mut self, height: usize) -> (f64, f64) {
        let return_s = self.study.way.return_s;
        let [start, _, target] = waypoints(self.study, self.links.reach_m(), height);
        let steps = 20;
        let mut used_w = 0.0;
        for n in 0..steps {
            let part = (f64::from(n) + 0.5) / f64::from(steps);
            let at = [0, 1].map(|axis| target[axis] + part * (start[axis] - target[axis]));
            let flexions = self.links.flexions(at);
            let weight = self
                .links
                .torques_nm(flexions, [0.0; JOINTS], [0.0; JOINTS], [0.0; 2]);
            for arm in &mut self.arms {
                arm.reset_to_rest(flexions, self.held);
                let muscles = host_core::limb::Muscles {
                    full_nm: arm.full_nm().to_vec(),
                    least: vec![0.0; MUSCLES],
                };
                let muscles = muscles.with_co_contraction(self.person.will.co_contraction, weight);
                if let Ok(found) = muscles.activations(weight) {
                    let found = std::array::from_fn(|muscle| found[muscle]);
                    used_w += arm.holding_power_w(&found) / f64::from(steps);
                }
            }
        }
        (used_w * return_s, return_s)
    }
}

/// Values recorded during a lift.
#[derive(Default)]
struct Record {
    hands_m: Vec<[[f64; 2]; ARMS]>,
    phases: [u32; 2],
    stimulated_nm: [f64; JOINTS],
}

impl Record {
    fn note(&mut self, hands: &[([f64; 2], [f64; 2]); ARMS], device: &Device) {
        self.hands_m.push(hands.map(|hand| hand.0));
        for arm in 0..ARMS {
            match device.phase(arm) {
                Some(MotionPhase::Lift) => self.phases[0] += 1,
                Some(MotionPhase::Drop) => self.phases[1] += 1,
                None => {}
            }
        }
    }
}
