//! The ladder of muscle models, measured: what each rung lacks in which scene.
//!
//! Lives here: scenes as pulses (`protocol`), forces (`signal`), the campaigns
//! (`dynamics`, `fatigue`, `telemetry`, `motion`), their table.
//! Not here: the rungs and the choice among them (`firmware::muscle`), other
//! integrators of the same equations (`accuracy`), control laws (`tracking`).
//! In: the grid of `host_core::choice`, or any scene. Out: errors in
//! parts of a scene's peak, and the committed table.

pub mod adequacy;
pub mod closed;
pub mod dynamics;
pub mod fatigue;
pub mod motion;
pub mod protocol;
pub mod replaced;
pub mod signal;
pub mod table;
pub mod telemetry;

use firmware::muscle::LadderError;
use host_core::choice::Scene;
use host_core::choice::grid::{
    BURSTS_MS, Discretization, LAW_PERIODS_MS, RAMPS_MS, RATES_MHZ, SESSIONS_S, STEPS_MS,
    TELEMETRY_MS,
};
use motion::{MotionError, Setting};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use table::{DISCRETIZATION_NAMES, Quantity, RUNG_NAMES, Row, percent, row, row_in};

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// A muscle that the firmware does not take.
    #[error("E551 a muscle the firmware does not take: {0:?}")]
    Muscle(LadderError),
    /// A finger or a law that cannot be.
    #[error(transparent)]
    Motion(#[from] MotionError),
}

impl From<LadderError> for MeasureError {
    fn from(error: LadderError) -> Self {
        Self::Muscle(error)
    }
}

/// All scenes of a grid: burst, then ramp, then pair of rates.
fn grid(bursts: &[u32], ramps: &[u32], rates: &[u32], session_s: u32) -> Vec<Scene> {
    let mut all = Vec::new();
    for &burst_ms in bursts {
        for &ramp_ms in ramps {
            for (slow, &slowest_mhz) in rates.iter().enumerate() {
                all.extend(rates[slow..].iter().map(|&fastest_mhz| Scene {
                    burst_ms,
                    slowest_mhz,
                    fastest_mhz,
                    ramp_ms,
                    session_s,
                }));
            }
        }
    }
    all
}

/// `work` on every one of `jobs`, in parallel; the results in their order.
/// `step` hears the part done.
///
/// # Errors
/// One of those that any of them had.
fn each<J: Sync, R: Send, E: Send>(
    jobs: &[J],
    step: impl Fn(f64) + Sync,
    work: impl Fn(&J) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let done = AtomicUsize::new(0);
    let results = jobs.par_iter().map(|job| {
        let result = work(job);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        step(done as f64 / jobs.len() as f64);
        result
    });
    results.collect()
}

/// The whole campaign: every row of `docs/charts/ladder.csv`. `step` hears the
/// part done.
///
/// # Errors
/// [`MeasureError`]; none for the subjects of the paper.
pub fn measure(step: impl Fn(f64) + Sync) -> Result<Vec<Row>, MeasureError> {
    let scenes = dynamics::grid();
    let cells = dynamics::campaign(&scenes, |part| step(0.2 * part))?;
    let courses = fatigue::campaign(|part| step(0.2 + 0.1 * part))?;
    let mut rows = force_rows(&scenes, &cells);
    rows.extend(fatigue_rows(&courses));
    rows.extend(telemetry_rows(&scenes, &cells));
    rows.extend(motion_rows(|part| step(0.3 + 0.1 * part))?);
    rows.extend(replaced::campaign(|part| step(0.4 + 0.6 * part))?);
    Ok(rows)
}

/// Rows of [`Quantity::Force`].
pub fn force_rows(scenes: &[Scene], cells: &[dynamics::Cell]) -> Vec<Row> {
    let rows = scenes.iter().zip(cells).flat_map(|(scene, cell)| {
        cell.rungs.iter().enumerate().map(|(i, error)| Row {
            rms_pct: Some(percent(error.rms)),
            against_top_pct: cell.against_top.get(i).map(|part| percent(*part)),
            ..row_in(scene, Quantity::Force, RUNG_NAMES[i], error.worst)
        })
    });
    rows.collect()
}

fn fatigue_rows(courses: &[fatigue::Course]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (&rate, course) in RATES_MHZ.iter().zip(courses) {
        for (&session_s, errors) in SESSIONS_S.iter().zip(course) {
            for (rung, error) in RUNG_NAMES[2..].iter().zip(errors) {
                rows.push(Row {
                    fastest_mhz: Some(rate),
                    session_s: Some(session_s),
                    rms_pct: Some(percent(error.rms)),
                    ..row(Quantity::Fatigue, *rung, error.worst)
                });
            }
        }
    }
    rows
}

/// The worst over ramps and fastest rates of each burst and slowest rate.
fn telemetry_rows(scenes: &[Scene], cells: &[dynamics::Cell]) -> Vec<Row> {
    let mut rows = Vec::new();
    for burst_ms in BURSTS_MS {
        for slowest_mhz in RATES_MHZ {
            for (i, period) in TELEMETRY_MS.iter().enumerate() {
                let own = scenes.iter().zip(cells);
                let own =
                    own.filter(|(s, _)| (s.burst_ms, s.slowest_mhz) == (burst_ms, slowest_mhz));
                let worst = own.map(|(_, cell)| cell.telemetry[i]).fold(0.0, f64::max);
                rows.push(Row {
                    burst_ms: Some(burst_ms),
                    slowest_mhz: Some(slowest_mhz),
                    ..row(Quantity::Telemetry, format!("{period} ms"), worst)
                });
            }
        }
    }
    rows
}

/// Rows of [`Quantity::Law`] and [`Quantity::Body`].
fn motion_rows(step: impl Fn(f64) + Sync) -> Result<Vec<Row>, MotionError> {
    let of_ramps = each(&RAMPS_MS, step, |&ramp_ms| motion_rows_of(ramp_ms))?;
    Ok(of_ramps.into_iter().flatten().collect())
}

/// The same of one ramp: the law against the better of the two at 1 ms, the
/// body against its own step of 1 ms under that law.
pub fn motion_rows_of(ramp_ms: u32) -> Result<Vec<Row>, MotionError> {
    const LAWS: [Discretization; 2] = [Discretization::Explicit, Discretization::Implicit];
    let finest = Setting {
        ramp_ms,
        law_period_ms: 1,
        discretization: Discretization::Implicit,
        step_ms: 1,
    };
    let fine = motion::errors_deg(&finest)?;
    let of_ramp = |quantity, candidate, worst| Row {
        ramp_ms: Some(ramp_ms),
        ..row(quantity, candidate, worst)
    };
    let mut rows = Vec::new();
    for (discretization, name) in LAWS.into_iter().zip(DISCRETIZATION_NAMES) {
        for law_period_ms in LAW_PERIODS_MS {
            let setting = Setting {
                law_period_ms,
                discretization,
                ..finest
            };
            let loss = motion::loss(&setting, &fine)?;
            rows.push(of_ramp(
                Quantity::Law,
                format!("{name} {law_period_ms} ms"),
                loss,
            ));
        }
    }
    for step_ms in STEPS_MS {
        let change = motion::change(&Setting { step_ms, ..finest }, &fine)?;
        rows.push(of_ramp(Quantity::Body, format!("{step_ms} ms"), change));
    }
    Ok(rows)
}
