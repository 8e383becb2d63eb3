//! A hand over time: leads that change, spikes, and the motion of the digits.

use super::detail::{HandDetail, Pools, Representative, representatives};
use super::digits::{INDEX, RANGES_DEG, REST_DEG, Torques, visible_movements};
use super::field::Pad;
use super::forearm::{Forearm, Memory};
use super::network::{InvalidSegment, Terminal};
use super::pools::DIGITS;
use super::response::{Hand, InvalidHand};
use super::spec::{HandSpec, RETURN};
use crate::body::joint::{Joint, JointSpec};
use crate::body::muscle::{Muscle, Parameters, Step};
use crate::body::sensor::{AngleSensor, SensorSpec};
use crate::body::{Body, CHANNELS, Drive, Lead, Load, Pulse};

/// Time step of the digits, µs.
const TICK_US: u64 = 1_000;
const TICK_S: f64 = 1e-3;
/// Number of parts of a time step to which spikes are resolved: forces within 250 µs differ by less
/// than a thousandth.
const GRAINS: u64 = 4;
const GRAIN_US: u64 = TICK_US / GRAINS;
/// Longest interval over which currents are solved ahead while no lead changes, µs. It is shorter
/// than the delay from a spike to its effect, so that no spike is known too late.
const STRETCH_US: u64 = 5_000;
/// Parameters of the data glove on the index finger. Assumed: those of the finger of
/// `body::finger`.
const GLOVE: SensorSpec = SensorSpec {
    lag_s: 0.010,
    noise_deg: 0.3,
    resolution_deg: 0.1,
    range_deg: RANGES_DEG[INDEX],
};

/// Muscle fibres of one motor unit.
#[derive(Debug, Clone)]
struct Fibres {
    muscle: Muscle,
    /// Share of their force that fatigue leaves, 0 to 1.
    capacity: f64,
    /// Number of units for which this unit is simulated.
    count: f64,
    /// Bit n is set if a spike takes effect in part n of the next time step; see [`GRAINS`].
    due: u8,
    /// Whether the unit has spiked; before its first spike it is skipped.
    is_awake: bool,
}

/// A hand whose leads, nerves and digits advance in time. The simulation is deterministic: leads
/// and seed determine every value.
#[derive(Debug, Clone)]
pub struct MovingHand {
    spec: HandSpec,
    forearm: Forearm,
    factor: f64,
    /// Channels of the points A, B and E.
    channels: [usize; RETURN],
    memory: Memory,
    terminals: [Terminal; RETURN],
    /// Time up to which currents and spikes have been computed.
    played_us: u64,
    /// Pending spikes: time at which each takes effect, µs, and index of its motor unit.
    under_way: Vec<(u64, usize)>,
    steps: [Step; 2],
    fibres: Vec<Fibres>,
    torques: Torques,
    /// Force of the wrist's extensors over the last time step, including fatigue, as a fraction of
    /// their full force.
    wrist: f64,
    joints: [Joint; DIGITS],
    sensor: AngleSensor,
    tick: u64,
    loads: [Load; CHANNELS],
    unsettled: u64,
}

/// Parameters of a hand with electrodes in place, from which a session creates its wearer.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedHand {
    /// Parameters of the forearm and hand.
    pub spec: HandSpec,
    /// Pads of the points A, B and E.
    pub points: [Pad; RETURN],
    /// Factor by which the threshold of every nerve is multiplied.
    pub factor: f64,
    /// Displacement of the skin from rest, along and around, m.
    pub shift_m: [f64; 2],
    /// Channels of A, B and E, from 0.
    pub channels: [usize; RETURN],
    /// Largest number of motor units that are simulated for each pool; `None` for every unit.
    pub simulated_units: Option<usize>,
}

impl FittedHand {
    /// Creates the hand at rest with every pool. `seed` determines the noise of its sensor.
    ///
    /// # Errors
    /// Returns the reason why the hand is invalid.
    pub fn to_moving_hand(&self, seed: u64) -> Result<MovingHand, InvalidHand> {
        self.with_pools(Pools::All, seed)
    }

    /// Creates the hand at rest with the pools of the index finger only: its index finger moves as
    /// that of [`Self::to_moving_hand`], bit for bit, and the other digits stay at rest. `seed`
    /// determines the noise of its sensor.
    ///
    /// # Errors
    /// Returns the reason why the hand is invalid.
    pub fn to_index_finger(&self, seed: u64) -> Result<MovingHand, InvalidHand> {
        self.with_pools(Pools::Index, seed)
    }

