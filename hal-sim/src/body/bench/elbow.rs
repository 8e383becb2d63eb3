//! Test rig that holds an elbow at an angle, with a load cell between the forearm's platform and a
//! wall (Harris 2017, figure 4): one pair of electrodes over the triceps, one over the biceps, and
//! the other muscles near enough to be stimulated.
//!
//! Torque is Σ force · moment arm. The force of a muscle is the share of its fibres that a pulse
//! excites (`recruitment`, by the current that reaches the muscle), passed through calcium-force
//! dynamics and multiplied by the force–length factor. Everything is simulated; each assumed number
//! says so.

use super::InvalidBench;
use super::arms::{BeyondFit, Muscle, Source, arm_m, elongation_m, length_m};
use super::recruitment::{Pool, StrengthDuration};
use super::sensor::{SAMPLE_US, Sensor, SensorSpec};
use crate::body::muscle::{self, Parameters, Step};
use crate::body::{Body, CHANNELS, Load, Pulse};
use std::collections::VecDeque;

/// Pulse rate to which the `force_n` of a muscle refers, Hz.
pub const FORCE_FREQUENCY_HZ: f64 = 50.0;
/// Number of electrode pairs: one over the triceps, one over the biceps.
pub const PAIRS: usize = 2;
/// Index of the pair over the triceps.
pub const TRICEPS: usize = 0;
/// Index of the pair over the biceps.
pub const BICEPS: usize = 1;

/// Width of the active force–length curve, exp(−(l − 1)²/γ) with l the length of the fibres over
/// their optimal length (Thelen 2003, equation 4; γ as in arm26.osim for these muscles).
const GAMMA: f64 = 0.5;

/// Direction in which the wire of the load cell holds the arm; the wire can only pull.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellSide {
    /// Extension tightens the wire (Harris, figure 4); flexion leaves it slack.
    Extension,
    /// The cell is on the other side: flexion tightens the wire.
    Flexion,
}

/// Parameters of a muscle in the test rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigMuscle {
    /// Anatomical muscle, which determines moment arm and length.
    pub muscle: Muscle,
    /// Force of all fibres that any electrode can reach, at [`FORCE_FREQUENCY_HZ`] and optimal
    /// length, N.
    pub force_n: f64,
    /// Distribution of the fibres' thresholds, for the current that reaches them.
    pub pool: Pool,
    /// Strength-duration relation of the fibres.
    pub strength: StrengthDuration,
    /// Share of each pair's current that reaches the muscle across the distance, 0 to 1.
    pub reached: [f64; PAIRS],
    /// Length of the fibres at 90° over their optimal length. Unused for a muscle whose
    /// musculotendon length is known, because the fibre length follows from that.
    pub length_at_90: f64,
    /// Calcium-force dynamics, normalised to a force of 1 at [`FORCE_FREQUENCY_HZ`].
    pub dynamics: Parameters,
}

/// Parameters of an elbow in the test rig.
#[derive(Debug, Clone, PartialEq)]
pub struct IsometricSpec {
    /// Angle between forearm and upper arm, degrees, as Harris measures it: 180° less flexion.
    pub included_deg: f64,
    /// Source of the true moment arms.
    pub source: Source,
    /// Whether a muscle's force depends on the length of its fibres; `false` ignores the
    /// force–length curve.
    pub has_force_length: bool,
    /// Channels of the pair over the triceps and of that over the biceps, 0 to 9.
    pub channels: [usize; PAIRS],
    /// Muscles that the electrodes can stimulate.
    pub muscles: Vec<RigMuscle>,
    /// Strength of this contraction relative to the mean one; above 0.
    pub contraction: f64,
    /// Delay from a pulse to its effect on a muscle, µs.
    pub electromechanical_delay_us: u32,
    /// Side on which the load cell is mounted.
    pub holds: CellSide,
    /// Parameters of the load cell and its lever.
    pub cell: SensorSpec,
    /// Resistance of every electrode pair, Ω.
    pub load_ohm: f64,
}

/// Returns the length of a muscle's tendon and the optimal length of its fibres, m (arm26.osim,
/// after Holzbaur 2005; for the biceps the mean of the two heads, weighted by force).
const fn tendon_and_fibre_m(muscle: Muscle) -> (f64, f64) {
    match muscle {
        Muscle::TricepsLong => (0.143, 0.134),
        Muscle::TricepsLateral => (0.098, 0.1138),
        Muscle::TricepsMedial => (0.0908, 0.1138),
        Muscle::Biceps => (0.2394, 0.1224),
        Muscle::Brachialis => (0.0535, 0.0858),
        Muscle::Deltoid => (0.0, 1.0),
    }
}

/// Returns the largest isometric force, N. Sources: arm26.osim (for the biceps, both heads
/// together); for the posterior deltoid, which does not move the elbow, Holzbaur 2005, quoted from
/// memory.
#[must_use]
pub const fn max_force_n(muscle: Muscle) -> f64 {
    match muscle {
        Muscle::TricepsLong => 798.52,
        Muscle::TricepsLateral | Muscle::TricepsMedial => 624.3,
        Muscle::Biceps => 624.3 + 435.56,
        Muscle::Brachialis => 987.26,
        Muscle::Deltoid => 259.88,
    }
}

