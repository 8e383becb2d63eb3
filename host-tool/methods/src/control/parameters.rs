//! Parameters of a law and its add-ons, with the bounds within which a search varies them: one
//! vector per law, in the same form for all.

use super::super::real::Real;
use super::adaptation::{Adaptation, Integral};
use super::controller::{AddOns, Controller};
use super::delay::SmithPredictor;
use super::derivative::{DerivativeKind, Differentiator};
use super::feedback::{Feedback, Form, NOMINAL_GAIN};
use super::twist::{Discretization, Twist};
use heapless::Vec;

/// Description of one parameter of a law. A law accepts any positive number; the bounds apply only
/// to searches for good values.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Parameter {
    /// Name of the parameter, with its unit.
    pub name: &'static str,
    /// Smallest value that a search tries.
    pub low: f64,
    /// Largest value that a search tries.
    pub high: f64,
    /// Whether a search draws values uniformly in their logarithm; otherwise uniformly in the
    /// value.
    pub is_log: bool,
}

/// Maximum number of parameters that a law with its add-ons can have.
pub const PARAMETERS_MAX: usize = 16;

/// Reason why values do not define a law.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ParameterError {
    /// The number of values differs from the number of [`parameters`].
    Count {
        /// Required number of values.
        wanted: usize,
    },
    /// A value is not a finite number, is below 0, or is 0 for a logarithmic parameter.
    Value {
        /// Name of the parameter.
        name: &'static str,
    },
}

/// Describes a parameter that a search varies uniformly in its logarithm.
pub const fn log(name: &'static str, low: f64, high: f64) -> Parameter {
    Parameter {
        name,
        low,
        high,
        is_log: true,
    }
}

/// Describes a parameter that a search varies uniformly in its value.
pub const fn linear(name: &'static str, low: f64, high: f64) -> Parameter {
    Parameter {
        name,
        low,
        high,
        is_log: false,
    }
}

const PAPER: [Parameter; 2] = [log("lambda_per_s", 1.0, 30.0), log("w_v_per_s", 0.1, 30.0)];
const TWIST: [Parameter; 4] = [
    log("lambda_per_s", 1.0, 40.0),
    log("k1", 0.01, 2.0),
    log("k2_per_rad", 0.05, 20.0),
    log("b_rad_per_s2", 10.0, 1000.0),
];
const TWIST_WITH_LINEAR: [Parameter; 5] = [
    log("lambda_per_s", 1.0, 40.0),
    log("kd_s_per_rad", 0.005, 1.0),
    log("ki_per_rad_s", 0.1, 30.0),
    // Lower bounds for which the law rejects a disturbance that changes by 0.1 of the range per
    // second (k2 > L, k1 > √((k2 + L)/b)). Below them the law would in effect be a PID.
    log("k1", 0.045, 0.5),
    log("k2_per_rad", 0.1, 5.0),
];
const PID: [Parameter; 3] = [
    log("kp_per_rad", 0.05, 10.0),
    log("ki_per_rad_s", 0.1, 30.0),
    log("kd_s_per_rad", 0.005, 1.0),
];
const CUTOFF: Parameter = log("cutoff_hz", 1.5, 20.0);
const ACCELERATION: Parameter = log("acceleration_rad_per_s2", 5.0, 2000.0);
const JERK: Parameter = log("jerk_rad_per_s3", 100.0, 1e6);
const LEAD: Parameter = linear("feed_forward_lead_s", 0.0, 0.3);
const PREVIEW: Parameter = linear("preview_s", 0.0, 0.15);
const SMITH: [Parameter; 4] = [
    log("smith_gain_rad", 0.1, 5.0),
    log("smith_muscle_s", 0.02, 0.3),
    log("smith_joint_s", 0.02, 0.5),
    linear("smith_delay_s", 0.0, 0.08),
];
const ADAPTATION: [Parameter; 2] = [
    log("adapt_scale_per_rad_s", 0.01, 30.0),
    log("adapt_damping_per_rad2", 0.001, 3.0),
];

impl Form {
    /// Returns the parameters of the law without add-ons, in the order in which values are given.
    /// The explicit form has no parameter b.
    pub fn parameters(self) -> &'static [Parameter] {
        match self {
            Self::Paper => &PAPER,
            Self::Twisting(Discretization::Explicit) => TWIST.get(..3).unwrap_or(&TWIST),
            Self::Twisting(_) => &TWIST,
            Self::TwistingWithLinear => &TWIST_WITH_LINEAR,
            Self::Pid => &PID,
        }
    }
}

