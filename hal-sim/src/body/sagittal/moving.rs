//! Simulation of the sagittal arm over time.

use super::JOINTS;
use super::fibres::{Fibres, TICK_US};
use super::geometry::{Geometry, MUSCLES, PostureGeometry, force_n};
use super::heat::power_w;
use super::links::Links;
use super::spec::{ELECTRODES, InvalidSagittal, SagittalSpec};
use crate::body::arm::posture::Lengths;
use crate::body::arm::{CUFF_PART, FOREARM, UPPER_ARM};

/// Time step of the simulation, s.
const TICK_S: f64 = 1e-3;
/// Inelastic stops of elbow and shoulder, low and high, rad.
const STOPS_RAD: [[f64; 2]; JOINTS] = [[0.0, 2.53], [-0.7, 2.8]];

/// Voluntary drive and intended motion for the next millisecond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intent {
    /// Voluntary drive of each muscle, 0 to 1.
    pub drive: [f64; MUSCLES],
    /// Intended flexions of elbow and shoulder, rad: the equilibrium towards which the stiffness of
    /// driven muscles pulls the joints (Flash 1987).
    pub flexions: [f64; JOINTS],
    /// Intended rates of elbow and shoulder, rad/s.
    pub rates: [f64; JOINTS],
}

/// The arm over time. The simulation is deterministic: intents, pulses and forces determine every
/// value.
#[derive(Debug, Clone, PartialEq)]
pub struct SagittalArm {
    spec: SagittalSpec,
    geometry: Geometry,
    links: Links,
    posed: PostureGeometry,
    now_us: u64,
    flexions: [f64; JOINTS],
    rates: [f64; JOINTS],
    activation: [f64; MUSCLES],
    fibres: [Fibres; ELECTRODES],
    stimulated_nm: [f64; JOINTS],
    used_j: f64,
}

impl SagittalArm {
    /// Creates an arm at rest with these flexions of elbow and shoulder, rad.
    ///
    /// # Errors
    /// Returns E766 with the name of the first field whose value is out of range.
    pub fn new(spec: SagittalSpec, flexions: [f64; JOINTS]) -> Result<Self, InvalidSagittal> {
        spec.validate()?;
        let geometry = Geometry::new(lengths(spec.stature_m), spec.fibre_length);
        Ok(Self {
            links: Links::new(spec.stature_m, spec.mass_kg, spec.added_inertia_kg_m2),
            posed: geometry.at(flexions.map(f64::to_degrees)),
            geometry,
            now_us: 0,
            flexions,
            rates: [0.0; JOINTS],
            activation: [0.0; MUSCLES],
            fibres: spec
                .electrodes
                .map(|electrode| Fibres::new(&spec, electrode)),
            stimulated_nm: [0.0; JOINTS],
            used_j: 0.0,
            spec,
        })
    }

    /// Resets the arm to a rested state with these flexions, rad, and activations, 0 to 1. The
    /// tables of the geometry are kept.
    pub fn reset_to_rest(&mut self, flexions: [f64; JOINTS], activation: [f64; MUSCLES]) {
        self.posed = self.geometry.at(flexions.map(f64::to_degrees));
        (self.flexions, self.rates) = (flexions, [0.0; JOINTS]);
        (self.activation, self.now_us, self.used_j) = (activation, 0, 0.0);
        self.stimulated_nm = [0.0; JOINTS];
        self.fibres = self
            .spec
            .electrodes
            .map(|electrode| Fibres::new(&self.spec, electrode));
    }

    /// Applies a pulse that leaves the output stage of electrode `electrode`, 0 to 3, at `at_us`.
    pub fn pulse(&mut self, electrode: usize, at_us: u64, current_ma: f64, width_us: u32) {
        if let Some(fibres) = self.fibres.get_mut(electrode) {
            fibres.excite(&self.spec, at_us, current_ma, width_us);
        }
    }

    /// Advances by a millisecond, with this force (x, z) on the hand, N.
    pub fn step(&mut self, intent: &Intent, hand_n: [f64; 2]) {
        for fibres in &mut self.fibres {
            fibres.pass(&self.spec, self.now_us);
        }
        let gain = TICK_S / self.spec.activation_s;
        for (own, drive) in self.activation.iter_mut().zip(&intent.drive) {
            *own += gain * (drive.clamp(0.0, 1.0) - *own);
        }
        let torque = self.torques_nm(intent);
        let turned = self
            .links
            .accelerations(self.flexions, self.rates, torque, hand_n);
        for joint in 0..JOINTS {
            self.rates[joint] += TICK_S * turned[joint];
            self.flexions[joint] += TICK_S * self.rates[joint];
            let [low, high] = STOPS_RAD[joint];
            if !(low..=high).contains(&self.flexions[joint]) {
                self.flexions[joint] = self.flexions[joint].clamp(low, high);
                self.rates[joint] = 0.0;
            }
        }
        self.now_us += TICK_US;
        self.posed = self.geometry.at(self.flexions.map(f64::to_degrees));
    }