/// Returns the length of a muscle's fibres over their optimal length, with a rigid tendon. For the
/// heads of the triceps that do not cross the shoulder and for the brachialis it follows from
/// Rankin & Neptune's lengths; for the others from `at_90` and the integral of the moment arm.
///
/// # Errors
/// Returns [`BeyondFit`] if the angle is outside the range of the sources.
pub fn fibre_length(muscle: Muscle, at_90: f64, flexion_deg: f64) -> Result<f64, BeyondFit> {
    let (tendon_m, best_m) = tendon_and_fibre_m(muscle);
    Ok(match length_m(muscle, flexion_deg)? {
        Some(length_m) => (length_m - tendon_m) / best_m,
        None => at_90 + elongation_m(Source::RankinNeptune, muscle, flexion_deg)? / best_m,
    })
}

/// Returns the factor by which this relative length reduces a muscle's force, 0 to 1.
#[must_use]
pub fn force_length(fibre_length: f64) -> f64 {
    libm::exp(-(fibre_length - 1.0).powi(2) / GAMMA)
}

impl RigMuscle {
    /// Returns the share of the fibres that a pulse of a pair excites, 0 to 1.
    #[must_use]
    pub fn share(&self, pair: usize, current_ma: f64, width_us: f64) -> f64 {
        let reached = self.reached.get(pair).copied().unwrap_or_default();
        let strength = self.strength.equivalent_ma(reached * current_ma, width_us);
        self.pool.share(strength)
    }
}

impl IsometricSpec {
    /// Returns the flexion of the elbow, degrees, 0 with the arm straight.
    #[must_use]
    pub fn flexion_deg(&self) -> f64 {
        180.0 - self.included_deg
    }

    /// Returns the torque of a muscle all of whose reachable fibres are excited, N·m, extension
    /// positive.
    ///
    /// # Errors
    /// Returns [`BeyondFit`] if the angle is outside the range of the sources.
    pub fn max_torque_nm(&self, rig_muscle: &RigMuscle) -> Result<f64, BeyondFit> {
        let flexion_deg = self.flexion_deg();
        let arm_m = arm_m(self.source, rig_muscle.muscle, flexion_deg)?;
        let length = fibre_length(rig_muscle.muscle, rig_muscle.length_at_90, flexion_deg)?;
        let lasting = match self.has_force_length {
            true => force_length(length),
            false => 1.0,
        };
        Ok(-arm_m * lasting * rig_muscle.force_n * self.contraction)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Returns the name of the first field whose value is out of range.
    pub fn validate(&self) -> Result<(), InvalidBench> {
        self.cell.validate()?;
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let part = |v: &f64| (0.0..=1.0).contains(v);
        let [first, second] = self.channels;
        let muscles = |rule: &dyn Fn(&RigMuscle) -> bool| self.muscles.iter().all(rule);
        let rules = [
            (
                "included_deg",
                arm_m(self.source, Muscle::Biceps, self.flexion_deg()).is_ok(),
            ),
            ("channels", first.max(second) < CHANNELS && first != second),
            ("contraction", positive(self.contraction)),
            ("load_ohm", positive(self.load_ohm)),
            (
                "force_n",
                muscles(&|stimulation| {
                    stimulation.force_n.is_finite() && stimulation.force_n >= 0.0
                }),
            ),
            (
                "reached",
                muscles(&|stimulation| stimulation.reached.iter().all(part)),
            ),
            (
                "length_at_90",
                muscles(&|stimulation| positive(stimulation.length_at_90)),
            ),
            (
                "chronaxie_us",
                muscles(&|stimulation| positive(stimulation.strength.chronaxie_us)),
            ),
            (
                "reference_us",
                muscles(&|stimulation| positive(stimulation.strength.reference_us)),
            ),
            (
                "dynamics",
                muscles(&|stimulation| stimulation.dynamics.all().into_iter().all(positive)),
            ),
        ];
        match rules.into_iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidBench(field)),
            None => Ok(()),
        }
    }
}

/// A muscle and its present activation.
#[derive(Debug, Clone, PartialEq)]
struct MuscleState {
    spec: RigMuscle,
    most_nm: f64,
    muscle: muscle::Muscle,
    step: Step,
    /// Share excited by the last pulse that excited any fibre.
    share: f64,
    /// Whether a pulse ever excited a fibre.
    is_awake: bool,
}

/// Isometric elbow over time; the limb itself does not move. The simulation is deterministic:
/// pulses and seed determine every value.
#[derive(Debug, Clone, PartialEq)]
pub struct IsometricElbow {
    spec: IsometricSpec,
    muscles: Vec<MuscleState>,
    cell: Sensor,
    loads: [Load; CHANNELS],
    /// Pending pulses: time at which each takes effect, µs, pair, current in mA and width in µs.
    under_way: VecDeque<(u64, usize, f64, f64)>,
    /// Number of samples that the load cell has taken, one per millisecond.
    tick: u64,
}

