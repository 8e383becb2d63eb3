//! Every edge of the paper's 29 stimulation patterns, on its microsecond.

use hal_sim::trace::{State, Trace, check};
use host_core::run::{DeviceName, SessionFile, edges_between};
use host_core::session::Course;
use std::fmt::Write;
use std::path::Path;
use tests::desk::{load_session, play, session_paths};
use tests::expectation::{session_expectation, trace_since};

/// Runs the first part of a session. Returns its trace from the epoch on, and the epoch.
fn stimulate(mut file: SessionFile, length_us: u64) -> (SessionFile, Trace, u64) {
    file.session.duration_us = length_us + 50_000;
    let played = play(&file, &DeviceName::Native);
    let epoch = played.epoch_us;
    let trace = trace_since(&played.trace, epoch);
    (file, trace.up_to(epoch + length_us), epoch)
}

/// Does the same, and checks every edge against its analytic microsecond.
fn exact(path: &Path, length_us: u64) -> (Trace, u64) {
    let file = SessionFile::load(path).unwrap();
    let (file, trace, epoch) = stimulate(file, length_us);
    let expected = session_expectation(&file.session, epoch, epoch + length_us);
    let violations = check(&trace, &expected);
    let name = path.display();
    assert!(violations.is_empty(), "{name}: {:?}", violations.first());
    (trace, epoch)
}
#[test]
fn all_29_patterns_are_exact() {
    let files = session_paths("hamana_exp2");
    assert_eq!(files.len(), 29, "25 of two points and 4 of one");
    let mut text = String::new();
    for path in files {
        let (trace, epoch) = exact(&path, 500_000);
        let _ = writeln!(text, "{}", path.file_stem().unwrap().display());
        // One period after the ramp.
        for edge in edges_between(&trace, epoch + 400_000, epoch + 420_000) {
            let state = format!("{:?}", edge.state).to_lowercase();
            let _ = writeln!(text, "{:>6} {} {state}", edge.t_us, edge.channel);
        }
    }
    insta::assert_snapshot!("hamana_exp2", text);
}

#[test]
fn ten_channels_are_exact() {
    for path in session_paths("") {
        let file = SessionFile::load(&path).unwrap();
        let is_constant = matches!(file.session.setpoints.course, Course::Amplitudes(_));
        let is_triggered = file
            .session
            .channels
            .iter()
            .any(|c| c.spec.train.trigger.is_some());
        if is_constant && !is_triggered {
            exact(&path, 2_000_000);
        }
    }
}

/// Each of four electrodes stimulates in its turn of the 100 ms period, and the others are
/// disconnected meanwhile.
#[test]
fn four_electrodes_share_a_muscle_by_turns() {
    let (_, trace, epoch) = stimulate(load_session("distributed.toml"), 5_200_000);
    let mut text = String::new();
    for edge in edges_between(&trace, epoch + 5_000_000, epoch + 5_100_000) {
        let state = format!("{:?}", edge.state).to_lowercase();
        let (t_us, code) = (edge.t_us, edge.dac_code);
        let _ = writeln!(text, "{t_us:>6} {} {state} {code}", edge.channel);
    }
    insta::assert_snapshot!("distributed", text);
}

#[test]
fn isolated_pulses_that_overlap_are_refused_with_the_reason() {
    let mut files = session_paths("hamana_exp2").into_iter();
    let path = files.find(|p| p.to_string_lossy().contains("_13_isolated"));
    let text = std::fs::read_to_string(path.unwrap()).unwrap();
    for offset in ["offset_us = 0 }", "offset_us = 199 }"] {
        let overlapping = text.replace("offset_us = 10000 }", offset);
        let error = SessionFile::parse("overlap.toml", &overlapping).unwrap_err();
        assert!(error.to_string().contains("overlap"), "{error}");
    }
}

#[test]
fn sync_follows_the_first_phase_of_its_channel() {
    let (file, trace, _) = stimulate(load_session("ten_channels.toml"), 300_000);
    let channel = file.session.sync.expect("the session names a sync channel");
    let shape = file.session.channel(channel).unwrap().spec.train.shape;
    let first = match shape.cathodic_first() {
        true => State::Cathodic,
        false => State::Anodic,
    };
    let mut highs = 0;
    for (t, levels) in &trace.levels {
        assert_eq!(levels.sync(), levels.state(channel) == first, "at {t}");
        highs += u32::from(levels.sync());
    }
    assert!(highs > 10);
}
