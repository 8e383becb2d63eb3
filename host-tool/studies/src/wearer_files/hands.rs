//! The default controller on a random hand with each file.

use super::outcome::{Files, Outcome};
use super::{CalibratedPoints, FilesError, PlannedPoint, calibrate_body};
use crate::hands::{Actuation, DrivenHand};
use crate::tracking::TrackingError;
use crate::tracking::driver::{Device, Driver};
use crate::tracking::trial::rmse;
use crate::tracking::wearer::Volts;
use firmware::control::{JointSpec, LawSpec, ResponseSpec, SpecError, WearerModel};
use hal_sim::body::hand::digits::{INDEX, INDEX_EXTENSION, INDEX_FLEXION, LOST, REST_DEG};
use hal_sim::body::hand::spec::{A, B, E};
use hal_sim::body::{Body, Load};

/// Highest level of a calibration, V: the stage's 20 mA through the assumed 2 kΩ. The searches of
/// the study go up to 44 V.
const CEILING_V: f64 = 40.0;
/// Largest current of a voltage stage, mA, as the device limits it.
const STAGE_MA: f64 = 20.0;
/// Ceiling of a calibration as a share of the voltage that drives [`STAGE_MA`] through the
/// electrode. At a higher one the device may refuse to arm (E229), because it measures the load
/// with an error.
const CEILING_SHARE: f64 = 0.9;
/// Lowest level with which a calibration may begin, V: the step of the searches in the study.
const START_V: f64 = 2.0;
/// Smallest and largest curvature of a wearer file ([`WearerModel::CURVATURE_MILLI`]).
const CURVATURES: [f64; 2] = [0.1, 11.0];

/// Calibrates the points A, B and E of a rested hand.
pub(super) fn calibrate(drawn: &DrivenHand, seed: u64) -> Result<CalibratedPoints, FilesError> {
    let hand = drawn.moving()?;
    let point = |channel: usize, movement| {
        let most_v = CEILING_SHARE * stage_v(&hand.loads()[channel]);
        PlannedPoint {
            channel,
            movement,
            start_v: START_V,
            ceiling_v: most_v.min(CEILING_V).floor(),
        }
    };
    let points = [
        point(A, INDEX_FLEXION),
        point(B, INDEX_FLEXION),
        point(E, INDEX_EXTENSION),
    ];
    Ok(calibrate_body(Box::new(hand), &points, seed)?)
}

/// Returns the voltage that drives [`STAGE_MA`] through an electrode, V.
fn stage_v(load: &Load) -> f64 {
    match load {
        Load::Ohms(ohm) => STAGE_MA * ohm / 1000.0,
        _ => f64::INFINITY,
    }
}

/// Lets the default controller drive a hand with one file.
pub(super) fn drive(
    drawn: &DrivenHand,
    way: &Actuation,
    files: Files,
    calibrated: &CalibratedPoints,
) -> Result<Outcome, FilesError> {
    let mut ranges_v = way.ranges_v;
    let joint = match files {
        Files::Absent | Files::Nominal => way.joint(LawSpec::ALONE),
        Files::True | Files::TrueWithoutLearning => {
            let model = true_model(drawn, way)?;
            files.joint_of(way.joint(LawSpec::RECOMMENDED.for_wearer(&model)), model)
        }
        Files::Calibrated => {
            let found = |point: usize| calibrated.ranges_v[point];
            if (way.ranges_v.iter().enumerate())
                .any(|(n, used)| used.is_some() && found(n).is_none())
            {
                return Ok(Outcome::refused(drawn.at_rest_deg(), Files::NOT_CALIBRATED));
            }
            for (point, range) in ranges_v.iter_mut().enumerate() {
                *range = range.and(found(point));
            }
            Actuation { ranges_v, ..*way }.joint(LawSpec::ALONE)
        }
    };
    let mut device = match Device::new(&joint) {
        Ok(device) => device,
        Err(TrackingError::Joint(SpecError::Range(e))) => {
            return Ok(Outcome::refused(drawn.at_rest_deg(), e.field));
        }
        Err(other) => return Err(other.into()),
    };
    let (attempt, _) = drawn.run(way, &mut device)?;
    let hand = drawn.moving()?;
    let mut used = ranges_v.iter().zip(hand.loads());
    let is_beyond_stage = used
        .any(|(range, load)| range.is_some_and(|[_, high]| high > CEILING_V.min(stage_v(load))));
    Ok(Outcome {
        rmse_deg: rmse(&attempt.angles, &drawn.wanted),
        refused: device.refused().map(str::to_owned),
        limit_cycles: device.limit_cycles().len(),
        is_beyond_stage,
    })
}

/// Returns the model of this hand with these points, with the values that its simulation has: the
/// torques that full flexion and full extension exert in a rested hand, and a curvature that fits
/// the torque at half effort. The model has no torque at the thresholds, but the hand has.
fn true_model(drawn: &DrivenHand, way: &Actuation) -> Result<WearerModel, FilesError> {
    let volts = |effort: f64| -> Volts {
        let at = |point: usize, effort: f64| {
            way.ranges_v[point].map_or(0.0, |[low, high]| low + (high - low) * effort.max(0.0))
        };
        [at(A, effort), at(B, effort), at(E, -effort)]
    };
    let mut torques = [[0.0; 2]; 4];
    for (torques, effort) in torques.iter_mut().zip([-1.0, 0.0, 0.5, 1.0]) {
        *torques = drawn.torques_nm(way, volts(effort))?;
    }
    let [extended, none, half, full] = torques;
    let share = (half[0] - none[0]) / (full[0] - none[0]);
    // (e^(c/2) - 1)/(e^c - 1) = 1/(e^(c/2) + 1) is the share at half effort.
    let octaves = libm::log((1.0 / share.clamp(1e-3, 1.0) - 1.0).max(1.0));
    let curvature = (2.0 * octaves).clamp(CURVATURES[0], CURVATURES[1]);
    let (spec, micro) = (drawn.spec(), |x: f64| (x * 1e6).round() as u32);
    Ok(WearerModel {
        rest_mdeg: (REST_DEG[INDEX] * 1000.0) as i32,
        stiffness_unm_per_rad: micro(spec.stiffness_nm_per_rad),
        damping_unm_s_per_rad: micro(spec.motion.damping_nm_s_per_rad),
        flexion_unm: micro(full[0]),
        extension_unm: micro(extended[1]),
        torque_loss_milli: (LOST * 1000.0) as u16,
        curvature_milli: (curvature * 1000.0) as u16,
        lead_ms: LawSpec::RECOMMENDED.default_lead_ms(),
    })
}

impl Files {
    /// Returns the joint with this model of the wearer, and with the response that this file has.
    pub(super) fn joint_of(self, joint: JointSpec, model: WearerModel) -> JointSpec {
        let response = ResponseSpec::RECOMMENDED.for_wearer(&model);
        JointSpec {
            wearer: Some(model),
            response: Some(match self {
                Self::TrueWithoutLearning => ResponseSpec {
                    scale_milli: 0,
                    damping_milli: 0,
                    ..response
                },
                _ => response,
            }),
            ..joint
        }
    }
}