impl IsometricElbow {
    /// Creates an arm at rest. `seed` determines the noise of the load cell.
    ///
    /// # Errors
    /// Returns the name of the first field of `spec` whose value is out of range.
    pub fn new(spec: IsometricSpec, seed: u64) -> Result<Self, InvalidBench> {
        spec.validate()?;
        let driven = |rig_muscle: &RigMuscle| {
            let most_nm = spec
                .max_torque_nm(rig_muscle)
                .map_err(|_| InvalidBench("included_deg"))?;
            Ok(MuscleState {
                spec: *rig_muscle,
                most_nm,
                muscle: muscle::Muscle::new(rig_muscle.dynamics),
                step: Step::new(&rig_muscle.dynamics, 1e-6 * SAMPLE_US as f64),
                share: 0.0,
                is_awake: false,
            })
        };
        Ok(Self {
            muscles: spec.muscles.iter().map(driven).collect::<Result<_, _>>()?,
            cell: Sensor::new(spec.cell, seed)?,
            loads: [Load::Ohms(spec.load_ohm); CHANNELS],
            under_way: VecDeque::with_capacity(16),
            tick: 0,
            spec,
        })
    }

    /// Returns the specification from which the elbow was created.
    #[must_use]
    pub const fn spec(&self) -> &IsometricSpec {
        &self.spec
    }

    /// Returns the true torque now, N·m, extension positive.
    #[must_use]
    pub fn extension_nm(&self) -> f64 {
        self.muscles.iter().map(MuscleState::torque_nm).sum()
    }

    /// Returns, for each muscle in the order of the specification, the muscle, its torque (N·m,
    /// extension positive), and the share of its fibres that the last effective pulse excited.
    pub fn parts(&self) -> impl Iterator<Item = (Muscle, f64, f64)> {
        let muscles = self.muscles.iter();
        muscles.map(|driven| (driven.spec.muscle, driven.torque_nm(), driven.share))
    }

    /// Returns the number of samples that the load cell has taken, one at the end of each
    /// millisecond.
    #[must_use]
    pub const fn samples(&self) -> u64 {
        self.tick
    }

    /// Simulates the next millisecond, split at every pulse in it.
    fn step(&mut self) {
        let (from_us, to_us) = (self.tick * SAMPLE_US, (self.tick + 1) * SAMPLE_US);
        let mut now_us = from_us;
        while let Some((due_us, pair, current_ma, width_us)) = self.under_way.front().copied() {
            if due_us >= to_us {
                break;
            }
            self.under_way.pop_front();
            self.pass(due_us.saturating_sub(now_us));
            now_us = now_us.max(due_us);
            for muscle in &mut self.muscles {
                muscle.pulse(muscle.spec.share(pair, current_ma, width_us));
            }
        }
        self.pass(to_us - now_us);
        let nm = match self.spec.holds {
            CellSide::Extension => self.extension_nm(),
            CellSide::Flexion => -self.extension_nm(),
        };
        // The wire can only pull.
        self.cell.sample(nm.max(0.0) / self.spec.cell.lever_m);
        self.tick += 1;
    }

    fn pass(&mut self, us: u64) {
        if us > 0 {
            let awake = self.muscles.iter_mut().filter(|driven| driven.is_awake);
            awake.for_each(|driven| driven.pass(us));
        }
    }
}

impl MuscleState {
    fn torque_nm(&self) -> f64 {
        self.most_nm * self.muscle.force()
    }

    /// Applies a pulse. A pulse that excites no fibre leaves the relaxation undisturbed.
    fn pulse(&mut self, share: f64) {
        if share > 0.0 {
            self.muscle.pulse(share);
            (self.share, self.is_awake) = (share, true);
        }
    }

    fn pass(&mut self, us: u64) {
        match us {
            SAMPLE_US => self.muscle.step(&self.step),
            _ => {
                let step = Step::new(&self.spec.dynamics, us as f64 * 1e-6);
                self.muscle.step(&step);
            }
        }
    }
}

impl Body for IsometricElbow {
    fn pulse(&mut self, pulse: &Pulse) {
        let Some(load) = self.loads.get(pulse.channel) else {
            return;
        };
        let pair = self
            .spec
            .channels
            .iter()
            .position(|channel| *channel == pulse.channel);
        let current_ma = load.current_ma(pulse.drive);
        if let Some(pair) = pair.filter(|_| current_ma > 0.0) {
            let due_us = pulse.t_us + u64::from(self.spec.electromechanical_delay_us);
            let width_us = f64::from(pulse.width_us);
            self.under_way
                .push_back((due_us, pair, current_ma, width_us));
        }
    }

    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.tick;
        while (self.tick + 1) * SAMPLE_US <= to_us {
            self.step();
        }
        self.tick != before
    }

    fn instrument_n(&self) -> Option<f64> {
        Some(self.cell.reading_n())
    }

    /// Returns the flexion at which the test rig holds the elbow, degrees.
    fn angle_deg(&self) -> f64 {
        self.spec.flexion_deg()
    }

    fn sensed_deg(&self) -> f64 {
        self.spec.flexion_deg()
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