    fn with_pools(&self, pools: Pools, seed: u64) -> Result<MovingHand, InvalidHand> {
        let detail = HandDetail {
            pools,
            units: self.simulated_units,
        };
        let mut hand =
            Hand::with_pools(self.spec.clone(), self.points, detail.pools, self.shift_m)?;
        hand.factor = self.factor;
        let kept = representatives(hand.forearm(), detail);
        Ok(MovingHand::with_units(&hand, &kept, self.channels, seed)?)
    }
}

impl MovingHand {
    /// Creates a moving copy of `hand` at rest, with its electrodes A, B and E on `channels`.
    /// `seed` determines the noise of the sensor.
    ///
    /// # Errors
    /// Fails if the circuit cannot be solved.
    pub fn new(hand: &Hand, channels: [usize; RETURN], seed: u64) -> Result<Self, InvalidSegment> {
        let kept = representatives(hand.forearm(), HandDetail::FULL);
        Self::with_units(hand, &kept, channels, seed)
    }

    /// Creates a moving copy of `hand` that simulates only the motor units `kept`.
    fn with_units(
        hand: &Hand,
        kept: &[Representative],
        channels: [usize; RETURN],
        seed: u64,
    ) -> Result<Self, InvalidSegment> {
        let (spec, mut forearm) = (hand.spec().clone(), hand.forearm().clone());
        let units: Vec<usize> = kept.iter().map(|one| one.unit).collect();
        forearm.keep_units(&units);
        let mut loads = [Load::NOMINAL; CHANNELS];
        for (point, &channel) in channels.iter().enumerate() {
            let ohm = hand.load_ohm(point)?;
            if let Some(load) = loads.get_mut(channel) {
                *load = Load::Ohms(ohm);
            }
        }
        let parameters = Parameters::mean_subject_at_50_hz();
        let step = |us: u64| Step::new(&parameters, us as f64 * 1e-6);
        let joint = |digit: usize| JointSpec {
            inertia_kg_m2: spec.motion.inertia_kg_m2,
            stiffness_nm_per_rad: spec.stiffness_nm_per_rad,
            damping_nm_s_per_rad: spec.motion.damping_nm_s_per_rad,
            rest_deg: REST_DEG[digit],
            stops_deg: RANGES_DEG[digit],
        };
        let relaxed = |count: usize| Fibres {
            muscle: Muscle::new(parameters),
            capacity: 1.0,
            count: count as f64,
            due: 0,
            is_awake: false,
        };
        Ok(Self {
            memory: forearm.resting_memory(),
            terminals: [Terminal::Floating; RETURN],
            played_us: 0,
            under_way: Vec::new(),
            steps: [step(TICK_US), step(GRAIN_US)],
            fibres: kept.iter().map(|one| relaxed(one.count)).collect(),
            torques: Torques::default(),
            wrist: 0.0,
            joints: std::array::from_fn(|digit| Joint::new(&joint(digit), TICK_S)),
            sensor: AngleSensor::new(GLOVE, REST_DEG[INDEX], TICK_S, seed),
            tick: 0,
            unsettled: 0,
            factor: hand.factor,
            channels,
            loads,
            forearm,
            spec,
        })
    }

    /// Returns the angles of all digits, °, thumb first.
    #[must_use]
    pub fn angles_deg(&self) -> [f64; DIGITS] {
        self.joints
            .each_ref()
            .map(|joint| joint.angle_rad.to_degrees())
    }

    /// Returns the isometric torques of the muscles over the last time step, including fatigue,
    /// N·m.
    #[must_use]
    pub const fn torques(&self) -> Torques {
        self.torques
    }

    /// Returns the smallest share of force that fatigue leaves in any motor unit, 0 to 1.
    #[must_use]
    pub fn least_capacity(&self) -> f64 {
        let capacities = self.fibres.iter().map(|fibres| fibres.capacity);
        capacities.fold(1.0, f64::min)
    }

