//! Any feedback with any add-ons: the law that harnesses run and search.

use super::super::real::Real;
use super::adaptation::{Adaptation, Integral};
use super::delay::SmithPredictor;
use super::derivative::{DerivativeKind, Differentiator};
use super::feedback::Feedback;
use super::{Input, Law};

/// What a feedback is combined with. Every feedback can have every combination.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AddOns {
    /// Where the error's rate comes from.
    pub derivative: DerivativeKind,
    /// The nominal wearer's inverse model.
    pub feed_forward: bool,
    /// Against the delay from effort to angle.
    pub delay: DelayCompensation,
    /// Learning: of the feed-forward's scale and damping, the scale for the feedback
    /// too, and an integral for each muscle.
    pub adaptation: bool,
}

/// What is done against the delay from effort to angle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DelayCompensation {
    /// Nothing.
    None,
    /// The target is taken ahead along its rate.
    Preview,
    /// A Smith predictor.
    Smith,
    /// Both.
    PreviewAndSmith,
}

impl DelayCompensation {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::None,
        Self::Preview,
        Self::Smith,
        Self::PreviewAndSmith,
    ];

    /// Whether the target is taken ahead.
    pub const fn has_preview(self) -> bool {
        matches!(self, Self::Preview | Self::PreviewAndSmith)
    }

    /// Whether there is a Smith predictor.
    pub const fn has_smith(self) -> bool {
        matches!(self, Self::Smith | Self::PreviewAndSmith)
    }
}

impl AddOns {
    /// The paper's: its pseudo-differentiation and nothing else.
    pub const NONE: Self = Self {
        derivative: DerivativeKind::PseudoOfError,
        feed_forward: false,
        delay: DelayCompensation::None,
        adaptation: false,
    };

    /// Every combination; adaptation needs the feed-forward.
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

/// A law with its add-ons and its memory, for one period. Made by
/// [`Controller::from_parameters`].
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
    /// How far ahead of the target, s, the feed-forward handed in should look.
    pub const fn lead_s(&self) -> R {
        self.lead_s
    }

    /// The error and its rate.
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
