//! The arm in one posture, as matrices.

use super::{RecruitmentError, ToDouble};
use firmware::limb::{AXES, Jacobians, LINES, Number};
use nalgebra::{SMatrix, SVector};

/// Torques about the nine axes of the arm, N·m.
pub type Torques = SVector<f64, AXES>;
/// Forces along the lines of action, N; 0 for lines that the arm does not have.
pub type Forces = SVector<f64, LINES>;
/// Wrench at the hand: three components of force, N, then three of torque, N·m.
pub type WrenchVector = SVector<f64, 6>;

/// Matrices of the arm in one posture, which convert muscle forces to joint torques, and joint
/// torques to a wrench at the hand.
#[derive(Clone, Debug)]
pub struct PostureMatrices {
    /// Matrix R of moment arms, m: the torque about each axis (row) per newton along each line
    /// (column).
    pub levers: SMatrix<f64, AXES, LINES>,
    /// Matrix J_armᵀ, which converts a wrench at the hand to the joint torques that exert it.
    pub arm: SMatrix<f64, AXES, 6>,
    /// Matrix (J_arm·J_armᵀ)⁻¹·J_arm, which converts joint torques to the wrench that needs the
    /// nearest torques.
    pub given: SMatrix<f64, 6, AXES>,
}

impl PostureMatrices {
    /// Computes the matrices from the Jacobians that the device's own code computes, in any type of
    /// number.
    ///
    /// # Errors
    /// [`RecruitmentError::Singular`] if the arm exerts some wrench without any torque in this
    /// posture.
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

    /// Returns the joint torques that exert a wrench at the hand, N·m.
    #[must_use]
    pub fn torques(&self, wrench: &WrenchVector) -> Torques {
        self.arm * wrench
    }

    /// Returns the wrench at the hand, N and N·m, while the muscles pull along their lines with
    /// `forces`, N.
    ///
    /// The arm has nine axes but the hand only six degrees of freedom, so three motions of the arm
    /// leave the hand in place. The support of the arm takes up torques that would cause these
    /// motions. This function returns the wrench whose torques are nearest to those of the muscles.
    /// A clamped arm with its own stiffnesses would exert another wrench.
    #[must_use]
    pub fn wrench(&self, forces: &Forces) -> WrenchVector {
        self.given * (self.levers * forces)
    }
}
