//! Measures how much the device's single precision and micromath's sine and cosine add to the error
//! of the force at the hand.

use super::arms::random_posture;
use super::declared::LimbDeclaration;
use super::method::{Arm, choices, forces_of_choices};
use firmware::bench::limb::nominal_limb;
use firmware::limb::{Limb, Number, Posture, Vector};
use host_core::limb::{Forces, RecruitmentError, Single, ToDouble};
use host_core::statistics::Sorted;
use serde::Serialize;

/// Errors of a number format over all postures, relative to the same computation in double
/// precision.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Error {
    /// Distance between the computed position of the hand and that in double precision, mm.
    pub hand_mm: Spread,
    /// Difference between the force at the hand and that in double precision, % of the latter.
    /// Postures at which other muscles were recruited are not counted.
    pub force_percent: Spread,
    /// Difference between the force at the hand and that in double precision, % of the error that
    /// the recruitment itself has in this posture.
    pub share_percent: Spread,
    /// Number of postures at which other muscles were recruited than in double precision.
    pub other_choices: u64,
}

/// Median, 95th percentile and maximum of a quantity over arms or postures.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    pub median: f64,
    pub p95: f64,
    pub most: f64,
}

impl Spread {
    /// Computes the spread of values in any order; all fields are NaN if there are no values.
    pub(super) fn from_values(values: &[f64]) -> Self {
        let sorted = Sorted::of(values);
        let at = |part| {
            sorted
                .as_ref()
                .map_or(f64::NAN, |sorted| sorted.quantile(part))
        };
        Self {
            median: at(0.5),
            p95: at(0.95),
            most: at(1.0),
        }
    }
}

/// Errors of the device's number format, and which part of them rounding alone causes.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Numbers {
    /// Errors of `f32` with the sine and cosine of micromath, as on the device.
    pub device: Error,
    /// Errors of `f32` with correctly rounded sine and cosine, which show the effect of rounding
    /// alone.
    pub rounding: Error,
    /// Error of the recruitment itself in double precision, % of the reference force, according to
    /// the arm model from which the forces are computed.
    pub recruitment_percent: Spread,
    /// Number of postures with a result; each has one reference force.
    pub n: u64,
}

/// Measures the errors over the preregistered number of random postures.
///
/// # Errors
/// Returns [`RecruitmentError`] if a posture or the arm is refused.
pub fn numbers(declared: &LimbDeclaration) -> Result<Numbers, RecruitmentError> {
    let (mut device, mut rounding) = (PostureErrors::default(), PostureErrors::default());
    let mut missed = Vec::new();
    for n in 0..declared.numbers.postures {
        let (posture, wanted) = random_posture(declared, n);
        let arm = match Arm::new(&nominal_limb(), &posture) {
            // The arm is stretched, so that no force can be computed.
            Err(RecruitmentError::Singular) => continue,
            arm => arm?,
        };
        let forces = arm.nearest_forces(wanted);
        if forces.amax() == 0.0 {
            continue;
        }
        let given = arm.endpoint_force(&forces);
        let recruitment = distance(given, wanted);
        missed.push(100.0 * recruitment);
        let hand = arm.limb.skeleton().pose(&arm.limb.radians(&posture)?).hand;
        let case = Case {
            arm: &arm,
            posture: &posture,
            wanted,
            forces,
            recruitment,
            hand: hand.to_array().map(ToDouble::to_double),
        };
        device.add(case.errors::<f32>()?);
        rounding.add(case.errors::<Single>()?);
    }
    Ok(Numbers {
        n: missed.len() as u64,
        device: device.error(),
        rounding: rounding.error(),
        recruitment_percent: Spread::from_values(&missed),
    })
}

/// One posture with a reference force of 1 N, and the result in double precision.
struct Case<'a> {
    arm: &'a Arm,
    posture: &'a Posture,
    wanted: [f64; 3],
    forces: Forces,
    recruitment: f64,
    hand: [f64; 3],
}

/// Errors of a number format in one posture.
struct NumberErrors {
    hand_m: f64,
    /// Difference of the force at the hand from that in double precision, N; `None` if other
    /// muscles were recruited.
    force: Option<f64>,
    given: f64,
    recruitment: f64,
}

impl Case<'_> {
    fn errors<N: Number + ToDouble>(&self) -> Result<NumberErrors, RecruitmentError> {
        let spec = nominal_limb();
        let limb =
            Limb::<N>::new(&spec).map_err(|e| RecruitmentError::Spec(vec![e.to_string()]))?;
        let radians = limb.radians(self.posture)?;
        let hand = limb.skeleton().pose(&radians).hand;
        // Rounded to a millionth of a newton.
        let [x, y, z] = self
            .wanted
            .map(|part| N::ratio((part * 1e6).round() as i32, 1_000_000));
        let jacobians = limb.jacobians(&radians);
        let forces = forces_of_choices(choices(&jacobians, Vector::new(x, y, z)));
        let same = forces.iter().zip(&self.forces);
        let is_same = same
            .clone()
            .all(|(ours, exact)| (*ours > 0.0) == (*exact > 0.0));
        let given = self.arm.endpoint_force(&self.forces);
        let force = is_same.then(|| distance(self.arm.endpoint_force(&forces), given));
        Ok(NumberErrors {
            hand_m: distance(hand.to_array().map(ToDouble::to_double), self.hand),
            force,
            given: distance(given, [0.0; 3]),
            recruitment: self.recruitment,
        })
    }
}

/// Errors of a number format, collected over all postures.
#[derive(Default)]
struct PostureErrors {
    hand_mm: Vec<f64>,
    force_percent: Vec<f64>,
    share_percent: Vec<f64>,
    other_choices: u64,
}

impl PostureErrors {
    fn add(&mut self, off: NumberErrors) {
        self.hand_mm.push(1000.0 * off.hand_m);
        match off.force {
            None => self.other_choices += 1,
            Some(force) => {
                self.force_percent.push(100.0 * force / off.given);
                self.share_percent.push(100.0 * force / off.recruitment);
            }
        }
    }

    fn error(self) -> Error {
        Error {
            hand_mm: Spread::from_values(&self.hand_mm),
            force_percent: Spread::from_values(&self.force_percent),
            share_percent: Spread::from_values(&self.share_percent),
            other_choices: self.other_choices,
        }
    }
}

/// Returns the Euclidean distance of two positions or forces.
pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let parts = a.into_iter().zip(b);
    parts.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
