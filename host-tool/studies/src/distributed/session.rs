//! Writes the session file of one condition and wearer.

use super::declared::{Condition, Phase};
use hal_sim::body::shared::{Electrode, SharedSpec};
use std::fmt::Write;

/// Pulse width of all trains, µs.
const WIDTH_US: u32 = 200;
/// Resistance between the electrodes of a channel, Ω.
const LOAD_OHM: u32 = 1_000;

/// Returns the text of a session file for `condition`, with the electrodes of `spec` on the first
/// channels. `alpha_a_per_s2` is the fatigue constant that a calibration would find.
pub(super) fn text(condition: &Condition, spec: &SharedSpec, alpha_a_per_s2: f64) -> String {
    let mut text = format!(
        "title = \"{}\"\nduration_s = 1.0\n[wearer]\nmax_current_ma = 30.0\n\
         max_charge_uc = 7.0\nmax_rms_ma = 6.0\nrise_ms = 50\nfall_ms = 50\n\
         host_timeout_ms = 1000\n",
        condition.says
    );
    let electrodes = spec.electrodes.iter().flatten();
    for (place, electrode) in electrodes.enumerate() {
        let number = place + 1;
        let offset_us = match condition.phase {
            Phase::Even => 1e6 / condition.rate_hz * place as f64 / condition.electrodes as f64,
            Phase::Together => 0.0,
        };
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "[[channel]]\nnumber = {number}\nname = \"electrode {number}\"\nlimit = {:.3}\n\
             stage = {{ kind = \"current\", full_scale_ma = 50.0 }}\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = {WIDTH_US}, \
             frequency_hz = {:.6}, offset_us = {offset_us:.0} }}\n",
            electrode.full_ma, condition.rate_hz,
        );
        if let Some(model) = condition.drive.model() {
            text += &muscle(spec, electrode, alpha_a_per_s2, model);
            text += "force = { hold = \"hold\" }\n";
        }
    }
    let setpoints = match condition.drive.model() {
        None => "kind = \"amplitudes\"\nrate_hz = 5\nvalues = [{ channel = 1, value = 0.0 }]",
        Some(_) => {
            "kind = \"force-ramp\"\nrate_hz = 5\nchannel = 1\npoints = [{ at_s = 0.0, n = 0.0 }]"
        }
    };
    text + &format!("[setpoints]\n{setpoints}\n[body]\nkind = \"still\"\nload_ohm = {LOAD_OHM}\n")
}

/// Returns the strength that a calibration of this electrode alone would find, N: the force of all
/// motor units that the electrode reaches at its largest amplitude.
pub(super) fn strength_n(spec: &SharedSpec, electrode: &Electrode) -> f64 {
    spec.strength_n * electrode.reach.iter().sum::<f64>() / electrode.reach.len() as f64
}

fn muscle(spec: &SharedSpec, electrode: &Electrode, alpha_a_per_s2: f64, model: &str) -> String {
    let strength_n = strength_n(spec, electrode);
    let (dynamics, fatigue) = (spec.dynamics, spec.fatigue);
    format!(
        "muscle = {{ a_n_per_s = {:.3}, k = {:.6}, tau_c_ms = {:.3}, tau1_ms = {:.3}, \
         tau2_ms = {:.3}, motor_threshold = {:.3}, reference = {:.3}, slope_per_unit = {:.6}, \
         model = \"{model}\", fatigue = {{ alpha_a_per_s2 = {alpha_a_per_s2:.3}, \
         alpha_k_per_n_s = {:.9}, alpha_tau1_per_n = {:.9}, tau_fat_s = {:.3} }} }}\n",
        dynamics.a_n_per_s * strength_n,
        dynamics.k,
        1e3 * dynamics.tau_c_s,
        1e3 * dynamics.tau1_s,
        1e3 * dynamics.tau2_s,
        electrode.threshold_ma,
        electrode.full_ma,
        electrode.slope_per_ma(),
        fatigue.alpha_k_per_n_s / strength_n,
        fatigue.alpha_tau1_per_n / strength_n,
        fatigue.tau_fat_s,
    )
}
