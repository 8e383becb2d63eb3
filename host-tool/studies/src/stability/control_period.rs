//! Map of control period × delay for the finger under the device's controllers with their default
//! gains: where the angle settles and where it oscillates because the controller runs rarely.
//!
//! The prediction is the describing function of the controller at that period, whose output is held
//! until its next step.

use super::describing::LazyEfforts;
use super::finger::{controllers, quiet_finger};
use super::muscle_lag::{ASSUMED, CLASSES, hold_cell};
use super::{Axis, Declaration, Layout, Map, Panel};
use firmware::control::{HoldPolicy, JointSpec};
use hal_sim::body::FingerSpec;

/// Control periods of the columns, ms: the device accepts 1 to 20.
const PERIODS_MS: [u8; 10] = [1, 2, 3, 4, 6, 8, 11, 14, 17, 20];
/// Delays of the rows, ms, which are added to the finger's electromechanical delay.
const DELAYS_MS: [u32; 9] = [0, 10, 20, 30, 40, 60, 80, 100, 150];

/// Declares the map; the seed is not used.
pub fn declare(_seed: u64) -> Declaration {
    let laws = controllers(HoldPolicy::Hold).map(|(name, joint)| {
        let with = |law_period_ms| JointSpec {
            law_period_ms,
            ..joint.clone()
        };
        (name, PERIODS_MS.map(|ms| LazyEfforts::new(with(ms))))
    });
    let map = Map {
        name: "control_period",
        title: "Control period and delay: where the device's controllers settle",
        across: Axis::new("control period", "ms", &PERIODS_MS, u8::to_string),
        down: Axis::new("added delay", "ms", &DELAYS_MS, u32::to_string),
        quantity: "angle, peak to peak over the last 5 s",
        classes: &CLASSES,
        panels: laws.iter().map(|(name, _)| Panel::blank(*name)).collect(),
        layout: Layout::Beside(2),
        theory: "N(A, ω) P(jω) = -1 with 2 A = 2°: N is the describing function of the device's \
                 controller, measured on its code at the period of the column, P the finger, \
                 linearised where it holds the reference.",
        notes: vec![
            "Gains and cutoff are the default ones at every period: 2 ms is the default period, \
             11 ms that of the paper's controller. Pulses stay at 50 Hz."
                .to_owned(),
            ASSUMED.to_owned(),
        ],
    };
    Declaration {
        map,
        simulate: Box::new(move |at| {
            let nominal = quiet_finger();
            let late_us = 1000 * DELAYS_MS[at.row];
            let finger = FingerSpec {
                electromechanical_delay_us: nominal.electromechanical_delay_us + late_us,
                ..nominal
            };
            hold_cell(&laws[at.panel].1[at.column], &finger)
        }),
    }
}
