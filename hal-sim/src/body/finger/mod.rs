//! An index finger's PIP joint, moved by two flexor points and one extensor point.

mod points;
mod spec;

use std::collections::VecDeque;

use super::joint::Joint;
use super::muscle::{Muscle, Step};
use super::sensor::AngleSensor;
use super::wearer::{Site, effective_voltage};
use super::{Body, CHANNELS, Load, Pulse};
pub use points::{Effect, Points};
pub use spec::{FingerSpec, InvalidSpec, Pair, TORQUE_FREQUENCY_HZ};

pub(super) const A: usize = 0;
pub(super) const B: usize = 1;
pub(super) const EXTENSOR: usize = 2;

/// A pulse on its way to its muscle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Excitation {
    due_us: u64,
    muscle: usize,
    effect: Effect,
}

/// The finger in motion. Deterministic: pulses and seed decide everything.
#[derive(Debug, Clone, PartialEq)]
pub struct Finger {
    spec: FingerSpec,
    sites: [Site; 3],
    points: Points,
    loads: [Load; CHANNELS],
    /// Whole steps passed.
    tick: u64,
    muscles: [Muscle; 3],
    muscle_step: Step,
    under_way: VecDeque<Excitation>,
    pair_factor: f64,
    /// What fatigue leaves of each muscle, 0 to 1.
    capacity: [f64; 3],
    torque_nm: f64,
    joint: Joint,
    sensor: AngleSensor,
}

impl Finger {
    /// A relaxed finger. `seed` decides the sensor's noise.
    ///
    /// # Errors
    /// [`InvalidSpec`] names a field that no finger can have.
    pub fn new(spec: FingerSpec, seed: u64) -> Result<Self, InvalidSpec> {
        spec.validate()?;
        Ok(Self {
            sites: spec.sites(),
            points: Points::new(&spec),
            loads: [Load::NOMINAL; CHANNELS],
            tick: 0,
            muscles: [Muscle::new(spec.muscle); 3],
            muscle_step: Step::new(&spec.muscle, spec.step_s()),
            under_way: VecDeque::with_capacity(64),
            pair_factor: 1.0,
            capacity: [1.0; 3],
            torque_nm: 0.0,
            joint: Joint::new(&spec.joint(), spec.step_s()),
            sensor: AngleSensor::new(spec.sensor(), spec.rest_deg, spec.step_s(), seed),
            spec,
        })
    }

    /// The numbers this finger was made from.
    pub fn spec(&self) -> &FingerSpec {
        &self.spec
    }

    /// Net muscle torque over the last step, N·m, flexion positive.
    pub fn torque_nm(&self) -> f64 {
        self.torque_nm
    }

    /// Joint rate, degrees per second, flexion positive.
    pub fn rate_deg_per_s(&self) -> f64 {
        self.joint.rate_rad_per_s.to_degrees()
    }

    /// Normalised force of flexor A, flexor B and extensor, before fatigue.
    pub fn muscle_forces(&self) -> [f64; 3] {
        self.muscles.map(|m| m.force())
    }

    /// Lets one step pass for the muscles; a muscle with pulses in it is split at
    /// each.
    fn step_muscles(&mut self) {
        let step_us = u64::from(self.spec.step_us);
        let start_us = self.tick * step_us;
        let mut passed_us = [0u64; 3];
        while let Some(e) = self.under_way.front().copied() {
            if e.due_us >= start_us + step_us {
                break;
            }
            self.under_way.pop_front();
            let at_us = e.due_us.saturating_sub(start_us);
            let muscle = &mut self.muscles[e.muscle];
            let span_us = at_us.saturating_sub(passed_us[e.muscle]);
            if span_us > 0 {
                muscle.step(&Step::new(&self.spec.muscle, span_us as f64 * 1e-6));
                passed_us[e.muscle] = at_us;
            }
            muscle.pulse(e.effect.recruitment);
            self.pair_factor = e.effect.pair_factor.unwrap_or(self.pair_factor);
        }
        for (muscle, passed_us) in self.muscles.iter_mut().zip(passed_us) {
            if passed_us == 0 {
                muscle.step(&self.muscle_step);
            } else {
                let rest_s = (step_us - passed_us) as f64 * 1e-6;
                muscle.step(&Step::new(&self.spec.muscle, rest_s));
            }
        }
    }

    /// Torque of the muscles at these normalised forces and the present angle.
    fn torque(&self, forces: [f64; 3]) -> f64 {
        let force = |i: usize| forces[i] * self.capacity[i];
        let (a, b) = (force(A), force(B));
        // One point alone is itself; a full pair is `pair_factor`.
        let flexor = a.max(b) + (self.pair_factor - 1.0) * a.min(b);
        let progress = self.joint.progress();
        let loss = self.spec.torque_loss;
        self.spec.flexor_torque_nm * flexor * (1.0 - loss * progress)
            - self.spec.extensor_torque_nm * force(EXTENSOR) * (1.0 - loss * (1.0 - progress))
    }

    fn tire(&mut self, forces: [f64; 3]) {
        let gain = self.spec.step_s() / self.spec.fatigue_time_s;
        for (capacity, force) in self.capacity.iter_mut().zip(forces) {
            let target = 1.0 - (1.0 - self.spec.fatigue_floor) * force.min(1.0);
            *capacity += gain * (target - *capacity);
        }
    }

    fn step(&mut self) {
        let before = self.muscle_forces();
        self.step_muscles();
        let after = self.muscle_forces();
        let mean = std::array::from_fn(|i| 0.5 * (before[i] + after[i]));
        self.torque_nm = self.torque(mean);
        self.tire(mean);
        self.joint.step(self.torque_nm);
        self.sensor.step(self.joint.angle_rad.to_degrees());
        self.tick += 1;
    }
}

impl Body for Finger {
    fn pulse(&mut self, pulse: &Pulse) {
        let Some(load) = self.loads.get(pulse.channel) else {
            return;
        };
        let effective_v = effective_voltage(load.current_ma(pulse.drive), pulse.width_us);
        if effective_v <= 0.0 {
            return;
        }
        for muscle in [A, B, EXTENSOR] {
            if self.sites[muscle].channel == pulse.channel {
                let effect = self
                    .points
                    .excite(muscle, pulse.t_us, effective_v, pulse.conducted);
                self.under_way.push_back(Excitation {
                    due_us: pulse.t_us + u64::from(self.spec.electromechanical_delay_us),
                    muscle,
                    effect,
                });
            }
        }
    }

    /// Joint and sensor move in whole steps: between them the values of the last
    /// one hold.
    fn fork(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.tick;
        while (self.tick + 1) * u64::from(self.spec.step_us) <= to_us {
            self.step();
        }
        self.tick != before
    }

    fn angle_deg(&self) -> f64 {
        self.joint.angle_rad.to_degrees()
    }

    fn sensed_deg(&self) -> f64 {
        self.sensor.read(self.tick)
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
