//! Bones, joints and axes of the right arm in a given posture.
//!
//! The axes are x forward, y to the left, z up; the origin is the sternoclavicular joint.

use super::anatomy::{Bone, Line, Muscle, from_das3};
use super::elbow_arms::{self, RANGE_DEG};
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};

/// Number of rotations (turns) of the arm: sternoclavicular about x, y, z, glenohumeral about x, y,
/// z, elbow flexion, pronation.
pub const TURNS: usize = 8;
/// Vector with one value for each of the [`TURNS`] rotations, such as a torque or a deflection.
pub type JointRotations = SVector<f64, TURNS>;

/// Orientation of the clavicle on the thorax at rest (DAS3): rotations about y, z and x, rad.
const CLAVICLE_RAD: [f64; 3] = [-0.584_440_78, 0.0873, 0.574_463_78];
/// Orientation of the scapula relative to the clavicle at rest (DAS3): rotations about y, z and x,
/// rad.
const SCAPULA_RAD: [f64; 3] = [0.795_362_6, 0.007_997_97, -0.210_516_55];
/// Position of the sternoclavicular joint on the thorax, m (DAS3).
const STERNAL_M: [f64; 3] = [0.0014, -0.0152, 0.0028];
/// Position of the angle of the acromion on the clavicle, m (DAS3).
const ACROMION_M: [f64; 3] = [0.2077, -0.0001, 0.0282];
/// Position of the glenohumeral joint on the scapula, m (DAS3).
const SOCKET_M: [f64; 3] = [0.002, -0.023, -0.0439];
/// Moment arm with which the biceps supinates the forearm about its long axis, m. Assumed (6 to 14
/// mm).
const BICEPS_SUPINATES_M: f64 = 0.010;

/// A posture of upper arm and forearm, degrees. Clavicle and scapula are at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Posture {
    /// Vertical plane of the upper arm: 0 is forward, 90 to the side.
    pub plane_deg: f64,
    /// Elevation of the upper arm in that plane: 0 hangs down, 90 is level.
    pub elevation_deg: f64,
    /// Rotation about the long axis of the upper arm, inward positive. At 0, elbow flexion moves
    /// the forearm as directly forward as possible.
    pub rotation_deg: f64,
    /// Elbow flexion, 0 with the arm straight, within [`RANGE_DEG`].
    pub elbow_deg: f64,
}

impl Posture {
    /// Posture that the study assumes, because the paper prints none: upper arm half raised between
    /// forward and to the side, elbow at a right angle, hand in front of the shoulder.
    pub const STUDY: Self = Self {
        plane_deg: 45.0,
        elevation_deg: 45.0,
        rotation_deg: 0.0,
        elbow_deg: 90.0,
    };

    /// Returns whether the moment arms are known in this posture: the elevation is 1° to 120°, the
    /// elbow flexion is within [`RANGE_DEG`], and all angles are finite.
    #[must_use]
    pub fn is_known(&self) -> bool {
        let angles_deg = [self.plane_deg, self.elevation_deg, self.rotation_deg];
        let [low, high] = RANGE_DEG;
        angles_deg.iter().all(|value| value.is_finite())
            && (1.0..=120.0).contains(&self.elevation_deg)
            && (low..=high).contains(&self.elbow_deg)
    }
}

/// Lengths that determine the positions of the joints, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lengths {
    /// Scale of the shoulder relative to DAS3; 1 is its original size.
    pub shoulder: f64,
    /// Distance from shoulder to elbow.
    pub upper_arm_m: f64,
    /// Distance from elbow to wrist.
    pub forearm_m: f64,
    /// Distance from the elbow to the middle of the cuff.
    pub cuff_m: f64,
}

/// Positions of bones, joints and axes in a posture.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// Lengths of the bones from which the positions were computed.
    pub lengths: Lengths,
    /// Position of the glenohumeral joint, m.
    pub shoulder: Vector3<f64>,
    /// Position of the elbow joint, m.
    pub elbow: Vector3<f64>,
    /// Middle of the cuff, where force is measured, m.
    pub cuff: Vector3<f64>,
    /// Unit vector of the upper arm, from shoulder to elbow.
    pub upper_arm: Vector3<f64>,
    /// Unit vector of the forearm, from elbow to wrist.
    pub forearm: Vector3<f64>,
    /// Axis of the elbow; a positive rotation about it flexes.
    pub hinge: Vector3<f64>,
    posture: Posture,
    clavicle: Matrix3<f64>,
    scapula: Matrix3<f64>,
    acromion: Vector3<f64>,
    humerus: Matrix3<f64>,
}

