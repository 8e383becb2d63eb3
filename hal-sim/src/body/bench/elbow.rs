//! An elbow held at an angle on a bench, a load cell between the forearm's platform and a
//! wall (Harris 2017, figure 4): one pair of electrodes over the triceps, one over the
//! biceps, and what else lies near enough to be stimulated.
//!
//! Torque is Σ force · arm. A muscle's force is the part of its fibres that a pulse excites
//! (`recruitment`, by the current that reaches it), through calcium-force dynamics, times
//! what its length makes of it. All of it is simulated; which numbers are assumed stands at
//! each.

use super::InvalidBench;
use super::arms::{BeyondFit, Muscle, Source, arm_m, elongation_m, length_m};
use super::recruitment::{Pool, StrengthDuration};
use super::sensor::{SAMPLE_US, Sensor, SensorSpec};
use crate::body::muscle::{self, Parameters, Step};
use crate::body::{Body, CHANNELS, Load, Pulse};
use std::collections::VecDeque;

/// Frequency at which a muscle's `force_n` holds, Hz.
pub const FORCE_FREQUENCY_HZ: f64 = 50.0;
/// A pair of electrodes.
pub const PAIRS: usize = 2;
/// The one over the triceps.
pub const TRICEPS: usize = 0;
/// The one over the biceps.
pub const BICEPS: usize = 1;

/// Width of the active force–length curve, exp(−(l − 1)²/γ) with l the fibres' length
/// against their best (Thelen 2003, equation 4; γ as arm26.osim has it for these muscles).
const GAMMA: f64 = 0.5;

/// Which way the wire of the load cell holds the arm: it can only pull.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellSide {
    /// Extension is in tension (Harris, figure 4); flexion leaves the wire slack.
    Extension,
    /// Mounted on the other side.
    Flexion,
}

/// A muscle on the bench.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigMuscle {
    /// Which.
    pub muscle: Muscle,
    /// Force of all of its fibres that any electrode can reach, at [`FORCE_FREQUENCY_HZ`]
    /// and their best length, N.
    pub force_n: f64,
    /// Thresholds of these fibres: of the current that reaches them.
    pub pool: Pool,
    /// What a width is worth.
    pub strength: StrengthDuration,
    /// Part of each pair's current that reaches it, 0 to 1: what distance leaves.
    pub reached: [f64; PAIRS],
    /// Length of its fibres at 90° against their best; of the muscles of which a
    /// musculotendon length is at hand it follows from that, and this is not used.
    pub length_at_90: f64,
    /// Dynamics, force normalised to 1 at [`FORCE_FREQUENCY_HZ`].
    pub dynamics: Parameters,
}

/// An elbow on the bench.
#[derive(Debug, Clone, PartialEq)]
pub struct IsometricSpec {
    /// Angle between forearm and upper arm, degrees, as Harris measures it: 180° less
    /// flexion.
    pub included_deg: f64,
    /// Whose moment arms are true.
    pub source: Source,
    /// Whether force depends on length.
    pub has_force_length: bool,
    /// Channels of the pair on the triceps and of that on the biceps, 0 to 9.
    pub channels: [usize; PAIRS],
    /// What is stimulated.
    pub muscles: Vec<RigMuscle>,
    /// This contraction against the mean one; above 0.
    pub contraction: f64,
    /// From a pulse to its effect on a muscle, µs.
    pub electromechanical_delay_us: u32,
    /// How the cell is mounted.
    pub holds: CellSide,
    /// The cell on its lever.
    pub cell: SensorSpec,
    /// Resistance of every pair, Ω.
    pub load_ohm: f64,
}

/// A muscle's fibres: length of the tendon and their best length, m (arm26.osim, after
/// Holzbaur 2005; of the biceps the two heads' best lengths, weighted by their forces).
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

/// Largest isometric force, N (arm26.osim; of the biceps both heads; the posterior deltoid
/// is Holzbaur 2005's, from memory, and moves no elbow).
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

/// Length of a muscle's fibres against their best, the tendon rigid. Of the triceps' heads
/// without a shoulder and of the brachialis it follows from Rankin & Neptune's lengths; of
/// the others from `at_90` and what their arm moves.
///
/// # Errors
/// An angle beyond the sources' fit.
pub fn fibre_length(muscle: Muscle, at_90: f64, flexion_deg: f64) -> Result<f64, BeyondFit> {
    let (tendon_m, best_m) = tendon_and_fibre_m(muscle);
    Ok(match length_m(muscle, flexion_deg)? {
        Some(length_m) => (length_m - tendon_m) / best_m,
        None => at_90 + elongation_m(Source::RankinNeptune, muscle, flexion_deg)? / best_m,
    })
}

