//! Recruitment of all lines together by bounded least squares. The force of each line lies between
//! 0 and the most that the line can make.

use super::{Bounded, Forces, PostureMatrices, RecruitmentError, WrenchVector};
use firmware::limb::{LINES, Limb, Number, Orders};
use nalgebra::SVector;

/// Weights of the terms in the sum that the recruitment minimises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Weight of the squared error of the force at the hand, 1/N²; 0 or more.
    pub force: f64,
    /// Weight of the squared errors of the nine joint torques, 1/(N·m)²; 0 or more. These include
    /// torques that have no effect at the hand.
    pub torque: f64,
    /// Weight of the squared effort of each line; above 0. The effort is the line's force divided
    /// by its largest force. The term prefers solutions with little current, and makes the solution
    /// unique where one muscle could replace another.
    pub effort: f64,
    /// Weight of the squared change of each line's effort since the last solution; 0 or more. It
    /// prevents sudden switching between muscles.
    pub change: f64,
}

impl Weights {
    /// Weights that were fixed in advance and not tuned. An error of 1 N at the hand counts as much
    /// as one of 1 N·m at a joint. Full effort of one muscle counts as much as an error of 0.3 N.
    pub const DECLARED: Self = Self {
        force: 1.0,
        torque: 1.0,
        effort: 0.1,
        change: 0.0,
    };

    /// Weights of [`Self::DECLARED`] with a weight on change, for one solution every 5 ms. A muscle
    /// takes about 100 ms to rise. A change of its effort by a twentieth from one solution to the
    /// next therefore counts as much as an error of 1 N.
    pub const SMOOTH: Self = Self {
        change: 400.0,
        ..Self::DECLARED
    };

