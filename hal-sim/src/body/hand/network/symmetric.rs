//! Symmetric positive definite matrices of at most seven rows: inverse, eigenvalues.
//!
//! Of our own because a segment needs several of each and may take a few
//! microseconds altogether: nothing here allocates, and a good guess of the
//! eigenvectors saves the work of finding them.

/// Most rows there are.
pub const SIZE: usize = 7;
/// One number per electrode; entries beyond the last are 0.
pub type Vector = [f64; SIZE];
/// Rows of `Vector`s.
pub type Matrix = [Vector; SIZE];

/// Sweeps of Jacobi's method before it is given up; seven rows take about six.
const SWEEPS: usize = 40;
/// Part of the geometric mean of two diagonal entries: an entry between them as small
/// as this moves no eigenvalue by more than rounding does.
const NEGLIGIBLE: f64 = 1e-16;

/// One on the diagonal.
pub fn identity() -> Matrix {
    let mut out = [[0.0; SIZE]; SIZE];
    out.iter_mut().enumerate().for_each(|(k, row)| row[k] = 1.0);
    out
}

/// Sum of products.
pub fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Inverse of the first `rows` rows and columns, by Gauss and Jordan without a
/// search for pivots, which positive definite matrices do not need. `None` if the
/// matrix is not positive definite.
pub fn inverse(mut a: Matrix, rows: usize) -> Option<Matrix> {
    for k in 0..rows {
        let pivot = a[k][k];
        // So written that a pivot which is not a number fails too.
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

/// Eigenvalues of the first `rows` rows and columns, in no order; the rows of `basis`
/// become their orthonormal eigenvectors and were orthonormal before, the better
/// guessed the sooner it is done. Jacobi's cyclic method, which finds small
/// eigenvalues as exactly as large ones (Demmel & Veselić 1992). `None` if it does not
/// end.
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

/// The matrix as the vectors of `basis` see it.
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

/// The rotation in the plane of rows `p` and `q` that makes their entry zero.
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
