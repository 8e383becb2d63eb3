//! What the hand exerts.

use super::{Number, Vector};

/// Force and torque that the hand exerts, seen from the thorax.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Wrench<N> {
    /// N.
    pub force: Vector<N>,
    /// N·m, about the hand.
    pub torque: Vector<N>,
}

impl<N: Number> Wrench<N> {
    /// A force alone, N: backward, to the right, upward.
    #[must_use]
    pub const fn from_force(x: N, y: N, z: N) -> Self {
        Self {
            force: Vector::new(x, y, z),
            torque: Vector::ZERO,
        }
    }

    /// `share` of it.
    #[must_use]
    pub fn times(self, share: N) -> Self {
        Self {
            force: self.force.times(share),
            torque: self.torque.times(share),
        }
    }
}
