//! Inverse and eigenvalues of symmetric positive definite matrices with at most seven rows.
//!
//! The project has its own implementation because a segment needs several of each and may take a
//! few microseconds altogether: nothing here allocates, and a good guess of the eigenvectors saves
//! most of the work.

/// Maximum number of rows and columns: one for each electrode of a network.
pub const SIZE: usize = 7;
/// One value per electrode; entries beyond the last electrode are 0.
pub type Vector = [f64; SIZE];
/// A matrix as rows of `Vector`s.
pub type Matrix = [Vector; SIZE];

/// Maximum number of sweeps of Jacobi's method; seven rows take about six.
const SWEEPS: usize = 40;
/// Largest off-diagonal entry, relative to the geometric mean of the two diagonal entries, that
/// changes no eigenvalue by more than rounding does.
const NEGLIGIBLE: f64 = 1e-16;

pub fn identity() -> Matrix {
    let mut out = [[0.0; SIZE]; SIZE];
    out.iter_mut().enumerate().for_each(|(k, row)| row[k] = 1.0);
    out
}

pub fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns the inverse of the first `rows` rows and columns by Gauss-Jordan elimination without
/// pivoting, which positive definite matrices do not need. Returns `None` if the matrix is not
/// positive definite.
pub fn inverse(mut a: Matrix, rows: usize) -> Option<Matrix> {
    for k in 0..rows {
        let pivot = a[k][k];
        // Written so that a NaN pivot fails too.
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        a[k][k] = 1.0;
        a[k].iter_mut().for_each(|value| *value /= pivot);
        let row = a[k];
        for (_, other) in (0..rows).zip(a.iter_mut()).filter(|(i, _)| *i != k) {
            let factor = std::mem::take(&mut other[k]);
            let pairs = other.iter_mut().zip(row);
            pairs.for_each(|(value, by)| *value -= factor * by);
        }
    }
    Some(a)
}

/// Returns the eigenvalues of the first `rows` rows and columns, unordered, by Jacobi's cyclic
/// method, which finds small eigenvalues as accurately as large ones (Demmel & Veselić 1992). The
/// rows of `basis` must be orthonormal and become the eigenvectors; a better guess converges
/// sooner. Returns `None` if the method does not converge.
pub fn eigen(a: &Matrix, basis: &mut Matrix, rows: usize) -> Option<Vector> {
    let mut a = change_basis(a, basis, rows);
    for _ in 0..SWEEPS {
        let mut is_diagonal = true;
        for p in 0..rows {
            for q in p + 1..rows {
                if a[p][q] * a[p][q] > NEGLIGIBLE * NEGLIGIBLE * a[p][p] * a[q][q] {
                    is_diagonal = false;
                    rotate(&mut a, basis, rows, [p, q])?;
                }
            }
        }
        if is_diagonal {
            return Some(std::array::from_fn(|k| a[k][k]));
        }
    }
    None
}

/// Returns the matrix in the coordinates of the vectors of `basis`.
fn change_basis(a: &Matrix, basis: &Matrix, rows: usize) -> Matrix {
    let mut out = [[0.0; SIZE]; SIZE];
    for (k, row) in basis[..rows].iter().enumerate() {
        let mut product = [0.0; SIZE];
        for (factor, a) in row[..rows].iter().zip(a) {
            let pairs = product.iter_mut().zip(a);
            pairs.for_each(|(value, a)| *value += factor * a);
        }
        for (j, other) in basis[..=k].iter().enumerate() {
            out[k][j] = dot(&product, other);
            out[j][k] = out[k][j];
        }
    }
    out
}

/// Rotates in the plane of rows `p` and `q` so that their off-diagonal entry becomes zero.
fn rotate(a: &mut Matrix, basis: &mut Matrix, rows: usize, [p, q]: [usize; 2]) -> Option<()> {
    let [first, second] = a.get_disjoint_mut([p, q]).ok()?;
    let entry = first[q];
    let (low, high) = (first[p], second[q]);
    let gap = high - low;
    let root = (gap * gap + 4.0 * entry * entry).sqrt();
    let tangent = 2.0 * entry / (gap + root.copysign(gap));
    let cosine = (1.0 + tangent * tangent).sqrt().recip();
    let sine = tangent * cosine;
    rotate_pair(first, second, cosine, sine);
    (first[p], second[q]) = (low - tangent * entry, high + tangent * entry);
    (first[q], second[p]) = (0.0, 0.0);
    let (first, second) = (*first, *second);
    for (k, row) in a[..rows].iter_mut().enumerate() {
        (row[p], row[q]) = (first[k], second[k]);
    }
    let [first, second] = basis.get_disjoint_mut([p, q]).ok()?;
    rotate_pair(first, second, cosine, sine);
    Some(())
}

fn rotate_pair(first: &mut Vector, second: &mut Vector, cosine: f64, sine: f64) {
    for (x, y) in first.iter_mut().zip(second) {
        (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    }
}
