//! Map of muscle lag × delay for the finger under the device's controllers: where the angle settles
//! and where it oscillates because the muscle is slower or faster than the one for which the
//! controller was made.
//!
//! The prediction is the describing function, as in `gain_delay`.

use super::describing::{LazyEfforts, Plant};
use super::finger::{Loop, controllers, quiet_finger, swing_deg};
use super::{Axis, Cell, Class, Declaration, Layout, Map, Panel};
use firmware::control::HoldPolicy;
use hal_sim::body::FingerSpec;
use hal_sim::body::muscle::Parameters;

/// Factors of the rows by which τ1 and τ2 of the muscles are multiplied.
const LAGS: [f64; 9] = [0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0];
/// Delays of the columns, ms, which are added to the finger's electromechanical delay.
const DELAYS_MS: [u32; 11] = [0, 10, 20, 30, 40, 50, 60, 80, 100, 120, 150];
/// Reference angle, °.
const TARGET_DEG: f64 = 30.0;
/// Lengths of a simulated trial and of the judged part at its end, ms.
const TRIAL_MS: u32 = 20_000;
const JUDGED_MS: u32 = 5_000;

/// Classes of the swing at a hold: more than 2° fails.
pub(super) const CLASSES: [Class; 7] = [
    Class::new('.', 0.5, "up to 0.5°", 0),
    Class::new('1', 1.0, "up to 1°", 0),
    Class::new('2', 2.0, "up to 2°", 0),
    Class::new('5', 5.0, "up to 5°", 1),
    Class::new('8', 20.0, "up to 20°", 1),
    Class::new('X', 180.0, "more than 20°", 1),
    Class::new('!', f64::INFINITY, "the device refuses the joint", 1),
];

/// Assumptions of the describing function's prediction.
pub(super) const ASSUMED: &str = "Finger of participant P, which itself delays by 25 ms, one point, \
     reference 30°, 20 s, sensor without noise. Assumed by theory: the finger passes only the first \
     harmonic, recruitment is computed around the effort that holds the reference, the effort in \
     volts of the paper's controller refers to the flexor's range for both muscles, and the default \
     controller has learnt the value at which the mean error is zero.";

/// Declares the map; the seed is not used.
pub fn declare(_seed: u64) -> Declaration {
    let laws = controllers(HoldPolicy::Hold).map(|(name, joint)| (name, LazyEfforts::new(joint)));
    let map = Map {
        name: "muscle_lag",
        title: "Muscle lag and delay: where the device's controllers settle",
        across: Axis::new("added delay", "ms", &DELAYS_MS, u32::to_string),
        down: Axis::new("τ1 and τ2 / nominal", "", &LAGS, |lag| format!("{lag}")),
        quantity: "angle, peak to peak over the last 5 s",
        classes: &CLASSES,
        panels: laws.iter().map(|(name, _)| Panel::blank(*name)).collect(),
        layout: Layout::Beside(2),
        theory: "N(A, ω) P(jω) = -1 with 2 A = 2°: N is the describing function of the device's \
                 controller, P the finger, linearised where it holds the reference, with the \
                 muscle's lag τ1 + τ2 x.",
        notes: vec![
            format!(
                "The muscle's nominal lag is {:.0} ms at 50 Hz. A is divided by the factor of the \
                 row, so that the torque at 50 Hz stays.",
                Plant::new(&finger(1.0, 0), TARGET_DEG).lag_s() * 1e3
            ),
            ASSUMED.to_owned(),
        ],
    };
    Declaration {
        map,
        simulate: Box::new(move |at| {
            let (lag, delay_ms) = (LAGS[at.row], DELAYS_MS[at.column]);
            hold_cell(&laws[at.panel].1, &finger(lag, delay_ms))
        }),
    }
}

/// Simulates a hold of this finger under a law, and predicts its limit cycle.
pub(super) fn hold_cell(law: &LazyEfforts, finger: &FingerSpec) -> Cell {
    let Some(efforts) = law.get() else {
        return Cell::with_verdict(&CLASSES, f64::INFINITY, None);
    };
    let device = Loop::new(finger.clone(), law.joint(), 0);
    let number = swing_deg(device, TARGET_DEG, TRIAL_MS, JUDGED_MS);
    let plant = Plant::new(finger, TARGET_DEG);
    let told = 2.0 * efforts.around(&plant).limit_cycle_deg(&plant);
    Cell::with_prediction(&CLASSES, number, Some(told))
}

fn finger(lag: f64, delay_ms: u32) -> FingerSpec {
    let nominal = quiet_finger();
    let m = nominal.muscle;
    FingerSpec {
        muscle: Parameters {
            a_n_per_s: m.a_n_per_s / lag,
            tau1_s: m.tau1_s * lag,
            tau2_s: m.tau2_s * lag,
            ..m
        },
        electromechanical_delay_us: nominal.electromechanical_delay_us + 1000 * delay_ms,
        ..nominal
    }
}
