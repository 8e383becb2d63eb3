//! The simulated arm in motion: pulses change the force at the cuff, or turn the segments.

use super::anatomy::{ALL, ELECTRODES, MUSCLES, Muscle};
use super::angles::{angles_deg, rotate_half_turn};
use super::driven::{StimulatedMuscle, recruited_muscles};
use super::mechanics::{self, Free, Square, ToWrench};
use super::posture::{JointRotations, Skeleton};
use super::sensors::{ForceSensor, Imu, MountedImu};
use super::spec::{ArmSpec, InvalidArm, SEGMENTS};
use crate::body::{Body, CHANNELS, Load, Pulse};
use crate::random;
use nalgebra::Vector3;

/// Unit in which the arm counts time, and its finest time step, µs.
const TICK_US: u64 = 1000;

/// How the arm is supported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// The arm is fixed in the cuff of the force sensor.
    InCuff,
    /// Only the wearer holds the arm, and the segments can turn.
    Freely,
}

/// Simulated right arm over time: its muscles, joints and sensors.
///
/// The simulation is deterministic: the pulses and the seed determine every value.
#[derive(Debug, Clone)]
pub struct Arm {
    spec: ArmSpec,
    skeleton: Skeleton,
    /// Moment arms of each muscle about each turn's axis, m.
    arms_m: [JointRotations; MUSCLES],
    muscles: [StimulatedMuscle; MUSCLES],
    to_wrench: ToWrench,
    /// Deflection of the turns per torque while the arm is in the cuff, rad/N m.
    compliance: Square,
    /// Mean torque of the muscles about each turn over the last time step, N m.
    torques: JointRotations,
    free: Free,
    held: Support,
    /// Voluntary force (N) and torque (N m) at the cuff.
    voluntary: [f64; 6],
    /// Force (N) and torque (N m) on the cuff over the last time step, without the arm's weight.
    wrench: [f64; 6],
    sensor: ForceSensor,
    imus: [MountedImu; SEGMENTS],
    loads: [Load; CHANNELS],
    /// Length of a time step of force and motion, ms.
    step_ticks: u64,
    /// Number of whole milliseconds that have been simulated.
    tick: u64,
}

impl Arm {
    /// Creates an arm that rests in the cuff and is simulated in steps of 1 ms.
    ///
    /// # Errors
    /// Returns an [`InvalidArm`] that names the first field with an invalid value, or reports that
    /// nothing resists the rotation of some joint.
    pub fn new(spec: ArmSpec) -> Result<Self, InvalidArm> {
        Self::in_steps_of(spec, 1)
    }

    /// Creates an arm that rests in the cuff and is simulated in steps of `step_ms` milliseconds, at
    /// least one. Between the ends of two steps no value changes. Pulses take effect at their own
    /// times within a step, and the noise does not depend on the step.
    ///
    /// # Errors
    /// Fails as [`Self::new`].
    pub fn in_steps_of(spec: ArmSpec, step_ms: u32) -> Result<Self, InvalidArm> {
        let step_ms = step_ms.max(1);
        let step_s = f64::from(step_ms) * 1e-3;
        spec.validate()?;
        let skeleton = Skeleton::new(spec.posture, spec.lengths());
        let stream_seed = |stream: u64| random::word(spec.seed, stream);
        let arms_m =
            std::array::from_fn(|muscle| skeleton.arms_m(ALL[muscle], spec.azimuth_deg[muscle]));
        let forces = spec.forces_n();
        let muscles = std::array::from_fn(|muscle| {
            let seed = random::word(stream_seed(1), muscle as u64);
            StimulatedMuscle::new(&spec, forces[muscle], step_s, seed)
        });
        let frames = skeleton.frames();
        let imus = std::array::from_fn(|segment| {
            let seed = random::word(stream_seed(2), segment as u64);
            MountedImu::new(spec.imu, spec.imu_faults[segment], &frames[segment], seed)
        });
        let (to_wrench, compliance) = mechanics::cuff_response(&spec, &skeleton)?;
        Ok(Self {
            to_wrench,
            compliance,
            torques: JointRotations::zeros(),
            free: Free::new(&spec, &skeleton, step_s)?,
            held: Support::InCuff,
            voluntary: [0.0; 6],
            wrench: [0.0; 6],
            sensor: ForceSensor::new(spec.force, mechanics::weight_n(&spec), stream_seed(3)),
            imus,
            loads: [Load::Ohms(spec.load_ohm); CHANNELS],
            step_ticks: u64::from(step_ms),
            tick: 0,
            arms_m,
            muscles,
            skeleton,
            spec,
        })
    }

    /// Returns the specification from which the arm was created.
    #[must_use]
    pub const fn spec(&self) -> &ArmSpec {
        &self.spec
    }

    /// Returns the bones of the arm in its posture.
    #[must_use]
    pub const fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Returns the moment arms of a muscle: its torque about each turn's axis per newton, m.
    #[must_use]
    pub const fn arms_m(&self, muscle: Muscle) -> &JointRotations {
        &self.arms_m[muscle as usize]
    }