fn rotation_matrix([y, z, x]: [f64; 3]) -> Matrix3<f64> {
    let turn = |axis, rad| Rotation3::from_axis_angle(&axis, rad);
    let turn = turn(Vector3::y_axis(), y) * turn(Vector3::z_axis(), z) * turn(Vector3::x_axis(), x);
    turn.into_inner()
}

fn from_das3_axes(das3: Vector3<f64>) -> Vector3<f64> {
    from_das3(das3.into())
}

impl Skeleton {
    /// Computes the skeleton in this posture, with bones of these lengths.
    #[must_use]
    pub fn new(posture: Posture, lengths: Lengths) -> Self {
        let clavicle = rotation_matrix(CLAVICLE_RAD);
        let scapula = clavicle * rotation_matrix(SCAPULA_RAD);
        let acromion = clavicle * Vector3::from(ACROMION_M);
        let socket = acromion + scapula * Vector3::from(SOCKET_M);
        let shoulder = lengths.shoulder * from_das3_axes(socket);
        let (sine, cosine) = libm::sincos(posture.elevation_deg.to_radians());
        let (aside, ahead) = libm::sincos(posture.plane_deg.to_radians());
        let upper_arm = Vector3::new(sine * ahead, -sine * aside, -cosine);
        let forward = Vector3::x() - upper_arm * upper_arm.x;
        let inward = nalgebra::Unit::new_normalize(-upper_arm);
        let turn = Rotation3::from_axis_angle(&inward, posture.rotation_deg.to_radians());
        let front = turn * forward.normalize();
        let (sine, cosine) = libm::sincos(posture.elbow_deg.to_radians());
        let forearm = cosine * upper_arm + sine * front;
        let hinge = upper_arm.cross(&front);
        let elbow = shoulder + lengths.upper_arm_m * upper_arm;
        // Axes of the humerus in DAS3: y up along the bone, z backward, x outward.
        let (y, z) = (-upper_arm, -front);
        let humerus = Matrix3::from_columns(&[y.cross(&z), y, z]);
        Self {
            shoulder,
            elbow,
            cuff: elbow + lengths.cuff_m * forearm,
            upper_arm,
            forearm,
            hinge,
            posture,
            clavicle,
            scapula,
            acromion,
            humerus,
            lengths,
        }
    }

    /// Converts a point from the axes of a bone to a position in the axes of the body, m.
    fn point(&self, (bone, at): (Bone, [f64; 3])) -> Vector3<f64> {
        let scale = self.lengths.shoulder;
        let at = Vector3::from(at);
        match bone {
            Bone::Thorax => scale * from_das3_axes(at - Vector3::from(STERNAL_M)),
            Bone::Clavicle => scale * from_das3_axes(self.clavicle * at),
            Bone::Scapula => scale * from_das3_axes(self.acromion + self.scapula * at),
            Bone::Humerus => self.shoulder + scale * (self.humerus * at),
        }
    }

    /// Returns the unit vector from the sternoclavicular to the glenohumeral joint.
    #[must_use]
    pub fn clavicle_axis(&self) -> Vector3<f64> {
        self.shoulder.normalize()
    }

    /// Returns the orientations of clavicle, upper arm and forearm. The columns of each matrix are
    /// the axes of the segment, expressed in the axes of the body. In upper arm and forearm, the
    /// second axis points back along the segment, and the third away from the direction of flexion.
    #[must_use]
    pub fn frames(&self) -> [Matrix3<f64>; 3] {
        let clavicle = {
            let x = self.clavicle_axis();
            let y = Vector3::z().cross(&x).normalize();
            Matrix3::from_columns(&[x, y, x.cross(&y)])
        };
        let y = -self.forearm;
        let forearm = Matrix3::from_columns(&[self.hinge, y, self.hinge.cross(&y)]);
        [clavicle, self.humerus, forearm]
    }

