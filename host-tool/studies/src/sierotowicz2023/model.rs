//! What the device is told of an arm (Sierotowicz 2023, section 2): routing points in
//! cylinders about segments, gains and currents, made into what `firmware::limb` takes. It
//! knows nothing of the body that it is tried on.
//!
//! Axes here are the device's: backward, to the right, upward. The body's are forward, to
//! the left, upward: half a turn about the vertical ([`turned`]).

use firmware::limb::{AXES, JointName, LimbSpec, LineSpec, Posture as Angles, ViaSpec};
use firmware::units::{Amplitude, Angle};
use hal_sim::body::arm::{CUFF_PART, ELECTRODES, FOREARM, Posture, UPPER_ARM};
use nalgebra::{Rotation3, Unit, Vector3};

/// What joints are called in table 1.
pub const JOINT_NAMES: [&str; 3] = ["SC", "GH", "EL"];
/// Half the width between a person's shoulders over stature (Drillis and Contini 0.129
/// from the midline, less 20 mm to the joint's edge, assumed).
const GIRDLE: f64 = 0.100;
/// The widest ranges that a limb may have: the study keeps to one posture.
const RANGE_MDEG: [(i32, i32); 3] = [(-180_000, 180_000), (-80_000, 80_000), (-180_000, 180_000)];

/// The device's axes from the body's, and back.
#[must_use]
pub fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    [-x, -y, z]
}

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
    /// Its joint.
    pub joint: JointName,
    /// Origin, insertion, each from that joint.
    pub points: [Point; 2],
}

/// A segment's cylinder: directions along its own axes.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder {
    /// Away from the trunk; of the trunk upward.
    axis: Vector3<f64>,
    /// Forward while the arm hangs: azimuth 0.
    front: Vector3<f64>,
}

impl Cylinder {
    /// Of segment `n`: thorax, girdle, upper arm, forearm.
    #[must_use]
    pub fn of_segment(n: usize) -> Self {
        let axis = match n {
            0 => Vector3::z(),
            1 => Vector3::y(),
            _ => -Vector3::z(),
        };
        let front = -Vector3::x();
        Self { axis, front }
    }

    /// A point from the joint along the segment's own axes, m.
    #[must_use]
    pub fn at(&self, point: &Point) -> Vector3<f64> {
        let (sine, cosine) = point.azimuth.sin_cos();
        let aside = self.axis.cross(&self.front);
        point.along_m * self.axis + point.radius_m * (cosine * self.front + sine * aside)
    }

    /// The same of so far along, in front and outward, m.
    fn point(&self, [along_m, front, outward]: [f64; 3]) -> Point {
        Point {
            along_m,
            radius_m: front.hypot(outward),
            azimuth: outward.atan2(front),
        }
    }

    /// The same of a place along the segment's own axes.
    fn point_at(&self, at: &Vector3<f64>) -> Point {
        let aside = self.axis.cross(&self.front);
        self.point([self.axis, self.front, aside].map(|vector| at.dot(&vector)))
    }
}

/// Where segments are, as far as the device knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Stature, m: lengths follow from it (Drillis, Contini and Bluestein 1964).
    pub stature_m: f64,
    /// Posture of the arm.
    pub posture: Posture,
}

impl Frame {
    /// From each segment's origin to the next joint or the cuff, m.
    fn ways_m(&self) -> [Vector3<f64>; 4] {
        let [girdle, upper, cuff] =
            [GIRDLE, UPPER_ARM[0], CUFF_PART * FOREARM[0]].map(|part| part * self.stature_m);
        [
            Vector3::zeros(),
            girdle * Vector3::y(),
            -upper * Vector3::z(),
            -cuff * Vector3::z(),
        ]
    }

    /// The nine angles: the girdle at rest, the shoulder's that put the upper arm where the
    /// posture says, the elbow's flexion.
    #[must_use]
    pub fn angles(&self) -> Angles {
        let posture = &self.posture;
        let [plane, elevation, turn] = [
            posture.plane_deg,
            posture.elevation_deg,
            posture.rotation_deg,
        ]
        .map(f64::to_radians);
        let along = Vector3::new(
            -elevation.sin() * plane.cos(),
            elevation.sin() * plane.sin(),
            -elevation.cos(),
        );
        let forward = -Vector3::x();
        let level = (forward - along * along.dot(&forward)).normalize();
        let front = Rotation3::from_axis_angle(&Unit::new_normalize(-along), turn) * level;
        let (x, z) = (-front, -along);
        let y = z.cross(&x);
        // Rows of a turn about y, then x, then z.
        let flexion = z.x.atan2(z.z);
        let abduction = -z.y.asin();
        let rotation = x.y.atan2(y.y);
        let degrees = [flexion, abduction, rotation].map(f64::to_degrees);
        let mut angles = [0.0; AXES];
        angles[3..6].copy_from_slice(&degrees);
        angles[6] = posture.elbow_deg;
        angles.map(|deg| Angle::from_millideg((1000.0 * deg).round() as i32))
    }
}

