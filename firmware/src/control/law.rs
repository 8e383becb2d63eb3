//! Choice of control law and gains, and the controller built from them.

use super::differentiator::{Differentiator, DifferentiatorState};
use super::effort::Effort;
use super::feed_forward::WearerModel;
use super::gain::Gain;
use super::integral::Integral;
use super::pid::Pid;
use super::response::{Course, FeedbackAid, Response, ResponseState};
use super::super_twisting::{Paper, PaperState, Recommended};
use crate::arithmetic::fixed_point::Q;
use crate::range::OutOfRange;
use crate::units::Angle;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A control law and its gains as they travel on the wire; every gain is in thousandths.
///
/// Angles enter the control laws in radians, except for [`LawSpec::Paper`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum LawSpec {
    /// Super-twisting as in Hamana 2022 (4), (5) with the sign corrected and without anti-windup.
    /// Its effort is in volts above threshold.
    Paper {
        /// Gain λ, both of the surface (1/s) and of the square root; 0.001…100.
        lambda_milli: u32,
        /// Gain W, V/s; 0…100.
        w_milli: u32,
    },
    /// Implicit super-twisting with anti-windup. Its effort is between −1 and 1.
    Recommended {
        /// Gain λ of the surface, 1/s; 0.1…100.
        lambda_milli: u32,
        /// Gain k1, (rad/s)^-½; 0.001…100.
        k1_milli: u32,
        /// Gain k2, 1/rad; 0.01…100.
        k2_milli: u32,
        /// Gain b of the plant from effort to s, rad/s²; 1…1000.
        b_milli: u32,
        /// Gain k3 of the linear term beside the root, s/rad; 0…100.
        k3_milli: u32,
        /// Gain ki, growth of the integral with the error, 1/(rad·s); 0…100.
        ki_milli: u32,
    },
    /// PID on the angle, the baseline for comparisons; differentiator and anti-windup are those of
    /// [`LawSpec::Recommended`].
    Pid {
        /// Proportional gain, 1/rad; 0…100.
        kp_milli: u32,
        /// Integral gain, 1/(rad·s); 0…100.
        ki_milli: u32,
        /// Derivative gain, s/rad; 0…100.
        kd_milli: u32,
    },
}

impl LawSpec {
    /// Gains of the paper: λ = 10, ρ = 0.5, W = 1 (Hamana 2022 §III-D), at 11 ms and 3 Hz.
    pub const PAPER: Self = Self::Paper {
        lambda_milli: 10_000,
        w_milli: 1_000,
    };
    /// Default gains at 2 ms and 4.48 Hz for a wearer of [`WearerModel::REFERENCE_MRAD`], used with
    /// that wearer's model and `ResponseSpec::RECOMMENDED`. See [`LawSpec::for_wearer`] for other
    /// wearers; without a model, [`LawSpec::ALONE`] is better. See [`Recommended`] for the search
    /// that found these gains.
    pub const RECOMMENDED: Self = Self::Recommended {
        lambda_milli: 7_588,
        k1_milli: 58,
        k2_milli: 55,
        b_milli: 100_000,
        k3_milli: 50,
        ki_milli: 2_025,
    };
    /// Super-twisting without linear terms, at 2 ms and 17 Hz, for a joint whose wearer is not
    /// modelled.
    pub const ALONE: Self = Self::Recommended {
        lambda_milli: 10_000,
        k1_milli: 80,
        k2_milli: 1_080,
        b_milli: 150_000,
        k3_milli: 0,
        ki_milli: 0,
    };
    /// PID gains that the same search as for [`LawSpec::ALONE`] found, at 2 ms and 6 Hz.
    pub const PID: Self = Self::Pid {
        kp_milli: 1_060,
        ki_milli: 17_000,
        kd_milli: 117,
    };

    /// Scales the gains of [`LawSpec::Recommended`] to a wearer of another strength: if an effort
    /// moves the joint half as far, the gains are doubled. Returns other control laws unchanged. b,
    /// which only sets the width of the boundary layer, stays.
    #[must_use]
    pub const fn for_wearer(self, wearer: &WearerModel) -> Self {
        let strength = wearer.strength_mrad() as u64;
        match self {
            Self::Recommended {
                lambda_milli,
                k1_milli,
                k2_milli,
                b_milli,
                k3_milli,
                ki_milli,
            } => Self::Recommended {
                lambda_milli,
                k1_milli: scale_inversely(k1_milli, strength),
                k2_milli: scale_inversely(k2_milli, strength),
                b_milli,
                k3_milli: scale_inversely(k3_milli, strength),
                ki_milli: scale_inversely(ki_milli, strength),
            },
            other => other,
        }
    }

    /// Returns the period for which this control law's default gains were chosen, ms. The paper
    /// gives no period; the 90 Hz of its glove are assumed.
    #[must_use]
    pub const fn default_period_ms(&self) -> u8 {
        match self {
            Self::Paper { .. } => 11,
            Self::Recommended { .. } | Self::Pid { .. } => 2,
        }
    }

