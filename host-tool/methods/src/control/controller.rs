//! Controller with any feedback and any add-ons, which test harnesses run and searches optimise.

use super::super::real::Real;
use super::adaptation::{Adaptation, Integral};
use super::delay::SmithPredictor;
use super::derivative::{DerivativeKind, Differentiator};
use super::feedback::Feedback;
use super::twist::Push;
use super::{Input, Law};

/// Parts that can be added to a feedback law. Every law can have every combination of
/// [`AddOns::all`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AddOns {
    /// How the rate of the error is obtained.
    pub derivative: DerivativeKind,
    /// Whether the controller has a feed-forward, computed with the inverse model of the nominal
    /// wearer.
    pub feed_forward: bool,
    /// Compensation of the delay between effort and angle.
    pub delay: DelayCompensation,
    /// Whether the controller adapts to the wearer. It then learns the scale and the damping of the
    /// feed-forward; the scale also multiplies the feedback. Flexor and extensor have separate
    /// integrals.
    pub adaptation: bool,
}

/// How the delay between effort and angle is compensated.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DelayCompensation {
    /// No compensation.
    None,
    /// The controller follows the reference as extrapolated along its rate.
    Preview,
    /// A Smith predictor predicts the angle after the delay.
    Smith,
    /// The reference is extrapolated, and a Smith predictor predicts the angle.
    PreviewAndSmith,
}

impl DelayCompensation {
    pub const ALL: [Self; 4] = [
        Self::None,
        Self::Preview,
        Self::Smith,
        Self::PreviewAndSmith,
    ];

    /// Returns whether the controller extrapolates the reference.
    pub const fn has_preview(self) -> bool {
        matches!(self, Self::Preview | Self::PreviewAndSmith)
    }

    /// Returns whether the controller has a Smith predictor.
    pub const fn has_smith(self) -> bool {
        matches!(self, Self::Smith | Self::PreviewAndSmith)
    }
}

impl AddOns {
    /// The paper's controller: it differentiates the error by pseudo-differentiation and has no
    /// other add-on.
    pub const NONE: Self = Self {
        derivative: DerivativeKind::PseudoOfError,
        feed_forward: false,
        delay: DelayCompensation::None,
        adaptation: false,
    };

    /// Returns every combination of add-ons. Adaptation occurs only together with the feed-forward,
    /// which it scales.
    pub fn all() -> impl Iterator<Item = Self> {
        let pairs = DerivativeKind::ALL
            .into_iter()
            .flat_map(|derivative| DelayCompensation::ALL.map(|delay| (derivative, delay)));
        pairs.flat_map(|(derivative, delay)| {
            [(false, false), (true, false), (true, true)].map(|(feed_forward, adaptation)| Self {
                derivative,
                feed_forward,
                delay,
                adaptation,
            })
        })
    }
}

/// A controller: a feedback law with its add-ons and its state, for a fixed control period.
/// [`Controller::from_parameters`] creates it.
#[derive(Clone, Copy, Debug)]
pub struct Controller<R> {
    pub(super) feedback: Feedback<R>,
    pub(super) add_ons: AddOns,
    pub(super) differentiator: Differentiator<R>,
    pub(super) lead_s: R,
    pub(super) preview_s: R,
    pub(super) smith: Option<SmithPredictor<R>>,
    pub(super) adaptation: Adaptation<R>,
    pub(super) integral: Integral<R>,
    /// Whether the integral stops growing while the effort is clamped.
    pub(super) has_anti_windup: bool,
}

impl<R: Real> Controller<R> {
    /// Returns the time by which the reference for the feed-forward input should be ahead of the
    /// present, s.
    pub const fn lead_s(&self) -> R {
        self.lead_s
    }

    /// Returns the controller with or without anti-windup, whatever its feedback law has by default.
    #[must_use]
    pub fn with_anti_windup(self, has: bool) -> Self {
        Self {
            has_anti_windup: has,
            ..self
        }
    }

    /// Returns the answer of the feedback law to a constant error, rad, with an integral of 0.
    pub fn feedback(&self, error: R) -> Push<R> {
        self.feedback.push(error, R::ZERO, R::ZERO)
    }

    /// Returns the error, rad, and its rate, rad/s, with the compensation of the delay.
    fn error(&mut self, input: &Input<R>) -> (R, R) {
        let mut measured = input.measured;
        if let Some(smith) = &self.smith {
            measured = measured + smith.prediction_offset();
        }
        let error = input.target + self.preview_s * input.target_rate - measured;
        let rate = match self.add_ons.derivative {
            DerivativeKind::PseudoOfError => self.differentiator.step(error),
            _ => input.target_rate - self.differentiator.step(measured),
        };
        (error, rate)
    }
}

impl<R: Real> Law<R> for Controller<R> {
    fn step(&mut self, input: &Input<R>) -> R {
        let (error, rate) = self.error(input);
        let scale = self.adaptation.scale();
        let push = self.feedback.push(error, rate, self.integral.latest());
        let growth = scale * push.growth;
        let mut torque = scale * push.push;
        if self.add_ons.feed_forward {
            torque = torque
                + self
                    .adaptation
                    .adapted_effort(input.feed_forward, input.target_rate);
        }
        let side = self.integral.side_shares(torque);
        let effort = torque + self.integral.contribution(side);
        let outward = |growth: R| {
            (effort > R::ONE && growth > R::ZERO) || (effort < -R::ONE && growth < R::ZERO)
        };
        if !(self.has_anti_windup && outward(growth)) {
            self.integral.accumulate(side, growth);
        }
        if input.target_rate != R::ZERO && !outward(error) {
            self.adaptation
                .learn(error, input.feed_forward, input.target_rate);
        }
        if let Some(smith) = &mut self.smith {
            smith.record_effort(super::bounded(effort, R::ONE));
        }
        effort
    }
}
