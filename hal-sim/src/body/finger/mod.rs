//! Simulated PIP joint of an index finger, which two flexor points and one extensor point move.

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

/// Index of flexor point A.
pub(super) const A: usize = 0;
/// Index of flexor point B.
pub(super) const B: usize = 1;
/// Index of the extensor point.
pub(super) const EXTENSOR: usize = 2;

/// The effect of a pulse on a muscle, pending during the electromechanical delay.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Excitation {
    due_us: u64,
    muscle: usize,
    effect: Effect,
}

/// Simulated index finger over time: its muscles, PIP joint and angle sensor.
///
/// The simulation is deterministic: the pulses and the seed determine every value.
#[derive(Debug, Clone, PartialEq)]
pub struct Finger {
    spec: FingerSpec,
    sites: [Site; 3],
    points: Points,
    loads: [Load; CHANNELS],
    /// Number of whole time steps since the start.
    tick: u64,
    muscles: [Muscle; 3],
    muscle_step: Step,
    /// Excitations that have not acted yet, in order of time.
    pending: VecDeque<Excitation>,
    /// Torque of the full flexor pair divided by that of one point alone.
    pair_factor: f64,
    /// Share of each muscle's force that fatigue leaves, 0 to 1.
    capacity: [f64; 3],
    torque_nm: f64,
    /// Torque from outside, N·m, flexion positive.
    external_nm: f64,
    joint: Joint,
    sensor: AngleSensor,
}

impl Finger {
    /// Creates a relaxed finger. `seed` determines the noise of the angle sensor.
    ///
    /// # Errors
    /// Returns an [`InvalidSpec`] that names the first field whose value is out of range.
    pub fn new(spec: FingerSpec, seed: u64) -> Result<Self, InvalidSpec> {
        spec.validate()?;
        Ok(Self {
            sites: spec.sites(),
            points: Points::new(&spec),
            loads: [Load::NOMINAL; CHANNELS],
            tick: 0,
            muscles: [Muscle::new(spec.muscle); 3],
            muscle_step: Step::new(&spec.muscle, spec.step_s()),
            pending: VecDeque::with_capacity(64),
            pair_factor: 1.0,
            capacity: [1.0; 3],
            torque_nm: 0.0,
            external_nm: 0.0,
            joint: Joint::new(&spec.joint(), spec.step_s()),
            sensor: AngleSensor::new(spec.sensor(), spec.rest_deg, spec.step_s(), seed),
            spec,
        })
    }

    /// Returns the specification from which the finger was created.
    pub fn spec(&self) -> &FingerSpec {
        &self.spec
    }

    /// Returns the net muscle torque over the last time step, N·m; positive for flexion.
    pub fn torque_nm(&self) -> f64 {
        self.torque_nm
    }

    /// Returns the angular rate of the joint, degrees per second; positive for flexion.
    pub fn rate_deg_per_s(&self) -> f64 {
        self.joint.rate_rad_per_s.to_degrees()
    }

    /// Returns the normalised forces of flexor A, flexor B and extensor, without fatigue.
    pub fn muscle_forces(&self) -> [f64; 3] {
        self.muscles.map(|muscle| muscle.force())
    }

    /// Advances the muscles by one time step. If pulses act within the step, the step of
    /// their muscle is split at each of them.
    fn step_muscles(&mut self) {
        let step_us = u64::from(self.spec.step_us);
        let start_us = self.tick * step_us;
        let mut passed_us = [0u64; 3];
        while let Some(excitation) = self.pending.front().copied() {
            if excitation.due_us >= start_us + step_us {
                break;
            }
            self.pending.pop_front();
            let at_us = excitation.due_us.saturating_sub(start_us);
            let muscle = &mut self.muscles[excitation.muscle];
            let span_us = at_us.saturating_sub(passed_us[excitation.muscle]);
            if span_us > 0 {
                muscle.step(&Step::new(&self.spec.muscle, span_us as f64 * 1e-6));
                passed_us[excitation.muscle] = at_us;
            }
            let effect = excitation.effect;
            muscle.pulse(effect.recruitment);
            self.pair_factor = effect.pair_factor.unwrap_or(self.pair_factor);
        }
        for (muscle, passed_us) in self.muscles.iter_mut().zip(passed_us) {
            if passed_us == 0 {
                muscle.step(&self.muscle_step);
            } else {
                let remaining_s = (step_us - passed_us) as f64 * 1e-6;
                muscle.step(&Step::new(&self.spec.muscle, remaining_s));
            }
        }
    }

    /// Returns the net torque of the muscles at the current angle, N·m; positive for flexion.
    /// `forces` are the normalised forces without fatigue.
    fn torque(&self, forces: [f64; 3]) -> f64 {
        let force = |muscle: usize| forces[muscle] * self.capacity[muscle];
        let (a, b) = (force(A), force(B));
        // One point alone contributes its own force; two points at full force contribute
        // `pair_factor`.
        let flexor = a.max(b) + (self.pair_factor - 1.0) * a.min(b);
        let progress = self.joint.progress();
        let loss = self.spec.torque_loss;
        self.spec.flexor_torque_nm * flexor * (1.0 - loss * progress)
            - self.spec.extensor_torque_nm * force(EXTENSOR) * (1.0 - loss * (1.0 - progress))
    }

    /// Updates the fatigue of each muscle after one time step with these normalised forces.
    fn update_fatigue(&mut self, forces: [f64; 3]) {
        let gain = self.spec.step_s() / self.spec.fatigue_time_s;
        for (capacity, force) in self.capacity.iter_mut().zip(forces) {
            let steady_state = 1.0 - (1.0 - self.spec.fatigue_floor) * force.min(1.0);
            *capacity += gain * (steady_state - *capacity);
        }
    }

    /// Advances the finger by one time step.
    fn step(&mut self) {
        let before = self.muscle_forces();
        self.step_muscles();
        let after = self.muscle_forces();
        let mean = std::array::from_fn(|muscle| 0.5 * (before[muscle] + after[muscle]));
        self.torque_nm = self.torque(mean);
        self.update_fatigue(mean);
        self.joint.step(self.torque_nm + self.external_nm);
        self.sensor.step(self.joint.angle_rad.to_degrees());
        self.tick += 1;
    }
}

impl Body for Finger {
    fn set_external_torque(&mut self, torque_nm: f64) {
        self.external_nm = torque_nm;
    }

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
                self.pending.push_back(Excitation {
                    due_us: pulse.t_us + u64::from(self.spec.electromechanical_delay_us),
                    muscle,
                    effect,
                });
            }
        }
    }

    fn fork(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    /// Advances joint and sensor in whole time steps. Until the next time step is complete, no
    /// value changes.
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