    /// Computes currents and spikes up to `to_us`.
    fn simulate_until(&mut self, to_us: u64) {
        let mut spikes = Vec::new();
        while self.played_us < to_us {
            let next_us = to_us.min((self.played_us / STRETCH_US + 1) * STRETCH_US);
            let lasts_s = (next_us - self.played_us) as f64 * 1e-6;
            let played = self.forearm.segment(
                &mut self.memory,
                &self.terminals,
                lasts_s,
                self.factor,
                &mut spikes,
            );
            self.unsettled += u64::from(played.is_err());
            for spike in spikes.drain(..) {
                let after_us = ((spike.at_s + self.spec.motion.delay_s) * 1e6) as u64;
                self.under_way.push((self.played_us + after_us, spike.unit));
            }
            self.played_us = next_us;
        }
    }

    /// Delivers to the fibres all spikes that take effect in the next time step.
    fn deliver(&mut self) {
        let begun_us = self.tick * TICK_US;
        let fibres = &mut self.fibres;
        self.under_way.retain(|&(due_us, unit)| {
            let grain = due_us.saturating_sub(begun_us) / GRAIN_US;
            let is_due = grain < GRAINS;
            if is_due {
                fibres[unit].due |= 1 << grain;
                fibres[unit].is_awake = true;
            }
            !is_due
        });
    }

    fn step(&mut self) {
        self.deliver();
        let (mut torques, mut wrist) = (Torques::default(), 0.0);
        let tires = TICK_S / self.spec.motion.fatigue_time_s;
        let pools = self.forearm.units().iter().map(|unit| unit.pool);
        for (fibres, pool) in self.fibres.iter_mut().zip(pools) {
            if !fibres.is_awake {
                continue;
            }
            let force = fibres.step(&self.steps);
            let floor = self.spec.motion.fatigue_floor;
            let goal = 1.0 - (1.0 - floor) * force.min(1.0);
            if let Some((torque, of_one)) = torques.unit_torque_mut(pool, &self.spec) {
                *torque += of_one * fibres.count * fibres.capacity * force;
            } else {
                wrist += fibres.count * fibres.capacity * force / self.spec.units as f64;
            }
            fibres.capacity += tires * (goal - fibres.capacity);
        }
        (self.torques, self.wrist) = (torques, wrist);
        for (digit, joint) in self.joints.iter_mut().enumerate() {
            joint.step(torques.net_nm(digit, joint.progress()));
        }
        self.sensor.step(self.angle_deg());
        self.tick += 1;
    }
}

impl Fibres {
    /// Advances by one time step and returns the mean force without fatigue, relative to that at 50
    /// Hz.
    fn step(&mut self, [whole, grain]: &[Step; 2]) -> f64 {
        let before = self.muscle.force();
        if self.due == 0 {
            self.muscle.step(whole);
        } else {
            for place in 0..GRAINS {
                if self.due & 1 << place != 0 {
                    self.muscle.pulse(1.0);
                }
                self.muscle.step(grain);
            }
            self.due = 0;
        }
        0.5 * (before + self.muscle.force())
    }
}

impl Body for MovingHand {
    /// Does nothing: [`Body::set_lead`] has already applied the pulse.
    fn pulse(&mut self, _pulse: &Pulse) {}

    fn set_lead(&mut self, t_us: u64, channel: usize, lead: Lead) {
        let Some(point) = self.channels.iter().position(|index| *index == channel) else {
            return;
        };
        self.simulate_until(t_us);
        self.terminals[point] = match (lead, self.loads[channel]) {
            (_, Load::Open) | (Lead::Floating, _) => Terminal::Floating,
            (Lead::Grounded, _) => Terminal::Grounded,
            (Lead::Cathodic(Drive::Volts(v)), _) => Terminal::Driven(-v),
            (Lead::Anodic(Drive::Volts(v)), _) => Terminal::Driven(v),
            // A session with a hand has voltage stages only.
            (Lead::Cathodic(_) | Lead::Anodic(_), _) => Terminal::Floating,
        };
    }

    fn fork(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    /// Advances digits and sensor in whole milliseconds. Until the next millisecond is complete, no
    /// value changes.
    fn advance(&mut self, to_us: u64) -> bool {
        self.simulate_until(to_us / STRETCH_US * STRETCH_US);
        let before = self.tick;
        while (self.tick + 1) * TICK_US <= to_us {
            self.step();
        }
        self.tick != before
    }

    fn uncomputed_intervals(&self) -> u64 {
        self.unsettled
    }

    /// Names what an observer sees ([`visible_movements`]).
    fn visible_movements(&self) -> Vec<&'static str> {
        visible_movements(&self.angles_deg(), self.wrist)
    }

    fn angle_deg(&self) -> f64 {
        self.joints[INDEX].angle_rad.to_degrees()
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
