//! Who drives a hand, and what they know of it.

use super::HandsError;
use super::drawn::{Actuation, DrivenHand};
use crate::tracking::TrackingError;
use crate::tracking::candidate::{Candidate, Equipment};
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
use methods::control::Form;

/// The extensor's torque as a part of the flexors': assumed, the population's ranges
/// have it so.
const EXTENSION: f64 = 0.7;

/// What drives a hand. All know its voltages, as searched, and no torque.
#[derive(Clone, PartialEq, Debug)]
pub enum Contender {
    /// The device's fixed-point default for a joint of whose wearer nothing is known
    /// ([`LawSpec::ALONE`]): what a session without a wearer's file gets.
    Unknown,
    /// The device's fixed-point default ([`LawSpec::RECOMMENDED`]) with the file that a
    /// calibration would write ([`Actuation::model`]).
    Calibrated,
    /// A law in f64 with the numbers that the search on fingers found; with add-ons it
    /// knows that file as well.
    Searched(Equipment, Box<Candidate>),
}

/// The device's default, the paper's law and PIDs.
///
/// # Errors
/// The committed table of gains cannot be read.
pub fn contenders() -> Result<Vec<Contender>, GainsError> {
    let searched = gains::read(gains::COMMITTED)?.into_iter();
    let wanted = |form| matches!(form, Form::Pid | Form::Paper);
    let searched = searched
        .filter(|(_, found)| wanted(found.candidate.form))
        .map(|(equipment, found)| Contender::Searched(equipment, Box::new(found.candidate)));
    let device = [Contender::Unknown, Contender::Calibrated];
    Ok(device.into_iter().chain(searched).collect())
}

/// How it went with one hand.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// From 10 to 30 s, °; of a refusal, what came of it.
    pub rmse_deg: f64,
    /// The name under which the device refused or stopped, if it did.
    pub refused: Option<String>,
}

impl Contender {
    /// For tables; a plus is for add-ons.
    pub fn name(&self) -> String {
        match self {
            Self::Unknown => "device default".to_owned(),
            Self::Calibrated => "default, calibrated".to_owned(),
            Self::Searched(Equipment::Alone, candidate) => candidate.form.name().to_owned(),
            Self::Searched(Equipment::Equipped, candidate) => {
                format!("{} +", candidate.form.name())
            }
        }
    }

    /// Whether it is a PID: the baseline.
    pub fn is_pid(&self) -> bool {
        matches!(self, Self::Searched(_, candidate) if candidate.form == Form::Pid)
    }

    /// The arithmetic it runs in.
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
                        // Not used, so never refused.
                        Equipment::Alone => KnownWearer::nominal(way.points).model,
                        Equipment::Equipped => way.model(0),
                    },
                })?)
            }
        })
    }

    /// What it makes of a hand; also stretches of time without consistent currents.
    ///
    /// # Errors
    /// The hand or the law cannot be.
    pub fn attempt(
        &self,
        drawn: &DrivenHand,
        way: &Actuation,
    ) -> Result<(Outcome, u64), HandsError> {
        let mut driver = match self.driver(way) {
            Ok(driver) => driver,
            // The device takes no such joint: nothing is stimulated.
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
    /// This hand's joint for the device, with this law and no file of the wearer.
    pub fn joint(&self, law: LawSpec) -> JointSpec {
        let millivolts = |volts: f64| Amplitude::new((volts * 1000.0).round() as u32);
        let of = |point: usize| {
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
            flexors: [A, B].into_iter().filter_map(of).collect(),
            // Every way has an extensor.
            extensor: of(E).unwrap_or(none),
            hold: SHIPPED_HOLD,
            angle_min_mdeg: low,
            angle_max_mdeg: high,
            sensor: SensorSource::Host,
            stale_after_ms: 100,
            wearer: None,
            response: None,
        }
    }

    /// The file that a calibration would write: the flexors' torque is what holds the
    /// angle that all flexion reaches in 3 s, against the nominal finger's spring,
    /// which nobody measures; the extensor's is 0.7 of it, for what it pulls cannot be
    /// seen from rest. All else is the nominal finger's.
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
