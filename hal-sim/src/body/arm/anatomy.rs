//! Muscle groups of the arm, their attachments, and the electrode over each.
//!
//! The attachments of the shoulder muscles are those of the published model DAS3 (Chadwick 2014,
//! 10.1109/TBME.2014.2309727; one middle element of each group). DAS3 gives them per bone, in its
//! own axes: x to the right, y up, z backward. The values are cited; no file of the model is stored
//! here. A line of action that would pass through the joint wraps around a sphere about the joint.

use nalgebra::Vector3;

/// Number of stimulated muscle groups (Sierotowicz 2023, section 2.4).
pub const ELECTRODES: usize = 9;
/// Number of muscles: the stimulated groups, and two that their electrodes may also reach.
pub const MUSCLES: usize = 11;

/// Muscle group of the arm. Each of the first nine lies under the electrode with the same index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Muscle {
    /// Biceps brachii; crosses shoulder and elbow.
    Biceps,
    /// Triceps brachii; its long head crosses the shoulder.
    Triceps,
    /// Deltoid, middle part (the paper's *superior*).
    DeltoidSuperior,
    /// Deltoid, clavicular part.
    DeltoidAnterior,
    /// Deltoid, part from the scapula's spine.
    DeltoidPosterior,
    /// Pectoralis major, clavicular head.
    PectoralisClavicular,
    /// Pectoralis major, sternocostal head; crosses both shoulder joints.
    PectoralisSternal,
    /// Trapezius, scapular part (the paper's *trapezoid scapular*).
    Trapezius,
    /// Latissimus dorsi; crosses both shoulder joints.
    Latissimus,
    /// Brachialis; has no electrode.
    Brachialis,
    /// Brachioradialis; has no electrode.
    Brachioradialis,
}

/// Every muscle, in the order of the enum.
pub const ALL: [Muscle; MUSCLES] = [
    Muscle::Biceps,
    Muscle::Triceps,
    Muscle::DeltoidSuperior,
    Muscle::DeltoidAnterior,
    Muscle::DeltoidPosterior,
    Muscle::PectoralisClavicular,
    Muscle::PectoralisSternal,
    Muscle::Trapezius,
    Muscle::Latissimus,
    Muscle::Brachialis,
    Muscle::Brachioradialis,
];

/// A bone to which muscles attach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bone {
    /// Fixed; origin at the incisura jugularis.
    Thorax,
    /// Origin at the sternoclavicular joint.
    Clavicle,
    /// Origin at the acromion's angle.
    Scapula,
    /// Origin at the glenohumeral joint.
    Humerus,
}

/// Line of action of a muscle about the shoulder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Bone and point of origin, in the axes of DAS3 for that bone, m.
    pub origin: (Bone, [f64; 3]),
    /// Bone and point of insertion, m.
    pub insertion: (Bone, [f64; 3]),
    /// Radius of the sphere about the glenohumeral joint around which the line wraps, m; 0 if the
    /// line does not wrap.
    pub wrap_m: f64,
}

/// Radius of the sphere around which the deltoid's lines of action wrap, m: the humeral head plus
/// the thickness of the muscle itself. Assumed (20 to 32 mm).
const DELTOID_WRAP_M: f64 = 0.026;

const fn line(origin: (Bone, [f64; 3]), insertion: [f64; 3], wrap_m: f64) -> Line {
    Line {
        origin,
        insertion: (Bone::Humerus, insertion),
        wrap_m,
    }
}

impl Muscle {
    /// Returns the line of action about the shoulder, or `None` for a muscle that crosses only the
    /// elbow.
    #[must_use]
    pub const fn line(self) -> Option<Line> {
        use Bone::{Clavicle, Scapula, Thorax};
        Some(match self {
            // Element trap_scap_6.
            Self::Trapezius => Line {
                origin: (Thorax, [-0.0043, -0.0002, 0.1363]),
                insertion: (Scapula, [-0.068_21, 0.007_23, 0.002_77]),
                wrap_m: 0.0,
            },
            // Elements delt_scap_9, delt_clav_2 and delt_scap_2, in this order.
            Self::DeltoidSuperior => line(
                (Scapula, [0.015_69, 0.0048, -0.024_14]),
                [0.018_47, -0.117_38, -0.004_94],
                DELTOID_WRAP_M,
            ),
            Self::DeltoidAnterior => line(
                (Clavicle, [0.129_12, 0.025_78, 0.004_98]),
                [0.015_36, -0.118_83, -0.011_59],
                DELTOID_WRAP_M,
            ),
            Self::DeltoidPosterior => line(
                (Scapula, [-0.049_99, 0.006_27, 0.001_13]),
                [0.015_55, -0.096_45, 0.005_28],
                DELTOID_WRAP_M,
            ),
            // Elements pect_maj_c_1, pect_maj_t_2 and lat_dorsi_4, in this order.
            Self::PectoralisClavicular => line(
                (Clavicle, [0.062_98, 0.010_75, -0.016_36]),
                [0.011_84, -0.088_69, -0.015_55],
                0.0,
            ),
            Self::PectoralisSternal => line(
                (Thorax, [0.0279, -0.1403, -0.0392]),
                [0.010_89, -0.068_75, -0.017_02],
                0.0,
            ),
            Self::Latissimus => line(
                (Thorax, [0.0211, -0.3109, 0.128]),
                [0.001_38, -0.037_89, -0.017_64],
                0.0,
            ),
            // The short head originates at the coracoid, at the same point as coracobr_1. The long
            // head passes over the joint and has no moment there, so half of the muscle acts
            // (assumed). The muscle leaves the shoulder along the front of the humerus (assumed).
            Self::Biceps => line(
                (Scapula, [-0.008_08, -0.0086, -0.076_55]),
                [0.0, -0.20, -0.020],
                0.0,
            ),
            // The long head originates below the socket (assumed: 25 mm below and 10 mm inward of
            // the joint, which lies at 0.002, -0.023, -0.0439).
            Self::Triceps => line(
                (Scapula, [-0.008, -0.048, -0.0439]),
                [0.0, -0.20, 0.022],
                0.0,
            ),
            Self::Brachialis | Self::Brachioradialis => return None,
        })
    }

