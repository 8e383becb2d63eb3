//! Errors of a setting against the true force.

use super::cases::{Case, DURATION_US};
use crate::subjects::forces;
use methods::muscle::{Integrator, Setting};

/// Returns the largest error of a setting whose force is read every `output_us`, % of the case's
/// peak force; infinite if a force is not a number.
pub fn case_error_pct(case: &Case, setting: Setting, output_us: u32) -> f64 {
    setting
        .with_integrator(&case.spec, |muscle| {
            run_error_pct(case, muscle, output_us, DURATION_US)
        })
        .unwrap_or(f64::INFINITY)
}

/// Returns the largest error of an integrator whose force is read every `output_us` until
/// `until_us` (at most [`DURATION_US`]), % of the case's peak force. The muscle must be at rest at
/// time 0.
pub fn run_error_pct(
    case: &Case,
    muscle: &mut dyn Integrator,
    output_us: u32,
    until_us: u32,
) -> f64 {
    let times = || (output_us..=until_us).step_by(output_us as usize);
    let mut worst = 0f64;
    for (force, at_us) in forces(muscle, &case.pulses_us, times()).zip(times()) {
        let off = (force - case.truth_n(at_us)).abs();
        worst = if off.is_nan() {
            f64::INFINITY
        } else {
            worst.max(off)
        };
    }
    worst / case.peak_n * 100.0
}

/// Returns the largest error of a setting over all `cases`, % of each case's peak force.
pub fn worst_error_pct(cases: &[Case], setting: Setting, output_us: u32) -> f64 {
    let errors = cases
        .iter()
        .map(|case| case_error_pct(case, setting, output_us));
    errors.fold(0.0, f64::max)
}
