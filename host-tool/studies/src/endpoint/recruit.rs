//! From a wanted wrench to forces of muscles: the paper's nearest neighbour, and bounded
//! least squares.
//!
//! Algorithm 1 with its misprints mended: line 11 takes the torque wanted of this joint,
//! not of all; where no muscle helps, none is chosen.

use super::limb::{JOINTS, Limb};
use hal_sim::body::arm::ELECTRODES;
use nalgebra::Vector3;

/// A way to share a wanted wrench out among muscles. Anything that has it can be studied.
pub trait Recruits: Sync {
    /// Force of each muscle, N, none negative, for this wrench at the cuff (N, N m).
    fn forces_n(&self, limb: &Limb, wrench: &[f64; 6]) -> [f64; ELECTRODES];
}

/// Algorithm 1: of each joint's muscles the one that turns nearest to what is wanted.
#[derive(Clone, Copy, Debug, Default)]
pub struct NearestNeighbour;

impl Recruits for NearestNeighbour {
    fn forces_n(&self, limb: &Limb, wrench: &[f64; 6]) -> [f64; ELECTRODES] {
        let (arms, wanted) = (limb.arms_m(), limb.frame.torques(wrench));
        let mut forces = [0.0; ELECTRODES];
        for (joint, torque) in wanted.iter().enumerate() {
            let of_joint = limb.actions.iter().enumerate();
            let of_joint = of_joint.filter(|(_, it)| it.joint == joint);
            let along = of_joint.map(|(at, _)| (at, torque.dot(&arms[at].normalize())));
            // The first of equals, as an argmax that walks upwards has it.
            let best = along.fold(None, |best: Option<(usize, f64)>, next| match best {
                Some(best) if best.1 >= next.1 => Some(best),
                _ => Some(next),
            });
            if let Some((at, along)) = best.filter(|(_, along)| *along > 0.0) {
                forces[at] = along / arms[at].norm();
            }
        }
        forces
    }
}

/// Bounded least squares per joint: the torques of all muscles of a joint, each force
/// between 0 and what its greatest current gives, against the wanted torque.
#[derive(Clone, Copy, Debug)]
pub struct LeastSquares {
    /// Cost of force, m.
    pub ridge_m: f64,
}

/// Rounds of coordinate descent. The problem is strictly convex and has nine unknowns;
/// `least_squares_meets_its_conditions` holds it to its optimality conditions.
const ROUNDS: usize = 4_000;

impl Recruits for LeastSquares {
    fn forces_n(&self, limb: &Limb, wrench: &[f64; 6]) -> [f64; ELECTRODES] {
        let (arms, wanted) = (limb.arms_m(), limb.frame.torques(wrench));
        let most = limb.greatest_n();
        let mut forces = [0.0; ELECTRODES];
        for (joint, torque) in wanted.iter().enumerate() {
            let members: Vec<usize> = (0..ELECTRODES)
                .filter(|at| limb.actions[*at].joint == joint)
                .collect();
            let mut left: Vector3<f64> = *torque;
            for _ in 0..ROUNDS {
                let mut moved = 0.0_f64;
                for &at in &members {
                    let whole = arms[at].norm_squared() + self.ridge_m * self.ridge_m;
                    let without = left + forces[at] * arms[at];
                    let next = (without.dot(&arms[at]) / whole).clamp(0.0, most[at]);
                    moved = moved.max((next - forces[at]).abs());
                    left = without - next * arms[at];
                    forces[at] = next;
                }
                if moved < 1e-12 {
                    break;
                }
            }
        }
        forces
    }
}

/// The size of a wrench along `direction` (a force, N) at which the first muscle at
/// shoulder or elbow that the nearest neighbour takes is at its greatest current; of a
/// direction that only the girdle helps, there; zero where nothing helps.
#[must_use]
pub fn reachable_n(limb: &Limb, direction: &[f64; 3]) -> f64 {
    let [x, y, z] = *direction;
    let forces = NearestNeighbour.forces_n(limb, &[x, y, z, 0.0, 0.0, 0.0]);
    let most = limb.greatest_n();
    let size = |girdle: bool| {
        let all = (0..ELECTRODES).filter(|at| forces[*at] > 0.0);
        let all = all.filter(|at| (limb.actions[*at].joint == 0) == girdle);
        all.map(|at| most[at] / forces[at])
            .fold(f64::INFINITY, f64::min)
    };
    let [arm, girdle] = [false, true].map(size);
    match (arm.is_finite(), girdle.is_finite()) {
        (true, _) => arm,
        (_, true) => girdle,
        _ => 0.0,
    }
}

/// How smoothly currents follow as the wanted direction goes around three great circles in
/// steps of a degree.
#[derive(Clone, Copy, Debug, PartialEq, Default, serde::Serialize)]
pub struct Switches {
    /// Steps in which some channel changed by more than the jump.
    pub jumps: usize,
    /// Greatest change of a channel in one step, as a part of its range.
    pub greatest: f64,
}

/// The same of `recruits`, with a force of `size_n`; a jump is `jump` of a range.
pub fn switches(recruits: &dyn Recruits, limb: &Limb, size_n: f64, jump: f64) -> Switches {
    let mut all = Switches::default();
    for [first, second] in [[0, 1], [1, 2], [2, 0]] {
        let parts = |deg: u32| {
            let (sine, cosine) = f64::from(deg).to_radians().sin_cos();
            let mut wrench = [0.0; 6];
            (wrench[first], wrench[second]) = (size_n * cosine, size_n * sine);
            let forces = recruits.forces_n(limb, &wrench);
            let most = limb.greatest_n();
            let part = |at: usize| (forces[at] / most[at]).min(1.0);
            std::array::from_fn::<f64, ELECTRODES, _>(part)
        };
        let mut before = parts(0);
        for deg in 1..=360 {
            let now = parts(deg);
            let change = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
            let change = change.fold(0.0, f64::max);
            all.jumps += usize::from(change > jump);
            all.greatest = all.greatest.max(change);
            before = now;
        }
    }
    all
}

/// Joint torques of all muscles at these forces, N m.
#[must_use]
pub fn torques(limb: &Limb, forces_n: &[f64; ELECTRODES]) -> [Vector3<f64>; JOINTS] {
    let mut all = [Vector3::zeros(); JOINTS];
    for ((action, arm), force) in limb.actions.iter().zip(limb.arms_m()).zip(forces_n) {
        all[action.joint] += *force * arm;
    }
    all
}
