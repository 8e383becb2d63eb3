//! The arm in time: pulses in, force at the cuff or turning segments out.

use super::anatomy::{ALL, ELECTRODES, MUSCLES, Muscle};
use super::angles::{about, angles_deg};
use super::driven::{Driven, part};
use super::mechanics::{self, Free, Square, ToWrench};
use super::posture::{Skeleton, Turns};
use super::sensors::{ForceSensor, Imu, MountedImu};
use super::spec::{ArmSpec, InvalidArm, SEGMENTS};
use crate::body::{Body, CHANNELS, Load, Pulse};
use crate::random;
use nalgebra::Vector3;

/// Step of force and motion, µs.
const TICK_US: u64 = 1000;
const TICK_S: f64 = 1e-3;

/// What holds the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Held {
    /// The cuff of the force sensor.
    InCuff,
    /// The person alone: segments turn.
    Freely,
}

/// An arm in motion. Deterministic: pulses and seed decide everything.
#[derive(Debug, Clone)]
pub struct Arm {
    spec: ArmSpec,
    skeleton: Skeleton,
    arms_m: [Turns; MUSCLES],
    muscles: [Driven; MUSCLES],
    to_wrench: ToWrench,
    /// How far turns give way in the cuff, rad/N m.
    gives: Square,
    /// What muscles pull with, N m, over the last millisecond.
    torques: Turns,
    free: Free,
    held: Held,
    voluntary: [f64; 6],
    wrench: [f64; 6],
    sensor: ForceSensor,
    imus: [MountedImu; SEGMENTS],
    loads: [Load; CHANNELS],
    tick: u64,
}

impl Arm {
    /// At rest in the cuff.
    ///
    /// # Errors
    /// [`InvalidArm`] names what no arm can have.
    pub fn new(spec: ArmSpec) -> Result<Self, InvalidArm> {
        spec.validate()?;
        let skeleton = Skeleton::new(spec.posture, spec.lengths());
        let stream = |what: u64| random::word(spec.seed, what);
        let arms_m = std::array::from_fn(|at| skeleton.arms_m(ALL[at], spec.azimuth_deg[at]));
        let forces = spec.forces_n();
        let muscles = std::array::from_fn(|at| {
            Driven::new(&spec, forces[at], random::word(stream(1), at as u64))
        });
        let frames = skeleton.frames();
        let imus = std::array::from_fn(|segment| {
            let seed = random::word(stream(2), segment as u64);
            MountedImu::new(spec.imu, spec.imu_faults[segment], &frames[segment], seed)
        });
        let (to_wrench, gives) = mechanics::held(&spec, &skeleton)?;
        Ok(Self {
            to_wrench,
            gives,
            torques: Turns::zeros(),
            free: Free::new(&spec, &skeleton, TICK_S)?,
            held: Held::InCuff,
            voluntary: [0.0; 6],
            wrench: [0.0; 6],
            sensor: ForceSensor::new(spec.force, mechanics::weight_n(&spec), stream(3)),
            imus,
            loads: [Load::Ohms(spec.load_ohm); CHANNELS],
            tick: 0,
            arms_m,
            muscles,
            skeleton,
            spec,
        })
    }

    /// The numbers it was made from.
    #[must_use]
    pub const fn spec(&self) -> &ArmSpec {
        &self.spec
    }

    /// Its bones.
    #[must_use]
    pub const fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Torque of one newton of a muscle about each turn's axis, m.
    #[must_use]
    pub const fn arms_m(&self, muscle: Muscle) -> &Turns {
        &self.arms_m[muscle as usize]
    }

    /// What the cuff feels of these torques, N and N m.
    #[must_use]
    pub const fn to_wrench(&self) -> &ToWrench {
        &self.to_wrench
    }

    /// Takes the arm into the cuff, or out of it; it comes to rest at its posture.
    pub fn hold(&mut self, held: Held) {
        self.held = held;
        self.free.settle();
    }

    /// The person pushes with this from now on (force in N, torque in N m), as far as the
    /// cuff feels it.
    pub const fn push(&mut self, wrench: [f64; 6]) {
        self.voluntary = wrench;
    }

