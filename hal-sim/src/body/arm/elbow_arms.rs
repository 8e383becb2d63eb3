//! Moment arms about the elbow from published polynomials.
//!
//! The coefficients are those of Rankin and Neptune 2012 as `anmuller/CusToM` keeps them (those
//! with six digits are the paper's; the long head of the triceps is a refit by that repository).
//! The biceps comes from MuscleArms of biomed.bas.bg, because the first source has no length of it.
//! The printed moment arms are separate fits: where a length exists, the moment arm is minus its
//! derivative, so that work and length agree. The two fits diverge beyond 100°.

/// Range of elbow flexion over which the fits are used, degrees.
pub const RANGE_DEG: [f64; 2] = [0.0, 100.0];

/// Maximum isometric forces of the heads of the triceps (long, lateral, medial), N (arm26.osim,
/// after Holzbaur 2005). They weight the heads of the muscle under one electrode.
pub const TRICEPS_N: [f64; 3] = [798.52, 624.3, 624.3];

/// Polynomial Σ aᵢ qⁱ (form RRN1), q in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quartic(pub [f64; 5]);

impl Quartic {
    /// Evaluates the polynomial at `q` rad.
    #[must_use]
    pub fn at(&self, q: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, a| sum * q + a)
    }

    /// Returns the derivative at `q` rad.
    #[must_use]
    pub fn slope(&self, q: f64) -> f64 {
        let [_, a, b, c, d] = self.0;
        a + q * (2.0 * b + q * (3.0 * c + q * 4.0 * d))
    }
}

/// Polynomial in two angles, rad, without mixed terms (form RRN2) or with them (RRN4): a₁ + cubic
/// in the first, cubic in the second, then q₁q₂, q₁²q₂, q₁q₂², q₁³q₂, q₁q₂³.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoAngles {
    /// The seven coefficients of RRN2.
    pub apart: [f64; 7],
    /// The five mixed coefficients of RRN4; zero for RRN2.
    pub mixed: [f64; 5],
}

impl TwoAngles {
    /// Evaluates the polynomial at these angles, rad.
    #[must_use]
    pub fn at(&self, q1: f64, q2: f64) -> f64 {
        let [a1, a2, a3, a4, a5, a6, a7] = self.apart;
        let [a8, a9, a10, a11, a12] = self.mixed;
        let first = a1 + q1 * (a2 + q1 * (a3 + q1 * a4));
        let second = q2 * (a5 + q2 * (a6 + q2 * a7));
        let mixed = a8 + a9 * q1 + a10 * q2 + a11 * q1 * q1 + a12 * q2 * q2;
        first + second + q1 * q2 * mixed
    }
}

/// Length of the medial head of the triceps as a function of elbow flexion, m. The lateral head has
/// the same moment arm.
pub const TRICEPS_MEDIAL_M: Quartic =
    Quartic([0.154222, 0.0207285, 0.00882432, -0.00864625, 0.00225989]);
/// Moment arm of the medial head of the triceps as the paper prints it, m; flexion positive.
pub const TRICEPS_MEDIAL_PRINTED_M: Quartic =
    Quartic([-0.0202999, -0.0215606, 0.0356484, -0.0178502, 0.0026245]);
/// Moment arm of the long head of the triceps, m (refitted by `CusToM`).
pub const TRICEPS_LONG_M: Quartic = Quartic([
    -0.020165081,
    -0.022691141,
    0.038332749,
    -0.020226156,
    0.003321056,
]);
/// Length of the brachialis as a function of elbow flexion, m.
pub const BRACHIALIS_M: Quartic =
    Quartic([0.146058, -0.0120401, 0.00359539, -0.00501862, 0.000960102]);
/// Moment arm of the brachialis as the paper prints it, m; flexion positive.
pub const BRACHIALIS_PRINTED_M: Quartic =
    Quartic([0.00984873, 0.010163, -0.0239557, 0.0290329, -0.00924344]);
/// Moment arm of the brachioradialis as a function of flexion and pronation, m.
pub const BRACHIORADIALIS_M: TwoAngles = TwoAngles {
    apart: [
        0.0118003,
        0.0209993,
        0.037126,
        -0.0147644,
        -0.00058285,
        -0.00357599,
        -0.000725432,
    ],
    mixed: [0.0140991, -0.0125532, -0.00147822, 0.00361034, -0.000257318],
};
/// Moment arm of the biceps, cm, as a polynomial of six terms in rad (MuscleArms, biomed.bas.bg).
const BICEPS_CM: [f64; 6] = [1.963, -1.44, 3.031, 0.887, -1.418, 0.285];

/// Returns the moment arms of biceps, triceps, brachialis and brachioradialis at this flexion, m,
/// flexion positive, with the forearm in neutral rotation. Returns `None` outside [`RANGE_DEG`].
#[must_use]
pub fn arms_m(flexion_deg: f64) -> Option<[f64; 4]> {
    let [low, high] = RANGE_DEG;
    if !(low..=high).contains(&flexion_deg) {
        return None;
    }
    let q = flexion_deg.to_radians();
    let [long, lateral, medial] = TRICEPS_N;
    let monarticular = -TRICEPS_MEDIAL_M.slope(q);
    let triceps = (long * TRICEPS_LONG_M.at(q) + (lateral + medial) * monarticular)
        / (long + lateral + medial);
    Some([
        biceps_m(q),
        triceps,
        -BRACHIALIS_M.slope(q),
        BRACHIORADIALIS_M.at(q, 0.0),
    ])
}

/// Returns the moment arm of the biceps at `q` rad of flexion, m.
#[must_use]
pub fn biceps_m(q: f64) -> f64 {
    1e-2 * BICEPS_CM.iter().rev().fold(0.0, |sum, a| sum * q + a)
}
