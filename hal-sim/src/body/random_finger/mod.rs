//! A finger whose muscles and friction differ in structure from every model of the firmware.
//!
//! Submodules: its parts (`twitch`, `friction`), the angles that it can hold (`reach`), and the
//! generation of a random wearer (`draw`). Points, pairs, thresholds and sensor are those of
//! [`super::Finger`]. Input: pulses and time. Output: the true and the sensed angle.

mod draw;
mod friction;
mod reach;
mod twitch;

use super::finger::{A, B, EXTENSOR, Effect, Points};
use super::hand::digits::{INDEX_EXTENSION, INDEX_FLEXION};
use super::sensor::AngleSensor;
use super::wearer::effective_voltage;
use super::{Body, CHANNELS, FingerSpec, InvalidSpec, Load, Pulse};
pub use draw::{Draws, TWO_POINTS_NM};
pub use friction::{Hinge, Motion, Torque};
pub use reach::Reach;
use std::collections::VecDeque;
pub use twitch::Twitch;
use twitch::TwitchState;

/// A torque from outside, such as an object in the hand or a knock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExternalTorque {
    /// Start of the torque, ms after the start of the simulation.
    pub from_ms: u32,
    /// End of the torque, ms after the start of the simulation.
    pub to_ms: u32,
    /// Torque on the joint, N·m, flexion positive.
    pub nm: f64,
}

impl ExternalTorque {
    /// Returns whether the torque acts in this millisecond.
    const fn acts_at(&self, ms: u64) -> bool {
        self.from_ms as u64 <= ms && ms < self.to_ms as u64
    }
}

/// Smallest movement of the finger that an observer sees, °. Assumed: as [`super::hand::digits`]
/// has it, but no more than half of the way from rest to full extension.
const VISIBLE_DEG: f64 = 2.0;
const TICK_US: u64 = 1000;
const TICK_S: f64 = 1e-3;

/// Parameters of a [`RandomFinger`]. All fields are public; [`RandomFinger::new`] checks them.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomFingerSpec {
    /// Points, their pair, recruitment, delay, inertia, spring, damping, stops, fatigue and sensor.
    /// Its `muscle`, torques and `torque_loss` are not used.
    pub finger: FingerSpec,
    /// Muscles in the order flexor A, flexor B, extensor.
    pub muscles: [Twitch; 3],
    /// Dry friction at rest, N·m.
    pub static_friction_nm: f64,
    /// Dry friction in motion, N·m, at most that at rest.
    pub coulomb_friction_nm: f64,
    /// Joint rate at which 1/e of the difference between both frictions remains, rad/s.
    pub stribeck_rad_per_s: f64,
    /// Share of each muscle's force that earlier work has left at the start, 0 to 1.
    pub capacity: [f64; 3],
    /// Torques on the joint besides muscles, spring and friction; simultaneous ones add.
    pub external: Vec<ExternalTorque>,
}

impl RandomFingerSpec {
    /// Returns the joint with these parameters.
    pub fn hinge(&self) -> Hinge {
        let f = &self.finger;
        Hinge {
            inertia: f.inertia_kg_m2,
            stiffness: f.stiffness_nm_per_rad,
            damping: f.damping_nm_s_per_rad,
            rest: f.rest_deg.to_radians(),
            stops: f.stops_deg.map(f64::to_radians),
            static_nm: self.static_friction_nm,
            coulomb_nm: self.coulomb_friction_nm,
            stribeck: self.stribeck_rad_per_s,
        }
    }

    fn validate(&self) -> Result<(), InvalidSpec> {
        self.finger.validate()?;
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let sound = |m: &Twitch| {
            [m.k, m.release_s, m.binding_s, m.rise_s, m.fall_s]
                .into_iter()
                .chain([m.potentiation_s, m.width_deg, m.fastest_rad_per_s])
                .all(positive)
                && m.release_s != m.binding_s
                && [m.torque_nm, m.potentiation].iter().all(|v| *v >= 0.0)
                && m.best_deg.is_finite()
        };
        let dry = self.coulomb_friction_nm..=self.static_friction_nm;
        let rules = [
            ("muscles", self.muscles.iter().all(sound)),
            ("coulomb_friction_nm", self.coulomb_friction_nm >= 0.0),
            ("static_friction_nm", dry.contains(&self.static_friction_nm)),
            ("stribeck_rad_per_s", positive(self.stribeck_rad_per_s)),
            (
                "capacity",
                self.capacity.iter().all(|c| (0.0..=1.0).contains(c)),
            ),
            ("external", self.external.iter().all(|e| e.nm.is_finite())),
        ];
        match rules.iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidSpec(field)),
            None => Ok(()),
        }
    }
}

/// A pulse that has not yet reached its muscle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Excitation {
    due_us: u64,
    muscle: usize,
    effect: Effect,
}

/// The finger over time. The simulation is deterministic: pulses and seed determine every value.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomFinger {
    spec: RandomFingerSpec,
    hinge: Hinge,
    points: Points,
    loads: [Load; CHANNELS],
    tick: u64,
    muscles: [TwitchState; 3],
    under_way: VecDeque<Excitation>,
    pair_factor: f64,
    capacity: [f64; 3],
    motion: Motion,
    sensor: AngleSensor,
}

