//! Compares the recruitment methods on random arms: their force errors, and how abruptly they
//! switch muscles.

use super::arms::random_arm;
use super::declared::LimbDeclaration;
use super::method::{Arm, Method, Recruiter};
use super::numbers::{Spread, distance};
use host_core::limb::RecruitmentError;
use rayon::prelude::*;
use serde::Serialize;

/// Force errors of one recruitment method on one arm, and how abruptly it switches muscles. On a
/// walk, the reference force turns in steps once around a circle in a plane.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ArmScore {
    pub method: Method,
    /// Rms error of the force at the hand over the independent reference forces, % of each
    /// reference force.
    pub targets_rmse_percent: f64,
    /// Largest change of any line's force from one step of a walk to the next, % of the line's
    /// largest force.
    pub largest_step_percent: f64,
    /// Mean number of times per walk that a line of muscle starts or stops pulling.
    pub switches: f64,
    /// Rms error of the force at the hand along the walks, % of the reference force, if the forces
    /// are computed anew at every step.
    pub walk_rmse_percent: f64,
    /// Rms error of the force at the hand along the walks, % of the reference force, if the forces
    /// are kept for the declared number of steps before they are computed again.
    pub held_rmse_percent: f64,
}

/// Scores of all methods on one arm, in the order of [`Method::ALL`].
pub type ArmScores = [ArmScore; 3];

/// Scores every method on every random arm of the declaration.
///
/// # Errors
/// Returns [`RecruitmentError`] if an arm is refused.
pub fn compare_arms(declared: &LimbDeclaration) -> Result<Vec<ArmScores>, RecruitmentError> {
    let arms = (0..declared.arms.draws).into_par_iter();
    arms.map(|n| {
        let (spec, posture) = random_arm(declared, n);
        let arm = Arm::new(&spec, &posture)?;
        let [a, b, c] = Method::ALL.map(|method| score_arm(declared, &arm, method));
        Ok([a?, b?, c?])
    })
    .collect()
}

/// Unit vectors of the directions backward, forward, right, left, up and down.
const DIRECTIONS: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];

fn score_arm(
    declared: &LimbDeclaration,
    arm: &Arm,
    method: Method,
) -> Result<ArmScore, RecruitmentError> {
    let mut recruiter = Recruiter::new(arm, method)?;
    let mut squares = Vec::new();
    for direction in DIRECTIONS {
        // Skips a direction in which no muscle can pull.
        let share = arm.reachable_share(direction);
        if !share.is_finite() {
            continue;
        }
        for part in &declared.targets.shares {
            let wanted = direction.map(|x| x * share * part);
            recruiter.forget();
            let given = arm.endpoint_force(&recruiter.recruit(wanted)?);
            squares.push((distance(given, wanted) / (share * part)).powi(2));
        }
    }
    let walked = walk_arm(declared, arm, &mut recruiter)?;
    Ok(ArmScore {
        method,
        targets_rmse_percent: rms_percent(&squares),
        ..walked.to_score(method)
    })
}

/// Largest change, number of switches and squared relative errors, collected along all walks of one
/// arm.
#[derive(Default)]
struct WalkResult {
    largest: f64,
    switches: u32,
    at_each: Vec<f64>,
    held: Vec<f64>,
}

impl WalkResult {
    fn to_score(&self, method: Method) -> ArmScore {
        ArmScore {
            method,
            targets_rmse_percent: 0.0,
            largest_step_percent: 100.0 * self.largest,
            switches: f64::from(self.switches) / 3.0,
            walk_rmse_percent: rms_percent(&self.at_each),
            held_rmse_percent: rms_percent(&self.held),
        }
    }
}

fn walk_arm(
    declared: &LimbDeclaration,
    arm: &Arm,
    recruiter: &mut Recruiter,
) -> Result<WalkResult, RecruitmentError> {
    let can = DIRECTIONS.map(|direction| arm.reachable_share(direction));
    let strength = 0.5 * can.into_iter().fold(f64::INFINITY, f64::min);
    let mut walked = WalkResult::default();
    for plane in 0..3 {
        recruiter.forget();
        let mut last = None;
        let mut held = [0.0; 3];
        for step in 0..declared.walk.steps {
            let angle = f64::from(step) / f64::from(declared.walk.steps) * std::f64::consts::TAU;
            let mut wanted = [0.0; 3];
            wanted[plane] = strength * libm::cos(angle);
            wanted[(plane + 1) % 3] = strength * libm::sin(angle);
            let forces = recruiter.recruit(wanted)?;
            let given = arm.endpoint_force(&forces);
            if step % declared.walk.hold.max(1) == 0 {
                held = given;
            }
            let missed = |given| (distance(given, wanted) / strength).powi(2);
            walked.at_each.push(missed(given));
            walked.held.push(missed(held));
            if let Some(last) = last.replace(forces) {
                walked.largest = walked.largest.max(arm.largest_change(&last, &forces));
                let lines = last.iter().zip(&forces);
                let turned = lines.filter(|(a, b)| (**a > 0.0) != (**b > 0.0));
                walked.switches += turned.count() as u32; // at most 10
            }
        }
    }
    Ok(walked)
}

/// Returns the root mean square of relative errors, %, given their squares.
fn rms_percent(squares: &[f64]) -> f64 {
    100.0 * (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Returns the spread over all arms of a quantity `quantity` their scores, for the method with this
/// index.
#[must_use]
pub fn spread(arms: &[ArmScores], method: usize, quantity: impl Fn(&ArmScore) -> f64) -> Spread {
    let scores = arms.iter().filter_map(|arm| arm.get(method));
    Spread::from_values(&scores.map(quantity).collect::<Vec<_>>())
}
