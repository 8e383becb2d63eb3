//! How the device thinks an arm works (Sierotowicz 2023, section 2): joints with three
//! axes each, a line of action per muscle group about one joint, gains. f64, of the study
//! alone: what goes in and out is what `recruit` asks for, so another implementation fits.
//!
//! Misprints mended: equation 3 pulls along the line *away* from the origin as printed; a
//! muscle pulls its insertion towards it. Axes x forward, y to the left, z up; the origin
//! is the sternoclavicular joint.

use hal_sim::body::arm::{ELECTRODES, FOREARM, Posture, UPPER_ARM};
use nalgebra::{Matrix3, Unit, Vector3};

/// Joints: sternoclavicular, glenohumeral, elbow.
pub const JOINTS: usize = 3;
/// What they are called in table 1.
pub const JOINT_NAMES: [&str; JOINTS] = ["SC", "GH", "EL"];

/// A routing point in the cylinder about a segment's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Along the axis from the joint, distal positive, m.
    pub along_m: f64,
    /// From the axis, m.
    pub radius_m: f64,
    /// Azimuth, rad, from the segment's front.
    pub azimuth: f64,
}

/// A muscle group's line of action: origin on the segment before its joint, insertion on
/// the one behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action {
    /// Its joint, 0 to 2.
    pub joint: usize,
    /// Origin, insertion.
    pub points: [Point; 2],
}

/// Where segments are, as far as the device knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Stature, m: lengths follow from it (Drillis, Contini and Bluestein 1964).
    pub stature_m: f64,
    /// Posture of the arm.
    pub posture: Posture,
}

/// Half the width between a person's shoulders over stature (Drillis and Contini 0.129
/// from the midline, less 20 mm to the joint's edge, assumed).
const GIRDLE: f64 = 0.100;

/// A segment before or behind a joint: its axis and its front, across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Away from the trunk.
    pub axis: Vector3<f64>,
    /// Azimuth 0.
    pub front: Vector3<f64>,
}

impl Segment {
    fn new(axis: Vector3<f64>, towards: Vector3<f64>) -> Self {
        let axis = axis.normalize();
        let front = (towards - axis * towards.dot(&axis)).normalize();
        Self { axis, front }
    }

    /// A point of its cylinder from the joint, m.
    #[must_use]
    pub fn at(&self, point: &Point) -> Vector3<f64> {
        let (sine, cosine) = point.azimuth.sin_cos();
        let aside = self.axis.cross(&self.front);
        point.along_m * self.axis + point.radius_m * (cosine * self.front + sine * aside)
    }

    /// The same of a point that lies at `from` the joint.
    #[must_use]
    pub fn cylinder(&self, from: &Vector3<f64>) -> Point {
        let along_m = from.dot(&self.axis);
        let across = from - along_m * self.axis;
        let aside = self.axis.cross(&self.front);
        Point {
            along_m,
            radius_m: across.norm(),
            azimuth: across.dot(&aside).atan2(across.dot(&self.front)),
        }
    }
}

impl Frame {
    /// Directions of upper arm and of the front that flexion turns it to.
    fn upper_arm(&self) -> [Vector3<f64>; 2] {
        let [plane, elevation, turn] = [
            self.posture.plane_deg,
            self.posture.elevation_deg,
            self.posture.rotation_deg,
        ]
        .map(f64::to_radians);
        let along = Vector3::new(
            elevation.sin() * plane.cos(),
            -elevation.sin() * plane.sin(),
            -elevation.cos(),
        );
        let front = Segment::new(along, Vector3::x()).front;
        let about = Unit::new_normalize(-along);
        [
            along,
            nalgebra::Rotation3::from_axis_angle(&about, turn) * front,
        ]
    }

    /// Direction of the forearm.
    fn forearm(&self) -> Vector3<f64> {
        let [along, front] = self.upper_arm();
        let (sine, cosine) = self.posture.elbow_deg.to_radians().sin_cos();
        cosine * along + sine * front
    }

    /// Segments before and behind each joint: trunk, girdle, upper arm, forearm.
    #[must_use]
    pub fn segments(&self) -> [[Segment; 2]; JOINTS] {
        let [along, front] = self.upper_arm();
        let trunk = Segment::new(Vector3::z(), Vector3::x());
        let girdle = Segment::new(-Vector3::y(), Vector3::x());
        let upper = Segment::new(along, front);
        let fore = Segment::new(self.forearm(), -along);
        [[trunk, girdle], [girdle, upper], [upper, fore]]
    }

    /// Joints and the middle of the cuff, m.
    #[must_use]
    pub fn places(&self) -> ([Vector3<f64>; JOINTS], Vector3<f64>) {
        let shoulder = -GIRDLE * self.stature_m * Vector3::y();
        let [along, _] = self.upper_arm();
        let elbow = shoulder + UPPER_ARM[0] * self.stature_m * along;
        let cuff = hal_sim::body::arm::CUFF_PART * FOREARM[0] * self.stature_m;
        (
            [Vector3::zeros(), shoulder, elbow],
            elbow + cuff * self.forearm(),
        )
    }

    /// Torques about each joint that `wrench` (N, N m) at the cuff is made of (equation 8).
    #[must_use]
    pub fn torques(&self, wrench: &[f64; 6]) -> [Vector3<f64>; JOINTS] {
        let [x, y, z, a, b, c] = *wrench;
        let (force, torque) = (Vector3::new(x, y, z), Vector3::new(a, b, c));
        let (joints, cuff) = self.places();
        joints.map(|joint| (cuff - joint).cross(&force) + torque)
    }