impl RandomFinger {
    /// Creates a relaxed finger. `seed` determines the noise of the sensor.
    ///
    /// # Errors
    /// Returns an [`InvalidSpec`] that names the first field whose value is out of range.
    pub fn new(spec: RandomFingerSpec, seed: u64) -> Result<Self, InvalidSpec> {
        spec.validate()?;
        let hinge = spec.hinge();
        Ok(Self {
            hinge,
            points: Points::new(&spec.finger),
            loads: [Load::NOMINAL; CHANNELS],
            tick: 0,
            muscles: spec.muscles.map(TwitchState::new),
            under_way: VecDeque::with_capacity(32),
            pair_factor: 1.0,
            capacity: spec.capacity,
            motion: Motion {
                angle: hinge.rest,
                rate: 0.0,
            },
            sensor: AngleSensor::new(spec.finger.sensor(), spec.finger.rest_deg, TICK_S, seed),
            spec,
        })
    }

    /// Returns the specification from which the finger was created.
    pub fn spec(&self) -> &RandomFingerSpec {
        &self.spec
    }

    /// Returns the joint rate, degrees per second, flexion positive.
    pub fn rate_deg_per_s(&self) -> f64 {
        self.motion.rate.to_degrees()
    }

    /// Returns the share of force that fatigue leaves in flexor A, flexor B and extensor, 0 to 1.
    pub fn capacity(&self) -> [f64; 3] {
        self.capacity
    }

    fn deliver(&mut self) {
        let end_us = (self.tick + 1) * TICK_US;
        while let Some(e) = self.under_way.front().copied() {
            if e.due_us >= end_us {
                break;
            }
            self.under_way.pop_front();
            let before_end = end_us.saturating_sub(e.due_us).min(TICK_US);
            self.muscles[e.muscle].pulse(e.effect.recruitment, before_end as f64 / TICK_US as f64);
            self.pair_factor = e.effect.pair_factor.unwrap_or(self.pair_factor);
        }
    }

    fn step(&mut self) {
        self.deliver();
        let forces = self.muscles.each_mut().map(TwitchState::step);
        let mut torque = self.spec.torque(
            [0, 1, 2].map(|i| forces[i] * self.capacity[i]),
            self.pair_factor,
            self.motion,
        );
        for external in self.spec.external.iter().filter(|e| e.acts_at(self.tick)) {
            torque.nm += external.nm;
        }
        self.tire(forces);
        self.hinge.step(&mut self.motion, torque, TICK_S);
        self.sensor.step(self.angle_deg());
        self.tick += 1;
    }

    fn tire(&mut self, forces: [f64; 3]) {
        for (capacity, force) in self.capacity.iter_mut().zip(forces) {
            *capacity = self.spec.capacity_after(*capacity, force, TICK_S);
        }
    }
}

impl RandomFingerSpec {
    /// Returns the torque of the muscles with these forces (fatigue included) in this motion. A
    /// single flexor point contributes its own torque; in a full pair, the weaker one contributes
    /// `pair_factor` - 1 times its own.
    fn torque(&self, forces: [f64; 3], pair_factor: f64, motion: Motion) -> Torque {
        let angle_deg = motion.angle.to_degrees();
        let isometric = |i: usize| {
            let m: &Twitch = &self.muscles[i];
            m.torque_nm * forces[i] * m.length_factor(angle_deg)
        };
        let (a, b) = (isometric(A), isometric(B));
        let flexor = a.max(b) + (pair_factor - 1.0) * a.min(b);
        let extensor = isometric(EXTENSOR);
        // The two flexor points lie on one muscle, so that both have the velocity of A.
        let [flexing, flexing_slope] = self.muscles[A].velocity_factor(motion.rate);
        let [extending, extending_slope] = self.muscles[EXTENSOR].velocity_factor(-motion.rate);
        Torque {
            nm: flexor * flexing - extensor * extending,
            slope: flexor * flexing_slope + extensor * extending_slope,
        }
    }

    /// Returns the share of force that fatigue leaves in a muscle after another `s` seconds, from
    /// the present share `capacity` and the force.
    fn capacity_after(&self, capacity: f64, force: f64, s: f64) -> f64 {
        let goal = 1.0 - (1.0 - self.finger.fatigue_floor) * force.min(1.0);
        capacity + s / self.finger.fatigue_time_s * (goal - capacity)
    }
}

impl Body for RandomFinger {
    fn pulse(&mut self, pulse: &Pulse) {
        let Some(load) = self.loads.get(pulse.channel) else {
            return;
        };
        let effective_v = effective_voltage(load.current_ma(pulse.drive), pulse.width_us);
        if effective_v <= 0.0 {
            return;
        }
        let sites = self.spec.finger.sites();
        for muscle in [A, B, EXTENSOR] {
            if sites[muscle].channel == pulse.channel {
                let effect = self
                    .points
                    .excite(muscle, pulse.t_us, effective_v, pulse.conducted);
                let delay_us = u64::from(self.spec.finger.electromechanical_delay_us);
                self.under_way.push_back(Excitation {
                    due_us: pulse.t_us + delay_us,
                    muscle,
                    effect,
                });
            }
        }
    }

    /// Names flexion or extension from the angle at which the relaxed finger rests.
    fn visible_movements(&self) -> Vec<&'static str> {
        let bent_deg = self.angle_deg() - self.spec.finger.rest_deg;
        match bent_deg {
            _ if bent_deg >= VISIBLE_DEG => vec![INDEX_FLEXION],
            _ if -bent_deg >= VISIBLE_DEG => vec![INDEX_EXTENSION],
            _ => Vec::new(),
        }
    }

    /// Advances in whole milliseconds. Until the next millisecond is complete, no value changes.
    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.tick;
        while (self.tick + 1) * TICK_US <= to_us {
            self.step();
        }
        self.tick != before
    }

    fn angle_deg(&self) -> f64 {
        self.motion.angle.to_degrees()
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
