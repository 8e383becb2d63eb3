//! What a simulated hand is made of.

use super::field::{Pad, Shape, Tissue};
use super::membrane::Membrane;

/// Stimulation points and what belongs to them: electrodes A and B on the flexors, E on
/// the extensor, and the common return.
pub const ELECTRODES: usize = 4;
/// Point A, the one nearer to the thumb (Hamana 2022, II-B).
pub const A: usize = 0;
/// Point B.
pub const B: usize = 1;
/// The extensor's point.
pub const E: usize = 2;
/// The common return: a large electrode, 4 × 9 cm (Hamana 2022, II-B).
pub const RETURN: usize = 3;

/// Which property of the field charges a nerve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The potential itself: a nerve that ends where the field is.
    Potential,
    /// Its second difference along the fibres: a long straight nerve (Rattay's activating
    /// function).
    Curvature,
    /// The field along the nerve's own direction: a nerve that bends or branches.
    Field,
}

/// Skin under one square centimetre of electrode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinSpec {
    /// Capacitance, F/cm².
    pub farad_per_cm2: f64,
    /// Resistance parallel to it at a small current, Ω·cm².
    pub ohm_cm2: f64,
    /// Resistance in series, Ω, under a round electrode; by area elsewhere.
    pub series_ohm: f64,
    /// Current density at which the parallel resistance has halved, A/cm².
    pub half_a_per_cm2: f64,
}

impl SkinSpec {
    /// Skin of so many times this impedance, at every frequency and current.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            farad_per_cm2: self.farad_per_cm2 / factor,
            ohm_cm2: self.ohm_cm2 * factor,
            series_ohm: self.series_ohm * factor,
            ..self
        }
    }
}

/// What counts once digits move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionSpec {
    /// Moment of inertia of a digit, kg·m².
    pub inertia_kg_m2: f64,
    /// Viscous friction of a digit, N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
    /// From a spike to its effect on the muscle, s.
    pub delay_s: f64,
    /// What is left of a motor unit's force that lasts at 50 Hz; 1 for none that tires.
    pub fatigue_floor: f64,
    /// Time constant of tiring and of recovery, s.
    pub fatigue_time_s: f64,
}

/// A simulated forearm and hand. Lengths in m, times in s.
#[derive(Debug, Clone, PartialEq)]
pub struct HandSpec {
    /// Elbow to wrist.
    pub forearm_m: f64,
    /// Around the forearm.
    pub around_m: f64,
    /// Fat and muscle.
    pub tissue: Tissue,
    /// Under every electrode.
    pub skin: SkinSpec,
    /// How many times as hard an ampere through A, B and E charges nerves as fat and depth
    /// at the place say: both differ from site to site. 1 is as they say.
    pub coupling: [f64; RETURN],
    /// What the return's skin has more than its area says: 1 is by area.
    pub return_factor: f64,
    /// What the stages' limiter lets through, A.
    pub limiter_a: f64,
    /// What charges a nerve.
    pub rule: Rule,
    /// The nerves.
    pub membrane: Membrane,
    /// Whether what one pulse leaves in a nerve adds to the next; `false` is an ablation.
    pub sums: bool,
    /// Standard deviation of the logarithm of thresholds within a pool.
    pub threshold_spread: f64,
    /// How far nerves of a pool lie apart and how much their thresholds differ, as a part
    /// of what `threshold_spread` and [`super::pools::Place::spread`] say: 1 is as they
    /// say, less a pool that is recruited within fewer volts.
    pub scatter: f64,
    /// Motor units of each pool.
    pub units: usize,
    /// Skin over muscle per degree of pronation, around the forearm, m/°.
    pub shift_m_per_deg: f64,
    /// Isometric torque of a pool with every unit at 50 Hz, N·m: of each flexor.
    pub flexor_nm: f64,
    /// The same of the index finger's extensor.
    pub extensor_nm: f64,
    /// Stiffness of a free digit, N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// How a digit moves, and how muscles tire.
    pub motion: MotionSpec,
    /// Decides where nerves are, their thresholds and directions.
    pub seed: u64,
}

/// Diameter of a round electrode, m (Hamana 2022, II-B).
pub const ROUND_M: f64 = 0.025;
/// The small one, along and around, m.
pub const SMALL_M: [f64; 2] = [0.020, 0.015];
/// The return, along and around, m.
pub const RETURN_M: [f64; 2] = [0.04, 0.09];
/// Elbow to wrist as a part of elbow to finger tip. Assumed, of common proportions.
const FOREARM_PART: f64 = 0.58;

impl MotionSpec {
    /// Assumed: joint and delay as in the finger of `body::finger`; that half of a unit's
    /// force is left, over 20 s, is the middle of what is drawn (floor 0.3 to 0.7, time 10
    /// to 40 s), for endurance at 50 Hz and surface electrodes is not at hand.
    pub const NOMINAL: Self = Self {
        inertia_kg_m2: 4e-5,
        damping_nm_s_per_rad: 0.018,
        delay_s: 0.025,
        fatigue_floor: 0.5,
        fatigue_time_s: 20.0,
    };
}

impl HandSpec {
    /// Of a person whose elbow is `reach_m` from the tip of the hand and whose forearm is
    /// `around_m` around (Hamana 2022, table 1). All else is the middle of its range.
    #[must_use]
    pub fn nominal(reach_m: f64, around_m: f64, seed: u64) -> Self {
        Self {
            forearm_m: FOREARM_PART * reach_m,
            around_m,
            tissue: Tissue {
                fat_m: 0.004,
                fat_s_per_m: 1.0 / 30.0,
                along_s_per_m: 0.35,
                across_s_per_m: 0.086,
            },
            skin: SkinSpec {
                farad_per_cm2: 25e-9,
                ohm_cm2: 8e3,
                series_ohm: 250.0,
                half_a_per_cm2: 3e-3,
            },
            coupling: [1.0; RETURN],
            return_factor: 1.0,
            limiter_a: 0.020,
            rule: Rule::Curvature,
            membrane: Membrane {
                leak_s: 200e-6,
                absolute_s: 2.75e-3,
                relative_s: 5e-3,
            },
            sums: true,
            threshold_spread: 0.2,
            scatter: 1.0,
            units: 32,
            shift_m_per_deg: 1.0e-4,
            flexor_nm: 0.5,
            extensor_nm: 0.35,
            stiffness_nm_per_rad: 0.12,
            motion: MotionSpec::NOMINAL,
            seed,
        }
    }

    /// The same with elbow to tip of the hand `reach_m` long.
    #[must_use]
    pub fn with_reach(self, reach_m: f64) -> Self {
        Self {
            forearm_m: FOREARM_PART * reach_m,
            ..self
        }
    }

    /// The return, across the forearm just above the wrist (its place is assumed).
    #[must_use]
    pub fn return_pad(&self) -> Pad {
        Pad {
            x_m: self.forearm_m - 0.5 * RETURN_M[0],
            y_m: 0.0,
            shape: Shape::Rectangle {
                along_m: RETURN_M[0],
                around_m: RETURN_M[1],
            },
        }
    }

    /// A round electrode at this place.
    #[must_use]
    pub const fn round_pad(x_m: f64, y_m: f64) -> Pad {
        Pad {
            x_m,
            y_m,
            shape: Shape::Round {
                diameter_m: ROUND_M,
            },
        }
    }
}
