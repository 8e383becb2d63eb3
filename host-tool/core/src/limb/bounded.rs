//! Least squares with bounds: minimises a strictly convex quadratic in a box.
//!
//! The algebra uses nalgebra's Cholesky decomposition. Crates that solve the whole problem were
//! tried on 200 such problems of ten unknowns: `nnls` 0.5 (upper bounds by its least-distance form)
//! ends the program where two unknowns meet their bounds at once, and `clarabel` 0.11 takes longer
//! than a recruitment may. Tests compare this implementation with `nnls`.

use super::RecruitmentError;
use firmware::limb::LINES;
use nalgebra::{SMatrix, SVector};

/// Square matrix with one row and one column for each line of action.
pub(super) type Square = SMatrix<f64, LINES, LINES>;
type Column = SVector<f64, LINES>;

/// Maximum number of iterations. A problem that has a solution needs about as many as there are
/// unknowns between their bounds.
const MOST_TURNS: usize = 40 * LINES;

/// Bounded quadratic problem: minimise ½·xᵀ·H·x − cᵀ·x with 0 ≤ x ≤ `upper`.
#[derive(Clone, Debug)]
pub struct Bounded {
    /// Matrix H, symmetric and positive definite.
    pub curvature: SMatrix<f64, LINES, LINES>,
    /// Vector c of the linear term.
    pub slope: SVector<f64, LINES>,
    /// Upper bound of each unknown, 0 or more. An unknown whose bound is 0 stays at 0.
    pub upper: SVector<f64, LINES>,
}

/// State of an unknown: at its lower bound, free between the bounds, or at its upper bound.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum BoundState {
    Lower,
    Free,
    Upper,
}

impl Bounded {
    /// Returns the unique minimum. Each iteration releases from its bound the unknown that lowers
    /// the objective most, and then moves towards the minimum until an unknown meets a bound (Stark
    /// & Parker 1995, "Bounded-variable least squares", applied to the normal equations).
    ///
    /// # Errors
    /// [`RecruitmentError::NotConverged`]: the matrix H is not positive definite, or an input is
    /// not a finite number.
    pub fn solve(&self) -> Result<SVector<f64, LINES>, RecruitmentError> {
        let mut numbers = self.curvature.iter().chain(&self.slope).chain(&self.upper);
        if !numbers.all(|number| number.is_finite()) {
            return Err(RecruitmentError::NotConverged);
        }
        let mut places = [BoundState::Lower; LINES];
        let mut x = Column::zeros();
        // Half of the resolution of the gradient in 16 digits.
        let still = 1e-13 * self.slope.amax();
        for _ in 0..MOST_TURNS {
            let Some(freed) = self.bound_to_release(&x, &places, still) else {
                return Ok(x);
            };
            places[freed] = BoundState::Free;
            self.move_to_minimum(&mut x, &mut places)?;
        }
        Err(RecruitmentError::NotConverged)
    }

    /// Returns the index of the unknown whose release from its bound would lower the objective
    /// most, or `None` at the minimum. `still` is the size of a gradient that counts as 0.
    fn bound_to_release(
        &self,
        x: &Column,
        places: &[BoundState; LINES],
        still: f64,
    ) -> Option<usize> {
        let gradient = self.curvature * x - self.slope;
        let gain = |n: usize| {
            let along = gradient[n];
            let is_held = self.upper[n] > 0.0
                && match places[n] {
                    BoundState::Lower => along < -still,
                    BoundState::Upper => along > still,
                    BoundState::Free => false,
                };
            is_held.then(|| along * along / self.curvature[(n, n)])
        };
        let gains = (0..LINES).filter_map(|n| Some((n, gain(n)?)));
        let most = gains.max_by(|a, b| a.1.total_cmp(&b.1));
        most.map(|(n, _)| n)
    }

    /// Moves `x` to the minimum over the free unknowns. An unknown that meets a bound on the way
    /// stays at this bound.
    fn move_to_minimum(
        &self,
        x: &mut Column,
        places: &mut [BoundState; LINES],
    ) -> Result<(), RecruitmentError> {
        for _ in 0..=LINES {
            let goal = self.free_minimum(x, places)?;
            let mut share = 1.0;
            let mut met = None;
            for n in (0..LINES).filter(|&n| places[n] == BoundState::Free) {
                let (bound, place) = match goal[n] {
                    below if below < 0.0 => (0.0, BoundState::Lower),
                    above if above > self.upper[n] => (self.upper[n], BoundState::Upper),
                    _ => continue,
                };
                let reached = (bound - x[n]) / (goal[n] - x[n]);
                if met.is_none() || reached < share {
                    (share, met) = (reached.clamp(0.0, 1.0), Some((n, bound, place)));
                }
            }
            *x += (goal - *x) * share;
            let Some((n, bound, place)) = met else {
                return Ok(());
            };
            (x[n], places[n]) = (bound, place);
        }
        Ok(())
    }

    /// Returns the minimum over the free unknowns, without regard to bounds, while the other
    /// unknowns keep their values.
    fn free_minimum(
        &self,
        x: &Column,
        places: &[BoundState; LINES],
    ) -> Result<Column, RecruitmentError> {
        let is_free = |n: usize| places[n] == BoundState::Free;
        let system = Square::from_fn(|i, j| match is_free(i) && is_free(j) {
            true => self.curvature[(i, j)],
            false => f64::from(u8::from(i == j)),
        });
        let held = Column::from_fn(|n, _| if is_free(n) { 0.0 } else { x[n] });
        let pull = self.slope - self.curvature * held;
        let right = Column::from_fn(|n, _| if is_free(n) { pull[n] } else { x[n] });
        let factor = system.cholesky().ok_or(RecruitmentError::NotConverged)?;
        Ok(factor.solve(&right))
    }
}