    /// Returns the torques about both joints, N m, and adds the energy consumed in this millisecond
    /// to the total.
    fn torques_nm(&mut self, intent: &Intent) -> [f64; JOINTS] {
        let full_n: [f64; MUSCLES] = std::array::from_fn(|muscle| {
            self.spec.strength * force_n(muscle) * self.posed.by_length[muscle]
        });
        let (mut torque, mut by_will, mut by_pulses) =
            ([0.0; JOINTS], [0.0; JOINTS], [0.0; JOINTS]);
        self.stimulated_nm = [0.0; JOINTS];
        for (muscle, full_n) in full_n.into_iter().enumerate() {
            let fibres = self.fibres.get(muscle);
            let busy = fibres.map_or(0.0, |fibres| fibres.pulsed_share(self.now_us));
            let will = self.activation[muscle] * (1.0 - busy);
            let pulsed = fibres.map_or(0.0, Fibres::force);
            let force_n = full_n * (will + pulsed);
            let mut shortening = 0.0;
            for joint in 0..JOINTS {
                let arm = self.posed.arms_m[muscle][joint];
                torque[joint] += force_n * arm;
                by_will[joint] += (full_n * will * arm).abs();
                by_pulses[joint] += (full_n * pulsed * arm).abs();
                self.stimulated_nm[joint] += full_n * pulsed * arm;
                shortening += arm * self.rates[joint];
            }
            let fibre_traits = (self.spec.strength, self.spec.fast_part);
            let used = power_w(muscle, fibre_traits, (will, busy), (force_n, shortening));
            self.used_j += TICK_S * used;
        }
        let drag = self.spec.active_damping_s_per_rad;
        for joint in 0..JOINTS {
            let off = intent.flexions[joint] - self.flexions[joint];
            let slip = intent.rates[joint] - self.rates[joint];
            let stiffness = self.spec.stiffness_nm_per_rad[joint]
                + self.spec.stiffness_per_rad[joint] * by_will[joint];
            torque[joint] += stiffness * (off + self.spec.viscosity_s * slip);
            let friction = self.spec.damping_nm_s_per_rad[joint] + drag * by_pulses[joint];
            torque[joint] -= friction * self.rates[joint];
        }
        torque
    }

    /// Returns the flexions of elbow and shoulder, rad.
    #[must_use]
    pub const fn flexions(&self) -> [f64; JOINTS] {
        self.flexions
    }

    /// Returns the rates of elbow and shoulder, rad/s.
    #[must_use]
    pub const fn rates(&self) -> [f64; JOINTS] {
        self.rates
    }

    /// Returns the position of the hand relative to the shoulder, forward and up, m, and its
    /// velocity, m/s.
    #[must_use]
    pub fn hand_motion(&self) -> ([f64; 2], [f64; 2]) {
        let at = self.links.hand_m(self.flexions);
        (at, self.links.hand_rate_m_s(self.flexions, self.rates))
    }

    /// Returns the torque of stimulated fibres about both joints, N m, flexion positive.
    #[must_use]
    pub const fn stimulated_nm(&self) -> [f64; JOINTS] {
        self.stimulated_nm
    }

    /// Returns the torque of each muscle about both joints at full activation in the present
    /// posture, N m.
    #[must_use]
    pub fn full_nm(&self) -> [[f64; JOINTS]; MUSCLES] {
        self.posed.full_nm(self.spec.strength)
    }

    /// Returns the energy consumed since the start or the last reset, J.
    #[must_use]
    pub const fn energy_used_j(&self) -> f64 {
        self.used_j
    }

    /// Returns the power that muscles consume while they hold these activations without pulses, W.
    #[must_use]
    pub fn holding_power_w(&self, activation: &[f64; MUSCLES]) -> f64 {
        let fibre_traits = (self.spec.strength, self.spec.fast_part);
        let muscles = activation.iter().enumerate();
        muscles
            .map(|(muscle, value)| power_w(muscle, fibre_traits, (*value, 0.0), (0.0, 0.0)))
            .sum()
    }

    /// Returns the two rigid segments.
    #[must_use]
    pub const fn links(&self) -> &Links {
        &self.links
    }

    /// Returns the specification from which the arm was created.
    #[must_use]
    pub const fn spec(&self) -> &SagittalSpec {
        &self.spec
    }
}

/// Returns the lengths of the bones for a stature, with the proportions of [`crate::body::arm`].
pub(super) fn lengths(stature_m: f64) -> Lengths {
    let forearm_m = FOREARM[0] * stature_m;
    Lengths {
        shoulder: 1.0,
        upper_arm_m: UPPER_ARM[0] * stature_m,
        forearm_m,
        cuff_m: CUFF_PART * forearm_m,
    }
}

impl Geometry {
    /// Tabulates the muscles of a wearer of this stature, m.
    #[must_use]
    pub fn for_stature(stature_m: f64, fibre_length: f64) -> Self {
        Self::new(lengths(stature_m), fibre_length)
    }
}
