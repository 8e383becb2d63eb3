//! A control law with its add-ons and parameters, as a search proposes it and a table stores it.

use super::TrackingError;
use super::driver::Floating;
use super::wearer::{self, KnownWearer, Points};
use firmware::control::{HoldPolicy, JointSpec, LawSpec, WearerModel};
use host_core::session::LawName;
use methods::control::parameters::parameters;
use methods::control::{AddOns, Controller, DelayCompensation, DerivativeKind, Form, Parameter};
use methods::real::Real;
use std::collections::BTreeMap;

/// Whether a control law may use the add-ons that need a wearer model.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Equipment {
    /// Only the law itself, its differentiator, and the extrapolation of lost setpoints.
    Alone,
    /// Also feed-forward, delay compensation and adaptation of gains.
    Equipped,
}

impl Equipment {
    pub const ALL: [Self; 2] = [Self::Alone, Self::Equipped];

    /// Returns the name of the equipment in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Alone => "alone",
            Self::Equipped => "equipped",
        }
    }
}

/// Periods with which the search may run a law, ms.
pub const PERIODS_MS: [u32; 3] = [2, 5, 11];
/// Longest extrapolations of lost setpoints that the search may choose, ms; 0 means that the last
/// setpoint is held.
pub const EXTRAPOLATIONS_MS: [u16; 4] = [0, 50, 100, 200];

/// Returns the controller's name in text tables and charts.
pub const fn form_title(form: Form) -> &'static str {
    match form {
        Form::Paper => LawName::Paper.title(),
        Form::Pid => LawName::Pid.title(),
        Form::Twisting(_) | Form::TwistingWithLinear => form.name(),
    }
}

/// A control law with everything that the search chooses: add-ons, period, extrapolation and
/// parameters.
#[derive(Clone, PartialEq, Debug)]
pub struct Candidate {
    /// Form of the control law, such as PID or super-twisting.
    pub form: Form,
    pub add_ons: AddOns,
    /// Period with which the law runs, ms.
    pub period_ms: u32,
    /// Longest extrapolation of lost setpoints, ms; 0 means that the last setpoint is held.
    pub extrapolation_ms: u16,
    /// Values of the parameters, by the names that [`parameters`] lists.
    pub values: BTreeMap<String, f64>,
}

impl Candidate {
    /// Returns the controller's name in CSV and JSON; a plus means that it has add-ons.
    pub fn name(&self, equipment: Equipment) -> String {
        marked(self.form.name(), equipment)
    }

    /// Returns the controller's name in text tables and charts; a plus means that it has add-ons.
    pub fn title(&self, equipment: Equipment) -> String {
        marked(form_title(self.form), equipment)
    }

    /// Returns what the device does when setpoints are lost: hold the last one, or extrapolate.
    pub const fn hold(&self) -> HoldPolicy {
        match self.extrapolation_ms {
            0 => HoldPolicy::Hold,
            max_ms => HoldPolicy::Extrapolate { max_ms },
        }
    }

    /// Builds the law in the arithmetic `R`, with the model of the nominal wearer.
    ///
    /// # Errors
    /// Returns [`TrackingError::Law`] if a parameter is missing or unusable.
    pub fn driver<R: Real>(&self, points: Points) -> Result<Floating<R>, TrackingError> {
        self.driver_of(&KnownWearer::nominal(points))
    }

    /// Builds the law in the arithmetic `R`, with the model of a known wearer.
    ///
    /// # Errors
    /// Returns [`TrackingError`] if a parameter is missing or unusable, or the wearer's values are
    /// invalid.
    pub fn driver_of<R: Real>(&self, known: &KnownWearer) -> Result<Floating<R>, TrackingError> {
        let law = self.controller(known)?;
        Floating::new(law, self.period_ms, self.hold(), known)
    }

