//! What changes if the top rung takes another's place, scene by scene: the
//! closed-loop measurements that the choice is made from.

use super::closed::{Off, Wearer, changes};
use super::protocol::Protocol;
use super::table::{Quantity, RUNG_NAMES, Row, row_in};
use super::{MeasureError, each, grid};
use firmware::muscle::Rung;
use hal_sim::body::muscle::SUBJECTS;
use host_core::choice::Scene;
use host_core::choice::grid::{
    LOOP_BURSTS_MS, LOOP_RAMPS_MS, LOOP_RATES_MHZ, WORK_BURSTS_MS, WORK_RAMPS_MS, WORK_RATES_MHZ,
    WORK_SESSIONS_S,
};

/// Draws of each rested scene's random parts. One even, one odd: rates that
/// change begin with either.
const SEEDS: [u64; 2] = [1, 2];

/// The scenes of a rested muscle.
pub fn rested_grid() -> Vec<Scene> {
    grid(&LOOP_BURSTS_MS, &LOOP_RAMPS_MS, &LOOP_RATES_MHZ, 0)
}

/// The scenes of a muscle at work, each as long as the longest time at work.
pub fn work_grid() -> Vec<Scene> {
    let longest = WORK_SESSIONS_S[WORK_SESSIONS_S.len() - 1];
    grid(&WORK_BURSTS_MS, &WORK_RAMPS_MS, &WORK_RATES_MHZ, longest)
}

/// Rows of one rested scene: static and lag.
pub fn rested_rows(scene: &Scene) -> Result<[Row; 2], MeasureError> {
    let protocols = SEEDS.map(|seed| Protocol::draw(scene, seed));
    let [at_once, lag, _] = changes(scene, &protocols, &[])?;
    let row = |rung: usize, change| row_in(scene, Quantity::Change, RUNG_NAMES[rung], change);
    Ok([row(0, at_once), row(1, lag)])
}

/// Rows of one scene at work: calcium-force after each time at work.
pub fn work_rows(scene: &Scene) -> Result<Vec<Row>, MeasureError> {
    let protocol = Protocol::draw(scene, SEEDS[0]);
    let mut worst = [0f64; WORK_SESSIONS_S.len()];
    for subject in &SUBJECTS {
        let wearer = Wearer::new(subject, scene);
        let courses = wearer.changes(&protocol, &[Rung::CalciumForce], &Off::STRONG)?;
        for (worst, session_s) in worst.iter_mut().zip(WORK_SESSIONS_S) {
            let course = &courses[0]; // of the one rung asked for
            let until = (session_s as usize * 1000).min(course.len() - 1);
            *worst = worst.max(course[until]);
        }
    }
    let row = |(session_s, change)| Row {
        session_s: Some(session_s),
        ..row_in(scene, Quantity::Tiring, RUNG_NAMES[2], change)
    };
    Ok(WORK_SESSIONS_S.into_iter().zip(worst).map(row).collect())
}

/// Rows of both grids; `step` hears the part done.
pub fn campaign(step: impl Fn(f64) + Sync) -> Result<Vec<Row>, MeasureError> {
    let rested = each(&rested_grid(), |part| step(0.5 * part), rested_rows)?;
    let work = each(&work_grid(), |part| step(0.5 + 0.5 * part), work_rows)?;
    let work = work.into_iter().flatten();
    Ok(rested.into_iter().flatten().chain(work).collect())
}