    /// Returns the lead of the feed-forward for which this control law's default gains were chosen,
    /// ms; see [`WearerModel::lead_ms`].
    #[must_use]
    pub const fn default_lead_ms(&self) -> u16 {
        match self {
            Self::Paper { .. } => 0,
            Self::Recommended { .. } => 235,
            Self::Pid { .. } => 255,
        }
    }

    /// Returns the cutoff of the pseudo-differentiation for which this control law's default gains
    /// were chosen, mHz. The paper uses 3 Hz.
    #[must_use]
    pub const fn default_cutoff_mhz(&self) -> u32 {
        match self {
            Self::Paper { .. } => 3_000,
            Self::Recommended { k3_milli: 0, .. } => 17_000,
            Self::Recommended { .. } => 5_510,
            Self::Pid { .. } => 6_000,
        }
    }
}

/// Scales a gain for [`WearerModel::REFERENCE_MRAD`] to another strength, rounded.
const fn scale_inversely(gain: u32, strength_mrad: u64) -> u32 {
    // The strength is a quarter of the reference or more, so the gain is below 2^34 before the
    // bound.
    let gain = gain as u64 * WearerModel::REFERENCE_MRAD as u64;
    let gain = (gain + strength_mrad / 2) / strength_mrad;
    if gain > u32::MAX as u64 {
        u32::MAX
    } else {
        gain as u32
    }
}

/// A validated controller with its differentiator, for one period.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    kind: LawKind,
    differentiator: Differentiator,
    response: Option<Response>,
}

#[derive(Clone, Copy, Debug)]
enum LawKind {
    Paper(Paper),
    Recommended(Recommended),
    Pid(Pid),
}

impl LawKind {
    fn new(spec: &LawSpec, period_ms: u8) -> Result<Self, OutOfRange> {
        Ok(match *spec {
            LawSpec::Paper {
                lambda_milli,
                w_milli,
            } => Self::Paper(Paper::new(lambda_milli, w_milli, period_ms)?),
            LawSpec::Recommended {
                lambda_milli,
                k1_milli,
                k2_milli,
                b_milli,
                k3_milli,
                ki_milli,
            } => {
                let twist = [k1_milli, k2_milli, b_milli, k3_milli];
                Self::Recommended(Recommended::new(lambda_milli, ki_milli, twist, period_ms)?)
            }
            LawSpec::Pid {
                kp_milli,
                ki_milli,
                kd_milli,
            } => Self::Pid(Pid::new(kp_milli, ki_milli, kd_milli, period_ms)?),
        })
    }
}

/// State of a controller between steps.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LawState {
    differentiator: DifferentiatorState,
    paper: PaperState,
    integral: Integral,
    response: ResponseState,
}

impl Law {
    /// Validates a controller and its differentiator for a period of `period_ms`. `response` is the
    /// wearer's response for the same period.
    pub(crate) fn new(
        spec: &LawSpec,
        period_ms: u8,
        cutoff_mhz: u32,
        response: Option<Response>,
    ) -> Result<Self, OutOfRange> {
        Ok(Self {
            differentiator: Differentiator::new(cutoff_mhz, period_ms)?,
            kind: LawKind::new(spec, period_ms)?,
            response,
        })
    }

    /// Returns an effort of zero in this controller's unit.
    pub(super) fn zero_effort(&self) -> Effort {
        match self.kind {
            LawKind::Paper(_) => Effort::AboveThreshold(Q::ZERO),
            LawKind::Recommended(_) | LawKind::Pid(_) => Effort::Fraction(Q::ZERO),
        }
    }

    /// Advances by one period and returns the effort. `error` is reference − measured, degrees.
    /// Since the differentiator is linear, one differentiator of the error replaces the paper's two
    /// of command and response. `gain` is the share of the feedback and of the learning. The
    /// paper's controller ignores `course`, the response and `gain`.
    pub(crate) fn step(
        &self,
        state: &mut LawState,
        error: Angle,
        course: &Course,
        gain: Gain,
    ) -> Effort {
        let (error, aid) = match &self.response {
            None => (error, FeedbackAid::from_feed_forward(course, gain)),
            Some(response) => (
                response.predicted_error(&state.response, error),
                response.aid(&state.response, course, gain),
            ),
        };
        let effort = self.compute_effort(state, error, &aid);
        if let (Some(response), Effort::Fraction(u)) = (&self.response, effort) {
            let error = gain.scale_angle(error);
            response.learn(&mut state.response, error, course, u);
        }
        effort
    }

    #[inline(always)]
    fn compute_effort(&self, state: &mut LawState, error: Angle, aid: &FeedbackAid) -> Effort {
        let rate = self.differentiator.step(&mut state.differentiator, error);
        match &self.kind {
            LawKind::Paper(law) => law.step(&mut state.paper, error, rate),
            LawKind::Recommended(law) => law.step(&mut state.integral, error, rate, aid),
            LawKind::Pid(law) => law.step(&mut state.integral, error, rate, aid),
        }
    }
}
