//! Sessions whose trains have a fixed number of pulses: all are emitted at the configured
//! amplitude, and then the session is complete.

use host_core::run::{SessionFile, run, simulated_port};
use host_core::session::Session;

/// Returns a session with a channel of 8 mA that emits `repeats` pulses at `hz`.
fn session(duration_s: u32, hz: u32, repeats: u32, start_ma: u32) -> String {
    format!(
        "title = \"counted\"\nduration_s = {duration_s}.0\n[wearer]\nhost_timeout_ms = 1000\n\
         rise_ms = 500\n[[channel]]\nnumber = 1\nname = \"flexor\"\nlimit = 15.0\n\
         start = {start_ma}.0\nstage = {{ kind = \"current\", full_scale_ma = 100.0 }}\n\
         train = {{ shape = \"biphasic-cathodic-first\", width_us = 200, frequency_hz = {hz}.0, \
         repeats = {repeats} }}\n[setpoints]\nkind = \"amplitudes\"\nrate_hz = 10\n\
         values = [{{ channel = 1, value = 8.0 }}]\n"
    )
}

#[test]
fn a_session_whose_trains_have_played_is_complete() {
    for (duration_s, hz, repeats) in [(1, 10, 1), (16, 3, 48), (5, 50, 20)] {
        let file = SessionFile::parse("counted.toml", &session(duration_s, hz, repeats, 8));
        let file = file.unwrap();
        let boot = firmware::units::Micros::new(0);
        let device = Box::new(hal_sim::native::native(boot));
        let port = simulated_port(&file.session, 1, device, boot).unwrap();
        let (outcome, port) = run(&file, port, None, |_| ());
        assert!(outcome.error.is_none(), "{:?}", outcome.error);
        let events = &outcome.trial.events;
        assert_eq!(events.last().unwrap().1, "stopped: Finished");
        assert_eq!(
            outcome.trial.pulses,
            Some(repeats.into()),
            "{repeats} at {hz} Hz"
        );
        // Every pulse has 8 of 100 mA.
        let dac = &port.unwrap().world.recorder.trace.dac;
        let last = dac.iter().rev().take(repeats as usize);
        assert!(last.clone().all(|write| write.code == 5_242), "{dac:?}");
    }
}

/// `values` beside another kind of setpoints also apply before the first pulse.
#[test]
fn amplitudes_beside_other_setpoints_lose_no_pulse() {
    for (hz, repeats) in [(50, 1), (50, 10), (200, 20)] {
        let text = session(1, hz, repeats, 8).replace("\"amplitudes\"", "\"keep-alive\"");
        let file = SessionFile::parse("counted.toml", &text).unwrap();
        let boot = firmware::units::Micros::new(0);
        let device = Box::new(hal_sim::native::native(boot));
        let port = simulated_port(&file.session, 1, device, boot).unwrap();
        let (outcome, _) = run(&file, port, None, |_| ());
        assert!(outcome.error.is_none(), "{:?}", outcome.error);
        assert_eq!(outcome.trial.pulses, Some(repeats.into()), "at {hz} Hz");
    }
}

/// The wearer's time limit includes the fall, and `check` notes that the device ends such a session
/// early.
#[test]
fn a_session_as_long_as_the_wearers_time_is_noted() {
    let text = session(2, 50, 0, 8);
    let at = |max_s: u32| {
        let limited = text.replace("[wearer]", &format!("[wearer]\nmax_session_s = {max_s}"));
        Session::parse("it.toml", &limited).unwrap().notes
    };
    let note = "the device ends stimulation after 1.94975 s";
    assert!(at(2).iter().any(|line| line.contains(note)), "{:?}", at(2));
    let ends = "the device ends stimulation";
    assert!(!at(3).iter().any(|line| line.contains(ends)));
}

#[test]
fn a_fixed_number_of_pulses_that_would_rise_is_refused() {
    let refused = |text: &str| Session::parse("it.toml", text).unwrap_err().to_string();
    let seven = refused(&session(5, 50, 20, 7));
    let wanted = "is 8 mA, but the `start` of channel 1 is 7 mA: 20 pulses of its `repeats`";
    assert!(seven.contains(wanted), "{seven}");
    let many = refused(&session(5, 50, 200, 0));
    assert!(many.contains(" 25 pulses"), "{many}");
}
