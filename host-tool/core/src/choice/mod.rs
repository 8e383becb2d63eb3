//! The lowest sufficient model for a kind of scene, looked up in committed
//! measurements.
//!
//! Lives here: `grid` (what was measured), `measured` (what came out, read from
//! what `flexor chart ladder` commits), `change` (what replacing a rung does, by
//! which is chosen) and `between` (points of a grid). Not here: the rungs
//! themselves, how a session becomes scenes (`session`).
//! In: a [`Scene`] and a tolerance. Out: a [`Choice`] with its expected change
//! and cycles, or [`NoRung`].

mod between;
mod change;
pub mod grid;
pub mod measured;

pub use change::expected_change;
use core::fmt;
use firmware::muscle::Rung;
use grid::{
    BURSTS_MS, Discretization, LAW_PERIODS_MS, RAMPS_MS, RATES_MHZ, SESSIONS_S, STEPS_MS,
    TELEMETRY_MS, enclosing,
};
use measured::Quantity::{Body, Fatigue, Force, Law, Telemetry};
use measured::{CYCLES, table};

/// What a muscle is asked to do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Scene {
    /// How long it is pulsed at a stretch, ms. [`Scene::UNBROKEN`] if pauses
    /// and the end do not matter.
    pub burst_ms: u32,
    /// Lowest pulse rate, mHz.
    pub slowest_mhz: u32,
    /// Highest pulse rate, mHz; the same if the rate is constant.
    pub fastest_mhz: u32,
    /// Shortest time in which its drive (amplitude or pulse rate) goes the
    /// whole way, ms; 0 for steps.
    pub ramp_ms: u32,
    /// How long it works, pauses included, s; 0 to leave fatigue aside.
    pub session_s: u32,
}

impl Scene {
    /// A muscle pulsed without a pause, from its ramp up to its ramp down.
    pub const UNBROKEN: u32 = grid::HOLD_MS;
}

/// A part of the largest force of a scene, in hundredths of a percent; larger
/// ones saturate at 655.35 %.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Share(pub u16);

impl Share {
    /// The just-noticeable difference of force, 10 %: the default tolerance.
    pub const JUST_NOTICEABLE: Self = Self(1_000);
    /// Never measured, so never within a tolerance.
    pub const UNKNOWN: Self = Self(u16::MAX);
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Self::UNKNOWN {
            return f.write_str("not measured");
        }
        write!(f, "{}.{:02} %", self.0 / 100, self.0 % 100)
    }
}

/// Most core clock cycles of a rung on the chip simulator, per call.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cycles {
    /// A control tick of 1 ms without a pulse.
    pub tick: u16,
    /// One with a pulse inside it.
    pub tick_with_pulse: u16,
}

impl Cycles {
    /// Not measured.
    pub const UNKNOWN: Self = Self {
        tick: u16::MAX,
        tick_with_pulse: u16::MAX,
    };
}

/// What a scene needs, and no more.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Choice {
    /// The lowest rung within the tolerance.
    pub rung: Rung,
    /// How far it is expected to be from the top rung: [`expected_change`].
    pub change: Share,
    /// What it costs.
    pub cycles: Cycles,
    /// The longest period of the control law that costs the tracking of such a
    /// ramp less than the tolerance, ms.
    pub law_period_ms: u8,
    /// How its law is best discretized at that period.
    pub discretization: Discretization,
    /// The longest telemetry period from which the force can be drawn again
    /// within the tolerance, ms.
    pub telemetry_ms: u16,
    /// The longest step of the simulated body that changes its motion by less
    /// than the tolerance, ms.
    pub body_step_ms: u8,
}

/// No rung is as accurate as that.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoRung {
    /// What was asked for.
    pub tolerance: Share,
    /// The least error that a rung has in this scene.
    pub least: Share,
    /// That rung.
    pub best: Rung,
}

impl fmt::Display for NoRung {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            tolerance,
            least,
            best,
        } = self;
        write!(
            f,
            "no model is within a tolerance of {tolerance}: the least possible here is {least} ({best:?})"
        )
    }
}

impl core::error::Error for NoRung {}

/// The lowest rung that the top one may replace, in a loop closed over the
/// prediction, without changing the true force by more than `tolerance`; and
/// what else the scene needs.
///
/// # Errors
/// [`NoRung`] with the least error possible, if no rung's own prediction is
/// within the tolerance: then being near the top rung says nothing.
pub fn choose(scene: &Scene, tolerance: Share) -> Result<Choice, NoRung> {
    let errors = Rung::ALL.map(|rung| (rung, expected_error(scene, rung)));
    let (best, least) = errors
        .into_iter()
        .min_by_key(|&(_, error)| error)
        .unwrap_or((Rung::CalciumForceFatigue, Share::UNKNOWN));
    if least > tolerance {
        return Err(NoRung {
            tolerance,
            least,
            best,
        });
    }
    let changes = Rung::ALL.map(|rung| (rung, expected_change(scene, rung)));
    let (rung, change) = changes
        .into_iter()
        .find(|&(_, change)| change <= tolerance)
        .unwrap_or((Rung::CalciumForceFatigue, Share(0)));
    let (law_period_ms, discretization) = law(scene, tolerance);
    Ok(Choice {
        rung,
        change,
        cycles: cycles(rung),
        law_period_ms,
        discretization,
        telemetry_ms: telemetry(scene, tolerance),
        body_step_ms: body_step(scene, tolerance),
    })
}

