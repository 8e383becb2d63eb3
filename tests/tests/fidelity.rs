//! `[fidelity]`: a session simplified to the level that its conditions allow stays within the
//! tolerance of the original.

use host_core::choice::resolve_auto_models;
use host_core::run::{DeviceName, SessionFile};
use host_core::session::BodySpec;
use tests::desk::{play, session_path};

/// Loads a committed session with a tolerance, or unchanged.
fn session(name: &str, tolerance: Option<f64>) -> SessionFile {
    let mut text = std::fs::read_to_string(session_path(&format!("{name}.toml"))).unwrap();
    if let Some(percent) = tolerance {
        text.push_str(&format!("\n[fidelity]\ntolerance_percent = {percent}\n"));
    }
    let mut file = SessionFile::parse(name, &text).unwrap();
    resolve_auto_models(&mut file.session).unwrap();
    file
}

/// Plays a session. Returns the telemetry period, ms, and the root mean square of `quantity` over the
/// samples from 10 s on.
fn played(file: &SessionFile, quantity: impl Fn(&host_core::record::Sample) -> f64) -> (f64, f64) {
    let samples = play(file, &DeviceName::Native)
        .outcome
        .trial
        .samples
        .to_vec();
    let (first, last) = (samples[1].t_s, samples[samples.len() - 1].t_s);
    let period_ms = (last - first) / (samples.len() - 2) as f64 * 1e3;
    let scored: Vec<f64> = samples
        .iter()
        .filter(|s| s.t_s >= 10.0)
        .map(quantity)
        .collect();
    let square: f64 = scored.iter().map(|e| e * e).sum();
    (period_ms, (square / scored.len() as f64).sqrt())
}

/// The finger's error changes by less than the tolerance, in % of the 80° range of motion.
#[test]
fn a_finger_is_followed_as_well_at_what_its_scenes_need() {
    let name = "hamana_exp4_two_point_finger";
    let error = |s: &host_core::record::Sample| s.target_deg.unwrap() - s.true_deg.unwrap();
    let (period_ms, as_filed) = played(&session(name, None), error);
    assert!((period_ms - 10.0).abs() < 0.1, "{period_ms}");
    let mut coarsest = 0;
    for percent in [2.0, 5.0, 10.0] {
        let file = session(name, Some(percent));
        let Some(BodySpec::Finger(finger)) = &file.session.body else {
            panic!("a finger");
        };
        let law_ms = file.session.joint.as_ref().unwrap().law_period_ms;
        let telemetry_ms = file.session.telemetry_ms;
        let (period_ms, rms) = played(&file, error);
        println!(
            "{percent} %: law {law_ms} ms, telemetry {telemetry_ms} ms, finger {} µs: \
             {rms:.2}° against {as_filed:.2}°",
            finger.step_us
        );
        assert!(
            (period_ms - f64::from(telemetry_ms)).abs() < 0.1,
            "{period_ms}"
        );
        assert!((rms - as_filed).abs() < percent * 0.8, "{rms} {as_filed}");
        coarsest = finger.step_us.max(coarsest);
    }
    assert!(coarsest > 1000, "nothing was coarser than the file's own");
}
