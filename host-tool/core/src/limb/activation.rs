//! Static optimisation: finds the smallest activations that give wanted torques.

use nalgebra::{SMatrix, SVector};

/// Maximum number of iterations; beyond, a torque counts as out of reach.
const MOST_ROUNDS: usize = 500;
/// Largest error of the torque, as a share of the wanted torque plus 1 N·m.
const MISSED: f64 = 1e-11;

/// Error for torques that no activations can give (E761).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "E761 no activations between their lower bounds and 1 give the torques {wanted_nm:?} N·m \
     about these joints (smallest error {missed_nm:.3} N·m): use a lighter object, a slower lift \
     or less co-contraction"
)]
pub struct OutOfReach {
    /// Wanted torque about each joint, N·m.
    pub wanted_nm: Vec<f64>,
    /// Magnitude of the torque error after the last iteration, N·m.
    pub missed_nm: f64,
}

/// Muscles that act about `J` joints in one posture.
#[derive(Clone, Debug, PartialEq)]
pub struct Muscles<const J: usize> {
    /// Torque of each muscle about each joint at full activation, N·m: force at this length and
    /// speed times moment arm.
    pub full_nm: Vec<[f64; J]>,
    /// Lower bound of each muscle's activation, 0 to 1.
    pub least: Vec<f64>,
}

impl<const J: usize> Muscles<J> {
    /// Returns the same muscles with active antagonists. A muscle that turns a joint against the
    /// wanted torque gets at least `share` (0 to 1) of the common activation that all agonists of
    /// that joint would need.
    #[must_use]
    pub fn with_co_contraction(mut self, share: f64, wanted_nm: [f64; J]) -> Self {
        for joint in 0..J {
            let along = |of: &[f64; J]| of[joint] * wanted_nm[joint].signum();
            let agonists: f64 = self
                .full_nm
                .iter()
                .map(|full_nm| along(full_nm).max(0.0))
                .sum();
            if agonists <= 0.0 {
                continue;
            }
            let effort = (wanted_nm[joint].abs() / agonists).min(1.0);
            // A muscle counts against a joint by the share of its torque that acts there.
            for (of, least) in self.full_nm.iter().zip(&mut self.least) {
                let size = of.iter().map(|value| value.abs()).sum::<f64>();
                if along(of) < 0.0 {
                    let part = -along(of) / size;
                    *least = least.max((share * effort * part).min(1.0));
                }
            }
        }
        self
    }

    /// Returns the activations k with the smallest Σ k² for which Σ k·`full_nm` = `wanted_nm` and
    /// each k is between its lower bound and 1 (Buatier de Mongeot, equations 1 and 2;
    /// Crowninshield and Brand 1981).
    ///
    /// The dual problem has `J` unknowns λ, with k = clamp(`full_nm`·λ). It is maximised by Newton
    /// steps over the muscles between their bounds or, where those do not increase it, by steps
    /// over all muscles, which always do.
    ///
    /// # Errors
    /// [`OutOfReach`] if no activations give the torques.
    pub fn activations(&self, wanted_nm: [f64; J]) -> Result<Vec<f64>, OutOfReach> {
        let rows: Vec<SVector<f64, J>> = self
            .full_nm
            .iter()
            .map(|full_nm| (*full_nm).into())
            .collect();
        let wanted = SVector::from(wanted_nm);
        let mut dual = SVector::<f64, J>::zeros();
        let all = rows.iter().map(|row| row * row.transpose());
        let all: SMatrix<f64, J, J> = all.sum();
        let mut missed = f64::INFINITY;
        for _ in 0..MOST_ROUNDS {
            let left = wanted - self.torques_for(&rows, &dual);
            missed = left.norm();
            if missed <= MISSED * (1.0 + wanted.norm()) {
                let each = rows.iter().zip(&self.least);
                return Ok(each
                    .map(|(row, least)| clamped(row.dot(&dual), *least))
                    .collect());
            }
            let Some(next) = self.step_dual(&rows, &wanted, (&dual, &left), &all) else {
                break;
            };
            dual = next;
        }
        Err(OutOfReach {
            wanted_nm: wanted_nm.to_vec(),
            missed_nm: missed,
        })
    }

    /// Returns the dual variables after one step; `None` if the step cannot be computed.
    fn step_dual(
        &self,
        rows: &[SVector<f64, J>],
        wanted: &SVector<f64, J>,
        (dual, left): (&SVector<f64, J>, &SVector<f64, J>),
        all: &SMatrix<f64, J, J>,
    ) -> Option<SVector<f64, J>> {
        let each = rows.iter().zip(&self.least);
        let is_free = |(row, least): &(&SVector<f64, J>, &f64)| {
            let drive = row.dot(dual);
            drive > **least && drive < 1.0
        };
        let free = each.filter(is_free).map(|(row, _)| row * row.transpose());
        let free: SMatrix<f64, J, J> = free.sum();
        let newton = free.cholesky().map(|factor| dual + factor.solve(left));
        let height = |dual: &SVector<f64, J>| self.dual_objective(rows, wanted, dual);
        let before = height(dual);
        let climbs = |s_vector: &SVector<f64, J>| height(s_vector) > before;
        let newton =
            newton.filter(|vector| vector.iter().all(|value| value.is_finite()) && climbs(vector));
        newton.or_else(|| Some(dual + all.cholesky()?.solve(left)))
    }

    fn torques_for(&self, rows: &[SVector<f64, J>], dual: &SVector<f64, J>) -> SVector<f64, J> {
        let each = rows.iter().zip(&self.least);
        each.map(|(row, least)| row * clamped(row.dot(dual), *least))
            .sum()
    }

    /// Returns the value of the dual objective.
    fn dual_objective(
        &self,
        rows: &[SVector<f64, J>],
        wanted: &SVector<f64, J>,
        dual: &SVector<f64, J>,
    ) -> f64 {
        let cost = |(row, least): (&SVector<f64, J>, &f64)| {
            let (drive, held) = (row.dot(dual), clamped(row.dot(dual), *least));
            held * (drive - 0.5 * held)
        };
        wanted.dot(dual) - rows.iter().zip(&self.least).map(cost).sum::<f64>()
    }
}

fn clamped(drive: f64, least: f64) -> f64 {
    drive.max(least).min(1.0)
}