    /// Returns the share of the muscle's force that crosses the shoulder, 0 to 1.
    #[must_use]
    pub fn shoulder_part(self) -> f64 {
        match self {
            Self::Biceps => 0.5,
            Self::Triceps => {
                let [long, lateral, medial] = super::elbow_arms::TRICEPS_N;
                long / (long + lateral + medial)
            }
            _ => 1.0,
        }
    }

    /// Returns the isometric force of the whole muscle, N. Sources: DAS3, summed over the elements
    /// of the muscle (trap_scap_5 to 10; delt_scap_6 to 11, delt_clav_1 to 4, delt_scap_1 to 5;
    /// pect_maj_c_1 and 2; pect_maj_t; lat_dorsi), arm26 (biceps, triceps, brachialis) and Holzbaur
    /// 2005 (brachioradialis). Only three of the six elements of pect_maj_t and of lat_dorsi were
    /// looked up; their sum is doubled.
    #[must_use]
    pub const fn force_n(self) -> f64 {
        match self {
            Self::Biceps => 1059.9,
            Self::Triceps => 2047.1,
            Self::DeltoidSuperior => 1619.0,
            Self::DeltoidAnterior => 505.0,
            Self::DeltoidPosterior => 1183.0,
            Self::PectoralisClavicular => 292.0,
            Self::PectoralisSternal => 882.0,
            Self::Trapezius => 662.0,
            Self::Latissimus => 578.0,
            Self::Brachialis => 987.3,
            Self::Brachioradialis => 261.3,
        }
    }

    /// Returns the adjacent muscles, which the electrode of this muscle may also reach.
    #[must_use]
    pub const fn neighbours(self) -> &'static [Self] {
        match self {
            Self::Biceps => &[Self::Brachialis, Self::Brachioradialis],
            Self::Triceps => &[Self::Brachioradialis, Self::DeltoidPosterior],
            Self::DeltoidSuperior => &[Self::DeltoidAnterior, Self::DeltoidPosterior],
            Self::DeltoidAnterior => &[Self::DeltoidSuperior, Self::PectoralisClavicular],
            Self::DeltoidPosterior => &[Self::DeltoidSuperior, Self::Triceps],
            Self::PectoralisClavicular => &[Self::PectoralisSternal, Self::DeltoidAnterior],
            Self::PectoralisSternal => &[Self::PectoralisClavicular],
            Self::Trapezius => &[Self::DeltoidSuperior],
            Self::Latissimus => &[Self::Triceps],
            Self::Brachialis | Self::Brachioradialis => &[],
        }
    }

    /// Returns the anatomical name, for messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Biceps => "biceps brachii",
            Self::Triceps => "triceps brachii",
            Self::DeltoidSuperior => "deltoid superior",
            Self::DeltoidAnterior => "deltoid anterior",
            Self::DeltoidPosterior => "deltoid posterior",
            Self::PectoralisClavicular => "pectoralis clavicular",
            Self::PectoralisSternal => "pectoralis sternocostal",
            Self::Trapezius => "trapezius scapular",
            Self::Latissimus => "latissimus dorsi",
            Self::Brachialis => "brachialis",
            Self::Brachioradialis => "brachioradialis",
        }
    }
}

/// Converts a vector from the axes of DAS3 to those of the body: x forward, y to the left, z up.
#[must_use]
pub fn from_das3([x, y, z]: [f64; 3]) -> Vector3<f64> {
    Vector3::new(-z, -x, y)
}
