//! What every set of electrodes misses of a wanted force.

use super::declaration::Study;
use super::wearer::{MUSCLES, Wearer, directions};
use crate::limb::{choices, forces_of_choices};
use crate::sierotowicz2023::{EndpointError, turned};
use firmware::limb::{Jacobians, Limb, Vector};
use host_core::limb::{Bounded, Exact, RecruitmentError};
use nalgebra::{SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

/// Sets of electrodes: bit `n` is electrode `n`.
pub const SETS: usize = 1 << MUSCLES.len();
/// Ways to recruit, in order.
pub const METHODS: [&str; 2] = ["squares", "nearest"];
/// Curvature that is added to make a minimum the only one, as a part of the largest: costs a
/// millionth of a force.
const RIDGE: f64 = 1e-6;
/// Part missed below which nothing is to be gained.
const NOTHING: f64 = 1e-4;

/// Of one wearer, by each method, of each wanted force (sizes, then directions): the part of
/// it that each set misses.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MissedForce(pub [Vec<Vec<f32>>; METHODS.len()]);

/// Parts of `wanted_forces` that least squares over each set of these forces miss.
///
/// # Errors
/// E706: what is no number.
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
        // One that does not pull towards what is left adds nothing: what is best without it
        // stays best (the conditions of a minimum).
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

/// What the nearest neighbour makes of each wanted force with these lines only.
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

/// What is wanted: each size in each direction, N.
fn wanted_forces(study: &Study) -> Vec<Vector3<f64>> {
    let sizes = study.wanted.sizes_n.iter();
    sizes
        .flat_map(|size| directions().map(|directions| *size * directions))
        .collect()
}

/// What every set of this wearer's electrodes misses.
///
/// # Errors
/// E700 to E706: an arm that the device refuses.
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

/// The set of `count` electrodes that misses least, the first of equals.
#[must_use]
pub fn best(parts: &[f32], count: u32) -> usize {
    let sets = (0..parts.len()).filter(|set| set.count_ones() == count);
    sets.min_by(|a, b| parts[*a].total_cmp(&parts[*b]))
        .unwrap_or(0)
}

impl MissedForce {
    /// The mean over all wanted forces of what each set misses by method `method`.
    #[must_use]
    pub fn mean_by_set(&self, method: usize) -> Vec<f32> {
        let all = &self.0[method];
        let mean =
            |set: usize| all.iter().map(|values| values[set]).sum::<f32>() / all.len() as f32;
        (0..SETS).map(mean).collect()
    }
}
