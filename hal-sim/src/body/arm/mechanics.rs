//! How the arm answers torques: held in the cuff, and free.
//!
//! Held: turns q give way to torques τ against tissue K and the cuff C, J being the
//! cuff's motion: (K + Jᵀ C J) q = τ; what the cuff feels is C J q. More turns than a
//! wrench has components leave the rest to tissue. Free: M q″ + B q′ + K q = τ about the
//! posture, small motions, as after a twitch.

use super::posture::{JointRotations, Skeleton, TURNS};
use super::spec::{ArmSpec, FOREARM, GIRDLE_KG, HAND, InvalidArm, SEGMENTS, UPPER_ARM};
use nalgebra::{Matrix3, SMatrix, Vector3};

pub(super) type Square = SMatrix<f64, TURNS, TURNS>;
/// From torques about turns to what the cuff feels.
pub type ToWrench = SMatrix<f64, 6, TURNS>;

/// A rigid part of a segment.
struct Part {
    segment: usize,
    kg: f64,
    centre: Vector3<f64>,
    /// About the centre, in our axes, kg m².
    inertia: Matrix3<f64>,
}

/// A rod-like part: inertia across its axis from its radius of gyration, a tenth of that
/// along it (assumed 0.05 to 0.2).
fn rod(
    segment: usize,
    kg: f64,
    centre: Vector3<f64>,
    axis: &Vector3<f64>,
    gyration_m: f64,
) -> Part {
    let across = kg * gyration_m * gyration_m;
    let along = axis * axis.transpose();
    Part {
        segment,
        kg,
        centre,
        inertia: across * (Matrix3::identity() - 0.9 * along),
    }
}

fn parts(spec: &ArmSpec, skeleton: &Skeleton) -> [Part; 4] {
    let lengths = skeleton.lengths;
    let [girdle, upper, fore] = spec.inertia_factors;
    let mass = spec.mass_kg;
    let (upper_m, fore_m, hand_m) = (
        lengths.upper_arm_m,
        lengths.forearm_m,
        HAND[0] * spec.stature_m,
    );
    let upper_at = skeleton.shoulder + UPPER_ARM[2] * upper_m * skeleton.upper_arm;
    let fore_at = skeleton.elbow + FOREARM[2] * fore_m * skeleton.forearm;
    let hand_at = skeleton.elbow + (fore_m + HAND[2] * hand_m) * skeleton.forearm;
    [
        rod(
            0,
            girdle * GIRDLE_KG,
            skeleton.shoulder,
            &skeleton.clavicle_axis(),
            0.05,
        ),
        rod(
            1,
            upper * UPPER_ARM[1] * mass,
            upper_at,
            &skeleton.upper_arm,
            UPPER_ARM[3] * upper_m,
        ),
        rod(
            2,
            fore * FOREARM[1] * mass,
            fore_at,
            &skeleton.forearm,
            FOREARM[3] * fore_m,
        ),
        rod(
            2,
            fore * HAND[1] * mass,
            hand_at,
            &skeleton.forearm,
            HAND[3] * hand_m,
        ),
    ]
}

/// Mass about each turn, kg m².
pub(super) fn masses(spec: &ArmSpec, skeleton: &Skeleton) -> Square {
    let mut all = Square::zeros();
    for part in parts(spec, skeleton) {
        let moves = skeleton.jacobian(&part.centre, part.segment);
        let turns = skeleton.rotation_jacobian(part.segment);
        all += part.kg * moves.transpose() * moves + turns.transpose() * part.inertia * turns;
    }
    all
}

/// Weight of the arm from the shoulder on, N.
pub(super) fn weight_n(spec: &ArmSpec) -> f64 {
    let mass = (UPPER_ARM[1] + FOREARM[1] + HAND[1]) * spec.mass_kg;
    super::sensors::GRAVITY_M_S2 * mass
}

/// The cuff's answer to torques: what it feels, and how far each turn gives way, rad/N m.
///
/// # Errors
/// Nothing resists some turn.
pub(super) fn cuff_response(
    spec: &ArmSpec,
    skeleton: &Skeleton,
) -> Result<(ToWrench, Square), InvalidArm> {
    let moves = skeleton.cuff_jacobian();
    let [along, about] = spec.hold.cuff;
    let cuff =
        SMatrix::<f64, 6, 6>::from_diagonal(&[along, along, along, about, about, about].into());
    let tissue = Square::from_diagonal(&spec.hold.passive_nm_per_rad.into());
    let whole = tissue + moves.transpose() * cuff * moves;
    let inverse = whole.try_inverse().ok_or(InvalidArm::Loose)?;
    Ok((cuff * moves * inverse, inverse))
}

/// The free arm, in steps of `h` seconds (implicit Euler: stable for any stiffness).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Free {
    turns: JointRotations,
    rates: JointRotations,
    masses: Square,
    stiffness: Square,
    inverse: Square,
    h: f64,
    turning: [SMatrix<f64, 3, TURNS>; SEGMENTS],
}

impl Free {
    /// At rest.
    ///
    /// # Errors
    /// Nothing resists some turn.
    pub fn new(spec: &ArmSpec, skeleton: &Skeleton, h: f64) -> Result<Self, InvalidArm> {
        let masses = masses(spec, skeleton);
        let hold = &spec.hold;
        let stiffness = std::array::from_fn(|turn| {
            hold.passive_nm_per_rad[turn] + hold.voluntary_nm_per_rad[turn]
        });
        let damping: [f64; TURNS] = std::array::from_fn(|turn| {
            2.0 * hold.damping * (stiffness[turn] * masses[(turn, turn)]).sqrt()
        });
        let stiffness = Square::from_diagonal(&stiffness.into());
        let damping = Square::from_diagonal(&damping.into());
        let whole = masses + h * damping + h * h * stiffness;
        Ok(Self {
            turns: JointRotations::zeros(),
            rates: JointRotations::zeros(),
            inverse: whole.try_inverse().ok_or(InvalidArm::Loose)?,
            masses,
            stiffness,
            h,
            turning: std::array::from_fn(|segment| skeleton.rotation_jacobian(segment)),
        })
    }

    /// A step under these torques, N m.
    pub fn step(&mut self, torques: &JointRotations) {
        let pull = torques - self.stiffness * self.turns;
        self.rates = self.inverse * (self.masses * self.rates + self.h * pull);
        self.turns += self.h * self.rates;
    }

    /// Rest at the posture again.
    pub fn settle(&mut self) {
        self.turns = JointRotations::zeros();
        self.rates = JointRotations::zeros();
    }

    /// How fast a segment turns, rad/s.
    pub fn rate(&self, segment: usize) -> Vector3<f64> {
        self.turning[segment] * self.rates
    }

    /// How far each has turned from the posture, rad.
    pub const fn deflections(&self) -> &JointRotations {
        &self.turns
    }
}
