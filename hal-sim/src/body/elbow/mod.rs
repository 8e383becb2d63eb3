//! A forearm about the elbow: triceps and biceps under electrodes, and a wearer who moves the arm
//! into a virtual wall.

mod draw;
mod person;
mod spec;
mod yields;

use crate::random::Noise;
use std::collections::VecDeque;

use super::muscle::{Muscle, Step};
use super::wearer::{effective_voltage, recruitment};
use super::{Body, CHANNELS, Load, Pulse};
use person::VisualFeedback;
pub use spec::{
    ElbowMuscle, ElbowSpec, InvalidElbow, MotorBehaviour, TORQUE_FREQUENCY_HZ, VisionSpec,
    VoluntaryApproach,
};
pub use yields::YieldSpec;
use yields::YieldState;

/// Time step of the joint, µs. The steps of the muscles are also split at every pulse.
const TICK_US: u64 = 1000;
const TICK_S: f64 = 1e-3;

/// A muscle and its pending pulses.
#[derive(Debug, Clone, PartialEq)]
struct StimulatedMuscle {
    spec: ElbowMuscle,
    muscle: Muscle,
    step: Step,
    /// Pending pulses: time at which each takes effect, µs, and recruited share.
    under_way: VecDeque<(u64, f64)>,
}

/// The arm over time. The simulation is deterministic: pulses, wearer and seed determine every
/// value.
#[derive(Debug, Clone, PartialEq)]
pub struct Elbow {
    spec: ElbowSpec,
    noise: Noise,
    loads: [Load; CHANNELS],
    /// Number of whole milliseconds since the start.
    tick: u64,
    /// Start of the wearer's trial, ms.
    begun: u64,
    triceps: StimulatedMuscle,
    biceps: StimulatedMuscle,
    seen: VisualFeedback,
    felt: YieldState,
    voluntary_nm: f64,
    angle_rad: f64,
    rate_rad_per_s: f64,
}

impl Elbow {
    /// Creates an arm at rest at the start angle of its wearer. `seed` determines the noise of the
    /// sensor.
    ///
    /// # Errors
    /// Returns an [`InvalidElbow`] that names the first field whose value is out of range.
    pub fn new(spec: ElbowSpec, seed: u64) -> Result<Self, InvalidElbow> {
        spec.validate()?;
        Ok(Self {
            noise: Noise::new(seed),
            loads: [Load::Ohms(spec.load_ohm); CHANNELS],
            tick: 0,
            begun: 0,
            triceps: StimulatedMuscle::new(spec.triceps),
            biceps: StimulatedMuscle::new(spec.biceps),
            seen: VisualFeedback::default(),
            felt: YieldState::default(),
            voluntary_nm: 0.0,
            angle_rad: spec.person.start_deg.to_radians(),
            rate_rad_per_s: 0.0,
            spec,
        })
    }

    /// Returns the specification from which the arm was created.
    pub fn spec(&self) -> &ElbowSpec {
        &self.spec
    }

    /// Returns the angular rate of the joint, degrees per second, flexion positive.
    pub fn rate_deg_per_s(&self) -> f64 {
        self.rate_rad_per_s.to_degrees()
    }

    /// Returns the torques of triceps (extending) and biceps (flexing), N·m, neither negative.
    pub fn torques_nm(&self) -> [f64; 2] {
        [self.triceps.torque_nm(), self.biceps.torque_nm()]
    }

    /// Returns the wearer's voluntary torque over the last millisecond, N·m, flexion positive.
    pub fn voluntary_nm(&self) -> f64 {
        self.voluntary_nm
    }

    fn step(&mut self) {
        let start_us = self.tick * TICK_US;
        let before = self.torques_nm();
        self.triceps.pass(start_us);
        self.biceps.pass(start_us);
        let after = self.torques_nm();
        let [triceps, biceps] = [0, 1].map(|i| 0.5 * (before[i] + after[i]));
        let t_s = ((self.tick - self.begun) * TICK_US) as f64 * 1e-6;
        let person = &self.spec.person;
        let (angle, rate) = (self.angle_rad, self.rate_rad_per_s);
        let push_nm = person.push_nm * self.felt.strength(person.yields, start_us);
        self.voluntary_nm = person.torque_nm(push_nm, &mut self.seen, t_s, angle, rate);
        let working = triceps + biceps + self.voluntary_nm.abs();
        let damping = self.spec.damping_nm_s_per_rad + self.spec.active_damping_s_per_rad * working;
        self.step_joint(biceps - triceps + self.voluntary_nm, damping);
        self.tick += 1;
    }

