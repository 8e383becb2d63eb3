//! Response of the arm to joint torques, while fixed in the cuff and while free.
//!
//! In the cuff, the turns q yield to the torques τ against the stiffness K of the tissue and the
//! cuff C, where J is the Jacobian of the cuff: (K + Jᵀ C J) q = τ. The wrench on the cuff is C J
//! q. There are more turns than components of the wrench; tissue carries the rest. Free motion
//! follows M q″ + B q′ + K q = τ about the posture, for small motions as after a twitch.

use super::posture::{JointRotations, Skeleton, TURNS};
use super::spec::{ArmSpec, FOREARM, GIRDLE_KG, HAND, InvalidArm, SEGMENTS, UPPER_ARM};
use nalgebra::{Matrix3, SMatrix, Vector3};

pub(super) type Square = SMatrix<f64, TURNS, TURNS>;
/// Matrix that converts torques about the arm's turns (N m) to the wrench on the cuff: force (N)
/// and torque (N m).
pub type ToWrench = SMatrix<f64, 6, TURNS>;

/// Rigid body that moves with a segment, such as the forearm or the hand.
struct Part {
    segment: usize,
    kg: f64,
    centre: Vector3<f64>,
    /// Inertia tensor about the centre, in the axes of the body, kg m².
    inertia: Matrix3<f64>,
}

/// Returns a rod-like part. Its inertia across the axis follows from the radius of gyration; the
/// inertia along the axis is a tenth of that (assumed 0.05 to 0.2).
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

/// Returns the mass matrix of the arm for rotations about its turns, kg m².
pub(super) fn masses(spec: &ArmSpec, skeleton: &Skeleton) -> Square {
    let mut matrix = Square::zeros();
    for part in parts(spec, skeleton) {
        let moves = skeleton.jacobian(&part.centre, part.segment);
        let turns = skeleton.rotation_jacobian(part.segment);
        matrix += part.kg * moves.transpose() * moves + turns.transpose() * part.inertia * turns;
    }
    matrix
}

/// Returns the weight of the arm from the shoulder to the hand, N.
pub(super) fn weight_n(spec: &ArmSpec) -> f64 {
    let mass = (UPPER_ARM[1] + FOREARM[1] + HAND[1]) * spec.mass_kg;
    super::sensors::GRAVITY_M_S2 * mass
}

/// Returns the cuff's response to torques: the wrench on the cuff, and the deflection of each turn,
/// rad/N m.
///
/// # Errors
/// Returns [`InvalidArm::Loose`] if nothing resists some turn.
pub(super) fn cuff_response(
    spec: &ArmSpec,
    skeleton: &Skeleton,
) -> Result<(ToWrench, Square), InvalidArm> {
    let moves = skeleton.cuff_jacobian();
    let [along, about] = spec.hold.cuff;
    let cuff =
        SMatrix::<f64, 6, 6>::from_diagonal(&[along, along, along, about, about, about].into());
    let tissue = Square::from_diagonal(&spec.hold.passive_nm_per_rad.into());
    let stiffness = tissue + moves.transpose() * cuff * moves;
    let inverse = stiffness.try_inverse().ok_or(InvalidArm::Loose)?;
    Ok((cuff * moves * inverse, inverse))
}

/// The free arm, integrated in steps of `h` seconds by implicit Euler, which is stable for any
/// stiffness.
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
    /// Creates a free arm at rest.
    ///
    /// # Errors
    /// Returns [`InvalidArm::Loose`] if nothing resists some turn.
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
        let system = masses + h * damping + h * h * stiffness;
        Ok(Self {
            turns: JointRotations::zeros(),
            rates: JointRotations::zeros(),
            inverse: system.try_inverse().ok_or(InvalidArm::Loose)?,
            masses,
            stiffness,
            h,
            turning: std::array::from_fn(|segment| skeleton.rotation_jacobian(segment)),
        })
    }

    /// Advances by one step under these torques, N m.
    pub fn step(&mut self, torques: &JointRotations) {
        let pull = torques - self.stiffness * self.turns;
        self.rates = self.inverse * (self.masses * self.rates + self.h * pull);
        self.turns += self.h * self.rates;
    }

    /// Returns the arm to rest at its posture.
    pub fn settle(&mut self) {
        self.turns = JointRotations::zeros();
        self.rates = JointRotations::zeros();
    }

    /// Returns the angular velocity of a segment, rad/s.
    pub fn rate(&self, segment: usize) -> Vector3<f64> {
        self.turning[segment] * self.rates
    }

    /// Returns the deflection of each turn from the posture, rad.
    pub const fn deflections(&self) -> &JointRotations {
        &self.turns
    }
}
