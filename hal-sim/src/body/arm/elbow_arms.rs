//! Moment arms about the elbow from published polynomials.
//!
//! Coefficients of Rankin and Neptune 2012 as `anmuller/CusToM` keeps them (those with
//! six digits are the paper's, the triceps' long head is that repository's own refit), and
//! the biceps of biomed.bas.bg's MuscleArms, which is a second source: no length of the
//! biceps exists in the first. Printed arms are separate fits: where a length exists the
//! arm is minus its derivative, so that work and length agree. Both part beyond 100°.

/// Elbow flexion over which the fits are used, degrees.
pub const RANGE_DEG: [f64; 2] = [0.0, 100.0];

/// Maximal isometric forces of the triceps' heads (long, lateral, medial), N (arm26.osim,
/// after Holzbaur 2005): weights of the muscle under one electrode.
pub const TRICEPS_N: [f64; 3] = [798.52, 624.3, 624.3];

/// Σ aᵢ qⁱ (form RRN1), q in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quartic(pub [f64; 5]);

impl Quartic {
    /// Its value at `q` rad.
    #[must_use]
    pub fn at(&self, q: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, a| sum * q + a)
    }

    /// Its derivative at `q` rad.
    #[must_use]
    pub fn slope(&self, q: f64) -> f64 {
        let [_, a, b, c, d] = self.0;
        a + q * (2.0 * b + q * (3.0 * c + q * 4.0 * d))
    }
}

/// Cubics in two angles without (form RRN2) or with mixed terms (RRN4), rad: a₁ + cubic in
/// the first, cubic in the second, then q₁q₂, q₁²q₂, q₁q₂², q₁³q₂, q₁q₂³.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoAngles {
    /// The seven of RRN2.
    pub apart: [f64; 7],
    /// The five of RRN4; zero for RRN2.
    pub mixed: [f64; 5],
}

impl TwoAngles {
    /// Its value at these angles, rad.
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

/// Length of the triceps' medial head against elbow flexion, m. The lateral head has the
/// same arm.
pub const TRICEPS_MEDIAL_M: Quartic =
    Quartic([0.154222, 0.0207285, 0.00882432, -0.00864625, 0.00225989]);
/// The medial head's arm as it is printed, m; flexion positive.
pub const TRICEPS_MEDIAL_PRINTED_M: Quartic =
    Quartic([-0.0202999, -0.0215606, 0.0356484, -0.0178502, 0.0026245]);
/// The long head's arm, m (a refit).
pub const TRICEPS_LONG_M: Quartic = Quartic([
    -0.020165081,
    -0.022691141,
    0.038332749,
    -0.020226156,
    0.003321056,
]);
/// Length of the brachialis, m.
pub const BRACHIALIS_M: Quartic =
    Quartic([0.146058, -0.0120401, 0.00359539, -0.00501862, 0.000960102]);
/// Its arm as it is printed, m.
pub const BRACHIALIS_PRINTED_M: Quartic =
    Quartic([0.00984873, 0.010163, -0.0239557, 0.0290329, -0.00924344]);
/// Arm of the brachioradialis against flexion and pronation, m.
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
/// Arm of the biceps, cm against rad (MuscleArms, biomed.bas.bg), six terms.
const BICEPS_CM: [f64; 6] = [1.963, -1.44, 3.031, 0.887, -1.418, 0.285];

/// Arms of biceps, triceps, brachialis and brachioradialis at this flexion, m, flexion
/// positive; `None` outside [`RANGE_DEG`]. The forearm is in neutral rotation.
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

/// Arm of the biceps at `q` rad, m.
#[must_use]
pub fn biceps_m(q: f64) -> f64 {
    1e-2 * BICEPS_CM.iter().rev().fold(0.0, |sum, a| sum * q + a)
}
