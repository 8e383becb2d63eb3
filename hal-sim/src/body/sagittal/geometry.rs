//! Moment arms and fibre lengths as functions of the joint angles.

use super::{ELBOW, JOINTS, SHOULDER};
use crate::body::arm::posture::{Lengths, Posture, Skeleton};
use crate::body::arm::{Muscle, elbow_arms};
use crate::body::bench::elbow::force_length;

/// Number of muscles that turn elbow or shoulder in this plane.
pub const MUSCLES: usize = 8;
/// Muscles in this plane, in order; the first four lie under electrodes. The deltoid's middle part
/// is left out, because its line passes the joint on the other side as the arm rises; so are
/// coracobrachialis, supraspinatus and teres.
pub const ALL: [Muscle; MUSCLES] = [
    Muscle::Biceps,
    Muscle::Triceps,
    Muscle::DeltoidAnterior,
    Muscle::DeltoidPosterior,
    Muscle::Brachialis,
    Muscle::Brachioradialis,
    Muscle::PectoralisClavicular,
    Muscle::Latissimus,
];
/// Optimal fibre lengths, m (Holzbaur 2005; for biceps and triceps the mean of their heads,
/// weighted by force).
const BEST_M: [f64; MUSCLES] = [
    0.1224, 0.1217, 0.0976, 0.1367, 0.0858, 0.1726, 0.1442, 0.2540,
];
/// Isometric force of the anterior and the posterior part of the deltoid, N (Holzbaur 2005, quoted
/// from memory). The anterior part includes the fibres of the middle part that pull forward.
const DELTOID_N: [f64; 2] = [1142.6, 259.9];
/// Range of angles in which moment arms are known, degrees: elbow (`elbow_arms`), shoulder
/// (posture). Beyond it a moment arm keeps the value at the nearer end.
pub const LIMITS_DEG: [[f64; 2]; JOINTS] = [elbow_arms::RANGE_DEG, [1.0, 120.0]];
/// Posture to which the fibre lengths of a specification refer, degrees.
const REFERENCE_DEG: [f64; JOINTS] = [90.0, 45.0];

/// Moment arms and shortening of all muscles about one joint, tabulated at whole degrees.
#[derive(Debug, Clone, PartialEq)]
struct Table {
    from_deg: f64,
    /// For each degree and muscle: moment arm (flexion positive), m, and shortening relative to the
    /// reference posture, m.
    rows: Vec<[[f64; 2]; MUSCLES]>,
}

impl Table {
    fn new(joint: usize, arms_m: impl Fn(f64) -> [f64; MUSCLES]) -> Self {
        let [low, high] = LIMITS_DEG[joint];
        let degrees = (low as u32..=high as u32).map(f64::from);
        let mut rows: Vec<[[f64; 2]; MUSCLES]> = degrees
            .map(|deg| arms_m(deg).map(|arm| [arm, 0.0]))
            .collect();
        for next in 1..rows.len() {
            let (before, after) = rows.split_at_mut(next);
            for (own, before) in after[0].iter_mut().zip(&before[next - 1]) {
                let mean = 0.5 * (before[0] + own[0]);
                own[1] = before[1] + mean * 1_f64.to_radians();
            }
        }
        let at = rows[(REFERENCE_DEG[joint] - low) as usize];
        for row in &mut rows {
            for (own, reference) in row.iter_mut().zip(&at) {
                own[1] -= reference[1];
            }
        }
        Self {
            from_deg: low,
            rows,
        }
    }

    /// Returns moment arms and shortenings at an angle, by linear interpolation.
    fn at(&self, deg: f64) -> [[f64; 2]; MUSCLES] {
        let last = self.rows.len() - 2;
        let along = (deg - self.from_deg).clamp(0.0, last as f64 + 1.0);
        let row = (along as usize).min(last);
        let part = along - row as f64;
        let (low, high) = (&self.rows[row], &self.rows[row + 1]);
        std::array::from_fn(|muscle| {
            [0, 1].map(|n| low[muscle][n] + part * (high[muscle][n] - low[muscle][n]))
        })
    }
}