    fn controller<R: Real>(&self, known: &KnownWearer) -> Result<Controller<R>, TrackingError> {
        let wanted = parameters(self.form, self.add_ons);
        let value = |p: &Parameter| {
            let value = self.values.get(p.name).copied().unwrap_or(f64::NAN);
            if self.add_ons.feed_forward {
                value * schedule(p.name, &known.model)
            } else {
                value
            }
        };
        let values: Vec<R> = wanted.iter().map(|p| R::from_f64(value(p))).collect();
        let h = R::from_f64(f64::from(self.period_ms) / 1000.0);
        Ok(Controller::from_parameters(
            self.form,
            self.add_ons,
            h,
            &values,
        )?)
    }

    /// Returns the law's effort besides the integral, and the rate at which the integral grows,
    /// 1/s, at a constant error, rad. The integral itself counts as 0.
    ///
    /// # Errors
    /// Returns [`TrackingError::Law`] if a parameter is missing or unusable.
    pub fn feedback_at(&self, error_rad: f64) -> Result<(f64, f64), TrackingError> {
        let known = KnownWearer::nominal(Points::One);
        let answer = self.controller::<f64>(&known)?.feedback(error_rad);
        let per_s = 1000.0 / f64::from(self.period_ms);
        Ok((answer.push, answer.growth * per_s))
    }
}

/// Returns the factor by which a parameter is multiplied for a wearer's strength. It is the same
/// for every law that has a wearer model as for the default controller ([`LawSpec::for_wearer`]).
fn schedule(name: &str, model: &WearerModel) -> f64 {
    let strength = f64::from(model.strength_mrad()) / f64::from(WearerModel::REFERENCE_MRAD);
    match name {
        "k1" | "k2_per_rad" | "kp_per_rad" | "ki_per_rad_s" | "kd_s_per_rad" => 1.0 / strength,
        "smith_gain_rad" | "adapt_scale_per_rad_s" => strength,
        _ => 1.0,
    }
}

/// Parameters of all control laws as positions within their bounds, 0 to 1, with all choices of the
/// search. Positions of parameters that a law does not use have no effect on it.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Genome {
    /// Position of each parameter between its bounds, 0 to 1, by its name.
    pub places: BTreeMap<&'static str, f64>,
    /// Numbers from 0 to 1 from which derivative, delay compensation, period, extrapolation,
    /// feed-forward and adaptation are chosen, in this order.
    pub choices: [f64; 6],
}

fn pick<T: Copy>(options: &[T], place: f64) -> T {
    let n = (place * options.len() as f64) as usize;
    options[n.min(options.len() - 1)]
}

impl Genome {
    /// Returns the controller of this form and equipment that the genome describes.
    pub fn candidate(&self, form: Form, equipment: Equipment) -> Candidate {
        let [
            derivative,
            delay,
            period,
            extrapolation,
            forward,
            adaptation,
        ] = self.choices;
        let derivative = pick(&DerivativeKind::ALL, derivative);
        let add_ons = match equipment {
            Equipment::Alone => AddOns {
                derivative,
                ..AddOns::NONE
            },
            // Three in four try the feed-forward; adaptation needs it.
            Equipment::Equipped => AddOns {
                derivative,
                feed_forward: forward < 0.75,
                delay: pick(&DelayCompensation::ALL, delay),
                adaptation: forward < 0.75 && adaptation < 0.5,
            },
        };
        Candidate {
            form,
            add_ons,
            period_ms: pick(&PERIODS_MS, period),
            extrapolation_ms: pick(&EXTRAPOLATIONS_MS, extrapolation),
            values: self.values(&parameters(form, add_ons)),
        }
    }

    /// Returns the value of each of these parameters at its position, by its name.
    pub fn values(&self, parameters: &[Parameter]) -> BTreeMap<String, f64> {
        let place = |p: &Parameter| self.places.get(p.name).copied().unwrap_or(0.5);
        let value = |p: &Parameter| {
            if p.is_log {
                p.low * libm::pow(p.high / p.low, place(p))
            } else {
                p.low + (p.high - p.low) * place(p)
            }
        };
        parameters
            .iter()
            .map(|p| (p.name.to_owned(), value(p)))
            .collect()
    }