    /// What the arm truly pushes the cuff with beside its weight, N and N m, over the last
    /// millisecond; zero outside of it.
    #[must_use]
    pub const fn wrench(&self) -> [f64; 6] {
        self.wrench
    }

    /// What the sensor in the cuff reads.
    #[must_use]
    pub fn sensed_wrench(&self) -> [f64; 6] {
        self.sensor.read(&self.wrench)
    }

    /// What a segment's IMU reads; `segment` is below [`SEGMENTS`].
    #[must_use]
    pub fn imu(&self, segment: usize) -> Option<Imu> {
        let imu = self.imus.get(segment)?;
        Some(imu.read(&self.free.rate(segment), self.tick))
    }

    /// Force of each muscle, N.
    #[must_use]
    pub fn forces_n(&self) -> [f64; MUSCLES] {
        self.muscles.each_ref().map(Driven::force_n)
    }

    /// What tiredness leaves of each muscle, 0 to 1.
    #[must_use]
    pub fn freshness(&self) -> [f64; MUSCLES] {
        let now_us = self.tick * TICK_US;
        self.muscles
            .each_ref()
            .map(|it| it.freshness(&self.spec, now_us))
    }

    /// How far each turn has given way, rad.
    fn turns(&self) -> Turns {
        match self.held {
            Held::InCuff => self.gives * self.torques,
            Held::Freely => *self.free.turns(),
        }
    }

    fn step(&mut self) {
        let end_us = (self.tick + 1) * TICK_US;
        let mut torques = Turns::zeros();
        for (muscle, arms) in self.muscles.iter_mut().zip(&self.arms_m) {
            let before = muscle.force_n();
            muscle.pass(end_us);
            let force = 0.5 * (before + muscle.force_n());
            if force > 0.0 {
                torques += force * arms;
            }
        }
        self.torques = torques;
        match self.held {
            Held::InCuff => {
                let felt = self.to_wrench * torques;
                self.wrench = std::array::from_fn(|axis| felt[axis] + self.voluntary[axis]);
                self.sensor.step();
            }
            Held::Freely => {
                self.wrench = [0.0; 6];
                self.free.step(&torques);
            }
        }
        self.tick += 1;
    }
}

impl Body for Arm {
    fn pulse(&mut self, pulse: &Pulse) {
        let (Some(load), true) = (self.loads.get(pulse.channel), pulse.channel < ELECTRODES) else {
            return;
        };
        let current_ma = load.current_ma(pulse.drive);
        let due_us = pulse.t_us + u64::from(self.spec.delay_us);
        let own = ALL[pulse.channel];
        let reached = part(&self.spec, pulse.channel, current_ma, pulse.width_us);
        self.muscles[pulse.channel].excite(due_us, reached);
        for neighbour in own.neighbours() {
            let at = *neighbour as usize;
            // What no electrode lies on answers as the muscle above it.
            let like = if at < ELECTRODES { at } else { pulse.channel };
            let there = self.spec.crosstalk[pulse.channel] * current_ma;
            let reached = part(&self.spec, like, there, pulse.width_us);
            self.muscles[at].excite(due_us, reached);
        }
    }

    /// Everything moves in whole milliseconds: between them the values of the last one
    /// hold.
    fn fork(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.tick;
        while (self.tick + 1) * TICK_US <= to_us {
            self.step();
        }
        self.tick != before
    }

    /// Elbow flexion, degrees.
    fn angle_deg(&self) -> f64 {
        self.spec.posture.elbow_deg + self.turns()[6].to_degrees()
    }

    /// Elbow flexion as it is: what is sensed of an arm are forces and turning rates.
    fn sensed_deg(&self) -> f64 {
        self.angle_deg()
    }

    /// The declared posture, and what cuff or joints give way.
    fn posture_deg(&self) -> Option<[f64; 9]> {
        let turns = self.turns();
        Some(angles_deg(&self.spec.posture, &self.skeleton, &turns))
    }

    fn hand_n(&self) -> Option<[f64; 3]> {
        let [x, y, z, ..] = self.wrench;
        let force = about(Vector3::new(x, y, z)).into();
        (self.held == Held::InCuff).then_some(force)
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
