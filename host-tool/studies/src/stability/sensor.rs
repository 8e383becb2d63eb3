//! Map of sensor noise × frame rate for the finger under the device's controllers: where tracking
//! fails because the angle is seen rarely or inaccurately.
//!
//! Theory treats rare frames as half a frame of delay, and noise as an input of the linearised loop.

use super::describing::{LazyEfforts, Plant};
use super::finger::{Loop, Sine, controllers, quiet_finger, tracking_rmse_deg};
use super::thresholds::{CLASSES, SCORED_MS};
use super::{Axis, Cell, Declaration, Layout, Map, Panel};
use crate::tracking::wearer::SHIPPED_HOLD;
use firmware::control::JointSpec;
use hal_sim::body::FingerSpec;

/// Frame rates of the sensor in the rows, Hz.
const FRAMES_HZ: [f64; 12] = [
    5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0, 45.0, 60.0, 90.0, 250.0, 1000.0,
];
/// Standard deviations of the noise of a frame in the columns, °.
const NOISE_DEG: [f64; 9] = [0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 2.0, 3.0];
/// Reference of experiment 4 of Hamana 2022, with an assumed middle.
const REFERENCE: Sine = Sine {
    middle_deg: 45.0,
    swing_deg: 40.0,
    frequency_hz: 0.2,
};
/// Number of seeds over which the mean square of a cell with noise is averaged.
const SEEDS: u64 = 3;

/// Declares the map; `seed` determines the noise.
pub fn declare(seed: u64) -> Declaration {
    let laws = controllers(SHIPPED_HOLD).map(|(name, joint)| (name, LazyEfforts::new(joint)));
    let plant = Plant::new(&quiet_finger(), REFERENCE.middle_deg);
    let map = Map {
        name: "sensor",
        title: "Sensor noise and frame rate: where tracking fails",
        across: Axis::new("noise of a frame", "°", &NOISE_DEG, f64::to_string),
        down: Axis::new("frames per second", "Hz", &FRAMES_HZ, f64::to_string),
        quantity: "RMSE of the true angle over 10…30 s",
        classes: &CLASSES,
        panels: laws.iter().map(|(name, _)| Panel::blank(*name)).collect(),
        layout: Layout::Beside(2),
        theory: "RMSE² = (that of a sensor without noise that is read every ms, on a finger with \
                 half a frame more delay)² + variance of the held white noise of the frames, \
                 through the loop that is linearised by the describing function for a sine of the \
                 same variance. The device stops where frames are further apart than 100 ms.",
        notes: vec![format!(
            "Finger of participant P, one point, reference 45 ± 40° at 0.2 Hz, resolution of the \
             sensor finer than the device's; root mean square over {SEEDS} seeds. Assumed by \
             theory: noise and reference add without affecting each other, the finger is \
             linearised at 45°."
        )],
    };
    Declaration {
        map,
        simulate: Box::new(move |at| {
            let (frames_hz, noise_deg) = (FRAMES_HZ[at.row], NOISE_DEG[at.column]);
            let law = &laws[at.panel].1;
            let noisy_deg = match law.get() {
                Some(efforts) if noise_deg > 0.0 => {
                    let function = efforts.around(&plant);
                    noise_deg * function.noise_gain(&plant, noise_deg, 1.0 / frames_hz)
                }
                _ => 0.0,
            };
            cell(law.joint(), frames_hz, noise_deg, noisy_deg, seed)
        }),
    }
}

/// Simulates a cell; `noisy_deg` is the standard deviation of the angle that theory predicts.
fn cell(joint: &JointSpec, frames_hz: f64, noise_deg: f64, noisy_deg: f64, seed: u64) -> Cell {
    let seeds = if noise_deg > 0.0 { SEEDS } else { 1 };
    let finger = FingerSpec {
        sensor_noise_deg: noise_deg,
        ..quiet_finger()
    };
    let rmse = |n| {
        let seed = seed.wrapping_mul(1000).wrapping_add(n);
        let device = Loop::new(finger.clone(), joint, seed);
        tracking_rmse_deg(device, &REFERENCE, SCORED_MS, frames_hz)
    };
    let squares = (0..seeds).map(|n| rmse(n).powi(2)).sum::<f64>();
    let number = (squares / seeds as f64).sqrt();
    let told = if 1000.0 / frames_hz > f64::from(joint.stale_after_ms) {
        f64::INFINITY
    } else {
        libm::hypot(late_rmse_deg(joint, 0.5 / frames_hz), noisy_deg)
    };
    Cell::with_prediction(&CLASSES, number, Some(told))
}

/// Returns the RMSE on a finger that delays by `late_s` more, with a sensor that is read every ms.
fn late_rmse_deg(joint: &JointSpec, late_s: f64) -> f64 {
    let nominal = quiet_finger();
    let late_us = (late_s * 1e6).round() as u32;
    let finger = FingerSpec {
        electromechanical_delay_us: nominal.electromechanical_delay_us + late_us,
        ..nominal
    };
    tracking_rmse_deg(Loop::new(finger, joint, 0), &REFERENCE, SCORED_MS, 1000.0)
}
