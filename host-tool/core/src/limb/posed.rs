//! The arm at one posture, as matrices.

use super::{ToDouble, Trouble};
use firmware::limb::{AXES, Jacobians, LINES, Number};
use nalgebra::{SMatrix, SVector};

/// One number an axis.
pub type Torques = SVector<f64, AXES>;
/// One number a line, those that are not there 0.
pub type Forces = SVector<f64, LINES>;
/// Force and torque at the hand: N, N, N, N·m, N·m, N·m.
pub type WrenchVector = SVector<f64, 6>;

/// What turns forces of muscles into torques and those into a wrench.
#[derive(Clone, Debug)]
pub struct Posed {
    /// R: torque about each axis per newton of each line, m; a column a line.
    pub levers: SMatrix<f64, AXES, LINES>,
    /// J_armᵀ: the torques that a wrench at the hand needs.
    pub arm: SMatrix<f64, AXES, 6>,
    /// (J_arm·J_armᵀ)⁻¹·J_arm: the wrench whose torques are nearest to given ones.
    pub given: SMatrix<f64, 6, AXES>,
}

impl Posed {
    /// Of the device's Jacobians, in whatever numbers.
    ///
    /// # Errors
    /// [`Trouble::Singular`]: at this posture some wrench needs no torque at all.
    pub fn new<N: Number + ToDouble>(jacobians: &Jacobians<N>) -> Result<Self, Trouble> {
        let mut levers = SMatrix::<f64, AXES, LINES>::zeros();
        for (mut column, line) in levers.column_iter_mut().zip(jacobians.muscles()) {
            column.copy_from_slice(&line.map(ToDouble::to_double));
        }
        let mut arm = SMatrix::<f64, AXES, 6>::zeros();
        for (mut row, axis) in arm.row_iter_mut().zip(jacobians.arm()) {
            let parts = axis.linear.to_array().into_iter();
            let parts = parts.chain(axis.angular.to_array());
            for (to, from) in row.iter_mut().zip(parts) {
                *to = from.to_double();
            }
        }
        let square = arm.transpose() * arm;
        let inverse = square.cholesky().ok_or(Trouble::Singular)?.inverse();
        // Squares of lengths around a metre: this far away nothing is left of them.
        if inverse.amax() > 1e9 {
            return Err(Trouble::Singular);
        }
        Ok(Self {
            levers,
            arm,
            given: inverse * arm.transpose(),
        })
    }

    /// The torques that a wrench needs, N·m.
    #[must_use]
    pub fn torques(&self, wrench: &WrenchVector) -> Torques {
        self.arm * wrench
    }

    /// The wrench at the hand while lines pull with `forces`, N and N·m.
    ///
    /// Nine axes and one hand: three ways to move the arm leave the hand where it is,
    /// and torques that do that are met by whatever holds the arm. Taken here is the
    /// wrench whose torques are nearest to those of the muscles; a clamped arm with
    /// stiffnesses of its own would tell another.
    #[must_use]
    pub fn wrench(&self, forces: &Forces) -> WrenchVector {
        self.given * (self.levers * forces)
    }
}
