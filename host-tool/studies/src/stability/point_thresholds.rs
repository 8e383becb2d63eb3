//! Map of a threshold mismatch between two points × delay for the finger under the device's
//! controllers: where tracking fails because the second point of a pair begins to act at another
//! effort than the first.
//!
//! A point of a pair acts from a lower voltage on if both act. Where the second begins late, the
//! torque jumps from nothing to that of the first, and no effort holds an angle within the jump.

use super::finger::{Loop, Sine, controllers_at, tracking_rmse_deg};
use super::thresholds::{CLASSES, SCORED_MS};
use super::{Axis, Cell, Declaration, Layout, Map, Panel};
use crate::tracking::wearer::{self, Points, SHIPPED_HOLD};
use firmware::control::JointSpec;
use hal_sim::body::FingerSpec;
use hal_sim::body::wearer::recruitment;

/// Mismatches of the rows: by how much the recruitment curve of point B lies above the file's, % of
/// its range from threshold to maximum. Point A and the extensor are as the file says.
const MISMATCHES: [i32; 9] = [-40, -30, -20, -10, 0, 10, 20, 30, 40];
/// Delays of the columns, ms, which are added to the finger's electromechanical delay.
const DELAYS_MS: [u32; 9] = [0, 10, 20, 30, 40, 50, 60, 80, 100];
/// Reference of experiment 4 of Hamana 2022, with an assumed middle.
const REFERENCE: Sine = Sine {
    middle_deg: 45.0,
    swing_deg: 40.0,
    frequency_hz: 0.2,
};

/// Declares the map; the seed is not used.
pub fn declare(_seed: u64) -> Declaration {
    let joints = controllers_at(Points::Two, SHIPPED_HOLD);
    let panel = |(name, _): &(&'static str, JointSpec)| Panel::blank(*name);
    let map = Map {
        name: "point_thresholds",
        title: "Threshold mismatch between two points, and delay: where tracking fails",
        across: Axis::new("added delay", "ms", &DELAYS_MS, u32::to_string),
        down: Axis::new("mismatch of B", "% of range", &MISMATCHES, i32::to_string),
        quantity: "RMSE of the true angle over 10…30 s",
        classes: &CLASSES,
        panels: joints.iter().map(panel).collect(),
        layout: Layout::Beside(2),
        theory: "RMSE² = (that without mismatch at this delay)² + mean square of the distance \
                 from the reference to the nearer end of the jump, while it is within: from the \
                 rest angle to the angle that point A holds at the effort at which B begins to \
                 act. No jump where B begins early.",
        notes: vec![
            "The mismatch is how far the recruitment curve of point B lies above the file's, in % \
             of the range from its threshold in a pair to its maximum. Finger of participant P, \
             which itself delays by 25 ms, two points as a conducted pair with the assumed torque \
             of docs/evidence/control.md, reference 45 ± 40° at 0.2 Hz, sensor without noise."
                .to_owned(),
        ],
    };
    Declaration {
        map,
        simulate: Box::new(move |at| {
            let joint = &joints[at.panel].1;
            cell(joint, MISMATCHES[at.row], DELAYS_MS[at.column])
        }),
    }
}

fn cell(joint: &JointSpec, mismatch: i32, delay_ms: u32) -> Cell {
    let rmse = |mismatch| {
        let device = Loop::new(finger(mismatch, delay_ms), joint, 0);
        tracking_rmse_deg(device, &REFERENCE, SCORED_MS, 1000.0)
    };
    let number = rmse(mismatch);
    let own = if mismatch == 0 { number } else { rmse(0) };
    let told = libm::hypot(own, jump_rmse_deg(mismatch));
    Cell::with_prediction(&CLASSES, number, Some(told))
}

fn finger(mismatch: i32, delay_ms: u32) -> FingerSpec {
    let mut finger = FingerSpec {
        sensor_noise_deg: 0.0,
        sensor_resolution_deg: 1e-6,
        ..wearer::nominal()
    };
    finger.electromechanical_delay_us += 1000 * delay_ms;
    if let Some(pair) = &mut finger.pair {
        let by_v = f64::from(mismatch) * 0.01 * (finger.flexor_b.max_v - pair.threshold_v[1]);
        pair.threshold_v[1] += by_v;
        finger.flexor_b.threshold_v += by_v;
        finger.flexor_b.max_v += by_v;
    }
    finger
}

/// Returns the RMSE that theory predicts for a controller that stays at the nearer end of the jump
/// while the reference is within it, °.
fn jump_rmse_deg(mismatch: i32) -> f64 {
    let spec = finger(mismatch, 0);
    let [low, high] = spec.stops_deg;
    let begins = f64::from(mismatch.max(0)) * 0.01;
    let torque_nm =
        spec.flexor_torque_nm * recruitment(begins, 0.0, 1.0, spec.recruitment_curvature);
    let spring = spec.stiffness_nm_per_rad.to_radians();
    let loss = torque_nm * spec.torque_loss / (high - low);
    let top_deg = (spring * spec.rest_deg + torque_nm + loss * low) / (spring + loss);
    let off = |ms: u32| {
        let wanted = REFERENCE.at(f64::from(ms) * 1e-3);
        match wanted > spec.rest_deg && wanted < top_deg {
            true => (wanted - spec.rest_deg).min(top_deg - wanted),
            false => 0.0,
        }
    };
    let square: f64 = SCORED_MS.map(|ms| off(ms).powi(2)).sum();
    (square / SCORED_MS.len() as f64).sqrt()
}
