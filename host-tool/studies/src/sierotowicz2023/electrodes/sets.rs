//! Computes the error of every set of electrodes for a reference force.

use super::declaration::Study;
use super::wearer::{MUSCLES, Wearer, directions};
use crate::limb::{choices, forces_of_choices};
use crate::sierotowicz2023::{EndpointError, turned};
use firmware::limb::{Jacobians, Limb, Vector};
use host_core::limb::{Bounded, Exact, RecruitmentError};
use nalgebra::{SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

/// Number of sets of electrodes; bit `n` of a set stands for electrode `n`.
pub const SETS: usize = 1 << MUSCLES.len();
/// Recruitment methods, in the order of all results.
pub const METHODS: [&str; 2] = ["squares", "nearest"];
/// Number that is added to the diagonal of the least squares problem so that its minimum is unique,
/// as a fraction of its largest element. It changes a force by a millionth.
const RIDGE: f64 = 1e-6;
/// Relative error below which no further electrode is tried.
const NOTHING: f64 = 1e-4;

/// Relative errors of one wearer by method, reference force and set of electrodes. The reference
/// forces are sorted by magnitude, then by direction.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MissedForce(pub [Vec<Vec<f32>>; METHODS.len()]);

/// Returns the relative error of the force `wanted` with least squares over each set of electrodes.
/// `forces_n` are the full forces of the electrodes.
///
/// # Errors
/// Returns E706 if a force is not finite.
pub fn squares(
    forces_n: &[Vector3<f64>; MUSCLES.len()],
    wanted: Vector3<f64>,
) -> Result<Vec<f32>, EndpointError> {
    let columns = SMatrix::<f64, 3, { MUSCLES.len() }>::from_columns(forces_n);
    let mut curvature = columns.transpose() * columns;
    let ridge = RIDGE * curvature.diagonal().amax();
    for at in 0..MUSCLES.len() {
        curvature[(at, at)] += ridge;
    }
    let slope = columns.transpose() * wanted;
    let size = wanted.norm();
    let mut left = vec![wanted; SETS];
    for set in 1..SETS {
        let members = (0..MUSCLES.len()).filter(|at| set >> at & 1 == 1);
        // An electrode that does not pull towards the residual adds nothing: the optimum without it
        // stays optimal (conditions of a minimum).
        let same = members
            .map(|at| (at, left[set ^ (1 << at)]))
            .find(|(at, rest)| rest.norm() < NOTHING * size || forces_n[*at].dot(rest) <= 0.0);
        left[set] = match same {
            Some((_, rest)) => rest,
            None => {
                let upper = SVector::from_fn(|at, _| f64::from(u8::from(set >> at & 1 == 1)));
                let problem = Bounded {
                    curvature,
                    slope,
                    upper,
                };
                wanted - columns * problem.solve()?
            }
        };
    }
    Ok(left
        .iter()
        .map(|vector| (vector.norm() / size) as f32)
        .collect())
}

/// Returns the relative error of the nearest neighbour method for each reference force with the
/// electrodes of `set` only.
fn nearest(
    wearer: &Wearer,
    set: usize,
    wanted: &[Vector3<f64>],
) -> Result<Vec<f32>, EndpointError> {
    let mut spec = wearer.limb.clone();
    spec.lines
        .retain(|line_spec| set >> line_spec.channel & 1 == 1);
    let wrong = |error: &dyn std::fmt::Display| RecruitmentError::Spec(vec![error.to_string()]);
    let limb = Limb::<Exact>::new(&spec).map_err(|limb_error| wrong(&limb_error))?;
    let jacobians: Jacobians<Exact> = limb
        .jacobians_at_posture(&wearer.posture)
        .map_err(RecruitmentError::from)?;
    // Forces are in the order of lines.
    let own: Vec<(Vector3<f64>, f64)> = spec
        .lines
        .iter()
        .zip(limb.max_forces())
        .map(|(line, Exact(most))| (wearer.forces_n[usize::from(line.channel)], most))
        .collect();
    let part = |wanted_n: &Vector3<f64>| {
        let [x, y, z] = turned((*wanted_n).into()).map(Exact);
        let forces = forces_of_choices(choices(&jacobians, Vector::new(x, y, z)));
        let pulls = own.iter().zip(&forces);
        let given = pulls.map(|((full_n, most), force)| full_n * (force / most).min(1.0));
        ((given.sum::<Vector3<f64>>() - wanted_n).norm() / wanted_n.norm()) as f32
    };
    Ok(wanted.iter().map(part).collect())
}

/// Lists the reference forces: each magnitude in each direction, N.
fn wanted_forces(study: &Study) -> Vec<Vector3<f64>> {
    let sizes = study.wanted.sizes_n.iter();
    sizes
        .flat_map(|size| directions().map(|directions| *size * directions))
        .collect()
}

/// Computes the relative error of every set of this wearer's electrodes for every reference force.
///
/// # Errors
/// Returns E700 to E706 if the device refuses the arm.
pub fn missed_forces(study: &Study, wearer: &Wearer) -> Result<MissedForce, EndpointError> {
    let wanted = wanted_forces(study);
    let by_squares = wanted
        .iter()
        .map(|vector| squares(&wearer.forces_n, *vector))
        .collect::<Result<_, _>>()?;
    let mut by_nearest = vec![vec![1.0; SETS]; wanted.len()];
    for set in 1..SETS {
        for (to, part) in by_nearest.iter_mut().zip(nearest(wearer, set, &wanted)?) {
            to[set] = part;
        }
    }
    Ok(MissedForce([by_squares, by_nearest]))
}

/// Returns the set of `count` electrodes with the smallest error in `parts`, which has one error
/// for each set; the first one in case of a tie.
#[must_use]
pub fn best(parts: &[f32], count: u32) -> usize {
    let sets = (0..parts.len()).filter(|set| set.count_ones() == count);
    sets.min_by(|a, b| parts[*a].total_cmp(&parts[*b]))
        .unwrap_or(0)
}

impl MissedForce {
    /// Returns for each set the mean relative error over all reference forces under method
    /// `method`.
    #[must_use]
    pub fn mean_by_set(&self, method: usize) -> Vec<f32> {
        let all = &self.0[method];
        let mean =
            |set: usize| all.iter().map(|values| values[set]).sum::<f32>() / all.len() as f32;
        (0..SETS).map(mean).collect()
    }
}
