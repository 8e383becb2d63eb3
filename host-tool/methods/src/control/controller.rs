//! Controller with any feedback and any add-ons, which test harnesses run and searches optimise.

use super::super::real::Real;
use super::adaptation::{Adaptation, Integral};
use super::delay::SmithPredictor;
use super::derivative::{DerivativeKind, Differentiator};
use super::feedback::Feedback;
use super::{Input, Law};

/// Add-ons of a feedback. Every feedback can have every combination.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AddOns {
    /// Source of the error's rate.
    pub derivative: DerivativeKind,
    /// Whether the inverse model of the nominal wearer contributes.
    pub feed_forward: bool,
    /// Compensation of the delay from effort to angle.
    pub delay: DelayCompensation,
    /// Whether the law learns: scale and damping of the feed-forward, the scale of the feedback
    /// too, and an integral for each muscle.
    pub adaptation: bool,
}

/// Compensation of the delay from effort to angle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DelayCompensation {
    /// No compensation.
    None,
    /// The reference is extrapolated along its rate.
    Preview,
    /// A Smith predictor.
    Smith,
    /// Extrapolation of the reference and a Smith predictor.
    PreviewAndSmith,
}

impl DelayCompensation {
    pub const ALL: [Self; 4] = [
        Self::None,
        Self::Preview,
        Self::Smith,
        Self::PreviewAndSmith,
    ];

    /// Returns whether the reference is extrapolated.
    pub const fn has_preview(self) -> bool {
        matches!(self, Self::Preview | Self::PreviewAndSmith)
    }

    /// Returns whether there is a Smith predictor.
    pub const fn has_smith(self) -> bool {
        matches!(self, Self::Smith | Self::PreviewAndSmith)
    }
}

impl AddOns {
    /// The add-ons of the paper: pseudo-differentiation and nothing else.
    pub const NONE: Self = Self {
        derivative: DerivativeKind::PseudoOfError,
        feed_forward: false,
        delay: DelayCompensation::None,
        adaptation: false,
    };

    /// Returns every combination; adaptation requires the feed-forward.
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

/// A law with its add-ons and its state, for one period. [`Controller::from_parameters`] creates
/// it.
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
}

impl<R: Real> Controller<R> {
    /// Returns the time by which the feed-forward input should lead the reference, s.
    pub const fn lead_s(&self) -> R {
        self.lead_s
    }

    /// Returns the error and its rate.
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
        if !(self.feedback.has_anti_windup() && outward(growth)) {
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
