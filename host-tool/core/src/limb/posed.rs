//! The arm in one posture, as matrices.

use super::{RecruitmentError, ToDouble};
use firmware::limb::{AXES, Jacobians, LINES, Number};
use nalgebra::{SMatrix, SVector};

/// Torques about the axes, N·m, one per axis.
pub type Torques = SVector<f64, AXES>;
/// Forces of the lines, N, one per line; 0 for lines that do not exist.
pub type Forces = SVector<f64, LINES>;
/// Force and torque at the hand: N, N, N, N·m, N·m, N·m.
pub type WrenchVector = SVector<f64, 6>;

/// Matrices that turn forces of muscles into torques, and torques into a wrench.
#[derive(Clone, Debug)]
pub struct PostureMatrices {
    /// Matrix R: torque about each axis per newton of each line, m; one column per line.
    pub levers: SMatrix<f64, AXES, LINES>,
    /// Matrix J_armᵀ: the torques that a wrench at the hand needs.
    pub arm: SMatrix<f64, AXES, 6>,
    /// Matrix (J_arm·J_armᵀ)⁻¹·J_arm: the wrench whose torques are nearest to given torques.
    pub given: SMatrix<f64, 6, AXES>,
}

impl PostureMatrices {
    /// Computes the matrices from the device's Jacobians, in any type of number.
    ///
    /// # Errors
    /// [`RecruitmentError::Singular`]: at this posture some wrench needs no torque at all.
    pub fn new<N: Number + ToDouble>(jacobians: &Jacobians<N>) -> Result<Self, RecruitmentError> {
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
        let inverse = square
            .cholesky()
            .ok_or(RecruitmentError::Singular)?
            .inverse();
        // The elements are squares of lengths around a metre; this close to singularity no digits
        // are left.
        if inverse.amax() > 1e9 {
            return Err(RecruitmentError::Singular);
        }
        Ok(Self {
            levers,
            arm,
            given: inverse * arm.transpose(),
        })
    }

    /// Returns the torques that a wrench needs, N·m.
    #[must_use]
    pub fn torques(&self, wrench: &WrenchVector) -> Torques {
        self.arm * wrench
    }

    /// Returns the wrench at the hand while lines pull with `forces`, N and N·m.
    ///
    /// The arm has nine axes and one hand, so three motions of the arm leave the hand in place;
    /// torques that cause them are met by the support of the arm. This function returns the wrench
    /// whose torques are nearest to those of the muscles; a clamped arm with its own stiffnesses
    /// would give another wrench.
    #[must_use]
    pub fn wrench(&self, forces: &Forces) -> WrenchVector {
        self.given * (self.levers * forces)
    }
}
