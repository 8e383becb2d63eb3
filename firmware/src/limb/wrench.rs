//! Wrench that the hand exerts.

use super::{Number, Vector};

/// Force and torque that the hand exerts, in the thorax frame.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Wrench<N> {
    /// Force at the hand, N.
    pub force: Vector<N>,
    /// Torque about the hand, N·m.
    pub torque: Vector<N>,
}

impl<N: Number> Wrench<N> {
    /// Creates a wrench without torque from a force, N: backward, to the right, upward.
    #[must_use]
    pub const fn from_force(x: N, y: N, z: N) -> Self {
        Self {
            force: Vector::new(x, y, z),
            torque: Vector::ZERO,
        }
    }

    /// Returns the wrench scaled by `share`.
    #[must_use]
    pub fn times(self, share: N) -> Self {
        Self {
            force: self.force.times(share),
            torque: self.torque.times(share),
        }
    }
}