    /// Returns the axis of each of the [`TURNS`] rotations as a unit vector, one per column.
    #[must_use]
    pub fn axes(&self) -> SMatrix<f64, 3, TURNS> {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
        SMatrix::from_columns(&[x, y, z, x, y, z, self.hinge, self.forearm])
    }

    /// Returns the velocity of a point of a segment per rate of each turn, m/rad; `segment` 0 is
    /// the clavicle with the scapula, 1 the upper arm, 2 the forearm.
    #[must_use]
    pub fn jacobian(&self, at: &Vector3<f64>, segment: usize) -> SMatrix<f64, 3, TURNS> {
        let axes = self.axes();
        let mut matrix = SMatrix::<f64, 3, TURNS>::zeros();
        let turns = self.turn_count(segment);
        for turn in 0..turns {
            let joint = match turn {
                0..3 => Vector3::zeros(),
                3..6 => self.shoulder,
                _ => self.elbow,
            };
            let axis: Vector3<f64> = axes.column(turn).into();
            matrix.set_column(turn, &axis.cross(&(at - joint)));
        }
        matrix
    }

    /// Returns the angular velocity of a segment per rate of each turn; see [`Self::jacobian`] for
    /// the numbers of the segments.
    #[must_use]
    pub fn rotation_jacobian(&self, segment: usize) -> SMatrix<f64, 3, TURNS> {
        let mut axes = self.axes();
        for turn in self.turn_count(segment)..TURNS {
            axes.set_column(turn, &Vector3::zeros());
        }
        axes
    }

    const fn turn_count(&self, segment: usize) -> usize {
        match segment {
            0 => 3,
            1 => 6,
            _ => TURNS,
        }
    }

    /// Returns the motion of the cuff per turn: translation in the upper three rows, m/rad,
    /// rotation in the lower three, rad/rad.
    #[must_use]
    pub fn cuff_jacobian(&self) -> SMatrix<f64, 6, TURNS> {
        let mut matrix = SMatrix::<f64, 6, TURNS>::zeros();
        matrix
            .fixed_rows_mut::<3>(0)
            .copy_from(&self.jacobian(&self.cuff, 2));
        matrix
            .fixed_rows_mut::<3>(3)
            .copy_from(&self.rotation_jacobian(2));
        matrix
    }

    /// Returns the moment arms of a muscle: the torque about each turn's axis per newton, m.
    /// `azimuth_deg` rotates the line of action about the bone to which it is attached: about the
    /// upper arm for the shoulder, about the clavicle for the trapezius. For a muscle that crosses
    /// only the elbow, it rotates flexion into supination.
    #[must_use]
    pub fn arms_m(&self, muscle: Muscle, azimuth_deg: f64) -> JointRotations {
        let mut arms = JointRotations::zeros();
        if let Some(line) = muscle.line() {
            let part = muscle.shoulder_part();
            let [sternal, shoulder] = self.shoulder_moments_m(&line);
            let turn = |axis: Vector3<f64>, arm: Vector3<f64>| {
                let axis = nalgebra::Unit::new_normalize(axis);
                part * (Rotation3::from_axis_angle(&axis, azimuth_deg.to_radians()) * arm)
            };
            arms.fixed_rows_mut::<3>(0)
                .copy_from(&turn(self.clavicle_axis(), sternal));
            arms.fixed_rows_mut::<3>(3)
                .copy_from(&turn(self.upper_arm, shoulder));
        }
        let scale = self.lengths.shoulder;
        let [biceps, triceps, brachialis, brachioradialis] =
            elbow_arms::arms_m(self.posture.elbow_deg).unwrap_or_default();
        let (flexes, supinates) = match muscle {
            Muscle::Biceps => (biceps, BICEPS_SUPINATES_M),
            Muscle::Triceps => (triceps, 0.0),
            Muscle::Brachialis => (brachialis, 0.0),
            Muscle::Brachioradialis => (brachioradialis, 0.0),
            _ => (0.0, 0.0),
        };
        let (sine, cosine) = libm::sincos(azimuth_deg.to_radians());
        arms[6] = scale * (cosine * flexes - sine * supinates);
        // The axis of the right forearm points to the hand: a positive rotation about it supinates.
        arms[7] = scale * (sine * flexes + cosine * supinates);
        arms
    }

