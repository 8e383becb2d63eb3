//! Contenders: the control laws that drive a hand, and what each knows about the hand.

use super::HandsError;
use super::drawn::{Actuation, DrivenHand};
use crate::tracking::TrackingError;
use crate::tracking::candidate::{Candidate, Equipment};
use crate::tracking::default;
use crate::tracking::driver::{Device, Driver};
use crate::tracking::gains::{self, GainsError};
use crate::tracking::trial::rmse;
use crate::tracking::wearer::{KnownWearer, SHIPPED_HOLD, nominal};
use firmware::control::{
    JointSpec, LawSpec, PointSpec, ResponseSpec, SensorSource, SpecError, WearerModel,
};
use firmware::units::Amplitude;
use hal_sim::body::hand::digits::{INDEX, RANGES_DEG, REST_DEG};
use hal_sim::body::hand::spec::{A, B, E};
use host_core::session::LawName;
use methods::control::Form;

/// Torque of the extensor as a fraction of that of the flexors. It is assumed, in agreement with
/// the ranges of the population.
const EXTENSION: f64 = 0.7;

/// Control law that drives a hand. Every contender knows the voltages that a search found on this
/// hand, and none knows its torques.
#[derive(Clone, PartialEq, Debug)]
pub enum Contender {
    /// The default controller in the device's fixed point, for a joint without a wearer file
    /// ([`LawSpec::ALONE`]).
    Unknown,
    /// The default controller ([`LawSpec::RECOMMENDED`]) in the device's fixed point, with the
    /// wearer model that a calibration of this hand would write ([`Actuation::model`]).
    Calibrated,
    /// A law in `f64` with the parameters that the search on simulated fingers found. With add-ons,
    /// it also knows the calibrated wearer model.
    Searched(Equipment, Box<Candidate>),
}

/// Returns all contenders: the default controllers, the paper's controllers, and the PID
/// controllers.
///
/// # Errors
/// Fails if the committed table of gains cannot be read.
pub fn contenders() -> Result<Vec<Contender>, GainsError> {
    let searched = gains::read(gains::COMMITTED)?.into_iter();
    let wanted = |form| matches!(form, Form::Pid | Form::Paper);
    let searched = searched
        .filter(|(_, found)| wanted(found.candidate.form))
        .map(|(equipment, found)| Contender::Searched(equipment, Box::new(found.candidate)));
    let device = [Contender::Unknown, Contender::Calibrated];
    Ok(device.into_iter().chain(searched).collect())
}

/// Outcome of one contender on one hand, with one stimulation point or with two.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// RMSE from 10 to 30 s, °. If the device refused or stopped, it includes the time without
    /// stimulation.
    pub rmse_deg: f64,
    /// Name of the field or fault for which the device refused or stopped; `None` if it did not.
    pub refused: Option<String>,
}

impl Contender {
    /// Returns the contender's name in CSV and JSON; a plus means that the law has add-ons.
    pub fn name(&self) -> String {
        match self {
            Self::Unknown => default::NAME.to_owned(),
            Self::Calibrated => "default, calibrated".to_owned(),
            Self::Searched(equipment, candidate) => candidate.name(*equipment),
        }
    }

    /// Returns the contender's name in text tables and charts; a plus means that the law has
    /// add-ons.
    pub fn title(&self) -> String {
        match self {
            Self::Unknown => LawName::Recommended.title().to_owned(),
            Self::Calibrated => format!("{}, calibrated", LawName::Recommended.title()),
            Self::Searched(equipment, candidate) => candidate.title(*equipment),
        }
    }

    /// Returns whether this contender is a PID controller, with which the others are compared.
    pub fn is_pid(&self) -> bool {
        matches!(self, Self::Searched(_, candidate) if candidate.form == Form::Pid)
    }