/// Moment arms and lengths of one wearer's muscles.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    tables: [Table; JOINTS],
    fibre_length: f64,
}

/// Moment arms and force-length factors of all muscles in one posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PostureGeometry {
    /// Moment arm of each muscle about elbow and shoulder, m, flexion positive.
    pub arms_m: [[f64; JOINTS]; MUSCLES],
    /// Factor by which each muscle's length reduces its force, 0 to 1.
    pub by_length: [f64; MUSCLES],
}

impl Geometry {
    /// Tabulates the muscles for bones of these lengths; `fibre_length` is the field of the same
    /// name in `SagittalSpec`.
    #[must_use]
    pub fn new(lengths: Lengths, fibre_length: f64) -> Self {
        let elbow = |deg: f64| {
            let [biceps, triceps, brachialis, brachioradialis] =
                elbow_arms::arms_m(deg).unwrap_or_default();
            [
                biceps,
                triceps,
                0.0,
                0.0,
                brachialis,
                brachioradialis,
                0.0,
                0.0,
            ]
        };
        let shoulder = |elevation_deg: f64| {
            let bones = Skeleton::new(
                Posture {
                    plane_deg: 0.0,
                    elevation_deg,
                    rotation_deg: 0.0,
                    elbow_deg: REFERENCE_DEG[ELBOW],
                },
                lengths,
            );
            // Raising the arm forward is a rotation about an axis to the right, and y points to the
            // left.
            ALL.map(|muscle| -bones.arms_m(muscle, 0.0)[4])
        };
        Self {
            tables: [Table::new(ELBOW, elbow), Table::new(SHOULDER, shoulder)],
            fibre_length,
        }
    }

    /// Returns the geometry at these flexions of elbow and shoulder, degrees.
    #[must_use]
    pub fn at(&self, flexion_deg: [f64; JOINTS]) -> PostureGeometry {
        let elbow = self.tables[ELBOW].at(flexion_deg[ELBOW]);
        let shoulder = self.tables[SHOULDER].at(flexion_deg[SHOULDER]);
        let length = |muscle: usize| {
            let shorter = elbow[muscle][1] + shoulder[muscle][1];
            self.fibre_length - shorter / BEST_M[muscle]
        };
        PostureGeometry {
            arms_m: std::array::from_fn(|muscle| [elbow[muscle][0], shoulder[muscle][0]]),
            by_length: std::array::from_fn(|muscle| force_length(length(muscle))),
        }
    }
}

impl PostureGeometry {
    /// Returns the torque of each muscle about elbow and shoulder at full activation, N m.
    /// `strength` scales the forces of the sources.
    #[must_use]
    pub fn full_nm(&self, strength: f64) -> [[f64; JOINTS]; MUSCLES] {
        std::array::from_fn(|muscle| {
            let force = strength * force_n(muscle) * self.by_length[muscle];
            self.arms_m[muscle].map(|arm| force * arm)
        })
    }
}

/// Returns the isometric force of a muscle, N: [`DELTOID_N`] for the deltoid, otherwise
/// [`Muscle::force_n`].
#[must_use]
pub(super) const fn force_n(muscle: usize) -> f64 {
    match ALL[muscle] {
        Muscle::DeltoidAnterior => DELTOID_N[0],
        Muscle::DeltoidPosterior => DELTOID_N[1],
        other => other.force_n(),
    }
}

/// Returns the mass of a muscle, kg: force over 0.25 MPa times fibre length times 1,060 kg/m³
/// (Umberger 2003).
pub(super) fn mass_kg(muscle: usize, strength: f64) -> f64 {
    strength * force_n(muscle) / 250e3 * BEST_M[muscle] * 1060.0
}
