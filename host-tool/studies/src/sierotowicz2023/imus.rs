//! Checks that each IMU is present and reads its axes in order, and measures how fast segments turn
//! in the axes of the simulated arm.

use super::error::EndpointError;
use hal_sim::body::Body;
use hal_sim::body::arm::{Arm, ArmSpec, Imu, Posture, SEGMENT_NAMES, SEGMENTS};
use nalgebra::{Matrix3, Vector3};

/// Second posture of the check: the arm hangs almost straight.
const HANGING: Posture = Posture {
    plane_deg: 80.0,
    elevation_deg: 5.0,
    rotation_deg: 20.0,
    elbow_deg: 10.0,
};
/// Third posture of the check: the arm is raised to the side.
const RAISED: Posture = Posture {
    plane_deg: 90.0,
    elevation_deg: 100.0,
    rotation_deg: 40.0,
    elbow_deg: 60.0,
};
/// Squared distance between the measured and the expected direction of gravity, as unit vectors,
/// above which a sensor's axes count as swapped. A tilted sensor stays below. 0.5 corresponds to
/// 41°.
const ASKEW: f64 = 0.5;
/// Number of averaged samples, 1 ms each.
const SAMPLES: u64 = 100;
/// Mean acceleration below which a sensor counts as missing, m/s².
const SILENT_M_S2: f64 = 1.0;

/// Returns the mean acceleration of each segment's IMU on this arm at rest, m/s².
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

/// Returns the 48 orders in which three axes can be read. Axes are numbered from 1, and negative if
/// reversed.
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

/// Checks that each IMU reads gravity in the direction that its segment's posture implies, in three
/// postures that a participant is asked to take. The shoulder hardly turns between them, so its two
/// horizontal axes cannot be distinguished.
///
/// # Errors
/// Returns E717 with each IMU that is missing or has swapped axes, and the order of axes that fits
/// best.
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
        // Squared distance of gravity from where this order puts it, in the worst posture.
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

/// Describes an order of axes for the error message.
fn describe_order(order: [i8; 3]) -> String {
    let name = |axis: i8| {
        let sign = if axis < 0 { "-" } else { "" };
        format!(
            "{sign}{}",
            ["x", "y", "z"][usize::from(axis.unsigned_abs()) - 1]
        )
    };
    format!("{} instead of x, y, z", order.map(name).join(", "))
}

/// Measures how fast each segment turns in the axes of the simulated arm, rad/s: subtracts the
/// gyroscope's reading at rest and rotates the difference by the segment's frame.
#[derive(Clone, Debug)]
pub struct Tracker {
    frames: [Matrix3<f64>; SEGMENTS],
    offsets: [Vector3<f64>; SEGMENTS],
}

impl Tracker {
    /// Creates a tracker for an arm that is now at rest; advances the time by 100 ms.
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

    /// Returns the angular velocity of a joint's distal segment relative to the segment before it,
    /// rad/s.
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
