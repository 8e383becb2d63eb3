//! Quantities that a law adapts while it runs: gains, and an integral for each muscle.

use super::super::real::Real;
use super::within;

/// Smallest and largest scale of the feed-forward.
const SCALE: (f64, f64) = (0.5, 2.5);
/// Width of the transition from one muscle to the other on either side of 0, as a fraction of the
/// range: that of the device (`firmware::control`, `integral.rs`).
const ZONE: f64 = 1.0 / 64.0;
/// Largest effort per rad/s of the reference, in either direction.
const DAMPING: f64 = 0.3;

/// Scale of the feed-forward and an additional term proportional to the rate of the reference,
/// adapted by gradient descent on the squared error ("MIT rule", Åström & Wittenmark, Adaptive
/// Control, ch. 5). If the error stays positive with a flexing feed-forward, the wearer is weaker
/// than nominal; if it stays positive while the reference flexes, the wearer is slower.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Adaptation<R> {
    /// Growth of the scale per period, error and feed-forward, 1/rad.
    scale_step: R,
    /// Growth of the damping per period, error and rate, s/rad².
    damping_step: R,
    scale: R,
    /// Effort per rate of the reference, per rad/s.
    damping: R,
}

impl<R: Real> Adaptation<R> {
    /// Creates the adaptation with its learning rates: of the scale in 1/(rad·s), of the damping in
    /// 1/rad² (0 for both disables learning). The period h is in s.
    pub fn new(scale_rate: R, damping_rate: R, h: R) -> Self {
        Self {
            scale_step: scale_rate * h,
            damping_step: damping_rate * h,
            scale: R::ONE,
            damping: R::ZERO,
        }
    }

    /// Returns the effort per effort of the nominal wearer, which also scales the feedback.
    pub const fn scale(&self) -> R {
        self.scale
    }

    /// Returns the adapted effort that replaces this feed-forward, for a reference with this rate,
    /// rad/s.
    pub fn adapted_effort(&self, feed_forward: R, target_rate: R) -> R {
        self.scale * feed_forward + self.damping * target_rate
    }

    /// Learns from one period. Do not call it while the effort is clamped or the reference is
    /// constant.
    pub fn learn(&mut self, error: R, feed_forward: R, target_rate: R) {
        let (low, high) = SCALE;
        let scale = self.scale + self.scale_step * error * feed_forward;
        self.scale = within(scale, R::from_f64(low), R::from_f64(high));
        let damping = self.damping + self.damping_step * error * target_rate;
        self.damping = within(damping, R::from_f64(-DAMPING), R::from_f64(DAMPING));
    }
}

/// The integral term of a law. With adaptation there is one for each muscle, because threshold,
/// gain and fatigue differ between muscles. The flexor's is never smaller than the extensor's.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Integral<R> {
    flexion: R,
    extension: R,
    is_apart: bool,
    latest: R,
}

impl<R: Real> Integral<R> {
    /// Creates an integral of 0: a single one, or one for each muscle if `is_apart`.
    pub const fn new(is_apart: bool) -> Self {
        Self {
            flexion: R::ZERO,
            extension: R::ZERO,
            is_apart,
            latest: R::ZERO,
        }
    }

    /// Returns the latest contribution.
    pub const fn latest(&self) -> R {
        self.latest
    }

    /// Returns the shares of flexor and extensor, 0…1, of an effort whose part without integrals is
    /// `torque` (−1…1). With a single integral both shares are 1.
    pub fn side_shares(&self, torque: R) -> [R; 2] {
        if self.is_apart {
            let place = R::from_f64(0.5) + torque / R::from_f64(2.0 * ZONE);
            let flexion = within(place, R::ZERO, R::ONE);
            [flexion, R::ONE - flexion]
        } else {
            [R::ONE; 2]
        }
    }

    /// Returns the contribution to an effort with these shares.
    pub fn contribution(&mut self, [flexion, _]: [R; 2]) -> R {
        self.latest = self.extension + (self.flexion - self.extension) * flexion;
        self.latest
    }

    /// Adds `growth` to the integrals in proportion to these shares.
    pub fn accumulate(&mut self, [flexion, extension]: [R; 2], growth: R) {
        self.flexion = self.flexion + growth * flexion;
        self.extension = self.extension + growth * extension;
        if self.flexion < self.extension {
            let middle = (self.flexion + self.extension) * R::from_f64(0.5);
            (self.flexion, self.extension) = (middle, middle);
        }
    }
}