    /// Returns the matrix from torques about the turns (N m) to force (N) and torque (N m) at
    /// the cuff.
    #[must_use]
    pub const fn to_wrench(&self) -> &ToWrench {
        &self.to_wrench
    }

    /// Moves the arm into the cuff or out of it. The arm comes to rest at its posture.
    pub fn set_support(&mut self, held: Support) {
        self.held = held;
        self.free.settle();
    }

    /// Sets the voluntary force (N) and torque (N m) at the cuff from now on. They act only
    /// while the arm is in the cuff.
    pub const fn set_voluntary_wrench(&mut self, wrench: [f64; 6]) {
        self.voluntary = wrench;
    }

    /// Returns the true force (N) and torque (N m) of the arm on the cuff over the last
    /// time step, without the arm's weight. They are zero while the arm is not in the cuff.
    #[must_use]
    pub const fn wrench(&self) -> [f64; 6] {
        self.wrench
    }

    /// Returns the force (N) and torque (N m) that the sensor in the cuff measures.
    #[must_use]
    pub fn sensed_wrench(&self) -> [f64; 6] {
        self.sensor.read(&self.wrench)
    }

    /// Returns the measurement of a segment's IMU: 0 is the shoulder, 1 the upper arm, 2 the
    /// forearm. Returns `None` for any other number.
    #[must_use]
    pub fn imu(&self, segment: usize) -> Option<Imu> {
        let imu = self.imus.get(segment)?;
        Some(imu.read(&self.free.rate(segment), self.tick))
    }

    /// Returns the force of each muscle at the end of the last time step, N.
    #[must_use]
    pub fn forces_n(&self) -> [f64; MUSCLES] {
        self.muscles.each_ref().map(StimulatedMuscle::force_n)
    }

    /// Returns the share of each muscle's force that fatigue leaves, 0 to 1.
    #[must_use]
    pub fn freshness(&self) -> [f64; MUSCLES] {
        let now_us = self.tick * TICK_US;
        self.muscles
            .each_ref()
            .map(|muscle| muscle.freshness(&self.spec, now_us))
    }

    /// Returns the deflection of each turn from the posture, rad.
    fn deflections(&self) -> JointRotations {
        match self.held {
            Support::InCuff => self.compliance * self.torques,
            Support::Freely => *self.free.deflections(),
        }
    }

    /// Advances the arm by one time step.
    fn step(&mut self) {
        let end_us = (self.tick + self.step_ticks) * TICK_US;
        let mut torques = JointRotations::zeros();
        for (muscle, moment_arms) in self.muscles.iter_mut().zip(&self.arms_m) {
            let before = muscle.force_n();
            muscle.advance(end_us);
            let force = 0.5 * (before + muscle.force_n());
            if force > 0.0 {
                torques += force * moment_arms;
            }
        }
        self.torques = torques;
        match self.held {
            Support::InCuff => {
                let evoked = self.to_wrench * torques;
                self.wrench = std::array::from_fn(|axis| evoked[axis] + self.voluntary[axis]);
                (0..self.step_ticks).for_each(|_| self.sensor.step());
            }
            Support::Freely => {
                self.wrench = [0.0; 6];
                self.free.step(&torques);
            }
        }
        self.tick += self.step_ticks;
    }
}

impl Body for Arm {
    fn pulse(&mut self, pulse: &Pulse) {
        let (Some(load), true) = (self.loads.get(pulse.channel), pulse.channel < ELECTRODES) else {
            return;
        };
        let current_ma = load.current_ma(pulse.drive);
        let due_us = pulse.t_us + u64::from(self.spec.delay_us);
        let recruited = recruited_muscles(&self.spec, pulse.channel, current_ma, pulse.width_us);
        for (muscle, share) in recruited {
            self.muscles[muscle as usize].excite(due_us, share);
        }
    }

    fn fork(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    /// Advances the arm in whole time steps. Until the next step is complete, no value changes.
    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.tick;
        while (self.tick + self.step_ticks) * TICK_US <= to_us {
            self.step();
        }
        self.tick != before
    }

    /// Returns the true elbow flexion, degrees.
    fn angle_deg(&self) -> f64 {
        self.spec.posture.elbow_deg + self.deflections()[6].to_degrees()
    }

    /// Returns the true elbow flexion, degrees: the arm has sensors for force and turning rate
    /// only, not for angles.
    fn sensed_deg(&self) -> f64 {
        self.angle_deg()
    }

    /// Returns the nine joint angles, degrees: the configured posture plus the present deflection
    /// of the joints.
    fn posture_deg(&self) -> Option<[f64; 9]> {
        let turns = self.deflections();
        Some(angles_deg(&self.spec.posture, &self.skeleton, &turns))
    }

    /// Returns the true force on the cuff without the arm's weight, N, in the directions backward,
    /// right and up. Returns `None` while the arm is not in the cuff.
    fn hand_force_n(&self) -> Option<[f64; 3]> {
        let [x, y, z, ..] = self.wrench;
        let force = rotate_half_turn(Vector3::new(x, y, z)).into();
        (self.held == Support::InCuff).then_some(force)
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