    /// Torque of one newton of a line of action about its joint, m (equation 3).
    #[must_use]
    pub fn arm_m(&self, action: &Action) -> Vector3<f64> {
        let [before, behind] = self.segments()[action.joint];
        let [origin, insertion] = &action.points;
        let (origin, insertion) = (before.at(origin), behind.at(insertion));
        insertion.cross(&(origin - insertion).normalize())
    }

    /// Moment of inertia about each joint of all that is behind it, kg m², of a person of
    /// this mass by the tables.
    #[must_use]
    pub fn inertias(&self, mass_kg: f64) -> [Matrix3<f64>; JOINTS] {
        use hal_sim::body::arm::HAND;
        let (joints, _) = self.places();
        let [along, _] = self.upper_arm();
        let fore = self.forearm();
        let rod =
            |part: [f64; 4], start: Vector3<f64>, axis: Vector3<f64>, joint: &Vector3<f64>| {
                let [length, mass, centre, gyration] = part;
                let length = length * self.stature_m;
                let from = start + centre * length * axis - joint;
                let kg = mass * mass_kg;
                let across = Matrix3::identity() - 0.9 * axis * axis.transpose();
                let steiner = from.norm_squared() * Matrix3::identity() - from * from.transpose();
                kg * ((gyration * length).powi(2) * across + steiner)
            };
        let wrist = joints[2] + FOREARM[0] * self.stature_m * fore;
        std::array::from_fn(|joint| {
            let at = &joints[joint];
            let mut all = rod(FOREARM, joints[2], fore, at) + rod(HAND, wrist, fore, at);
            if joint < 2 {
                all += rod(UPPER_ARM, joints[1], along, at);
            }
            all
        })
    }
}

/// A person's limb as the device knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Limb {
    /// Segments.
    pub frame: Frame,
    /// Lines of action, in the order of channels.
    pub actions: [Action; ELECTRODES],
    /// Force per current above the least, N/mA.
    pub gains: [f64; ELECTRODES],
    /// Least and greatest current of each channel, mA.
    pub ranges_ma: [[f64; 2]; ELECTRODES],
}

impl Limb {
    /// Torque of one newton of each muscle about its joint, m.
    #[must_use]
    pub fn arms_m(&self) -> [Vector3<f64>; ELECTRODES] {
        self.actions.each_ref().map(|it| self.frame.arm_m(it))
    }

    /// Greatest force of each muscle, N.
    #[must_use]
    pub fn greatest_n(&self) -> [f64; ELECTRODES] {
        std::array::from_fn(|at| {
            let [least, greatest] = self.ranges_ma[at];
            (greatest - least) * self.gains[at]
        })
    }

    /// Currents of these forces (line 12 of algorithm 1), mA, within their ranges; none of
    /// no force.
    #[must_use]
    pub fn currents_ma(&self, forces_n: &[f64; ELECTRODES]) -> [f64; ELECTRODES] {
        std::array::from_fn(|at| {
            let [least, greatest] = self.ranges_ma[at];
            match forces_n[at] > 0.0 {
                true => (least + forces_n[at] / self.gains[at]).min(greatest),
                false => 0.0,
            }
        })
    }
}

/// Where electrodes and cursory anatomy put origins (from the joint in our axes, m) and
/// insertions (along the segment behind the joint, front and outward of it, m). Assumed,
/// to the centimetre, of nobody in particular.
const CURSORY: [(usize, [f64; 3], [f64; 3]); ELECTRODES] = [
    // Elbow: origin along, front and outward of the upper arm; biceps, triceps.
    (2, [-0.20, 0.03, 0.0], [0.05, 0.02, 0.0]),
    (2, [-0.20, -0.03, 0.0], [-0.02, -0.01, 0.0]),
    // Deltoid superior, anterior, posterior.
    (1, [0.0, -0.01, 0.04], [0.12, 0.0, 0.02]),
    (1, [0.03, 0.03, 0.03], [0.12, 0.01, 0.02]),
    (1, [-0.06, 0.04, 0.02], [0.10, -0.01, 0.02]),
    // Pectoralis clavicular, sternocostal.
    (1, [0.07, 0.11, 0.01], [0.08, 0.02, 0.01]),
    (1, [0.09, 0.15, -0.12], [0.07, 0.02, 0.01]),
    // Trapezius: about the sternoclavicular joint; insertion on the scapula's spine.
    (0, [-0.14, 0.0, 0.0], [0.12, -0.10, 0.0]),
    // Latissimus.
    (1, [-0.06, 0.14, -0.30], [0.04, 0.02, 0.0]),
];

/// Lines of action by cursory anatomy in this frame.
#[must_use]
pub fn cursory(frame: &Frame) -> [Action; ELECTRODES] {
    let segments = frame.segments();
    CURSORY.map(|(joint, origin, insertion)| {
        let [before, behind] = segments[joint];
        let aside = |segment: &Segment| segment.front.cross(&-segment.axis);
        let along = |segment: &Segment, [x, front, outward]: [f64; 3]| {
            x * segment.axis + front * segment.front + outward * aside(segment)
        };
        let origin = match joint {
            2 => along(&before, origin),
            _ => Vector3::from(origin),
        };
        let points = [
            before.cylinder(&origin),
            behind.cylinder(&along(&behind, insertion)),
        ];
        Action { joint, points }
    })
}
