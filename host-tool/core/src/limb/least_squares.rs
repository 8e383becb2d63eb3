//! The better recruitment: all lines together, each between nothing and its most.

use super::{Bounded, Forces, Posed, Trouble, WrenchVector};
use firmware::limb::{LINES, Limb, Number, Orders};
use nalgebra::SVector;

/// What counts how much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Of what the force at the hand misses, per N²; not below 0.
    pub force: f64,
    /// Of what the nine torques miss, those too that do not reach the hand, per
    /// (N·m)²; not below 0.
    pub torque: f64,
    /// Of each line's share of its most, squared: what prefers little current, and
    /// leaves one answer where muscles could stand in for each other; above 0.
    pub effort: f64,
    /// Of what each line's share has changed since the last answer, squared: what keeps
    /// it from switching; not below 0.
    pub change: f64,
}

impl Weights {
    /// Declared, not tuned: a newton at the hand counts as a newton metre at a joint,
    /// and all of one muscle as 0.3 N missed.
    pub const DECLARED: Self = Self {
        force: 1.0,
        torque: 1.0,
        effort: 0.1,
        change: 0.0,
    };

    /// The same for an answer every 5 ms: a muscle takes about 100 ms to rise, and a
    /// twentieth of it from one answer to the next counts as 1 N missed.
    pub const SMOOTH: Self = Self {
        change: 400.0,
        ..Self::DECLARED
    };

    fn check(&self) -> Result<(), Trouble> {
        let rules = [
            ("force", self.force, self.force >= 0.0, "0 or more"),
            ("torque", self.torque, self.torque >= 0.0, "0 or more"),
            ("effort", self.effort, self.effort > 0.0, "above 0"),
            ("change", self.change, self.change >= 0.0, "0 or more"),
        ];
        for (weight, value, holds, allowed) in rules {
            if !(holds && value.is_finite()) {
                return Err(Trouble::Weight {
                    weight,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }
}

/// Least squares with its memory of the last answer.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    weights: Weights,
    most: Forces,
    last: Option<Forces>,
}

/// What came of a wanted wrench.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Of each line, N.
    pub forces: Forces,
    /// The wrench that they give, by the arm's own model.
    pub given: WrenchVector,
}

impl Found {
    /// By how much the force at the hand misses the wanted, N.
    #[must_use]
    pub fn missed_n(&self, wanted: &WrenchVector) -> f64 {
        (self.given - wanted).fixed_rows::<3>(0).norm()
    }
}

impl LeastSquares {
    /// For one arm.
    ///
    /// # Errors
    /// [`Trouble::Weight`].
    pub fn new<N: Number + super::ToDouble>(
        limb: &Limb<N>,
        weights: Weights,
    ) -> Result<Self, Trouble> {
        weights.check()?;
        let mut most = Forces::zeros();
        for (to, from) in most.iter_mut().zip(limb.most()) {
            *to = from.to_double();
        }
        Ok(Self {
            weights,
            most,
            last: None,
        })
    }

    /// Forgets the last answer: nothing holds the next one back.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// The forces that give what is nearest to the wanted wrench; they need not give
    /// it: [`Found::given`] says what they do.
    ///
    /// # Errors
    /// [`Trouble::NotConverged`], on what is not finite.
    pub fn recruit(&mut self, posed: &Posed, wanted: &WrenchVector) -> Result<Found, Trouble> {
        let forces = self.problem(posed, wanted).solve()?;
        self.last = Some(forces);
        Ok(Found {
            forces,
            given: posed.wrench(&forces),
        })
    }

    /// The same, refused where the force at the hand misses the wanted by more than
    /// `tolerance_n`; then nothing is remembered either.
    ///
    /// # Errors
    /// [`Trouble::Beyond`] with the most of the wanted force that is not refused;
    /// [`Trouble::NotConverged`].
    pub fn recruit_within(
        &mut self,
        posed: &Posed,
        wanted: &WrenchVector,
        tolerance_n: f64,
    ) -> Result<Found, Trouble> {
        let last = self.last;
        let found = self.recruit(posed, wanted)?;
        if found.missed_n(wanted) <= tolerance_n {
            return Ok(found);
        }
        self.last = last;
        let (mut low, mut high) = (0.0, 1.0);
        // To a millionth of it.
        for _ in 0..20 {
            let share = 0.5 * (low + high);
            let part = wanted * share;
            let forces = self.problem(posed, &part).solve()?;
            let missed = (posed.wrench(&forces) - part).fixed_rows::<3>(0).norm();
            match missed <= tolerance_n {
                true => low = share,
                false => high = share,
            }
        }
        let [x, y, z, ..] = wanted.data.0[0];
        Err(Trouble::Beyond {
            wanted_n: wanted.fixed_rows::<3>(0).norm(),
            nearest: [x, y, z].map(|part| part * low),
        })
    }

    /// The quadratic whose minimum is the answer.
    #[must_use]
    pub fn problem(&self, posed: &Posed, wanted: &WrenchVector) -> Bounded {
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
        for n in 0..LINES {
            // A line that is not there stays at 0 with any curvature.
            let per_square = match self.most[n] > 0.0 {
                true => 1.0 / (self.most[n] * self.most[n]),
                false => 1.0,
            };
            curvature[(n, n)] += (effort + change) * per_square;
            slope[n] += change * per_square * last[n];
        }
        Bounded {
            curvature,
            slope,
            upper: self.most,
        }
    }
}

/// The channels' amplitudes for forces of the lines.
#[must_use]
pub fn amplitudes(limb: &Limb, forces: &Forces) -> Orders {
    let forces: [f32; LINES] = forces.data.0[0].map(|force| force as f32);
    limb.orders(&forces)
}

/// A force alone, N: backward, to the right, upward.
#[must_use]
pub fn force(parts: [f64; 3]) -> WrenchVector {
    let [x, y, z] = parts;
    SVector::from([x, y, z, 0.0, 0.0, 0.0])
}