    /// Checks that every weight is finite and within its range.
    fn check(&self) -> Result<(), RecruitmentError> {
        let rules = [
            ("force", self.force, self.force >= 0.0, "0 or more"),
            ("torque", self.torque, self.torque >= 0.0, "0 or more"),
            ("effort", self.effort, self.effort > 0.0, "above 0"),
            ("change", self.change, self.change >= 0.0, "0 or more"),
        ];
        for (weight, value, holds, allowed) in rules {
            if !(holds && value.is_finite()) {
                return Err(RecruitmentError::Weight {
                    weight,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }
}

/// Recruitment of one arm's muscles by least squares. It remembers the last solution, so that
/// forces can change smoothly from one solution to the next.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    weights: Weights,
    /// Largest force of each line, N; 0 for lines that the arm does not have.
    most: Forces,
    last: Option<Forces>,
}

/// Muscle forces for a wanted wrench (force and torque at the hand).
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Force along each line of action, N.
    pub forces: Forces,
    /// Wrench at the hand that `forces` cause according to the model of the arm, N and N·m.
    pub given: WrenchVector,
}

impl Solution {
    /// Returns the magnitude of the difference between the wanted force at the hand and the given
    /// one, N. Differences of torque do not count.
    #[must_use]
    pub fn force_error_n(&self, wanted: &WrenchVector) -> f64 {
        (self.given - wanted).fixed_rows::<3>(0).norm()
    }
}

impl LeastSquares {
    /// Creates the recruitment of one arm. The weight on change has no effect until there is a
    /// first solution.
    ///
    /// # Errors
    /// [`RecruitmentError::Weight`] if a weight is outside its range.
    pub fn new<N: Number + super::ToDouble>(
        limb: &Limb<N>,
        weights: Weights,
    ) -> Result<Self, RecruitmentError> {
        weights.check()?;
        let mut most = Forces::zeros();
        for (entry, force) in most.iter_mut().zip(limb.max_forces()) {
            *entry = force.to_double();
        }
        Ok(Self {
            weights,
            most,
            last: None,
        })
    }

    /// Forgets the last solution, so that the weight on change does not affect the next one.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// Returns the muscle forces whose wrench is nearest to the wanted one, and remembers them as
    /// the last solution. Their wrench, [`Solution::given`], may differ from the wanted one.
    ///
    /// # Errors
    /// [`RecruitmentError::NotConverged`] if an input is not finite.
    pub fn recruit(
        &mut self,
        posed: &PostureMatrices,
        wanted: &WrenchVector,
    ) -> Result<Solution, RecruitmentError> {
        let forces = self.problem(posed, wanted).solve()?;
        self.last = Some(forces);
        Ok(Solution {
            forces,
            given: posed.wrench(&forces),
        })
    }

    /// Returns the same as [`Self::recruit`], but refuses a wanted force that the force at the hand
    /// would miss by more than `tolerance_n`, N. A refused solution is not remembered.
    ///
    /// # Errors
    /// [`RecruitmentError::Beyond`] with the largest force in the wanted direction that would not
    /// be refused; [`RecruitmentError::NotConverged`] if an input is not finite.
    pub fn recruit_within(
        &mut self,
        posed: &PostureMatrices,
        wanted: &WrenchVector,
        tolerance_n: f64,
    ) -> Result<Solution, RecruitmentError> {
        let last = self.last;
        let found = self.recruit(posed, wanted)?;
        if found.force_error_n(wanted) <= tolerance_n {
            return Ok(found);
        }
        self.last = last;
        let (mut low, mut high) = (0.0, 1.0);
        // 20 bisections find the share to a millionth.
        for _ in 0..20 {
            let share = 0.5 * (low + high);
            let scaled = wanted * share;
            let forces = self.problem(posed, &scaled).solve()?;
            let missed_n = (posed.wrench(&forces) - scaled).fixed_rows::<3>(0).norm();
            match missed_n <= tolerance_n {
                true => low = share,
                false => high = share,
            }
        }
        let [x, y, z, ..] = wanted.data.0[0];
        Err(RecruitmentError::Beyond {
            wanted_n: wanted.fixed_rows::<3>(0).norm(),
            nearest: [x, y, z].map(|component| component * low),
        })
    }

    /// Returns the bounded quadratic problem whose minimum is the vector of line forces for
    /// `wanted`.
    #[must_use]
    pub fn problem(&self, posed: &PostureMatrices, wanted: &WrenchVector) -> Bounded {
        let Weights {
            force,
            torque,
            effort,
            change,
        } = self.weights;
        let change = if self.last.is_some() { change } else { 0.0 };
        let at_hand = (posed.given * posed.levers).fixed_rows::<3>(0).into_owned();
        let mut curvature = at_hand.transpose() * at_hand * force
            + posed.levers.transpose() * posed.levers * torque;
        let mut slope = at_hand.transpose() * wanted.fixed_rows::<3>(0) * force
            + posed.levers.transpose() * posed.torques(wanted) * torque;
        let last = self.last.unwrap_or_default();
        for line in 0..LINES {
            // The force of a missing line is 0, whatever its curvature.
            let per_square = match self.most[line] > 0.0 {
                true => 1.0 / (self.most[line] * self.most[line]),
                false => 1.0,
            };
            curvature[(line, line)] += (effort + change) * per_square;
            slope[line] += change * per_square * last[line];
        }
        Bounded {
            curvature,
            slope,
            upper: self.most,
        }
    }
}

/// Returns the amplitudes with which the channels' muscles have these forces, N. For a force above
/// the largest of its line, the amplitude is that of the largest force.
#[must_use]
pub fn amplitudes(limb: &Limb, forces: &Forces) -> Orders {
    let forces: [f32; LINES] = forces.data.0[0].map(|force| force as f32);
    limb.orders(&forces)
}

/// Returns a wrench that consists of a force without torque. The components of the force, N, point
/// backward, to the right and upward.
#[must_use]
pub fn force(components: [f64; 3]) -> WrenchVector {
    let [x, y, z] = components;
    SVector::from([x, y, z, 0.0, 0.0, 0.0])
}