    /// Returns the moments of one newton along this line about the sternoclavicular and the
    /// glenohumeral joint, m.
    fn shoulder_moments_m(&self, line: &Line) -> [Vector3<f64>; 2] {
        let (from, to) = (self.point(line.origin), self.point(line.insertion));
        let pull = (from - to).normalize();
        let on = |bone: Bone, moves: &[Bone]| moves.contains(&bone);
        let (start, end) = (line.origin.0, line.insertion.0);
        let sternal = match on(start, &[Bone::Thorax]) {
            true => to.cross(&pull),
            false => Vector3::zeros(),
        };
        let shoulder = match on(end, &[Bone::Humerus]) {
            true => (to - self.shoulder).cross(&pull),
            false => Vector3::zeros(),
        };
        let least = self.lengths.shoulder * line.wrap_m;
        let wraps = shoulder.norm() > 0.0 && shoulder.norm() < least;
        let factor = if wraps { least / shoulder.norm() } else { 1.0 };
        [sternal, factor * shoulder]
    }
}

#[cfg(test)]
mod tests {
    use super::super::anatomy::ALL;
    use super::*;

    fn nominal() -> Skeleton {
        let lengths = Lengths {
            shoulder: 1.0,
            upper_arm_m: 0.327,
            forearm_m: 0.257,
            cuff_m: 0.218,
        };
        Skeleton::new(Posture::STUDY, lengths)
    }

    /// Principle of virtual work: a moment is minus the change of the line's length as its
    /// insertion rotates.
    #[test]
    fn moments_are_what_lengths_lose() {
        let bones = nominal();
        for muscle in ALL {
            let Some(mut line) = muscle.line() else {
                continue;
            };
            line.wrap_m = 0.0;
            let moments = bones.shoulder_moments_m(&line);
            let (from, to) = (bones.point(line.origin), bones.point(line.insertion));
            for (joint, moment) in [Vector3::zeros(), bones.shoulder].iter().zip(moments) {
                if moment == Vector3::zeros() {
                    continue;
                }
                for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
                    let length = |rad: f64| {
                        let turned = Rotation3::from_axis_angle(&axis, rad) * (to - joint);
                        (joint + turned - from).norm()
                    };
                    let slope = (length(1e-5) - length(-1e-5)) / 2e-5;
                    let off = moment.dot(&axis) + slope;
                    assert!(off.abs() < 1e-9, "{muscle:?}: {off}");
                }
            }
        }
    }

    /// Compares the Jacobian of the cuff with finite rotations of everything beyond each joint.
    #[test]
    fn the_cuff_moves_as_turning_moves_it() {
        let bones = nominal();
        let jacobian = bones.cuff_jacobian();
        let axes = bones.axes();
        for turn in 0..TURNS {
            let joint = match turn {
                0..3 => Vector3::zeros(),
                3..6 => bones.shoulder,
                _ => bones.elbow,
            };
            let axis: Vector3<f64> = axes.column(turn).into();
            let axis = nalgebra::Unit::new_normalize(axis);
            let at =
                |rad: f64| joint + Rotation3::from_axis_angle(&axis, rad) * (bones.cuff - joint);
            let moved = (at(1e-6) - at(-1e-6)) / 2e-6;
            let off = (moved - jacobian.fixed_view::<3, 1>(0, turn)).norm();
            assert!(off < 1e-9, "turn {turn}: {off}");
        }
    }

    /// Lines that would pass through the shoulder wrap around a sphere and keep their direction.
    #[test]
    fn deltoids_do_not_run_through_the_joint() {
        let bones = nominal();
        for muscle in [
            Muscle::DeltoidSuperior,
            Muscle::DeltoidAnterior,
            Muscle::DeltoidPosterior,
        ] {
            let arms = bones.arms_m(muscle, 0.0);
            let about: Vector3<f64> = arms.fixed_rows::<3>(3).into();
            assert!((0.025..0.045).contains(&about.norm()), "{muscle:?} {about}");
        }
    }

    /// DAS3 at rest places the shoulder to the right of, behind and above the breastbone.
    #[test]
    fn the_shoulder_is_where_shoulders_are() {
        let at = nominal().shoulder;
        assert!(at.y < -0.12 && at.y > -0.22, "{at}");
        assert!(at.x < 0.0 && at.x > -0.12, "{at}");
        assert!(at.z.abs() < 0.08, "{at}");
    }
}
