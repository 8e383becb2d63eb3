//! The recruitments, each from a wanted force to a force of each line.

use firmware::limb::{
    Choice, JOINTS, Jacobians, LINES, Limb, LimbSpec, Number, Posture, Vector, Wrench, nearest,
};
use host_core::limb::{
    Exact, Forces, LeastSquares, PostureMatrices, RecruitmentError, ToDouble, Weights, force,
};
use serde::Serialize;

/// A recruitment.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Algorithm 1 of Sierotowicz 2023.
    Nearest,
    /// Least squares with bounds.
    LeastSquares,
    /// The same with change weighed.
    Smooth,
}

impl Method {
    /// In the order of tables.
    pub const ALL: [Self; 3] = [Self::Nearest, Self::LeastSquares, Self::Smooth];

    /// For tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest neighbour",
            Self::LeastSquares => "least squares",
            Self::Smooth => "least squares, smooth",
        }
    }
}

/// An arm at its posture, in double precision.
#[derive(Clone, Debug)]
pub struct Arm {
    /// The arm.
    pub limb: Limb<Exact>,
    /// At its posture.
    pub jacobians: Jacobians<Exact>,
    /// The same as matrices.
    pub posed: PostureMatrices,
    /// The most of each line, N.
    pub most: Forces,
}

impl Arm {
    /// # Errors
    /// [`RecruitmentError`]: all mistakes of the arm, its posture, or no force can be told there.
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

    /// The nearest neighbour's forces, N, whatever the limits.
    #[must_use]
    pub fn nearest_forces(&self, wanted: [f64; 3]) -> Forces {
        let [x, y, z] = wanted.map(Exact);
        forces_of_choices(choices(&self.jacobians, Vector::new(x, y, z)))
    }

    /// How much of a force the nearest neighbour can make: its factor, which may be
    /// above 1, or infinite where nothing helps.
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

    /// Of each line's share of its most, the largest change.
    #[must_use]
    pub fn largest_change(&self, before: &Forces, now: &Forces) -> f64 {
        let changes = before.iter().zip(now).zip(&self.most);
        let shares = changes.filter(|(_, most)| **most > 0.0);
        shares
            .map(|((before, now), most)| (now - before).abs() / most)
            .fold(0.0, f64::max)
    }

    /// The force at the hand, N.
    #[must_use]
    pub fn endpoint_force(&self, forces: &Forces) -> [f64; 3] {
        let [x, y, z, ..] = self.posed.wrench(forces).data.0[0];
        [x, y, z]
    }
}

/// The lines that the nearest neighbour chooses for a force at the hand, N, at SC, GH and
/// EL, each with its own force, N.
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

/// Forces of lines from the three joints' choices.
#[must_use]
pub fn forces_of_choices(choices: [Option<(u8, f64)>; JOINTS]) -> Forces {
    let mut forces = Forces::zeros();
    for (line, force) in choices.into_iter().flatten() {
        let place = usize::from(line).min(LINES - 1);
        forces[place] = force;
    }
    forces
}

/// A method at work on an arm.
#[derive(Debug)]
pub struct Recruiter<'a> {
    arm: &'a Arm,
    squares: Option<LeastSquares>,
}

impl<'a> Recruiter<'a> {
    /// # Errors
    /// None that a method of [`Method::ALL`] can have.
    pub fn new(arm: &'a Arm, method: Method) -> Result<Self, RecruitmentError> {
        let squares = |weights| LeastSquares::new(&arm.limb, weights).map(Some);
        let squares = match method {
            Method::Nearest => None,
            Method::LeastSquares => squares(Weights::DECLARED)?,
            Method::Smooth => squares(Weights::SMOOTH)?,
        };
        Ok(Self { arm, squares })
    }

    /// The forces for a wanted one, N.
    ///
    /// # Errors
    /// [`RecruitmentError::NotConverged`], on what is not finite.
    pub fn recruit(&mut self, wanted: [f64; 3]) -> Result<Forces, RecruitmentError> {
        match &mut self.squares {
            None => Ok(self.arm.nearest_forces(wanted)),
            Some(squares) => {
                let found = squares.recruit(&self.arm.posed, &force(wanted))?;
                Ok(found.forces)
            }
        }
    }

    /// As if nothing had been asked before.
    pub fn forget(&mut self) {
        if let Some(squares) = &mut self.squares {
            squares.forget();
        }
    }
}
