//! The default controller on a random finger with each file.

use super::outcome::{Files, Outcome};
use super::{CalibratedPoints, FilesError, PlannedPoint, calibrate_body};
use crate::tracking::TrackingError;
use crate::tracking::driver::{Device, Driver};
use crate::tracking::exercise::Exercise;
use crate::tracking::plant::Plant;
use crate::tracking::trial;
use crate::tracking::wearer::{self, Points, SHIPPED_HOLD, nominal};
use firmware::control::{JointSpec, LawSpec, SpecError, WearerModel};
use firmware::units::Amplitude;
use hal_sim::body::hand::digits::{INDEX_EXTENSION, INDEX_FLEXION};
use hal_sim::body::wearer::recruitment;
use hal_sim::body::{RandomFinger, RandomFingerSpec};

/// Lowest level with which a calibration may begin, V: that of a plan for a voltage stage.
const START_V: f64 = 10.0;

/// Calibrates the points of a rested finger without an object in the hand. The nominal wearer's
/// maxima are the ceilings, as the voltages of a session are.
pub(super) fn calibrate(plant: &Plant, seed: u64) -> Result<CalibratedPoints, FilesError> {
    let spec = RandomFingerSpec {
        external: Vec::new(),
        ..plant.finger.clone()
    };
    let file = nominal();
    let movements = [INDEX_FLEXION, INDEX_FLEXION, INDEX_EXTENSION];
    let points = [file.flexor_a, file.flexor_b, file.extensor].into_iter();
    let points = points.zip(movements).map(|(site, movement)| PlannedPoint {
        channel: site.channel,
        movement,
        start_v: START_V,
        ceiling_v: site.max_v,
    });
    let finger = RandomFinger::new(spec, plant.seed).map_err(TrackingError::from)?;
    let points: Vec<PlannedPoint> = points.collect();
    Ok(calibrate_body(Box::new(finger), &points, seed)?)
}

/// Lets the default controller attempt an exercise with one file.
pub(super) fn drive(
    exercise: &Exercise,
    files: Files,
    calibrated: &CalibratedPoints,
) -> Result<Outcome, FilesError> {
    let points = exercise.points;
    let alone = || wearer::joint(LawSpec::ALONE, points, SHIPPED_HOLD);
    let joint = match files {
        Files::Absent => alone(),
        Files::Nominal => wearer::shipped(points),
        Files::True | Files::TrueWithoutLearning => {
            let model = true_model(&exercise.plant.finger, points);
            let law = LawSpec::RECOMMENDED.for_wearer(&model);
            let ranges = true_ranges_v(&exercise.plant.finger, points);
            let joint = with_ranges(wearer::joint(law, points, SHIPPED_HOLD), |n| {
                Some(ranges[n])
            });
            files.joint_of(joint.unwrap_or_else(alone), model)
        }
        Files::Calibrated => {
            let found = |channel: usize| calibrated.ranges_v.get(channel).copied().flatten();
            match with_ranges(alone(), found) {
                Some(joint) => joint,
                None => return Ok(Outcome::refused(rest_rmse(exercise), Files::NOT_CALIBRATED)),
            }
        }
    };
    let mut device = match Device::new(&joint) {
        Ok(device) => device,
        Err(TrackingError::Joint(SpecError::Range(e))) => {
            return Ok(Outcome::refused(rest_rmse(exercise), e.field));
        }
        Err(other) => return Err(other.into()),
    };
    let attempt = trial::run(&exercise.plant, &mut device, &exercise.wanted)?;
    Ok(Outcome {
        rmse_deg: exercise.rmse(&attempt.angles),
        refused: device.refused().map(str::to_owned),
        limit_cycles: device.limit_cycles().len(),
        is_beyond_stage: false, // the finger has no electrodes
    })
}

/// Returns the RMSE of a finger that is not stimulated, °.
fn rest_rmse(exercise: &Exercise) -> f64 {
    let rest = exercise.plant.finger.finger.rest_deg as f32;
    exercise.rmse(&vec![rest; exercise.wanted.len()])
}

/// Returns the joint with the threshold and maximum that `range` has for each of its channels, V;
/// `None` if a channel has none.
fn with_ranges(
    mut joint: JointSpec,
    range: impl Fn(usize) -> Option<[f64; 2]>,
) -> Option<JointSpec> {
    let millivolts = |volts: f64| Amplitude::new((volts * 1000.0).round() as u32);
    for point in joint.flexors.iter_mut().chain([&mut joint.extensor]) {
        let [threshold, max] = range(point.channel.into())?.map(millivolts);
        (point.threshold, point.max) = (threshold, max);
    }
    Some(joint)
}

/// Largest true threshold in a file, as a share of the point's maximum; a point that begins to act
/// above it has no range.
const MOST_THRESHOLD: f64 = 0.97;

/// Returns the true thresholds of A, B and the extensor, with the nominal wearer's maxima, which no
/// session exceeds, V. The points of a pair begin at the pair's thresholds.
fn true_ranges_v(spec: &RandomFingerSpec, points: Points) -> [[f64; 2]; 3] {
    let finger = &spec.finger;
    let mut thresholds_v = finger.sites().map(|site| site.threshold_v);
    if let (Points::Two, Some(pair)) = (points, &finger.pair) {
        thresholds_v[..2].copy_from_slice(&pair.threshold_v);
    }
    let maxima_v = nominal().sites().map(|site| site.max_v);
    [0, 1, 2].map(|n| {
        [
            thresholds_v[n].min(MOST_THRESHOLD * maxima_v[n]),
            maxima_v[n],
        ]
    })
}

/// Returns the share of its torque that each point exerts at the nominal wearer's maximum.
fn shares(spec: &RandomFingerSpec, points: Points) -> [f64; 3] {
    let (finger, ranges) = (&spec.finger, true_ranges_v(spec, points));
    let (sites, curvature) = (finger.sites(), finger.recruitment_curvature);
    [0, 1, 2].map(|n| {
        let [threshold_v, max_v] = ranges[n];
        recruitment(max_v, threshold_v, sites[n].max_v.max(max_v), curvature)
    })
}

/// Returns the model of this finger with the values that its simulation has. Muscles that depend on
/// length and velocity have the nominal loss of torque.
fn true_model(spec: &RandomFingerSpec, points: Points) -> WearerModel {
    let (finger, micro) = (&spec.finger, |x: f64| (x * 1e6).round() as u32);
    let shares = shares(spec, points);
    let torque = |n: usize| spec.muscles[n].torque_nm * spec.capacity[n] * shares[n];
    let [a, b, extensor] = [0, 1, 2].map(torque);
    let flexion_nm = match (points, &finger.pair) {
        (Points::Two, Some(pair)) => {
            // The weaker point adds a share of its own torque (`RandomFinger`).
            let factor = pair.torque_nm[0] / finger.flexor_torque_nm;
            a.max(b) + (factor - 1.0) * a.min(b)
        }
        _ => a,
    };
    WearerModel {
        stiffness_unm_per_rad: micro(finger.stiffness_nm_per_rad),
        damping_unm_s_per_rad: micro(finger.damping_nm_s_per_rad),
        flexion_unm: micro(flexion_nm),
        extension_unm: micro(extensor),
        curvature_milli: (finger.recruitment_curvature * 1000.0) as u16,
        ..wearer::model(points, LawSpec::RECOMMENDED.default_lead_ms())
    }
}
