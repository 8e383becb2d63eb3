//! Posture of the arm as nine joint angles, as sensors on four segments would measure it.
//!
//! The axes here are x backward, y to the right, z upward: half a turn about the vertical from the
//! axes of the body. With all angles zero the arm hangs down and every segment has these axes; the
//! axes of the shoulder girdle are those at rest.

use super::posture::{JointRotations, Posture, Skeleton};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Converts a vector between the axes forward, left, up and the axes backward, right, up, in either
/// direction.
pub(super) fn rotate_half_turn(vector3: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(0.0 - vector3.x, 0.0 - vector3.y, vector3.z) // adding to 0.0 avoids negative zero
}

/// Returns the nine joint angles, degrees: those of the posture plus the small deflection of each
/// turn (rad). They are, with their axes: sternoclavicular protraction z, elevation x, roll y;
/// glenohumeral flexion y, abduction x, internal rotation z; elbow flexion y, lateral bending x,
/// pronation z.
pub(super) fn angles_deg(posture: &Posture, bones: &Skeleton, turns: &JointRotations) -> [f64; 9] {
    let turn = |from: usize| rotate_half_turn(turns.fixed_rows::<3>(from).into());
    let girdle = Rotation3::new(turn(0)).into_inner();
    let axes = [
        -bones.hinge.cross(&bones.upper_arm),
        bones.hinge,
        -bones.upper_arm,
    ]
    .map(rotate_half_turn);
    let upper_arm = Rotation3::new(turn(0) + turn(3)) * Matrix3::from_columns(&axes);
    let shoulder = girdle.transpose() * upper_arm;
    // Euler angles: the middle axis first, then the first and the third.
    let sternal = [
        libm::atan2(-girdle[(0, 1)], girdle[(1, 1)]),
        libm::asin(girdle[(2, 1)].clamp(-1.0, 1.0)),
        libm::atan2(-girdle[(2, 0)], girdle[(2, 2)]),
    ];
    let glenohumeral = [
        libm::atan2(shoulder[(0, 2)], shoulder[(2, 2)]),
        libm::asin((-shoulder[(1, 2)]).clamp(-1.0, 1.0)),
        libm::atan2(shoulder[(1, 0)], shoulder[(1, 1)]),
    ];
    let [a, b, c] = sternal.map(f64::to_degrees);
    let [d, e, f] = glenohumeral.map(f64::to_degrees);
    let elbow = posture.elbow_deg + turns[6].to_degrees();
    // A positive rotation about the forearm axis, which points to the hand, supinates.
    [a, b, c, d, e, f, elbow, 0.0, -turns[7].to_degrees()]
}
