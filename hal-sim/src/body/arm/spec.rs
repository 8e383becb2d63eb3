//! Parameters of a simulated arm. Every number names its source or says that it is assumed.

use super::anatomy::{ALL, ELECTRODES, MUSCLES};
use super::posture::{Lengths, Posture, TURNS};
use super::sensors::{ForceSpec, ImuFault, ImuSpec};
use crate::body::muscle::Parameters;

/// Number of segments with an IMU: clavicle (on the acromion), upper arm, forearm.
pub const SEGMENTS: usize = 3;
/// Names of the segments, for messages.
pub const SEGMENT_NAMES: [&str; SEGMENTS] = ["shoulder", "upper arm", "forearm"];

/// Proportions of the upper arm: its length over stature; its mass over body mass; the distance of
/// its centre of mass from the proximal joint over its length; its radius of gyration about the
/// centre of mass over its length. Sources: Drillis, Contini and Bluestein 1964, and cadaver data
/// as tabulated in Winter 2009.
pub const UPPER_ARM: [f64; 4] = [0.186, 0.028, 0.436, 0.322];
/// Proportions of the forearm; see [`UPPER_ARM`].
pub const FOREARM: [f64; 4] = [0.146, 0.016, 0.430, 0.303];
/// Proportions of the hand; see [`UPPER_ARM`].
pub const HAND: [f64; 4] = [0.108, 0.006, 0.506, 0.297];
/// Distance of the middle of the cuff from the elbow, over the length of the forearm. Assumed (0.7
/// to 1): the paper's cuff holds the forearm.
pub const CUFF_PART: f64 = 0.85;
/// Mass of clavicle, scapula and attached tissue, kg, located at the glenohumeral joint. Assumed
/// (0.5 to 2).
pub const GIRDLE_KG: f64 = 1.0;

/// Stiffness and damping with which tissue, wearer and cuff hold the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoldSpec {
    /// Stiffness of each turn due to tissue alone, N m/rad. Assumed: shoulder girdle 60 (20 to 150,
    /// because the scapula lies on the thorax), shoulder 10, elbow 2, pronation 1.
    pub passive_nm_per_rad: [f64; TURNS],
    /// Additional stiffness while the wearer holds the arm in place, N m/rad. Assumed: as much
    /// again for the girdle, 20 for the shoulder, 10 for the elbow, 2 for pronation.
    pub voluntary_nm_per_rad: [f64; TURNS],
    /// Damping ratio of each turn. Assumed (0.1 to 0.5).
    pub damping: f64,
    /// Stiffness of the cuff, its sensor and the skin beneath: translational, N/m, and rotational,
    /// N m/rad. Assumed (3 to 30 kN/m, 20 to 200 N m/rad).
    pub cuff: [f64; 2],
}

/// Parameters of a simulated right arm under nine electrodes.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmSpec {
    /// Stature of the wearer, m (in the paper: 1.76 ± 0.09).
    pub stature_m: f64,
    /// Body mass, kg (in the paper: 77.3 ± 6.67).
    pub mass_kg: f64,
    /// Lengths of upper arm and forearm, divided by those that [`UPPER_ARM`] and [`FOREARM`] give
    /// for the stature. Assumed (0.93 to 1.07).
    pub length_factors: [f64; 2],
    /// Size of the shoulder relative to DAS3. Assumed (0.9 to 1.1).
    pub shoulder_factor: f64,
    /// Inertia of girdle, upper arm, and forearm with hand, divided by the values that follow from
    /// the proportions above (0.8 to 1.2).
    pub inertia_factors: [f64; SEGMENTS],
    /// Joint angles in which the arm is held.
    pub posture: Posture,
    /// Rotation of each muscle's line of action about its bone, degrees. Assumed (-30 to 30): the
    /// place of the electrode decides which part of a muscle pulls.
    pub azimuth_deg: [f64; MUSCLES],
    /// Share of the muscle's isometric force that its electrode evokes at its largest current, at
    /// the pulse rate of the train. Assumed (0.04 to 0.16): surface stimulation reaches a part of a
    /// muscle and is painful beyond.
    pub reached: [f64; MUSCLES],
    /// Current at which the first fibres respond, mA at 200 µs. Assumed (6 to 16).
    pub threshold_ma: [f64; ELECTRODES],
    /// Current of full recruitment, mA at 200 µs. Assumed (20 to 45); the paper's device delivers
    /// at most 70.
    pub max_ma: [f64; ELECTRODES],
    /// Curvature with which force rises with current, as `wearer::RECRUITMENT_CURVATURE`.
    pub curvature: f64,
    /// Share of an electrode's current that reaches each neighbouring muscle. Assumed (0.1 to 0.6).
    pub crosstalk: [f64; ELECTRODES],
    /// Calcium-force dynamics of every muscle; normalised to a force of 1 at
    /// [`super::FREQUENCY_HZ`].
    pub dynamics: Parameters,
    /// Delay from pulse to force, µs. Assumed (10 to 50 ms), as in `body::elbow`.
    pub delay_us: u32,
    /// Share of the force that remains under sustained full recruitment. Assumed (0.3 to 0.7).
    pub fatigue_floor: f64,
    /// Time constant of fatigue and of recovery, s. Assumed (30 to 120).
    pub fatigue_time_s: f64,
    /// Relative standard deviation of the strength of a contraction: 0.06 to 0.10 (Hong and Iaizzo
    /// 2002, Medeiros Dutra 2023; fixed before any run).
    pub force_noise: f64,
    /// Stiffness and damping of the arm and the cuff.
    pub hold: HoldSpec,
    /// Noise, offset and wander of the force at the cuff.
    pub force: ForceSpec,
    /// Noise, offset and misalignment of every IMU.
    pub imu: ImuSpec,
    /// Missing sensor or swapped axes, for each segment.
    pub imu_faults: [ImuFault; SEGMENTS],
    /// Impedance of every electrode pair, Ω.
    pub load_ohm: f64,
    /// Seed of all noise.
    pub seed: u64,
}

/// Reason why an [`ArmSpec`] is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidArm {
    /// A number that must be finite and above zero is not; names the field.
    #[error("E710 arm: {0} must be a finite number above zero")]
    NotPositive(&'static str),
    /// The posture is outside the range in which the moment arms are known.
    #[error(
        "E711 arm: the moment arms are not known for this posture; allowed: elevation 1 to 120 \
         degrees, elbow 0 to 100 degrees"
    )]
    Posture,
    /// The range of currents of a channel (numbered from 0) is empty.
    #[error("E712 arm: threshold_ma of channel {0} must be above zero and below its max_ma")]
    Range(usize),
    /// A share is not between 0 and 1; names the field.
    #[error("E713 arm: {0} must lie between 0 and 1")]
    NotAPart(&'static str),
    /// The matrix of mass and stiffness has no inverse: nothing resists some turn.
    #[error(
        "E714 arm: with these masses and stiffnesses nothing resists the motion of a joint; \
         increase a mass or a stiffness"
    )]
    Loose,
}

impl ArmSpec {
    /// Returns the lengths of the bones, which follow from stature and length factors.
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

    /// Returns the isometric force of each muscle at the largest current of its electrode, N.
    #[must_use]
    pub fn forces_n(&self) -> [f64; MUSCLES] {
        std::array::from_fn(|at| self.reached[at] * ALL[at].force_n())
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Returns an [`InvalidArm`] for the first field whose value is invalid.
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
