//! Static optimisation: finds the smallest activations that give wanted torques.

use nalgebra::{SMatrix, SVector};

/// Maximum number of iterations. Torques that need more count as out of reach.
const MOST_ROUNDS: usize = 500;
/// Largest torque error of a solution, as a share of the wanted torque plus 1 N·m.
const MISSED: f64 = 1e-11;

/// Error for joint torques that no activations of the muscles can give (E761).
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

/// Muscles that act about `J` joints, with their strength and moment arms in one posture.
#[derive(Clone, Debug, PartialEq)]
pub struct Muscles<const J: usize> {
    /// Torque of each muscle about each joint at full activation, N·m: its force at the present
    /// length and speed, times its moment arm.
    pub full_nm: Vec<[f64; J]>,
    /// Smallest activation that each muscle must have, 0 to 1.
    pub least: Vec<f64>,
}

impl<const J: usize> Muscles<J> {
    /// Returns the same muscles with co-contraction: a larger `least` for the antagonists. A muscle
    /// that turns a joint against the wanted torque must have at least a part of the activation
    /// that all agonists of that joint would need in common. The part is `share` (0 to 1), times
    /// the portion of the muscle's torque that acts on this joint.
    #[must_use]
    pub fn with_co_contraction(mut self, share: f64, wanted_nm: [f64; J]) -> Self {
        for joint in 0..J {
            let along = |torques: &[f64; J]| torques[joint] * wanted_nm[joint].signum();
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
            for (muscle_torques, least) in self.full_nm.iter().zip(&mut self.least) {
                let size = muscle_torques.iter().map(|value| value.abs()).sum::<f64>();
                if along(muscle_torques) < 0.0 {
                    let part = -along(muscle_torques) / size;
                    *least = least.max((share * effort * part).min(1.0));
                }
            }
        }
        self
    }

    /// Returns the activations k with the smallest Σ k² for which the muscles give the wanted
    /// torques: Σ k·`full_nm` = `wanted_nm`, with each k between its lower bound and 1 (Buatier de
    /// Mongeot, equations 1 and 2; Crowninshield and Brand 1981).
    ///
    /// The function maximises the dual problem, which has `J` unknowns λ with k =
    /// clamp(`full_nm`·λ). It uses Newton steps over the muscles that are between their bounds.
    /// Where such a step does not increase the dual objective, it uses a step over all muscles,
    /// which always increases it.
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
        let products = rows.iter().map(|row| row * row.transpose());
        let hessian: SMatrix<f64, J, J> = products.sum();
        let mut missed = f64::INFINITY;
        for _ in 0..MOST_ROUNDS {
            let left = wanted - self.torques_for(&rows, &dual);
            missed = left.norm();
            if missed <= MISSED * (1.0 + wanted.norm()) {
                let pairs = rows.iter().zip(&self.least);
                return Ok(pairs
                    .map(|(row, least)| clamped(row.dot(&dual), *least))
                    .collect());
            }
            let Some(next) = self.step_dual(&rows, &wanted, (&dual, &left), &hessian) else {
                break;
            };
            dual = next;
        }
        Err(OutOfReach {
            wanted_nm: wanted_nm.to_vec(),
            missed_nm: missed,
        })
    }

    /// Returns the dual variables λ after one maximisation step from `dual`, where the torques
    /// still miss the wanted ones by `left`. Returns `None` if the step cannot be computed.
    fn step_dual(
        &self,
        rows: &[SVector<f64, J>],
        wanted: &SVector<f64, J>,
        (dual, left): (&SVector<f64, J>, &SVector<f64, J>),
        hessian: &SMatrix<f64, J, J>,
    ) -> Option<SVector<f64, J>> {
        let pairs = rows.iter().zip(&self.least);
        let is_free = |(row, least): &(&SVector<f64, J>, &f64)| {
            let drive = row.dot(dual);
            drive > **least && drive < 1.0
        };
        let free = pairs.filter(is_free).map(|(row, _)| row * row.transpose());
        let free: SMatrix<f64, J, J> = free.sum();
        let newton = free.cholesky().map(|factor| dual + factor.solve(left));
        let height = |dual: &SVector<f64, J>| self.dual_objective(rows, wanted, dual);
        let before = height(dual);
        let climbs = |s_vector: &SVector<f64, J>| height(s_vector) > before;
        let newton =
            newton.filter(|vector| vector.iter().all(|value| value.is_finite()) && climbs(vector));
        newton.or_else(|| Some(dual + hessian.cholesky()?.solve(left)))
    }

    fn torques_for(&self, rows: &[SVector<f64, J>], dual: &SVector<f64, J>) -> SVector<f64, J> {
        let pairs = rows.iter().zip(&self.least);
        pairs
            .map(|(row, least)| row * clamped(row.dot(dual), *least))
            .sum()
    }

    /// Returns the objective of the dual problem at `dual`, which the wanted activations maximise.
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
