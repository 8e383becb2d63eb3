//! Parameters of a simulated hand.

use super::field::{Pad, Shape, Tissue};
use super::membrane::Membrane;

/// Number of electrodes: A and B on the flexors, E on the extensor, and the common return.
pub const ELECTRODES: usize = 4;
/// Index of point A, the one nearer to the thumb (Hamana 2022, II-B).
pub const A: usize = 0;
/// Index of point B, the one farther from the thumb.
pub const B: usize = 1;
/// Index of the point on the extensor.
pub const E: usize = 2;
/// Index of the common return, a large electrode of 4 × 9 cm (Hamana 2022, II-B).
pub const RETURN: usize = 3;

/// Property of the field that charges a nerve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The potential itself, for a nerve that ends where the field is.
    Potential,
    /// The second derivative along the fibres, for a long straight nerve (Rattay's activating
    /// function).
    Curvature,
    /// The field along the nerve's own direction, for a nerve that bends or branches.
    Field,
}

/// Electrical properties of skin under one square centimetre of electrode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinSpec {
    /// Capacitance per area, F/cm².
    pub farad_per_cm2: f64,
    /// Resistance parallel to the capacitance at a small current, Ω·cm².
    pub ohm_cm2: f64,
    /// Series resistance under a round electrode, Ω. Under other electrodes it is inversely
    /// proportional to their area.
    pub series_ohm: f64,
    /// Current density at which the parallel resistance is halved, A/cm².
    pub half_a_per_cm2: f64,
}

impl SkinSpec {
    /// Returns skin with `factor` times this impedance, at every frequency and current.
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

/// Parameters of the motion of digits and of fatigue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionSpec {
    /// Moment of inertia of a digit, kg·m².
    pub inertia_kg_m2: f64,
    /// Viscous friction of a digit, N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
    /// Delay from a spike to its effect on the muscle, s.
    pub delay_s: f64,
    /// Share of a motor unit's force that remains at a sustained 50 Hz; 1 for a unit without
    /// fatigue.
    pub fatigue_floor: f64,
    /// Time constant of fatigue and of recovery, s.
    pub fatigue_time_s: f64,
}

/// Parameters of a simulated forearm and hand. Lengths are in m, times in s.
#[derive(Debug, Clone, PartialEq)]
pub struct HandSpec {
    /// Distance from elbow to wrist, m.
    pub forearm_m: f64,
    /// Circumference of the forearm, m.
    pub around_m: f64,
    /// Layers and conductivities of fat and muscle.
    pub tissue: Tissue,
    /// Skin under every electrode.
    pub skin: SkinSpec,
    /// Factor on the drive of nerves per ampere through A, B and E, because fat and depth differ
    /// from site to site. 1 is the value that the field model gives.
    pub coupling: [f64; RETURN],
    /// Factor on the impedance of the skin under the return; 1 is the value for its area.
    pub return_factor: f64,
    /// Current limit of the output stages, A.
    pub limiter_a: f64,
    /// Property of the field that charges a nerve.
    pub rule: Rule,
    /// Leak and refractory times of the nerves.
    pub membrane: Membrane,
    /// Whether the charge that a pulse leaves in a nerve adds to that of the next; `false` is an
    /// ablation.
    pub sums: bool,
    /// Standard deviation of the logarithm of thresholds within a pool.
    pub threshold_spread: f64,
    /// Factor on `threshold_spread` and [`super::pools::Place::spread`]: 1 leaves them as they are;
    /// a smaller value gives pools that are recruited within fewer volts.
    pub scatter: f64,
    /// Number of motor units of each pool.
    pub units: usize,
    /// Shift of the skin over the muscle per degree of pronation, around the forearm, m/°.
    pub shift_m_per_deg: f64,
    /// Isometric torque of each flexor pool with every unit at 50 Hz, N·m.
    pub flexor_nm: f64,
    /// Isometric torque of the index finger's extensor with every unit at 50 Hz, N·m.
    pub extensor_nm: f64,
    /// Stiffness of a free digit, N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Motion of the digits, and fatigue of the muscles.
    pub motion: MotionSpec,
    /// Seed of the nerves' positions, thresholds and directions.
    pub seed: u64,
}

/// Diameter of a round electrode, m (Hamana 2022, II-B).
pub const ROUND_M: f64 = 0.025;
/// Sides of the small rectangular electrode, along and around the forearm, m.
pub const SMALL_M: [f64; 2] = [0.020, 0.015];
/// Sides of the common return, along and around the forearm, m.
pub const RETURN_M: [f64; 2] = [0.04, 0.09];
/// Distance from elbow to wrist over that from elbow to finger tip. Assumed, of common proportions.
const FOREARM_PART: f64 = 0.58;

impl MotionSpec {
    /// Nominal motion and fatigue, assumed: joint and delay as in the finger of `body::finger`.
    /// Fatigue leaves half of a unit's force, with a time constant of 20 s. Both are the middle of
    /// the random ranges (floor 0.3 to 0.7, time 10 to 40 s), because no data on endurance at 50 Hz
    /// with surface electrodes is at hand.
    pub const NOMINAL: Self = Self {
        inertia_kg_m2: 4e-5,
        damping_nm_s_per_rad: 0.018,
        delay_s: 0.025,
        fatigue_floor: 0.5,
        fatigue_time_s: 20.0,
    };
}

impl HandSpec {
    /// Returns the hand of a wearer with `reach_m` from the elbow to the tip of the hand and a
    /// forearm circumference of `around_m` (Hamana 2022, table 1). Every other value is the middle
    /// of its range.
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

    /// Returns the same hand with `reach_m` from the elbow to the tip of the hand.
    #[must_use]
    pub fn with_reach(self, reach_m: f64) -> Self {
        Self {
            forearm_m: FOREARM_PART * reach_m,
            ..self
        }
    }

    /// Returns the return electrode, across the forearm just above the wrist (its place is
    /// assumed).
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

    /// Returns a round electrode at this position, m.
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
