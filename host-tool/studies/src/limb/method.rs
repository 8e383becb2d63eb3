//! Recruitment methods, each of which turns a reference force at the hand into a force of each
//! line.

use firmware::limb::{
    Choice, JOINTS, Jacobians, LINES, Limb, LimbSpec, Number, Posture, Vector, Wrench, nearest,
};
use host_core::limb::{
    Exact, Forces, LeastSquares, PostureMatrices, RecruitmentError, ToDouble, Weights, force,
};
use serde::Serialize;

/// Method that distributes a force at the hand over the muscle lines of an arm.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Algorithm 1 of Sierotowicz 2023.
    Nearest,
    /// Least squares, with a lower and an upper bound on the force of each line.
    LeastSquares,
    /// Least squares with the same bounds, and a penalty on changes of the line forces since the
    /// previous answer.
    Smooth,
}

impl Method {
    /// All methods, in the order in which tables list them.
    pub const ALL: [Self; 3] = [Self::Nearest, Self::LeastSquares, Self::Smooth];

    /// Returns the name of the method in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest neighbour",
            Self::LeastSquares => "least squares",
            Self::Smooth => "least squares, smooth",
        }
    }
}

/// An arm in one posture, computed in double precision.
#[derive(Clone, Debug)]
pub struct Arm {
    pub limb: Limb<Exact>,
    /// Jacobians of the arm in this posture.
    pub jacobians: Jacobians<Exact>,
    /// The same Jacobians as matrices, for least squares.
    pub posed: PostureMatrices,
    /// Largest force of each line, N.
    pub most: Forces,
}

impl Arm {
    /// Computes the arm's Jacobians in `posture`.
    ///
    /// # Errors
    /// Returns [`RecruitmentError`] with all mistakes of the arm or its posture, or if no force can
    /// be computed there (stretched arm).
    pub fn new(spec: &LimbSpec, posture: &Posture) -> Result<Self, RecruitmentError> {
        RecruitmentError::check_spec(spec)?;
        let limb =
            Limb::<Exact>::new(spec).map_err(|e| RecruitmentError::Spec(vec![e.to_string()]))?;
        let jacobians = limb.jacobians_at_posture(posture)?;
        let posed = PostureMatrices::new(&jacobians)?;
        let mut most = Forces::zeros();
        for (to, Exact(from)) in most.iter_mut().zip(limb.max_forces()) {
            *to = from;
        }
        Ok(Self {
            limb,
            jacobians,
            posed,
            most,
        })
    }

    /// Returns the line forces of the nearest neighbour method for the force `wanted` at the hand,
    /// N. Limits of the lines are not applied.
    #[must_use]
    pub fn nearest_forces(&self, wanted: [f64; 3]) -> Forces {
        let [x, y, z] = wanted.map(Exact);
        forces_of_choices(choices(&self.jacobians, Vector::new(x, y, z)))
    }

    /// Returns the factor by which the nearest neighbour method can multiply the force `wanted`
    /// until a line reaches its limit. A factor below 1 means that `wanted` itself is too large;
    /// infinity means that no muscle pulls in this direction.
    #[must_use]
    pub fn reachable_share(&self, wanted: [f64; 3]) -> f64 {
        let forces = self.nearest_forces(wanted);
        let asked = forces
            .iter()
            .zip(&self.most)
            .filter(|(force, _)| **force > 0.0);
        let shares = asked.map(|(force, most)| most / force);
        shares.fold(f64::INFINITY, f64::min)
    }

    /// Returns the largest change of any line's force between two answers of a method, as a
    /// fraction of the line's largest force.
    #[must_use]
    pub fn largest_change(&self, before: &Forces, now: &Forces) -> f64 {
        let changes = before.iter().zip(now).zip(&self.most);
        let shares = changes.filter(|(_, most)| **most > 0.0);
        shares
            .map(|((before, now), most)| (now - before).abs() / most)
            .fold(0.0, f64::max)
    }

    /// Returns the force at the hand that these line forces produce, N.
    #[must_use]
    pub fn endpoint_force(&self, forces: &Forces) -> [f64; 3] {
        let [x, y, z, ..] = self.posed.wrench(forces).data.0[0];
        [x, y, z]
    }
}

/// Returns for each of the joints SC, GH and EL the line that the nearest neighbour method chooses
/// for `force` at the hand, with the line's force, N; `None` where no line helps.
#[must_use]
pub fn choices<N: Number + ToDouble>(
    jacobians: &Jacobians<N>,
    force: Vector<N>,
) -> [Option<(u8, f64)>; JOINTS] {
    let torque = Vector::ZERO;
    nearest(jacobians, &Wrench { force, torque }).map(|choice| match choice {
        Choice::Line(line, force) => Some((line, force.to_double())),
        Choice::None | Choice::Unhelped => None,
    })
}

/// Returns the force of every line, N, given the line chosen at each of the three joints. Lines
/// that were not chosen have 0.
#[must_use]
pub fn forces_of_choices(choices: [Option<(u8, f64)>; JOINTS]) -> Forces {
    let mut forces = Forces::zeros();
    for (line, force) in choices.into_iter().flatten() {
        let place = usize::from(line).min(LINES - 1);
        forces[place] = force;
    }
    forces
}

/// A recruitment method in use on one arm. The smooth method remembers its previous answer.
#[derive(Debug)]
pub struct Recruiter<'a> {
    arm: &'a Arm,
    squares: Option<LeastSquares>,
}

impl<'a> Recruiter<'a> {
    /// Prepares `method` for `arm`.
    ///
    /// # Errors
    /// Never fails for a method of [`Method::ALL`].
    pub fn new(arm: &'a Arm, method: Method) -> Result<Self, RecruitmentError> {
        let squares = |weights| LeastSquares::new(&arm.limb, weights).map(Some);
        let squares = match method {
            Method::Nearest => None,
            Method::LeastSquares => squares(Weights::DECLARED)?,
            Method::Smooth => squares(Weights::SMOOTH)?,
        };
        Ok(Self { arm, squares })
    }

    /// Returns the line forces, N, that the method computes for the force `wanted` at the hand, N.
    ///
    /// # Errors
    /// Returns [`RecruitmentError::NotConverged`] if `wanted` is not finite.
    pub fn recruit(&mut self, wanted: [f64; 3]) -> Result<Forces, RecruitmentError> {
        match &mut self.squares {
            None => Ok(self.arm.nearest_forces(wanted)),
            Some(squares) => {
                let found = squares.recruit(&self.arm.posed, &force(wanted))?;
                Ok(found.forces)
            }
        }
    }

    /// Forgets the previous answer, so that the smooth method does not stay close to it.
    pub fn forget(&mut self) {
        if let Some(squares) = &mut self.squares {
            squares.forget();
        }
    }
}
