//! What IMUs tell the device: whether each is there and reads its axes in order, and how
//! fast segments turn in our axes.

use super::error::EndpointError;
use hal_sim::body::Body;
use hal_sim::body::arm::{Arm, ArmSpec, Imu, Posture, SEGMENT_NAMES, SEGMENTS};
use nalgebra::{Matrix3, Vector3};

/// Second posture of the check: the arm hangs nearly straight.
const HANGING: Posture = Posture {
    plane_deg: 80.0,
    elevation_deg: 5.0,
    rotation_deg: 20.0,
    elbow_deg: 10.0,
};
/// Third: the arm reaches up to the side.
const RAISED: Posture = Posture {
    plane_deg: 90.0,
    elevation_deg: 100.0,
    rotation_deg: 40.0,
    elbow_deg: 60.0,
};
/// So far from where it should be (square of the distance of unit vectors; 0.5 is 41°)
/// gravity is not by a sensor that sits askew.
const ASKEW: f64 = 0.5;
/// Samples that are averaged, 1 ms each.
const SAMPLES: u64 = 100;
/// Below this mean a sensor is not there, m/s².
const SILENT_M_S2: f64 = 1.0;

/// Mean acceleration of each segment's IMU of this arm at rest, m/s².
fn resting(spec: &ArmSpec, posture: Posture) -> Result<[Vector3<f64>; SEGMENTS], EndpointError> {
    let mut arm = Arm::new(ArmSpec {
        posture,
        ..spec.clone()
    })?;
    let mut sum = [Vector3::zeros(); SEGMENTS];
    for ms in 1..=SAMPLES {
        arm.advance(1_000 * ms);
        for (segment, sum) in sum.iter_mut().enumerate() {
            *sum += arm.imu(segment).map_or_else(Vector3::zeros, accel);
        }
    }
    Ok(sum.map(|sum| sum / SAMPLES as f64))
}

fn accel(imu: Imu) -> Vector3<f64> {
    Vector3::from(imu.accel_m_s2)
}

/// The 48 ways in which three axes can be read: axes in order, reversed where negative.
fn axis_orders() -> Vec<[i8; 3]> {
    let mut all = Vec::new();
    for order in [
        [1, 2, 3],
        [1, 3, 2],
        [2, 1, 3],
        [2, 3, 1],
        [3, 1, 2],
        [3, 2, 1],
    ] {
        for signs in 0..8_u8 {
            let mut order: [i8; 3] = order;
            for (axis, value) in order.iter_mut().enumerate() {
                if signs >> axis & 1 == 1 {
                    *value = -*value;
                }
            }
            all.push(order);
        }
    }
    all
}

fn read_in(order: [i8; 3], meant: &Vector3<f64>) -> Vector3<f64> {
    let at = |axis: i8| f64::from(axis.signum()) * meant[usize::from(axis.unsigned_abs()) - 1];
    Vector3::new(at(order[0]), at(order[1]), at(order[2]))
}

/// Checks that each IMU reads gravity where its segment's posture says, in three postures
/// that a person is asked to take; where it does not, the order of axes that fits best is
/// named. The shoulder hardly turns between them, so that its two level axes are not told
/// apart.
///
/// # Errors
/// E717 names each IMU that is missing or has axes swapped, and how.
pub fn check(spec: &ArmSpec) -> Result<(), EndpointError> {
    let mut reads = Vec::new();
    for posture in [spec.posture, HANGING, RAISED] {
        let frames = hal_sim::body::arm::Skeleton::new(posture, spec.lengths()).frames();
        reads.push((frames, resting(spec, posture)?));
    }
    let mut wrong = Vec::new();
    for (segment, name) in SEGMENT_NAMES.iter().enumerate() {
        if reads
            .iter()
            .all(|(_, read)| read[segment].norm() < SILENT_M_S2)
        {
            wrong.push(format!("the IMU of the {name} reads nothing"));
            continue;
        }
        // How far gravity lies from where this order says, in the worst of the postures.
        let off = |order: [i8; 3]| -> f64 {
            let each = reads.iter().map(|(frames, read)| {
                let up = frames[segment].transpose() * Vector3::z();
                (read[segment].normalize() - read_in(order, &up)).norm_squared()
            });
            each.fold(0.0, f64::max)
        };
        let right = off([1, 2, 3]);
        let best = axis_orders().into_iter().map(|order| (order, off(order)));
        let best = best.fold(([1, 2, 3], right), |best, next| match next.1 < best.1 {
            true => next,
            false => best,
        });
        if right < ASKEW {
            continue;
        }
        if best.0 != [1, 2, 3] {
            wrong.push(format!(
                "the IMU of the {name} reads its axes as {}",
                describe_order(best.0)
            ));
        }
    }
    match wrong.is_empty() {
        true => Ok(()),
        false => Err(EndpointError::Imus(wrong.join(", and "))),
    }
}

/// An order of axes in words.
fn describe_order(order: [i8; 3]) -> String {
    let name = |axis: i8| {
        let sign = if axis < 0 { "-" } else { "" };
        format!(
            "{sign}{}",
            ["x", "y", "z"][usize::from(axis.unsigned_abs()) - 1]
        )
    };
    format!("{} where x, y, z are meant", order.map(name).join(", "))
}

/// How fast each segment turns, in our axes, rad/s: what IMUs read, less what they read at
/// rest, turned by the segments' frames as the posture tracker has them.
#[derive(Clone, Debug)]
pub struct Tracker {
    frames: [Matrix3<f64>; SEGMENTS],
    offsets: [Vector3<f64>; SEGMENTS],
}

impl Tracker {
    /// Of an arm at rest now, whose time goes on by 100 ms.
    pub fn at_rest(arm: &mut Arm, now_us: &mut u64) -> Self {
        let mut offsets = [Vector3::zeros(); SEGMENTS];
        for _ in 0..SAMPLES {
            *now_us += 1_000;
            arm.advance(*now_us);
            for (segment, offset) in offsets.iter_mut().enumerate() {
                *offset += gyro(arm, segment) / SAMPLES as f64;
            }
        }
        Self {
            frames: arm.skeleton().frames(),
            offsets,
        }
    }

    /// Turning of a joint's distal segment against the one before it, rad/s.
    #[must_use]
    pub fn turning(&self, arm: &Arm, joint: usize) -> Vector3<f64> {
        let of =
            |segment: usize| self.frames[segment] * (gyro(arm, segment) - self.offsets[segment]);
        match joint {
            0 => of(0),
            _ => of(joint) - of(joint - 1),
        }
    }
}

fn gyro(arm: &Arm, segment: usize) -> Vector3<f64> {
    let read = arm.imu(segment);
    read.map_or_else(Vector3::zeros, |imu| Vector3::from(imu.gyro_rad_s))
}
