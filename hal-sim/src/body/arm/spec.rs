//! What a simulated arm is made of. Every number says where it comes from.

use super::anatomy::{ALL, ELECTRODES, MUSCLES};
use super::posture::{Lengths, Posture, TURNS};
use super::sensors::{ForceSpec, ImuFault, ImuSpec};
use crate::body::muscle::Parameters;

/// Segments with an IMU: clavicle (on the acromion), upper arm, forearm.
pub const SEGMENTS: usize = 3;
/// What they are called.
pub const SEGMENT_NAMES: [&str; SEGMENTS] = ["shoulder", "upper arm", "forearm"];

/// Segments as parts of stature and mass (Drillis, Contini and Bluestein 1964, and the
/// cadavers' as Winter 2009 tables them): length of upper arm, forearm and hand over
/// stature; mass over mass; centre from the nearer joint and radius of gyration about the
/// centre over length.
pub const UPPER_ARM: [f64; 4] = [0.186, 0.028, 0.436, 0.322];
/// The forearm's; see [`UPPER_ARM`].
pub const FOREARM: [f64; 4] = [0.146, 0.016, 0.430, 0.303];
/// The hand's; see [`UPPER_ARM`].
pub const HAND: [f64; 4] = [0.108, 0.006, 0.506, 0.297];
/// The cuff's middle from the elbow, over the forearm's length. Assumed (0.7 to 1): the
/// paper's cuff holds the forearm.
pub const CUFF_PART: f64 = 0.85;
/// Clavicle, scapula and what moves with them, kg, at the glenohumeral joint. Assumed (0.5
/// to 2).
pub const GIRDLE_KG: f64 = 1.0;

/// How the arm is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoldSpec {
    /// Stiffness of each turn by tissue alone, N m/rad. Assumed: shoulder girdle 60 (20 to
    /// 150: the scapula lies on the thorax), shoulder 10, elbow 2, pronation 1.
    pub passive_nm_per_rad: [f64; TURNS],
    /// What a person who holds the arm in place adds, N m/rad. Assumed: as much again for
    /// the girdle, 20 for the shoulder, 10 for the elbow, 2 for pronation.
    pub voluntary_nm_per_rad: [f64; TURNS],
    /// Part of critical damping of each turn. Assumed (0.1 to 0.5).
    pub damping: f64,
    /// Stiffness of cuff, its sensor and the skin beneath: along, N/m, and about, N m/rad.
    /// Assumed (3 to 30 kN/m, 20 to 200 N m/rad).
    pub cuff: [f64; 2],
}

/// A simulated right arm under nine electrodes.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSpec {
    /// Stature, m (the paper's: 1.76 ± 0.09).
    pub stature_m: f64,
    /// Mass, kg (the paper's: 77.3 ± 6.67).
    pub mass_kg: f64,
    /// Upper arm and forearm over what the stature's table says. Assumed (0.93 to 1.07).
    pub length_factors: [f64; 2],
    /// Size of the shoulder against DAS3's. Assumed (0.9 to 1.1).
    pub shoulder_factor: f64,
    /// Inertia of girdle, upper arm and forearm with hand over the table's (0.8 to 1.2).
    pub inertia_factors: [f64; SEGMENTS],
    /// Where it is.
    pub posture: Posture,
    /// Turn of each muscle's line about its bone, degrees. Assumed (-30 to 30): where an
    /// electrode lies decides which part of a muscle pulls.
    pub azimuth_deg: [f64; MUSCLES],
    /// Part of the muscle's isometric force that its electrode gets out of it at its
    /// greatest current, at the train's frequency. Assumed (0.04 to 0.16): surface
    /// stimulation reaches a part of a muscle and is painful beyond.
    pub reached: [f64; MUSCLES],
    /// Current at which the first fibres answer, mA at 200 µs. Assumed (6 to 16).
    pub threshold_ma: [f64; ELECTRODES],
    /// Current of full recruitment, mA at 200 µs. Assumed (20 to 45); the paper's device
    /// ends at 70.
    pub max_ma: [f64; ELECTRODES],
    /// How strongly force curves upwards with current, as `wearer::RECRUITMENT_CURVATURE`.
    pub curvature: f64,
    /// Part of an electrode's current that reaches each of the muscle's neighbours, in
    /// their order. Assumed (0.1 to 0.6).
    pub crosstalk: [f64; ELECTRODES],
    /// Thresholds and ranges of what no electrode lies on, as their neighbour's.
    pub dynamics: Parameters,
    /// From pulse to force, µs. Assumed (10 to 50 ms), as in `body::elbow`.
    pub delay_us: u32,
    /// What is left of the force of a muscle that is kept at full recruitment. Assumed
    /// (0.3 to 0.7).
    pub fatigue_floor: f64,
    /// Time constant of tiring and of recovery, s. Assumed (30 to 120).
    pub fatigue_time_s: f64,
    /// Standard deviation of a contraction's strength, as a part: 0.06 to 0.10 (Hong and
    /// Iaizzo 2002, Medeiros Dutra 2023; fixed before anything was run).
    pub force_noise: f64,
    /// How it is held.
    pub hold: HoldSpec,
    /// Force sensor.
    pub force: ForceSpec,
    /// IMUs.
    pub imu: ImuSpec,
    /// What is wrong with each.
    pub imu_faults: [ImuFault; SEGMENTS],
    /// Impedance of every electrode pair, Ω.
    pub load_ohm: f64,
    /// Decides noise.
    pub seed: u64,
}

