//! The lowest sufficient model for a kind of scene, looked up in committed
//! measurements.
//!
//! Lives here: `grid` (what was measured), `measured` (what came out, written by
//! `flexor chart ladder`), `change` (what replacing a rung does, by which is
//! chosen) and `between` (points of a grid). Not here: the rungs themselves, how a
//! session becomes scenes (host).
//! In: a [`Scene`] and a tolerance. Out: a [`Choice`] with its expected change
//! and cycles, or [`NoRung`].

mod between;
mod change;
pub mod grid;
mod measured;

pub use change::expected_change;
use core::fmt;
use firmware::muscle::Rung;
use grid::{
    BURSTS_MS, Discretization, FASTEST_MEASURED_MHZ, LAW_PERIODS_MS, RAMPS_MS, RATES_MHZ,
    SESSIONS_S, SLOWEST_MEASURED_MHZ, STEPS_MS, TELEMETRY_MS, enclosing, pair,
};
pub use measured::{BODY, CHANGE, CYCLES, DYNAMICS, FATIGUE, LAW, TELEMETRY, TIRING};

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
pub const fn cycles(rung: Rung) -> Cycles {
    let [at_once, lag, calcium_force, fatigue] = CYCLES;
    match rung {
        Rung::Static => at_once,
        Rung::Lag => lag,
        Rung::CalciumForce => calcium_force,
        Rung::CalciumForceFatigue => fatigue,
    }
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
    let (slowest, fastest) = rates(scene);
    let is_measured = slowest >= SLOWEST_MEASURED_MHZ && fastest <= FASTEST_MEASURED_MHZ;
    let (column, with_fatigue) = match rung {
        Rung::Static | Rung::Lag if !is_measured => return Share::UNKNOWN,
        Rung::Static => (0, 0),
        Rung::Lag => (1, 0),
        Rung::CalciumForce => (2, 0),
        Rung::CalciumForceFatigue => (2, 1),
    };
    let dynamics = around_dynamics(scene)
        .map(|cell| cell.get(column).copied())
        .fold(Some(0), worse);
    let rates = enclosing(&RATES_MHZ, fastest);
    let fatigue = enclosing(&SESSIONS_S, scene.session_s)
        .flat_map(|session| rates.clone().map(move |rate| (session, rate)))
        .map(|(session, rate)| FATIGUE.get(session)?.get(rate)?.get(with_fatigue).copied())
        .fold(Some(0), worse);
    match (dynamics, fatigue) {
        (Some(dynamics), Some(fatigue)) => Share(dynamics.saturating_add(fatigue)),
        _ => Share::UNKNOWN,
    }
}

/// Lowest and highest pulse rate, mHz.
fn rates(scene: &Scene) -> (u32, u32) {
    let (a, b) = (scene.slowest_mhz, scene.fastest_mhz);
    (a.min(b), a.max(b))
}

/// The worse of two errors; what is not measured stays so.
fn worse(a: Option<u16>, b: Option<u16>) -> Option<u16> {
    Some(a?.max(b?))
}

/// The measured scenes around this one.
fn around_dynamics(scene: &Scene) -> impl Iterator<Item = &'static [u16; 3]> {
    let (slowest, fastest) = rates(scene);
    let (slow, fast) = (
        enclosing(&RATES_MHZ, slowest),
        enclosing(&RATES_MHZ, fastest),
    );
    // slowest ≤ fastest, but between the same two points either may come first.
    let pairs = slow
        .flat_map(move |slow| fast.clone().map(move |fast| (slow, fast)))
        .filter(|(slow, fast)| slow <= fast)
        .map(|(slow, fast)| pair(RATES_MHZ.len(), slow, fast));
    let ramps = enclosing(&RAMPS_MS, scene.ramp_ms);
    enclosing(&BURSTS_MS, scene.burst_ms)
        .filter_map(|burst| DYNAMICS.get(burst))
        .flat_map(move |rows| ramps.clone().filter_map(|ramp| rows.get(ramp)))
        .flat_map(move |row| pairs.clone().filter_map(|pair| row.get(pair)))
}

/// The longest period, and the better discretization at it, up to which all are
/// within the tolerance; the shortest if none is.
fn law(scene: &Scene, tolerance: Share) -> (u8, Discretization) {
    let error = |discretization: usize, period: usize| {
        enclosing(&RAMPS_MS, scene.ramp_ms)
            .map(|ramp| LAW.get(ramp)?.get(discretization)?.get(period).copied())
            .fold(Some(0), worse)
    };
    let enough = |(index, period)| {
        let (explicit, implicit) = (error(0, index)?, error(1, index)?);
        let discretization = if explicit < implicit {
            Discretization::Explicit
        } else {
            Discretization::Implicit
        };
        let is_within = Share(explicit.min(implicit)) <= tolerance;
        is_within.then_some((period, discretization))
    };
    let periods = LAW_PERIODS_MS.into_iter().enumerate();
    let last = periods.map_while(enough).last();
    last.unwrap_or((1, Discretization::Implicit))
}

/// The longest telemetry period up to which all are within the tolerance; the
/// shortest if none is.
fn telemetry(scene: &Scene, tolerance: Share) -> u16 {
    let (slowest, _) = rates(scene);
    let is_enough = |(index, _): &(usize, u16)| {
        let rates = enclosing(&RATES_MHZ, slowest);
        enclosing(&BURSTS_MS, scene.burst_ms)
            .flat_map(|burst| rates.clone().map(move |rate| (burst, rate)))
            .map(|(burst, rate)| TELEMETRY.get(burst)?.get(rate)?.get(*index).copied())
            .fold(Some(0), worse)
            .is_some_and(|error| Share(error) <= tolerance)
    };
    let periods = TELEMETRY_MS.into_iter().enumerate();
    let last = periods.take_while(is_enough).last();
    last.map_or(1, |(_, period)| period)
}

/// The longest step of the body up to which all are within the tolerance; the
/// shortest if none is.
fn body_step(scene: &Scene, tolerance: Share) -> u8 {
    let is_enough = |(index, _): &(usize, u8)| {
        enclosing(&RAMPS_MS, scene.ramp_ms)
            .map(|ramp| BODY.get(ramp)?.get(*index).copied())
            .fold(Some(0), worse)
            .is_some_and(|error| Share(error) <= tolerance)
    };
    let steps = STEPS_MS.into_iter().enumerate();
    let last = steps.take_while(is_enough).last();
    last.map_or(1, |(_, step)| step)
}