/// Returns the parameters of a law with its add-ons, in the order in which
/// [`Controller::from_parameters`] expects their values.
pub fn parameters(form: Form, add_ons: AddOns) -> Vec<Parameter, PARAMETERS_MAX> {
    let mut parameters = Vec::new();
    // At most 5 + 1 + 1 + 1 + 4 + 2: extending cannot fail.
    parameters.extend(form.parameters().iter().copied());
    parameters.extend([match add_ons.derivative {
        DerivativeKind::PseudoOfError | DerivativeKind::Pseudo => CUTOFF,
        DerivativeKind::RobustExact => ACCELERATION,
        DerivativeKind::RobustExactSecondOrder => JERK,
    }]);
    parameters.extend(add_ons.feed_forward.then_some(LEAD));
    parameters.extend(add_ons.delay.has_preview().then_some(PREVIEW));
    if add_ons.delay.has_smith() {
        parameters.extend(SMITH);
    }
    if add_ons.adaptation {
        parameters.extend(ADAPTATION);
    }
    parameters
}

impl<R: Real> Controller<R> {
    /// Creates a controller for a control period of `h`, s. `values` are the values of the
    /// parameters that [`parameters`] lists.
    ///
    /// # Errors
    /// Returns [`ParameterError`] with the invalid number or value.
    pub fn from_parameters(
        form: Form,
        add_ons: AddOns,
        h: R,
        values: &[R],
    ) -> Result<Self, ParameterError> {
        let wanted = parameters(form, add_ons);
        if values.len() != wanted.len() {
            let wanted = wanted.len();
            return Err(ParameterError::Count { wanted });
        }
        for (parameter, value) in wanted.iter().zip(values) {
            let value = value.to_f64();
            if !value.is_finite() || value < 0.0 || (parameter.is_log && value <= 0.0) {
                let name = parameter.name;
                return Err(ParameterError::Value { name });
            }
        }
        let mut values = values.iter().copied();
        // The count was checked above.
        let mut next = || values.next().unwrap_or(R::ONE);
        let feedback = feedback(form, h, &mut next);
        let differentiator = match add_ons.derivative {
            DerivativeKind::PseudoOfError | DerivativeKind::Pseudo => {
                Differentiator::pseudo(next(), h)
            }
            DerivativeKind::RobustExact => Differentiator::robust_exact(next(), h),
            DerivativeKind::RobustExactSecondOrder => {
                Differentiator::robust_exact_second_order(next(), h)
            }
        };
        let mut next_if = |is_on: bool| if is_on { next() } else { R::ZERO };
        Ok(Self {
            feedback,
            add_ons,
            differentiator,
            lead_s: next_if(add_ons.feed_forward),
            preview_s: next_if(add_ons.delay.has_preview()),
            smith: add_ons.delay.has_smith().then(|| {
                let gain = next_if(true);
                let lags = [next_if(true), next_if(true)];
                SmithPredictor::new(gain, lags, next_if(true), h)
            }),
            adaptation: Adaptation::new(
                next_if(add_ons.adaptation),
                next_if(add_ons.adaptation),
                h,
            ),
            integral: Integral::new(add_ons.adaptation),
            has_anti_windup: feedback.has_anti_windup(),
        })
    }
}

fn feedback<R: Real>(form: Form, h: R, next: &mut impl FnMut() -> R) -> Feedback<R> {
    match form {
        Form::Paper => Feedback::Paper {
            lambda: next(),
            w_step: next() * h,
        },
        Form::Twisting(discretization) => {
            let (lambda, k1, k2) = (next(), next(), next());
            let b = match discretization {
                Discretization::Explicit => R::ONE,
                _ => next(),
            };
            let twist = Twist::new(discretization, k1, k2, b, h);
            Feedback::Twisting {
                lambda,
                twist,
                ki_step: R::ZERO,
            }
        }
        Form::TwistingWithLinear => {
            let (lambda, k3, ki_step) = (next(), next(), next() * h);
            let (form, b) = (Discretization::ProperImplicit, R::from_f64(NOMINAL_GAIN));
            let twist = Twist::new(form, next(), next(), b, h).with_linear(k3);
            Feedback::Twisting {
                lambda,
                twist,
                ki_step,
            }
        }
        Form::Pid => Feedback::Pid {
            kp: next(),
            ki_step: next() * h,
            kd: next(),
        },
    }
}