/// What of an arm cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidArm {
    /// A number that must be finite and above zero is not.
    #[error("E710 arm: {0} must be a finite number above zero")]
    NotPositive(&'static str),
    /// A posture outside what moment arms are known for.
    #[error(
        "E711 arm: this posture is outside what moment arms are known for: elevation 1 to 120 \
         degrees, elbow 0 to 100 degrees"
    )]
    Posture,
    /// A muscle's range of currents is empty.
    #[error("E712 arm: threshold_ma of channel {0} must be above zero and below its max_ma")]
    Range(usize),
    /// What must be a part of one is not.
    #[error("E713 arm: {0} must lie between 0 and 1")]
    NotAPart(&'static str),
    /// Mass and stiffness have no inverse.
    #[error("E714 arm: masses and stiffnesses leave a joint without resistance")]
    Loose,
}

impl ArmSpec {
    /// Lengths of its bones.
    #[must_use]
    pub fn lengths(&self) -> Lengths {
        let [upper, fore] = self.length_factors;
        let forearm_m = fore * FOREARM[0] * self.stature_m;
        Lengths {
            shoulder: self.shoulder_factor,
            upper_arm_m: upper * UPPER_ARM[0] * self.stature_m,
            forearm_m,
            cuff_m: CUFF_PART * forearm_m,
        }
    }

    /// Isometric force of each muscle at its electrode's greatest current, N.
    #[must_use]
    pub fn forces_n(&self) -> [f64; MUSCLES] {
        std::array::from_fn(|at| self.reached[at] * ALL[at].force_n())
    }

    /// # Errors
    /// The first field that no arm can have.
    pub fn validate(&self) -> Result<(), InvalidArm> {
        let positive = [
            ("stature_m", self.stature_m),
            ("mass_kg", self.mass_kg),
            (
                "length_factors",
                self.length_factors[0].min(self.length_factors[1]),
            ),
            ("shoulder_factor", self.shoulder_factor),
            (
                "inertia_factors",
                self.inertia_factors.into_iter().fold(f64::MAX, f64::min),
            ),
            ("curvature", self.curvature),
            ("fatigue_time_s", self.fatigue_time_s),
            ("load_ohm", self.load_ohm),
            ("hold.cuff", self.hold.cuff[0].min(self.hold.cuff[1])),
            (
                "hold.passive_nm_per_rad",
                self.hold
                    .passive_nm_per_rad
                    .into_iter()
                    .fold(f64::MAX, f64::min),
            ),
        ];
        for (name, value) in positive {
            if !value.is_finite() || value <= 0.0 {
                return Err(InvalidArm::NotPositive(name));
            }
        }
        if !self.posture.is_known() {
            return Err(InvalidArm::Posture);
        }
        for (channel, (low, high)) in self.threshold_ma.iter().zip(&self.max_ma).enumerate() {
            if !(*low > 0.0 && low < high && high.is_finite()) {
                return Err(InvalidArm::Range(channel));
            }
        }
        let parts = [
            ("fatigue_floor", vec![self.fatigue_floor]),
            ("reached", self.reached.to_vec()),
            ("crosstalk", self.crosstalk.to_vec()),
            ("force_noise", vec![self.force_noise]),
        ];
        for (name, values) in parts {
            if !values.iter().all(|value| (0.0..=1.0).contains(value)) {
                return Err(InvalidArm::NotAPart(name));
            }
        }
        Ok(())
    }
}
