//! Random wearers: the muscles that their electrodes reach, and how strongly.

use super::declared::RampsDeclaration;
use super::error::RampsError;
use hal_sim::body::bench::arms::{MUSCLES, Muscle, Source};
use hal_sim::body::bench::elbow::{FORCE_FREQUENCY_HZ, max_force_n};
use hal_sim::body::bench::{
    CellSide, IsometricSpec, Pool, RigMuscle, SensorSpec, StrengthDuration,
};
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use hal_sim::random;

/// Pulse width to which the random thresholds refer, except that of the biceps, µs (as in
/// harris-wall).
const TRICEPS_US: f64 = 35.0;
/// Pulse width to which the random threshold of the biceps refers, µs (as in harris-wall).
const BICEPS_US: f64 = 25.0;
/// Distance from the elbow to the load cell, m. Assumed; the torque does not depend on it.
const LEVER_M: f64 = 0.25;
/// Range of the load cell, N. Assumed: 50 lbf.
const CELL_N: f64 = 222.0;
/// Electromechanical delay, µs, the same as that of the moving elbow.
const DELAY_US: u32 = 25_000;
/// Random stream of a wearer's chronaxies.
const CHRONAXIES: u64 = 1;
/// Random stream of the strengths of a wearer's contractions.
const CONTRACTIONS: u64 = 2;
/// Random stream of the errors in a test's angle.
const SETTINGS: u64 = 3;

/// Simulated wearer in the isometric test rig.
#[derive(Clone, Debug)]
pub struct RampsWearer {
    /// Index of the draw, from 0.
    pub index: u64,
    /// Random parameters, in the order of the declared ranges.
    pub drawn: Vec<f64>,
    /// Source of the moment arms that are true for this wearer.
    pub source: Source,
    /// Muscles that the electrodes reach.
    pub muscles: Vec<RigMuscle>,
    /// Relative standard deviation of the strength from contraction to contraction.
    noise: f64,
    cell_noise_n: f64,
    cell_drift_n_per_s: f64,
    stream: u64,
}

/// Position and contraction of a wearer in the test rig.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Angle between forearm and upper arm, °.
    pub included_deg: f64,
    /// Strength of this contraction relative to the mean one.
    pub contraction: f64,
    /// Direction in which the cell is mounted.
    pub holds: CellSide,
}

impl Setting {
    /// Returns the setting with exactly this angle and the mean contraction.
    #[must_use]
    pub const fn exact(included_deg: f64) -> Self {
        Self {
            included_deg,
            contraction: 1.0,
            holds: CellSide::Extension,
        }
    }
}

impl RampsWearer {
    /// Generates wearer `index` of `seed`.
    ///
    /// # Errors
    /// Returns E690 if a range is missing, or E691 if the random values are invalid.
    pub fn random(declared: &RampsDeclaration, seed: u64, index: u64) -> Result<Self, RampsError> {
        let drawn = declared.draw_values(seed, index);
        let of = |field: &str| declared.value(&drawn, field);
        let stream = random::word(random::word(seed, index), u64::MAX);
        let subject = of("subject")? as usize; // 0 to 9
        let dynamics = SUBJECTS[subject % SUBJECTS.len()].normalised_at(FORCE_FREQUENCY_HZ);
        let muscle = |muscle| stimulated(&of, muscle, stream, dynamics);
        let muscles = MUSCLES.into_iter().map(muscle).collect::<Result<_, _>>()?;
        Ok(Self {
            index,
            source: match of("arms")? < 1.0 {
                true => Source::RankinNeptune,
                false => Source::MuscleArms,
            },
            muscles,
            noise: of("noise")?,
            cell_noise_n: of("cell_noise_n")?,
            cell_drift_n_per_s: of("cell_drift_n_per_min")? / 60.0,
            stream,
            drawn,
        })
    }

    /// Returns the setting of test `nth`: the angle with a random error of at most `error_deg`, and
    /// a random contraction.
    #[must_use]
    pub fn setting(&self, nth: u64, included_deg: f64, error_deg: f64, holds: CellSide) -> Setting {
        let deviate = random::standard_normal(random::word(self.stream, CONTRACTIONS), nth);
        let part = random::unit(random::word(self.stream, SETTINGS), nth);
        Setting {
            included_deg: included_deg + error_deg * (2.0 * part - 1.0),
            contraction: libm::exp(self.noise * deviate),
            holds,
        }
    }

    /// Returns the specification of the test rig with this wearer in it.
    #[must_use]
    pub fn rig_spec(&self, setting: Setting) -> IsometricSpec {
        IsometricSpec {
            included_deg: setting.included_deg,
            source: self.source,
            has_force_length: true,
            channels: [0, 1],
            muscles: self.muscles.clone(),
            contraction: setting.contraction,
            electromechanical_delay_us: DELAY_US,
            holds: setting.holds,
            cell: SensorSpec {
                lever_m: LEVER_M,
                believed_lever_m: LEVER_M,
                noise_n: self.cell_noise_n,
                offset_n: 0.0,
                drift_n_per_s: self.cell_drift_n_per_s,
                wander_n_per_sqrt_s: 0.0,
                range_n: CELL_N,
                is_upside_down: false,
            },
            load_ohm: 1_000.0,
        }
    }

