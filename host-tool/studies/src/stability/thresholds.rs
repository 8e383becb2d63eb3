//! Map of threshold mismatch × delay for the finger under the device's controllers: where tracking
//! fails because the muscles begin to act at other amplitudes than the wearer file says.
//!
//! Thresholds above the file's leave a gap between flexing and extending. A controller with a single
//! integral has to cross this gap at each change of direction, and the error grows meanwhile.

use super::finger::{Loop, Sine, controllers, quiet_finger, tracking_rmse_deg};
use super::{Axis, Cell, Class, Declaration, Layout, Map, Panel};
use crate::tracking::wearer::SHIPPED_HOLD;
use firmware::control::{JointSpec, LawSpec};
use hal_sim::body::FingerSpec;
use hal_sim::body::wearer::Site;

/// Mismatches of the rows: by how much the recruitment curves of flexor and extensor lie above the
/// file's, % of the point's range from threshold to maximum.
const MISMATCHES: [i32; 9] = [-40, -30, -20, -10, 0, 10, 20, 30, 40];
/// Delays of the columns, ms, which are added to the finger's electromechanical delay.
const DELAYS_MS: [u32; 9] = [0, 10, 20, 30, 40, 50, 60, 80, 100];
/// Reference. The finger's rest angle is its middle, so that each half period needs the other
/// muscle.
const REFERENCE: Sine = Sine {
    middle_deg: 45.0,
    swing_deg: 20.0,
    frequency_hz: 0.2,
};
/// Part of a trial over which the error is computed, ms from its start: four periods.
pub(super) const SCORED_MS: std::ops::Range<u32> = 10_000..30_000;

/// Classes of a tracking error: more than 3° fails, as in docs/evidence/control.md.
pub(super) const CLASSES: [Class; 8] = [
    Class::new('.', 0.5, "up to 0.5°", 0),
    Class::new('1', 1.0, "up to 1°", 0),
    Class::new('2', 2.0, "up to 2°", 0),
    Class::new('3', 3.0, "up to 3°", 0),
    Class::new('5', 5.0, "up to 5°", 1),
    Class::new('8', 10.0, "up to 10°", 1),
    Class::new('X', 180.0, "more than 10°", 1),
    Class::new('!', f64::INFINITY, "the device stops", 1),
];

/// Declares the map; the seed is not used.
pub fn declare(_seed: u64) -> Declaration {
    let mut joints = controllers(SHIPPED_HOLD);
    for (_, joint) in &mut joints {
        if let Some(wearer) = &mut joint.wearer {
            wearer.rest_mdeg = (REFERENCE.middle_deg * 1e3) as i32;
        }
    }
    let map = Map {
        name: "thresholds",
        title: "Threshold mismatch and delay: where tracking fails",
        across: Axis::new("added delay", "ms", &DELAYS_MS, u32::to_string),
        down: Axis::new("mismatch", "% of range", &MISMATCHES, i32::to_string),
        quantity: "RMSE of the true angle over 10…30 s",
        classes: &CLASSES,
        panels: joints.iter().map(|(name, _)| Panel::blank(*name)).collect(),
        layout: Layout::Beside(2),
        theory: "RMSE² = (that without mismatch at this delay)² + 4 r² t³/(3 T): at each of the \
                 two changes of direction in a period T the finger stands still for a time t, \
                 until the controller's effort has crossed the gap of both thresholds, while the \
                 reference moves at its largest rate r; the error shrinks as it grew. No gap: \
                 thresholds below the file's, and controllers with an integral for each muscle.",
        notes: vec![
            "The mismatch is how far the recruitment curves of both muscles lie above the file's, in \
             % of the range from threshold to maximum. Finger of participant P, which itself \
             delays by 25 ms, one point, sensor without noise, reference 45 ± 20° at 0.2 Hz. Assumed: the finger rests at 45°, and the file \
             says so. P's flexor range is 4 V (24 to 28 V): 10 % are 0.4 V, or 1.7 % of the \
             threshold."
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
    let told = libm::hypot(own, gap_rmse_deg(joint, mismatch));
    Cell::with_prediction(&CLASSES, number, Some(told))
}

fn finger(mismatch: i32, delay_ms: u32) -> FingerSpec {
    let nominal = quiet_finger();
    let shifted = |site: Site| {
        let by_v = f64::from(mismatch) * 0.01 * (site.max_v - site.threshold_v);
        Site {
            threshold_v: site.threshold_v + by_v,
            max_v: site.max_v + by_v,
            ..site
        }
    };
    FingerSpec {
        flexor_a: shifted(nominal.flexor_a),
        flexor_b: shifted(nominal.flexor_b),
        extensor: shifted(nominal.extensor),
        rest_deg: REFERENCE.middle_deg,
        electromechanical_delay_us: nominal.electromechanical_delay_us + 1000 * delay_ms,
        ..nominal
    }
}

/// Returns the RMSE that theory predicts for crossing the gap, °.
fn gap_rmse_deg(joint: &JointSpec, mismatch: i32) -> f64 {
    let has_two_integrals = joint.response.is_some();
    if mismatch <= 0 || has_two_integrals {
        return 0.0;
    }
    let part = f64::from(mismatch) * 0.01;
    let gap = match joint.law {
        // Volts.
        LawSpec::Paper { .. } => {
            let range =
                |p: &firmware::control::PointSpec| f64::from(p.max.get() - p.threshold.get());
            let flexor = joint.flexors.first().map_or(0.0, range);
            part * (flexor + range(&joint.extensor)) * 1e-3
        }
        _ => 2.0 * part,
    };
    const STEP_S: f64 = 1e-4;
    let rate = REFERENCE.rate_deg_per_s();
    let period_s = 1.0 / REFERENCE.frequency_hz;
    let (mut t, mut integral) = (0.0, 0.0);
    // Beyond a quarter of a period the reference turns back.
    while t < 0.25 * period_s {
        let (push, growth) = feedback(&joint.law, rate * t, rate);
        if push + integral >= gap {
            break;
        }
        integral += growth * STEP_S;
        t += STEP_S;
    }
    (4.0 * rate.powi(2) * t.powi(3) / (3.0 * period_s)).sqrt()
}

/// Returns the effort besides the integral and the rate at which the integral grows, 1/s, for an
/// error (°) that changes at `rate` (°/s): the control law in continuous time.
fn feedback(law: &LawSpec, error_deg: f64, rate_deg_per_s: f64) -> (f64, f64) {
    let milli = |gain: u32| f64::from(gain) * 1e-3;
    let (e, rate) = (error_deg.to_radians(), rate_deg_per_s.to_radians());
    match *law {
        LawSpec::Paper {
            lambda_milli,
            w_milli,
        } => {
            let lambda = milli(lambda_milli);
            let s = rate_deg_per_s + lambda * error_deg;
            (
                lambda * s.abs().sqrt() * s.signum(),
                milli(w_milli) * s.signum(),
            )
        }
        LawSpec::Recommended {
            lambda_milli,
            k1_milli,
            k2_milli,
            k3_milli,
            ki_milli,
            ..
        } => {
            let s = rate + milli(lambda_milli) * e;
            let push = milli(k1_milli) * s.abs().sqrt() * s.signum() + milli(k3_milli) * s;
            (push, milli(k2_milli) * s.signum() + milli(ki_milli) * e)
        }
        LawSpec::Pid {
            kp_milli,
            ki_milli,
            kd_milli,
        } => (
            milli(kp_milli) * e + milli(kd_milli) * rate,
            milli(ki_milli) * e,
        ),
    }
}