/// A person's arm as the device is told of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Segments.
    pub frame: Frame,
    /// Lines of action, in the order of channels.
    pub actions: [Action; ELECTRODES],
    /// Force per current above the least, N/mA.
    pub gains: [f64; ELECTRODES],
    /// Least and greatest current of each channel, mA.
    pub ranges_ma: [[f64; 2]; ELECTRODES],
}

/// To whole millionths.
fn um(at: &Vector3<f64>) -> [i32; 3] {
    [at.x, at.y, at.z].map(|m| (1e6 * m).round() as i32)
}

impl Model {
    /// What the device takes; gains to 1 mN/mA, currents to 1 µA, points to 1 µm.
    #[must_use]
    pub fn spec(&self) -> LimbSpec {
        let ways = self.frame.ways_m();
        let [first, middle, last] = RANGE_MDEG;
        let line = |channel: usize| {
            let Action { joint, points } = &self.actions[channel];
            let before = usize::from(joint.index());
            let [origin, insertion] = points;
            let origin = ways[before] + Cylinder::of_segment(before).at(origin);
            let insertion = Cylinder::of_segment(before + 1).at(insertion);
            let via = |segment, at: &Vector3<f64>| ViaSpec {
                segment,
                at_um: um(at),
            };
            let vias = [
                via(joint.index(), &origin),
                via(joint.index() + 1, &insertion),
            ];
            let [threshold, limit] = self.ranges_ma[channel];
            let ua = |ma: f64| Amplitude::new((1000.0 * ma).round() as u32);
            LineSpec {
                channel: channel as u8, // below ELECTRODES
                joint: *joint,
                vias: vias.into_iter().collect(),
                gain_mn_per_ma: (1000.0 * self.gains[channel]).round() as u32,
                threshold: ua(threshold),
                limit: ua(limit),
            }
        };
        LimbSpec {
            ways_um: ways.each_ref().map(um),
            ranges_mdeg: [
                first, middle, last, first, middle, last, first, middle, last,
            ],
            lines: (0..ELECTRODES).map(line).collect(),
        }
    }
}

/// Where electrodes and cursory anatomy put origins (at the elbow along, in front of and
/// outward of the upper arm, else backward, right and up, from the joint, m) and insertions
/// (along the segment behind the joint, in front and outward of it, m). Assumed, to the
/// centimetre, of nobody in particular.
const CURSORY: [(JointName, [f64; 3], [f64; 3]); ELECTRODES] = {
    use JointName::{Elbow, Glenohumeral, Sternoclavicular};
    [
        // Biceps, triceps.
        (Elbow, [-0.20, 0.03, 0.0], [0.05, 0.02, 0.0]),
        (Elbow, [-0.20, -0.03, 0.0], [-0.02, -0.01, 0.0]),
        // Deltoid superior, anterior, posterior.
        (Glenohumeral, [0.0, 0.01, 0.04], [0.12, 0.0, 0.02]),
        (Glenohumeral, [-0.03, -0.03, 0.03], [0.12, 0.01, 0.02]),
        (Glenohumeral, [0.06, -0.04, 0.02], [0.10, -0.01, 0.02]),
        // Pectoralis clavicular, sternocostal.
        (Glenohumeral, [-0.07, -0.11, 0.01], [0.08, 0.02, 0.01]),
        (Glenohumeral, [-0.09, -0.15, -0.12], [0.07, 0.02, 0.01]),
        // Trapezius: insertion on the scapula's spine.
        (Sternoclavicular, [0.14, 0.0, 0.0], [0.12, -0.10, 0.0]),
        // Latissimus.
        (Glenohumeral, [0.06, -0.14, -0.30], [0.04, 0.02, 0.0]),
    ]
};

/// Lines of action by cursory anatomy.
#[must_use]
pub fn cursory() -> [Action; ELECTRODES] {
    CURSORY.map(|(joint, origin, insertion)| {
        let before = usize::from(joint.index());
        let cylinder = Cylinder::of_segment(before);
        let origin = match joint {
            JointName::Elbow => cylinder.point(origin),
            _ => cylinder.point_at(&Vector3::from(origin)),
        };
        let points = [origin, Cylinder::of_segment(before + 1).point(insertion)];
        Action { joint, points }
    })
}
