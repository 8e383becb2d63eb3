//! Gains that a law corrects while it runs.

use super::super::real::Real;
use super::within;

/// Lowest and highest scale of the feed-forward.
const SCALE: (f64, f64) = (0.5, 2.5);
/// Highest effort per rad/s of the target, either way.
const DAMPING: f64 = 0.3;

/// Scales the feed-forward, and adds to it in proportion to the target's rate,
/// by gradient descent on the squared error ("MIT rule", Åström & Wittenmark,
/// Adaptive Control, ch. 5): where the error stays positive with a flexing
/// feed-forward, the wearer is weaker than nominal; where it stays positive
/// while the target flexes, slower.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Adaptation<R> {
    /// Growth of the scale per period, error and feed-forward, 1/rad.
    scale_step: R,
    /// Growth of the damping per period, error and rate, s/rad².
    damping_step: R,
    scale: R,
    /// Effort per rad/s.
    damping: R,
}

impl<R: Real> Adaptation<R> {
    /// Rates of learning: of the scale in 1/(rad·s), of the damping in 1/rad²
    /// (both 0: nothing is learnt); period h in s.
    pub fn new(scale_rate: R, damping_rate: R, h: R) -> Self {
        Self {
            scale_step: scale_rate * h,
            damping_step: damping_rate * h,
            scale: R::ONE,
            damping: R::ZERO,
        }
    }

    /// The effort in place of this feed-forward for a target of this rate, rad/s.
    pub fn applied(&self, feed_forward: R, target_rate: R) -> R {
        self.scale * feed_forward + self.damping * target_rate
    }

    /// Learns from one period; not to be called while the effort is clamped.
    pub fn learn(&mut self, error: R, feed_forward: R, target_rate: R) {
        let (low, high) = SCALE;
        let scale = self.scale + self.scale_step * error * feed_forward;
        self.scale = within(scale, R::of(low), R::of(high));
        let damping = self.damping + self.damping_step * error * target_rate;
        self.damping = within(damping, R::of(-DAMPING), R::of(DAMPING));
    }
}
