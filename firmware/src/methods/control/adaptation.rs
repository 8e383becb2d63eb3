//! Gains that a law corrects while it runs.

use super::super::real::Real;
use super::within;

/// Lowest and highest scale of the feed-forward.
const SCALE: (f64, f64) = (0.5, 2.5);

/// Scales the feed-forward by gradient descent on the squared error ("MIT
/// rule", Åström & Wittenmark, Adaptive Control, ch. 5): where the error stays
/// positive with a flexing feed-forward, the wearer is weaker than nominal.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Adaptation<R> {
    /// Growth per period, error and feed-forward, 1/rad.
    step: R,
    scale: R,
}

impl<R: Real> Adaptation<R> {
    /// `rate` in 1/(rad·s), 0 to keep the scale at 1; period h in s.
    #[must_use]
    pub fn new(rate: R, h: R) -> Self {
        Self {
            step: rate * h,
            scale: R::ONE,
        }
    }

    /// What to multiply the feed-forward by.
    #[must_use]
    pub const fn scale(&self) -> R {
        self.scale
    }

    /// Learns from one period; not to be called while the effort is clamped.
    pub fn learn(&mut self, error: R, feed_forward: R) {
        let (low, high) = SCALE;
        let scale = self.scale + self.step * error * feed_forward;
        self.scale = within(scale, R::of(low), R::of(high));
    }
}
