//! What a law corrects while it runs: gains, and an integral for each muscle.

use super::super::real::Real;
use super::within;

/// Lowest and highest scale of the feed-forward.
const SCALE: (f64, f64) = (0.5, 2.5);
/// The change from one muscle to the other takes so much of the range either side of
/// 0: the device's (`firmware::control`, `integral.rs`).
const ZONE: f64 = 1.0 / 64.0;
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

    /// Effort per effort of the nominal wearer: what feedback is scaled by as well.
    pub const fn scale(&self) -> R {
        self.scale
    }

    /// The effort in place of this feed-forward for a target of this rate, rad/s.
    pub fn adapted_effort(&self, feed_forward: R, target_rate: R) -> R {
        self.scale * feed_forward + self.damping * target_rate
    }

    /// Learns from one period; not to be called while the effort is clamped or the
    /// target stands.
    pub fn learn(&mut self, error: R, feed_forward: R, target_rate: R) {
        let (low, high) = SCALE;
        let scale = self.scale + self.scale_step * error * feed_forward;
        self.scale = within(scale, R::from_f64(low), R::from_f64(high));
        let damping = self.damping + self.damping_step * error * target_rate;
        self.damping = within(damping, R::from_f64(-DAMPING), R::from_f64(DAMPING));
    }
}

/// A law's integral term; with adaptation one for each muscle, since threshold, gain
/// and fatigue are each muscle's own. The flexor's is never the lower one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Integral<R> {
    flexion: R,
    extension: R,
    is_apart: bool,
    latest: R,
}

impl<R: Real> Integral<R> {
    /// Nothing yet, in one or one for each muscle.
    pub const fn new(is_apart: bool) -> Self {
        Self {
            flexion: R::ZERO,
            extension: R::ZERO,
            is_apart,
            latest: R::ZERO,
        }
    }

    /// What it added last.
    pub const fn latest(&self) -> R {
        self.latest
    }

    /// How much of an effort is the flexor's, and how much the extensor's, 0…1, that
    /// asks for `torque` (−1…1) before any integral; all of one integral is both's.
    pub fn side_shares(&self, torque: R) -> [R; 2] {
        if self.is_apart {
            let place = R::from_f64(0.5) + torque / R::from_f64(2.0 * ZONE);
            let flexion = within(place, R::ZERO, R::ONE);
            [flexion, R::ONE - flexion]
        } else {
            [R::ONE; 2]
        }
    }

    /// What it adds to an effort of this side.
    pub fn contribution(&mut self, [flexion, _]: [R; 2]) -> R {
        self.latest = self.extension + (self.flexion - self.extension) * flexion;
        self.latest
    }

    /// Grows on this side.
    pub fn accumulate(&mut self, [flexion, extension]: [R; 2], growth: R) {
        self.flexion = self.flexion + growth * flexion;
        self.extension = self.extension + growth * extension;
        if self.flexion < self.extension {
            let middle = (self.flexion + self.extension) * R::from_f64(0.5);
            (self.flexion, self.extension) = (middle, middle);
        }
    }
}
