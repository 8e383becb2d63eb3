//! Map of fatigue depth × time constant for the finger under the device's controllers: where
//! tracking fails because the muscles tire.
//!
//! Theory: what a tired muscle cannot reach is lost; what it can reach, the integral restores.

use super::finger::{Loop, Sine, controllers, quiet_finger, tracking_rmse_deg};
use super::thresholds::CLASSES;
use super::{Axis, Cell, Declaration, Layout, Map, Panel};
use crate::tracking::wearer::SHIPPED_HOLD;
use firmware::control::JointSpec;
use hal_sim::body::FingerSpec;
use std::f64::consts::TAU;

/// Shares of the force that remain under sustained full activation, in the rows.
const FLOORS: [f64; 10] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
/// Time constants of fatigue in the columns, s.
const TIMES_S: [f64; 8] = [2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 90.0, 180.0];
const REFERENCE: Sine = Sine {
    middle_deg: 45.0,
    swing_deg: 30.0,
    frequency_hz: 0.2,
};
/// Part of a trial over which the error is computed, ms from its start: the last four of twelve
/// periods.
const SCORED_MS: std::ops::Range<u32> = 40_000..60_000;

/// Declares the map; the seed is not used.
pub fn declare(_seed: u64) -> Declaration {
    let joints = controllers(SHIPPED_HOLD);
    let map = Map {
        name: "fatigue",
        title: "Depth and time of fatigue: where tracking fails",
        across: Axis::new("time constant of fatigue", "s", &TIMES_S, f64::to_string),
        down: Axis::new("force left by full activation", "", &FLOORS, f64::to_string),
        quantity: "RMSE of the true angle over 40…60 s",
        classes: &CLASSES,
        panels: joints.iter().map(|(name, _)| Panel::blank(*name)).collect(),
        layout: Layout::Beside(2),
        theory: "RMSE² = (that without fatigue)² + mean square of what the tired finger cannot \
                 reach: capacity' = (1 − (1 − depth) force − capacity)/T along the force that \
                 following the reference needs against spring and friction, at most all of it.",
        notes: vec![
            "Finger of participant P, one point, reference 45 ± 30° at 0.2 Hz for 60 s, sensor \
             without noise, all muscles rested at the start. Without fatigue the reference needs \
             0.82 of the flexor's torque at its top. Assumed by theory: a reachable reference is \
             followed as without fatigue, and the finger stays where torque and spring balance \
             while the reference is beyond."
                .to_owned(),
        ],
    };
    Declaration {
        map,
        simulate: Box::new(move |at| cell(&joints[at.panel].1, FLOORS[at.row], TIMES_S[at.column])),
    }
}

fn cell(joint: &JointSpec, floor: f64, time_s: f64) -> Cell {
    let tired = |floor| FingerSpec {
        fatigue_floor: floor,
        fatigue_time_s: time_s,
        ..quiet_finger()
    };
    let rmse = |floor| {
        let device = Loop::new(tired(floor), joint, 0);
        tracking_rmse_deg(device, &REFERENCE, SCORED_MS, 1000.0)
    };
    let number = rmse(floor);
    let rested = if floor < 1.0 { rmse(1.0) } else { number };
    let told = libm::hypot(rested, out_of_reach_deg(&tired(floor)));
    Cell::with_prediction(&CLASSES, number, Some(told))
}

/// Returns the root mean square of the angle that the tired finger cannot reach, °.
fn out_of_reach_deg(spec: &FingerSpec) -> f64 {
    let [low, high] = spec.stops_deg;
    let (mut capacity, mut square) = (1.0, 0.0);
    for ms in 0..SCORED_MS.end {
        let t = f64::from(ms) * 1e-3;
        let angle = REFERENCE.at(t);
        let rate = REFERENCE.rate_deg_per_s() * libm::cos(TAU * REFERENCE.frequency_hz * t);
        let needed = spec.stiffness_nm_per_rad * (angle - spec.rest_deg).to_radians()
            + spec.damping_nm_s_per_rad * rate.to_radians();
        let rested =
            spec.flexor_torque_nm * (1.0 - spec.torque_loss * (angle - low) / (high - low));
        let share = (needed / (rested * capacity)).clamp(0.0, 1.0);
        let lacking = (needed - share * rested * capacity).max(0.0);
        if SCORED_MS.contains(&ms) {
            square += (lacking / spec.stiffness_nm_per_rad).to_degrees().powi(2);
        }
        let steady = 1.0 - (1.0 - spec.fatigue_floor) * share;
        capacity += (steady - capacity) * 1e-3 / spec.fatigue_time_s;
    }
    (square / SCORED_MS.len() as f64).sqrt()
}
