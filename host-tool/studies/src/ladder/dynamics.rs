//! What each rung lacks of a rested muscle, scene by scene.

use super::protocol::Protocol;
use super::signal::{Difference, predicted, reference, subjects};
use super::{MeasureError, each, telemetry};
use firmware::muscle::{CalciumForceSpec, Ladder, Rung};
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use host_core::choice::Scene;
use host_core::choice::grid::{BURSTS_MS, RAMPS_MS, RATES_MHZ, TELEMETRY_MS};

/// Draws of each scene's random parts.
pub const SEEDS: [u64; 2] = [1, 2];

/// What one grid scene gave: the worst over subjects and seeds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// Error of static, lag and calcium-force against the f64 reference.
    pub rungs: [Difference; 3],
    /// The same against the top rung's own prediction (calcium-force, as
    /// nothing tires here): static and lag.
    pub against_top: [f64; 2],
    /// Worst error of the force drawn again from telemetry at each period.
    pub telemetry: [f64; TELEMETRY_MS.len()],
}

impl Cell {
    fn worse(self, other: Self) -> Self {
        Self {
            rungs: std::array::from_fn(|i| self.rungs[i].max(other.rungs[i])),
            against_top: std::array::from_fn(|i| self.against_top[i].max(other.against_top[i])),
            telemetry: std::array::from_fn(|i| self.telemetry[i].max(other.telemetry[i])),
        }
    }
}

/// All grid scenes.
pub fn grid() -> Vec<Scene> {
    super::grid(&BURSTS_MS, &RAMPS_MS, &RATES_MHZ, 0)
}

/// One scene with every subject and seed.
///
/// # Errors
/// A subject the firmware does not take.
pub fn measure(scene: &Scene) -> Result<Cell, MeasureError> {
    let mut worst = Cell::default();
    for seed in SEEDS {
        let protocol = Protocol::draw(scene, seed);
        for (parameters, spec) in SUBJECTS.iter().zip(subjects()) {
            worst = worst.worse(one(parameters, spec, &protocol)?);
        }
    }
    Ok(worst)
}

fn one(
    parameters: &Parameters,
    spec: CalciumForceSpec,
    protocol: &Protocol,
) -> Result<Cell, MeasureError> {
    let truth = reference(parameters, protocol);
    let rung = |rung| Ok::<_, MeasureError>(predicted(&Ladder::new(spec, None, rung)?, protocol));
    let (at_once, lag) = (rung(Rung::Static)?, rung(Rung::Lag)?);
    let top = rung(Rung::CalciumForce)?;
    Ok(Cell {
        rungs: [&at_once, &lag, &top].map(|rung| Difference::of(&truth, rung)),
        against_top: [&at_once, &lag].map(|rung| Difference::of(&top, rung).worst),
        telemetry: TELEMETRY_MS.map(|period| telemetry::error(&truth, usize::from(period))),
    })
}

/// Every scene of `scenes`, in their order; `step` hears the part done.
///
/// # Errors
/// As [`measure`].
pub fn campaign(scenes: &[Scene], step: impl Fn(f64) + Sync) -> Result<Vec<Cell>, MeasureError> {
    each(scenes, step, measure)
}