    /// Converts parameter values to positions between their bounds. A parameter without a known
    /// value is in the middle.
    pub fn from_values<'a>(
        known: impl Fn(&str) -> Option<f64>,
        parameters: impl IntoIterator<Item = &'a Parameter>,
    ) -> Self {
        let place = |p: &Parameter| {
            let Some(x) = known(p.name) else { return 0.5 };
            let place = if p.is_log {
                libm::log(x / p.low) / libm::log(p.high / p.low)
            } else {
                (x - p.low) / (p.high - p.low)
            };
            place.clamp(0.0, 1.0)
        };
        Self {
            places: parameters.into_iter().map(|p| (p.name, place(p))).collect(),
            // Pseudo-derivative of the error, Smith, 2 ms, 200 ms, both on.
            choices: [0.0, 0.6, 0.0, 0.9, 0.0, 0.0],
        }
    }

    /// Returns every parameter that any form with any add-ons has, sorted by name.
    pub fn parameters() -> Vec<Parameter> {
        let mut collected: Vec<Parameter> = Vec::new();
        for form in Form::ALL {
            for derivative in DerivativeKind::ALL {
                let add_ons = AddOns {
                    derivative,
                    feed_forward: true,
                    delay: DelayCompensation::PreviewAndSmith,
                    adaptation: true,
                };
                collected.extend(parameters(form, add_ons));
            }
        }
        collected.sort_by_key(|p| p.name);
        collected.dedup_by_key(|p| p.name);
        collected
    }

    /// Returns the genome with which the search for a form begins: the parameters of the default
    /// controller as far as this form uses them. A PID gets the linear terms of the default
    /// controller. Parameters that the default controller lacks are in the middle of their bounds.
    pub fn from_default(form: Form) -> Self {
        let known = numbers_of(&wearer::shipped(Points::Two));
        let number = |name: &str| known.iter().find(|(n, _)| *n == name).map(|(_, x)| *x);
        // The form's own bounds replace other bounds of the same name.
        let mut parameters = Self::parameters();
        parameters.extend(form.parameters());
        Self::from_values(number, &parameters)
    }
}

/// Appends a plus to the name of a controller that has add-ons.
fn marked(name: &str, equipment: Equipment) -> String {
    match equipment {
        Equipment::Alone => name.to_owned(),
        Equipment::Equipped => format!("{name} +"),
    }
}

/// Returns the parameters of the device's super-twisting law, by the names that [`parameters`]
/// lists.
pub fn numbers_of(spec: &JointSpec) -> Vec<(&'static str, f64)> {
    let milli = |x: u32| f64::from(x) / 1000.0;
    let mut known = vec![("cutoff_hz", milli(spec.cutoff_mhz))];
    if let LawSpec::Recommended {
        lambda_milli,
        k1_milli,
        k2_milli,
        b_milli,
        k3_milli,
        ki_milli,
    } = spec.law
    {
        let (lambda, k3) = (milli(lambda_milli), milli(k3_milli));
        known.extend([
            ("lambda_per_s", lambda),
            ("k1", milli(k1_milli)),
            ("k2_per_rad", milli(k2_milli)),
            ("b_rad_per_s2", milli(b_milli)),
            ("kd_s_per_rad", k3),
            ("ki_per_rad_s", milli(ki_milli)),
            ("kp_per_rad", lambda * k3),
        ]);
    }
    if let Some(model) = spec.wearer {
        known.push(("feed_forward_lead_s", milli(model.lead_ms.into())));
    }
    if let Some(response) = spec.response {
        known.extend([
            ("smith_gain_rad", milli(response.gain_mrad.into())),
            ("smith_muscle_s", milli(response.muscle_ms.into())),
            ("smith_joint_s", milli(response.joint_ms.into())),
            ("smith_delay_s", milli(response.delay_ms.into())),
        ]);
        known.extend([
            ("adapt_scale_per_rad_s", milli(response.scale_milli)),
            ("adapt_damping_per_rad2", milli(response.damping_milli)),
        ]);
    }
    known
}