/// What a rung costs.
#[must_use]
pub fn cycles(rung: Rung) -> Cycles {
    CYCLES[rung as usize]
}

/// The error to expect of a rung's own prediction in a scene: the worst over all
/// ten subjects at the measured scenes around it.
///
/// Conservative in three ways. Between two points of an axis the worse counts,
/// over all axes at once; beyond an axis' end its last point counts, where the
/// error no longer grows, and pulse rates outside the measured ones make the
/// two lowest rungs [`Share::UNKNOWN`]. What a rung lacks for want of fatigue
/// is added to what it lacks otherwise, as if both fell on the same moment.
#[must_use]
pub fn expected_error(scene: &Scene, rung: Rung) -> Share {
    let column = match rung {
        Rung::Static | Rung::Lag if !is_measured(scene) => return Share::UNKNOWN,
        Rung::Static => 0,
        Rung::Lag => 1,
        Rung::CalciumForce | Rung::CalciumForceFatigue => 2,
    };
    let [slowest, fastest] = rates(scene).map(|rate| enclosing(&RATES_MHZ, rate));
    let burst = enclosing(&BURSTS_MS, scene.burst_ms);
    let ramp = enclosing(&RAMPS_MS, scene.ramp_ms);
    let session = enclosing(&SESSIONS_S, scene.session_s);
    let dynamics = table(Force).worst([burst, ramp, slowest, fastest.clone()], column);
    let with_fatigue = usize::from(rung == Rung::CalciumForceFatigue);
    let fatigue = table(Fatigue).worst([session, fastest], with_fatigue);
    match (dynamics, fatigue) {
        (Some(dynamics), Some(fatigue)) => Share(dynamics.saturating_add(fatigue)),
        _ => Share::UNKNOWN,
    }
}

/// Lowest and highest pulse rate, mHz.
fn rates(scene: &Scene) -> [u32; 2] {
    let (a, b) = (scene.slowest_mhz, scene.fastest_mhz);
    [a.min(b), a.max(b)]
}

/// Whether its pulse rates lie within the measured ones, without which nothing is
/// known of the two lowest rungs.
fn is_measured(scene: &Scene) -> bool {
    let [slowest, fastest] = rates(scene);
    slowest >= RATES_MHZ[0] && fastest <= RATES_MHZ[RATES_MHZ.len() - 1]
}

/// The last of the candidates, finest first, up to which all are within the
/// tolerance; the finest if none is.
fn coarsest<T: Copy>(
    candidates: &[T],
    tolerance: Share,
    error: impl Fn(usize) -> Option<u16>,
) -> T {
    let is_within = |n: &usize| error(*n).is_some_and(|error| Share(error) <= tolerance);
    let last = (0..candidates.len()).take_while(is_within).last();
    candidates[last.unwrap_or(0)]
}

/// The longest period, and the better discretization at it.
fn law(scene: &Scene, tolerance: Share) -> (u8, Discretization) {
    let error = |discretization: usize, period: usize| {
        let candidate = discretization * LAW_PERIODS_MS.len() + period;
        table(Law).worst([enclosing(&RAMPS_MS, scene.ramp_ms)], candidate)
    };
    let better = |period| Some(error(0, period)?.min(error(1, period)?));
    let places: [usize; LAW_PERIODS_MS.len()] = std::array::from_fn(|n| n);
    let period = coarsest(&places, tolerance, better);
    let discretization = match error(0, period) < error(1, period) {
        true => Discretization::Explicit,
        false => Discretization::Implicit,
    };
    (LAW_PERIODS_MS[period], discretization)
}

/// The longest telemetry period.
fn telemetry(scene: &Scene, tolerance: Share) -> u16 {
    let [slowest, _] = rates(scene);
    coarsest(&TELEMETRY_MS, tolerance, |period| {
        let around = [
            enclosing(&BURSTS_MS, scene.burst_ms),
            enclosing(&RATES_MHZ, slowest),
        ];
        table(Telemetry).worst(around, period)
    })
}

/// The longest step of the body.
fn body_step(scene: &Scene, tolerance: Share) -> u8 {
    coarsest(&STEPS_MS, tolerance, |step| {
        table(Body).worst([enclosing(&RAMPS_MS, scene.ramp_ms)], step)
    })
}
