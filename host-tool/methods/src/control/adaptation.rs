//! Quantities that a law adapts while it runs: gains, and an integral for each muscle.

use super::super::real::Real;
use super::within;

/// Smallest and largest scale that the adaptation gives the feed-forward.
const SCALE: (f64, f64) = (0.5, 2.5);
/// Half width of the range of efforts around 0 in which the integral changes from one muscle to the
/// other, as a fraction of the full effort. The device has the same width (`firmware::control`,
/// `integral.rs`).
const ZONE: f64 = 1.0 / 64.0;
/// Largest magnitude of the adapted damping: effort per rad/s of the reference.
const DAMPING: f64 = 0.3;

/// Adapts two parameters of a controller to the wearer: the scale of the feed-forward, and the
/// damping, which is an additional effort proportional to the rate of the reference. They follow
/// the gradient of the squared error ("MIT rule", Åström & Wittenmark, Adaptive Control, ch. 5). If
/// the error stays positive while the feed-forward flexes, the wearer is weaker than nominal, and
/// the scale grows. If the error stays positive while the reference flexes, the wearer is slower
/// than nominal, and the damping grows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Adaptation<R> {
    /// Growth of the scale per period, for an error of 1 rad and a feed-forward of 1, 1/rad.
    scale_step: R,
    /// Growth of the damping per period, for an error of 1 rad and a rate of 1 rad/s, s/rad².
    damping_step: R,
    scale: R,
    /// Damping: effort per rate of the reference, 1/(rad/s).
    damping: R,
}

impl<R: Real> Adaptation<R> {
    /// Creates an adaptation with a scale of 1 and no damping. `scale_rate` is the learning rate of
    /// the scale, 1/(rad·s), and `damping_rate` that of the damping, 1/rad²; with 0 for both,
    /// nothing is learnt. `h` is the control period, s.
    pub fn new(scale_rate: R, damping_rate: R, h: R) -> Self {
        Self {
            scale_step: scale_rate * h,
            damping_step: damping_rate * h,
            scale: R::ONE,
            damping: R::ZERO,
        }
    }

    /// Returns the scale: the effort that this wearer needs relative to the nominal wearer. The
    /// feedback is multiplied by it, too.
    pub const fn scale(&self) -> R {
        self.scale
    }

    /// Returns the effort that replaces `feed_forward`: scaled, and with the damping term for a
    /// reference that changes at `target_rate`, rad/s.
    pub fn adapted_effort(&self, feed_forward: R, target_rate: R) -> R {
        self.scale * feed_forward + self.damping * target_rate
    }

    /// Adapts scale and damping after one period, from the angle error in that period. Do not call
    /// it while the effort is clamped or the reference is constant.
    pub fn learn(&mut self, error: R, feed_forward: R, target_rate: R) {
        let (low, high) = SCALE;
        let scale = self.scale + self.scale_step * error * feed_forward;
        self.scale = within(scale, R::from_f64(low), R::from_f64(high));
        let damping = self.damping + self.damping_step * error * target_rate;
        self.damping = within(damping, R::from_f64(-DAMPING), R::from_f64(DAMPING));
    }
}

/// The integral term of a control law. With adaptation, flexor and extensor have separate
/// integrals, because threshold, gain and fatigue differ between muscles. The flexor's integral is
/// never smaller than the extensor's.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Integral<R> {
    flexion: R,
    extension: R,
    is_apart: bool,
    latest: R,
}

impl<R: Real> Integral<R> {
    /// Creates an integral term of 0. If `is_apart` is true, flexor and extensor have separate
    /// integrals.
    pub const fn new(is_apart: bool) -> Self {
        Self {
            flexion: R::ZERO,
            extension: R::ZERO,
            is_apart,
            latest: R::ZERO,
        }
    }

    /// Returns the value that [`Self::contribution`] returned last.
    pub const fn latest(&self) -> R {
        self.latest
    }

    /// Returns the weights of the flexor's and the extensor's integral, 0…1. `torque` is the effort
    /// without its integral term (−1…1), whose sign decides which muscle is active. With a single
    /// integral, both weights are 1.
    pub fn side_shares(&self, torque: R) -> [R; 2] {
        if self.is_apart {
            let place = R::from_f64(0.5) + torque / R::from_f64(2.0 * ZONE);
            let flexion = within(place, R::ZERO, R::ONE);
            [flexion, R::ONE - flexion]
        } else {
            [R::ONE; 2]
        }
    }

    /// Returns the integral term of the effort: the mean of both integrals, weighted as
    /// [`Self::side_shares`] says.
    pub fn contribution(&mut self, [flexion, _]: [R; 2]) -> R {
        self.latest = self.extension + (self.flexion - self.extension) * flexion;
        self.latest
    }

    /// Adds `growth` to both integrals, multiplied by their weights from [`Self::side_shares`].
    pub fn accumulate(&mut self, [flexion, extension]: [R; 2], growth: R) {
        self.flexion = self.flexion + growth * flexion;
        self.extension = self.extension + growth * extension;
        if self.flexion < self.extension {
            let middle = (self.flexion + self.extension) * R::from_f64(0.5);
            (self.flexion, self.extension) = (middle, middle);
        }
    }
}