/// What this length makes of a muscle's force, 0 to 1.
#[must_use]
pub fn force_length(fibre_length: f64) -> f64 {
    (-(fibre_length - 1.0).powi(2) / GAMMA).exp()
}

impl RigMuscle {
    /// Part of its fibres that a pulse of a pair excites.
    #[must_use]
    pub fn share(&self, pair: usize, current_ma: f64, width_us: f64) -> f64 {
        let reached = self.reached.get(pair).copied().unwrap_or_default();
        let strength = self.strength.equivalent_ma(reached * current_ma, width_us);
        self.pool.share(strength)
    }
}

impl IsometricSpec {
    /// Flexion of the elbow, degrees.
    #[must_use]
    pub fn flexion_deg(&self) -> f64 {
        180.0 - self.included_deg
    }

    /// Torque of a muscle of which everything that can be reached is excited, N·m, extension
    /// positive.
    ///
    /// # Errors
    /// An angle beyond the sources' fit.
    pub fn max_torque_nm(&self, of: &RigMuscle) -> Result<f64, BeyondFit> {
        let flexion_deg = self.flexion_deg();
        let arm_m = arm_m(self.source, of.muscle, flexion_deg)?;
        let length = fibre_length(of.muscle, of.length_at_90, flexion_deg)?;
        let lasting = match self.has_force_length {
            true => force_length(length),
            false => 1.0,
        };
        Ok(-arm_m * lasting * of.force_n * self.contraction)
    }

    /// # Errors
    /// Names the field that no bench can have.
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

/// A muscle with what it does now.
#[derive(Debug, Clone, PartialEq)]
struct MuscleState {
    spec: RigMuscle,
    most_nm: f64,
    muscle: muscle::Muscle,
    step: Step,
    /// Of the last pulse that excited anything.
    share: f64,
    /// Whether anything was ever excited.
    is_awake: bool,
}

/// An elbow on the bench, in motion; the arm is not. Deterministic: pulses and seed decide
/// everything.
#[derive(Debug, Clone, PartialEq)]
pub struct IsometricElbow {
    spec: IsometricSpec,
    muscles: Vec<MuscleState>,
    cell: Sensor,
    loads: [Load; CHANNELS],
    /// When each pulse acts, µs, from which pair, with which current and width.
    under_way: VecDeque<(u64, usize, f64, f64)>,
    /// Samples taken.
    tick: u64,
}

impl IsometricElbow {
    /// An arm at rest. `seed` decides the cell's noise.
    ///
    /// # Errors
    /// Names the field that no bench can have.
    pub fn new(spec: IsometricSpec, seed: u64) -> Result<Self, InvalidBench> {
        spec.validate()?;
        let driven = |of: &RigMuscle| {
            let most_nm = spec
                .max_torque_nm(of)
                .map_err(|_| InvalidBench("included_deg"))?;
            Ok(MuscleState {
                spec: *of,
                most_nm,
                muscle: muscle::Muscle::new(of.dynamics),
                step: Step::new(&of.dynamics, 1e-6 * SAMPLE_US as f64),
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

    /// The numbers it was made from.
    #[must_use]
    pub const fn spec(&self) -> &IsometricSpec {
        &self.spec
    }

    /// True torque now, N·m, extension positive.
    #[must_use]
    pub fn extension_nm(&self) -> f64 {
        self.muscles.iter().map(MuscleState::torque_nm).sum()
    }

    /// Of each muscle in the order of the spec: its torque, N·m, extension positive, and the
    /// part of its fibres that the last pulse which excited any of them did excite.
    pub fn parts(&self) -> impl Iterator<Item = (Muscle, f64, f64)> {
        let muscles = self.muscles.iter();
        muscles.map(|driven| (driven.spec.muscle, driven.torque_nm(), driven.share))
    }

    /// Samples that the cell has taken; one is taken as each millisecond ends.
    #[must_use]
    pub const fn samples(&self) -> u64 {
        self.tick
    }

    /// The next millisecond, split at every pulse in it.
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
        // A wire does not push.
        self.cell.sample(nm.max(0.0) / self.spec.cell.lever_m);
        self.tick += 1;
    }

    fn pass(&mut self, us: u64) {
        if us > 0 {
            let all = self.muscles.iter_mut().filter(|driven| driven.is_awake);
            all.for_each(|driven| driven.pass(us));
        }
    }
}

impl MuscleState {
    fn torque_nm(&self) -> f64 {
        self.most_nm * self.muscle.force()
    }

    /// A pulse acts. Where it excites nothing, what was excited relaxes as it is.
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

    /// Flexion, held.
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