    /// Advances I·θ″ + b·θ′ + k·(θ − rest) = torque by one millisecond with the implicit midpoint
    /// rule (second order, stable for any b and k). A stop absorbs all momentum.
    fn step_joint(&mut self, torque_nm: f64, damping: f64) {
        let spec = &self.spec;
        let half = 0.5 * TICK_S / spec.inertia_kg_m2;
        let pull =
            torque_nm - spec.stiffness_nm_per_rad * (self.angle_rad - spec.rest_deg.to_radians());
        let drag = damping + 0.5 * TICK_S * spec.stiffness_nm_per_rad;
        let middle = (self.rate_rad_per_s + half * pull) / (1.0 + half * drag);
        self.angle_rad += TICK_S * middle;
        self.rate_rad_per_s = 2.0 * middle - self.rate_rad_per_s;
        let [low, high] = spec.stops_deg.map(f64::to_radians);
        if self.angle_rad <= low {
            (self.angle_rad, self.rate_rad_per_s) = (low, self.rate_rad_per_s.max(0.0));
        } else if self.angle_rad >= high {
            (self.angle_rad, self.rate_rad_per_s) = (high, self.rate_rad_per_s.min(0.0));
        }
    }
}

impl StimulatedMuscle {
    fn new(spec: ElbowMuscle) -> Self {
        Self {
            muscle: Muscle::new(spec.dynamics),
            step: Step::new(&spec.dynamics, TICK_S),
            under_way: VecDeque::with_capacity(32),
            spec,
        }
    }

    fn torque_nm(&self) -> f64 {
        self.spec.torque_nm * self.muscle.force()
    }

    /// Schedules a pulse of this current, which takes effect at `due_us`, the electromechanical
    /// delay after its output.
    fn excite(&mut self, due_us: u64, current_ma: f64, width_us: u32, curvature: f64) {
        let volts = |ma, width| effective_voltage(ma, width);
        let own = self.spec.width_us;
        let share = recruitment(
            volts(current_ma, width_us),
            volts(self.spec.threshold_ma, own),
            volts(self.spec.max_ma, own),
            curvature,
        );
        self.under_way.push_back((due_us, share));
    }

    /// Simulates the millisecond from `start_us` on, split at every pulse in it.
    fn pass(&mut self, start_us: u64) {
        let mut passed_us = 0;
        while let Some((due_us, share)) = self.under_way.front().copied() {
            if due_us >= start_us + TICK_US {
                break;
            }
            self.under_way.pop_front();
            let span_us = due_us.saturating_sub(start_us).saturating_sub(passed_us);
            if span_us > 0 {
                let step = Step::new(&self.spec.dynamics, span_us as f64 * 1e-6);
                self.muscle.step(&step);
                passed_us += span_us;
            }
            self.muscle.pulse(share);
        }
        if passed_us == 0 {
            self.muscle.step(&self.step);
        } else {
            let rest_s = (TICK_US - passed_us) as f64 * 1e-6;
            self.muscle.step(&Step::new(&self.spec.dynamics, rest_s));
        }
    }
}

impl Body for Elbow {
    fn pulse(&mut self, pulse: &Pulse) {
        let Some(load) = self.loads.get(pulse.channel) else {
            return;
        };
        let current_ma = load.current_ma(pulse.drive);
        if current_ma <= 0.0 {
            return;
        }
        let due_us = pulse.t_us + u64::from(self.spec.electromechanical_delay_us);
        let curvature = self.spec.recruitment_curvature;
        for muscle in [&mut self.triceps, &mut self.biceps] {
            if muscle.spec.channel == pulse.channel {
                muscle.excite(due_us, current_ma, pulse.width_us, curvature);
                let yields = self.spec.person.yields;
                self.felt.pulse(yields, pulse.t_us, current_ma);
            }
        }
    }

    fn fork(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    /// Advances the joint in whole milliseconds. Until the next millisecond is complete, no value
    /// changes.
    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.tick;
        while (self.tick + 1) * TICK_US <= to_us {
            self.step();
        }
        self.tick != before
    }

    fn begin_trial(&mut self) {
        self.begun = self.tick;
    }

    fn angle_deg(&self) -> f64 {
        self.angle_rad.to_degrees()
    }

    fn sensed_deg(&self) -> f64 {
        self.angle_deg() + self.spec.sensor_noise_deg * self.noise.at(self.tick)
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
