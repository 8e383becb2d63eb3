//! Recruitments on drawn arms: what each misses, and how it switches.

use super::arms::random_arm;
use super::declared::LimbDeclaration;
use super::method::{Arm, Method, Recruiter};
use super::numbers::{Spread, distance};
use host_core::limb::RecruitmentError;
use rayon::prelude::*;
use serde::Serialize;

/// One arm under one method.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ArmScore {
    /// Which method.
    pub method: Method,
    /// Rms of what the force at the hand misses over the targets, % of each wanted.
    pub targets_rmse_percent: f64,
    /// The largest change of a line between two answers along the walks, % of its most.
    pub largest_step_percent: f64,
    /// How often a line goes on or off in one walk around.
    pub switches: f64,
    /// Rms along the walks, % of the wanted, with an answer at every step.
    pub walk_rmse_percent: f64,
    /// The same with answers held.
    pub held_rmse_percent: f64,
}

/// All of one arm's.
pub type ArmScores = [ArmScore; 3];

/// Every drawn arm.
///
/// # Errors
/// [`RecruitmentError`] where an arm was refused.
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

/// Backward, forward, right, left, up, down.
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
        // Where nothing helps there is nothing to want.
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

/// What came along the walks.
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
            wanted[plane] = strength * angle.cos();
            wanted[(plane + 1) % 3] = strength * angle.sin();
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

/// Of squares of parts of one.
fn rms_percent(squares: &[f64]) -> f64 {
    100.0 * (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Of one quantity over all arms.
#[must_use]
pub fn spread(arms: &[ArmScores], method: usize, of: impl Fn(&ArmScore) -> f64) -> Spread {
    let all = arms.iter().filter_map(|arm| arm.get(method));
    Spread::from_values(&all.map(of).collect::<Vec<_>>())
}