    /// Returns the seed of the noise in test `nth`.
    #[must_use]
    pub const fn seed(&self, nth: u64) -> u64 {
        random::word(self.stream, 16 + nth)
    }

    /// Returns for each muscle its torque, N·m, extension positive, and its excited share, 0 to 1,
    /// under this pulse at 50 Hz in the mean contraction.
    ///
    /// # Errors
    /// Returns E691 if no source covers the angle.
    pub fn steady(
        &self,
        spec: &IsometricSpec,
        pair: usize,
        (current_ma, width_us): (f64, f64),
    ) -> Result<Vec<(Muscle, f64, f64)>, RampsError> {
        let one = |of: &RigMuscle| {
            let share = of.share(pair, current_ma, width_us);
            let most_nm = spec.max_torque_nm(of).map_err(|_| BEYOND)?;
            Ok((of.muscle, share * most_nm, share))
        };
        self.muscles.iter().map(one).collect()
    }
}

/// Returns a muscle with random parameters, which `of` returns by name.
fn stimulated(
    of: &dyn Fn(&str) -> Result<f64, RampsError>,
    muscle: Muscle,
    stream: u64,
    dynamics: Parameters,
) -> Result<RigMuscle, RampsError> {
    let triceps_ma = of("threshold_ma")?;
    let (lowest_ma, reference_us) = match muscle {
        Muscle::Biceps => (of("biceps_threshold_ma")?, BICEPS_US),
        Muscle::Brachialis | Muscle::Deltoid => (of("others")? * triceps_ma, TRICEPS_US),
        _ => (triceps_ma, TRICEPS_US),
    };
    let middle_ma = of("middle")? * lowest_ma;
    let deviate =
        random::standard_normal(random::word(stream, CHRONAXIES), chronaxie_group(muscle));
    Ok(RigMuscle {
        muscle,
        force_n: of("strength")? * of("reached")? * max_force_n(muscle),
        pool: Pool::new(lowest_ma, middle_ma, 0.5 * (middle_ma - lowest_ma))?,
        strength: StrengthDuration {
            chronaxie_us: of("chronaxie_us")? * libm::exp(of("chronaxie_apart")? * deviate),
            reference_us,
        },
        reached: current_fractions(of, muscle)?,
        length_at_90: match muscle {
            Muscle::Biceps => of("biceps_at_90")?,
            _ => of("long_head_at_90")?,
        },
        dynamics,
    })
}

/// Returns the fraction of each pair's current that reaches a muscle.
fn current_fractions(
    of: &dyn Fn(&str) -> Result<f64, RampsError>,
    muscle: Muscle,
) -> Result<[f64; 2], RampsError> {
    let (near_mm, falloff) = (of("near_mm")?, of("falloff")?);
    let left = |field: &str| -> Result<f64, RampsError> {
        Ok(libm::pow((near_mm / of(field)?).min(1.0), falloff))
    };
    Ok(match muscle {
        Muscle::TricepsLong | Muscle::TricepsLateral => [1.0, left("biceps_mm")?],
        Muscle::TricepsMedial => [left("medial_mm")?, left("biceps_mm")?],
        Muscle::Biceps => [left("biceps_mm")?, 1.0],
        Muscle::Brachialis => [left("brachialis_mm")?, left("under_biceps_mm")?],
        Muscle::Deltoid => [left("deltoid_mm")?; 2],
    })
}

/// Error for an angle that no source covers.
pub(super) const BEYOND: hal_sim::body::bench::InvalidBench =
    hal_sim::body::bench::InvalidBench("included_deg");

/// Returns the group of muscle heads that share one chronaxie.
const fn chronaxie_group(muscle: Muscle) -> u64 {
    match muscle {
        Muscle::TricepsLong | Muscle::TricepsLateral | Muscle::TricepsMedial => 0,
        Muscle::Biceps => 1,
        Muscle::Brachialis => 2,
        Muscle::Deltoid => 3,
    }
}

/// Returns whether `muscle` is a head of the triceps.
#[must_use]
pub const fn is_triceps(muscle: Muscle) -> bool {
    chronaxie_group(muscle) == 0
}

/// Returns the name for the report.
#[must_use]
pub const fn in_words(muscle: Muscle) -> &'static str {
    match muscle {
        Muscle::TricepsLong => "triceps, long head",
        Muscle::TricepsLateral => "triceps, lateral head",
        Muscle::TricepsMedial => "triceps, medial head",
        Muscle::Biceps => "biceps",
        Muscle::Brachialis => "brachialis",
        Muscle::Deltoid => "deltoid",
    }
}
