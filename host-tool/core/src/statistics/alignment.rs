//! Finds the rotation that aligns one set of points best with another.

use super::sample::{StatisticsError, check_count, check_equal_length, check_finite};
use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};

/// Rotation followed by a translation, which maps one set of points onto another: `to ≈ rotation ·
/// from + translation`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Alignment {
    /// Rows of the rotation matrix, whose determinant is +1.
    pub rotation: [[f64; 3]; 3],
    /// Translation, in the points' unit.
    pub translation: [f64; 3],
    /// Root mean square of the distances that remain between corresponding points, in the points'
    /// unit.
    pub rmsd: f64,
}

/// Smallest allowed difference between the two largest eigenvalues of Horn's matrix, relative to
/// the largest. With a smaller difference, the best rotation is not unique. The rounding error of
/// the rotation is about 1e-14 divided by this difference.
const LEAST_GAP: f64 = 1e-5;

/// Returns the rotation and translation that map `from` onto `to`, point by point, with the
/// smallest root mean square distance. For mirror images it returns the best rotation, never a
/// reflection (Kabsch 1976 and 1978). The rotation is found as a quaternion (Horn 1987, eq. 25 and
/// section 4), because nalgebra's singular values are not always correct to ten digits.
///
/// # Errors
/// Fewer than three points, unequal lengths, values that are not finite, points on a line, or
/// points for which several rotations are equally good.
pub fn kabsch(from: &[[f64; 3]], to: &[[f64; 3]]) -> Result<Alignment, StatisticsError> {
    check_count("points", from.len(), 3)?;
    check_equal_length("second set of points", to.len(), from.len())?;
    check_finite("points", from.iter().flatten())?;
    check_finite("second set of points", to.iter().flatten())?;
    let (from_centre, to_centre) = (centre(from), centre(to));
    let mut products = Matrix3::zeros();
    for (a, b) in from.iter().zip(to) {
        products += (Vector3::from(*a) - from_centre) * (Vector3::from(*b) - to_centre).transpose();
    }
    let rotation = best_rotation(&products)?;
    let translation = to_centre - rotation * from_centre;
    let distance = |(a, b): (&[f64; 3], &[f64; 3])| {
        (rotation * Vector3::from(*a) + translation - Vector3::from(*b)).norm_squared()
    };
    let squares: f64 = from.iter().zip(to).map(distance).sum();
    Ok(Alignment {
        rotation: rotation.transpose().into(),
        translation: translation.into(),
        rmsd: (squares / from.len() as f64).sqrt(),
    })
}

/// Returns the rotation R with the largest tr(R·`products`). It is the quaternion that is the
/// eigenvector of the largest eigenvalue of Horn's matrix. `products` is the sum of products of
/// corresponding centred points.
fn best_rotation(products: &Matrix3<f64>) -> Result<Matrix3<f64>, StatisticsError> {
    let turned = products - products.transpose();
    let axis = Vector3::new(turned[(1, 2)], turned[(2, 0)], turned[(0, 1)]);
    let trace = products.trace();
    let symmetric = products + products.transpose() - Matrix3::from_diagonal_element(trace);
    let mut horn = Matrix4::zeros();
    horn[(0, 0)] = trace;
    horn.fixed_view_mut::<3, 1>(1, 0).copy_from(&axis);
    horn.fixed_view_mut::<1, 3>(0, 1)
        .copy_from(&axis.transpose());
    horn.fixed_view_mut::<3, 3>(1, 1).copy_from(&symmetric);
    let eigen = horn.symmetric_eigen();
    let best = eigen.eigenvalues.imax();
    let others = (0..4).filter(|other| *other != best);
    let next = others
        .map(|i| eigen.eigenvalues[i])
        .fold(f64::MIN, f64::max);
    let largest = eigen.eigenvalues[best];
    if largest <= 0.0 || largest - next <= LEAST_GAP * largest {
        return Err(StatisticsError::NoVariance {
            what: "the directions of the points",
        });
    }
    let [w, i, j, k] = eigen.eigenvectors.column(best).into_owned().into();
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    Ok(turn.to_rotation_matrix().into_inner())
}

/// Returns the mean of the points; there must be at least one.
fn centre(points: &[[f64; 3]]) -> Vector3<f64> {
    let sum: Vector3<f64> = points.iter().map(|point| Vector3::from(*point)).sum();
    sum / points.len() as f64
}
