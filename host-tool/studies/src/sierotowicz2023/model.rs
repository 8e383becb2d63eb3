//! The device's model of an arm (Sierotowicz 2023, section 2): routing points in cylinders around
//! segments, gains and currents. Converts it into the specification that `firmware::limb` takes.
//! The model knows nothing of the simulated arm.
//!
//! The axes here are the device's: backward, right, up. Those of the simulated arm are forward,
//! left, up: half a turn about the vertical ([`turned`]).

use firmware::limb::{AXES, JointName, LimbSpec, LineSpec, Posture as Angles, ViaSpec};
use firmware::units::{Amplitude, Angle};
use hal_sim::body::arm::{CUFF_PART, ELECTRODES, FOREARM, Posture, UPPER_ARM};
use nalgebra::{Rotation3, Unit, Vector3};

/// Names of the joints in table 1.
pub const JOINT_NAMES: [&str; 3] = ["SC", "GH", "EL"];
/// Half the shoulder width as a fraction of stature (Drillis and Contini: 0.129 from the midline,
/// minus 20 mm to the joint's edge, assumed).
const GIRDLE: f64 = 0.100;
/// Ranges of the three angles of every joint, in thousandths of a degree: the widest that a limb
/// may have, because the study keeps to one posture.
const RANGE_MDEG: [(i32, i32); 3] = [(-180_000, 180_000), (-80_000, 80_000), (-180_000, 180_000)];

/// Converts a vector from the axes of the simulated arm to those of the device, or back.
#[must_use]
pub fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    [-x, -y, z]
}

/// Routing point in the cylinder around a segment's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Distance from the joint along the axis, distal positive, m.
    pub along_m: f64,
    /// Distance from the axis, m.
    pub radius_m: f64,
    /// Azimuth from the segment's front, rad.
    pub azimuth: f64,
}

/// Line of action of a muscle group: its origin is on the segment before its joint, its insertion
/// on the segment after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action {
    /// Joint that the muscle group moves.
    pub joint: JointName,
    /// Origin and insertion, relative to that joint.
    pub points: [Point; 2],
}

/// Cylinder of a segment, with directions in the segment's own axes.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder {
    /// Direction away from the trunk; up for the trunk itself.
    axis: Vector3<f64>,
    /// Direction of azimuth 0: forward while the arm hangs.
    front: Vector3<f64>,
}

impl Cylinder {
    /// Returns the cylinder of segment `n`: 0 thorax, 1 girdle, 2 upper arm, 3 forearm.
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

    /// Returns the position of a point relative to the joint in the segment's own axes, m.
    #[must_use]
    pub fn at(&self, point: &Point) -> Vector3<f64> {
        let (sine, cosine) = libm::sincos(point.azimuth);
        let aside = self.axis.cross(&self.front);
        point.along_m * self.axis + point.radius_m * (cosine * self.front + sine * aside)
    }

    /// Returns the point that lies this far along the axis, in front and outward, m.
    fn point(&self, [along_m, front, outward]: [f64; 3]) -> Point {
        Point {
            along_m,
            radius_m: libm::hypot(front, outward),
            azimuth: libm::atan2(outward, front),
        }
    }

    /// Returns the point at a position in the segment's own axes.
    fn point_at(&self, at: &Vector3<f64>) -> Point {
        let aside = self.axis.cross(&self.front);
        self.point([self.axis, self.front, aside].map(|vector| at.dot(&vector)))
    }
}

/// Positions of the segments, as far as the device knows them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Stature, m; the segment lengths follow from it (Drillis, Contini and Bluestein 1964).
    pub stature_m: f64,
    pub posture: Posture,
}

impl Frame {
    /// Returns the vector from each segment's origin to the next joint or the cuff, m.
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

    /// Returns the nine joint angles: the girdle at rest, the shoulder angles of the posture, and
    /// the elbow's flexion.
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
            -libm::sin(elevation) * libm::cos(plane),
            libm::sin(elevation) * libm::sin(plane),
            -libm::cos(elevation),
        );
        let forward = -Vector3::x();
        let level = (forward - along * along.dot(&forward)).normalize();
        let front = Rotation3::from_axis_angle(&Unit::new_normalize(-along), turn) * level;
        let (x, z) = (-front, -along);
        let y = z.cross(&x);
        // Decomposes the rotation into turns about y, then x, then z.
        let flexion = libm::atan2(z.x, z.z);
        let abduction = -libm::asin(z.y);
        let rotation = libm::atan2(x.y, y.y);
        let degrees = [flexion, abduction, rotation].map(f64::to_degrees);
        let mut angles = [0.0; AXES];
        angles[3..6].copy_from_slice(&degrees);
        angles[6] = posture.elbow_deg;
        angles.map(|deg| Angle::from_millideg((1000.0 * deg).round() as i32))
    }
}

/// The device's model of a wearer's arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Stature and posture, which give the positions of the segments.
    pub frame: Frame,
    /// Lines of action, in the order of channels.
    pub actions: [Action; ELECTRODES],
    /// Force per mA of current above the channel's smallest current, N/mA.
    pub gains: [f64; ELECTRODES],
    /// Smallest and largest current of each channel, mA.
    pub ranges_ma: [[f64; 2]; ELECTRODES],
}

/// Converts metres to whole micrometres.
fn um(at: &Vector3<f64>) -> [i32; 3] {
    [at.x, at.y, at.z].map(|m| (1e6 * m).round() as i32)
}

impl Model {
    /// Returns the specification for the device, with gains rounded to 1 mN/mA, currents to 1 µA
    /// and points to 1 µm.
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
            offsets_um: ways.each_ref().map(um),
            ranges_mdeg: [
                first, middle, last, first, middle, last, first, middle, last,
            ],
            lines: (0..ELECTRODES).map(line).collect(),
        }
    }
}

/// Joint, origin and insertion of each line by electrode position and approximate anatomy, m.
/// Origins at the elbow are along, in front of and outward of the upper arm; other origins are
/// backward, right and up from the joint. Insertions are along, in front of and outward of the
/// segment after the joint. Assumed to the centimetre, not measured on a person.
const CURSORY: [(JointName, [f64; 3], [f64; 3]); ELECTRODES] = {
    use JointName::{Elbow, Glenohumeral, Sternoclavicular};
    [
        // Biceps and triceps.
        (Elbow, [-0.20, 0.03, 0.0], [0.05, 0.02, 0.0]),
        (Elbow, [-0.20, -0.03, 0.0], [-0.02, -0.01, 0.0]),
        // Deltoid: superior, anterior and posterior part.
        (Glenohumeral, [0.0, 0.01, 0.04], [0.12, 0.0, 0.02]),
        (Glenohumeral, [-0.03, -0.03, 0.03], [0.12, 0.01, 0.02]),
        (Glenohumeral, [0.06, -0.04, 0.02], [0.10, -0.01, 0.02]),
        // Pectoralis: clavicular and sternocostal part.
        (Glenohumeral, [-0.07, -0.11, 0.01], [0.08, 0.02, 0.01]),
        (Glenohumeral, [-0.09, -0.15, -0.12], [0.07, 0.02, 0.01]),
        // Trapezius: inserts at the spine of the scapula.
        (Sternoclavicular, [0.14, 0.0, 0.0], [0.12, -0.10, 0.0]),
        // Latissimus.
        (Glenohumeral, [0.06, -0.14, -0.30], [0.04, 0.02, 0.0]),
    ]
};

/// Returns the lines of action by approximate anatomy.
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