    /// Returns the arithmetic in which the law computes: `f64`, or `fixed` for the device's fixed
    /// point.
    pub const fn arithmetic(&self) -> &'static str {
        match self {
            Self::Searched(..) => "f64",
            Self::Unknown | Self::Calibrated => "fixed",
        }
    }

    fn driver(&self, way: &Actuation) -> Result<Box<dyn Driver>, TrackingError> {
        Ok(match self {
            Self::Unknown => Box::new(Device::new(&way.joint(LawSpec::ALONE))?),
            Self::Calibrated => {
                let model = way.model(LawSpec::RECOMMENDED.default_lead_ms());
                let law = LawSpec::RECOMMENDED.for_wearer(&model);
                Box::new(Device::new(&JointSpec {
                    wearer: Some(model),
                    response: Some(ResponseSpec::RECOMMENDED.for_wearer(&model)),
                    ..way.joint(law)
                })?)
            }
            Self::Searched(equipment, candidate) => {
                Box::new(candidate.driver_of::<f64>(&KnownWearer {
                    joint: way.joint(LawSpec::ALONE),
                    model: match equipment {
                        // The law does not use this model, so the nominal one is never refused.
                        Equipment::Alone => KnownWearer::nominal(way.points).model,
                        Equipment::Equipped => way.model(0),
                    },
                })?)
            }
        })
    }

    /// Drives one hand through a trial. Returns the outcome, and the number of time intervals in
    /// which the simulation found no consistent currents.
    ///
    /// # Errors
    /// Fails if the hand or the law is invalid.
    pub fn attempt(
        &self,
        drawn: &DrivenHand,
        way: &Actuation,
    ) -> Result<(Outcome, u64), HandsError> {
        let mut driver = match self.driver(way) {
            Ok(driver) => driver,
            // The device refuses this joint, so nothing is stimulated.
            Err(TrackingError::Joint(SpecError::Range(e))) => {
                let outcome = Outcome {
                    rmse_deg: drawn.at_rest_deg(),
                    refused: Some(e.field.to_owned()),
                };
                return Ok((outcome, 0));
            }
            Err(other) => return Err(other.into()),
        };
        let (attempt, unsettled) = drawn.run(way, &mut *driver)?;
        let outcome = Outcome {
            rmse_deg: rmse(&attempt.angles, &drawn.wanted),
            refused: attempt.refused,
        };
        Ok((outcome, unsettled))
    }
}

impl Actuation {
    /// Returns this hand's joint as the device is configured for it, with `law` and without a
    /// wearer model.
    pub fn joint(&self, law: LawSpec) -> JointSpec {
        let millivolts = |volts: f64| Amplitude::new((volts * 1000.0).round() as u32);
        let point_spec = |point: usize| {
            self.ranges_v[point].map(|[threshold_v, max_v]| PointSpec {
                channel: point as u8,
                threshold: millivolts(threshold_v),
                max: millivolts(max_v),
            })
        };
        let none = PointSpec {
            channel: E as u8,
            threshold: Amplitude::new(0),
            max: Amplitude::new(0),
        };
        let [low, high] = RANGES_DEG[INDEX].map(|deg| (deg * 1000.0) as i32);
        JointSpec {
            law,
            law_period_ms: law.default_period_ms(),
            cutoff_mhz: law.default_cutoff_mhz(),
            flexors: [A, B].into_iter().filter_map(point_spec).collect(),
            // Every actuation has an extensor, so `none` is never used.
            extensor: point_spec(E).unwrap_or(none),
            hold: SHIPPED_HOLD,
            angle_min_mdeg: low,
            angle_max_mdeg: high,
            sensor: SensorSource::Host,
            stale_after_ms: 100,
            wearer: None,
            response: None,
        }
    }

    /// Returns the wearer model that a calibration of this hand would write, with the lead
    /// `lead_ms`.
    ///
    /// The flexors' torque is chosen so that full flexion holds the measured angle after 3 s
    /// against the spring of the nominal finger; nobody measures the real spring. The extensor's
    /// torque is 0.7 of it, because its pull cannot be observed from rest. All other values are
    /// those of the nominal finger.
    pub fn model(&self, lead_ms: u16) -> WearerModel {
        let finger = nominal();
        let micro = |x: f64| (x * 1e6).round() as u32;
        let [low, high] = RANGES_DEG[INDEX];
        let progress = (self.fresh_deg - low) / (high - low);
        let bent_deg = self.fresh_deg - REST_DEG[INDEX];
        let spring_nm = finger.stiffness_nm_per_rad * bent_deg.to_radians();
        let flexion_nm = spring_nm / (1.0 - finger.torque_loss * progress);
        WearerModel {
            rest_mdeg: (REST_DEG[INDEX] * 1000.0) as i32,
            stiffness_unm_per_rad: micro(finger.stiffness_nm_per_rad),
            damping_unm_s_per_rad: micro(finger.damping_nm_s_per_rad),
            flexion_unm: micro(flexion_nm),
            extension_unm: micro(EXTENSION * flexion_nm),
            torque_loss_milli: (finger.torque_loss * 1000.0) as u16,
            curvature_milli: (finger.recruitment_curvature * 1000.0) as u16,
            lead_ms,
        }
    }
}
