//! Every edge of the paper's 29 stimulation patterns, on its microsecond.

use hal_sim::trace::{Levels, Trace};
use host_core::link::Port;
use host_core::run::{DeviceName, SessionFile, edges_between, run};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use tests::expectation::{of_session, since};

fn sessions(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../host-tool/sessions")
        .join(folder);
    let entries = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    files
}

/// Runs `seconds` of a session; its trace from the epoch on, epoch and end.
fn stimulate(path: &Path, length_us: u64) -> (SessionFile, Trace, u64) {
    let mut file = SessionFile::load(path).unwrap();
    file.session.duration_us = length_us + 50_000;
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let (outcome, port) = run(&file, port, None, |_| ());
    assert!(
        outcome.error.is_none(),
        "{}: {}",
        path.display(),
        outcome.error.unwrap()
    );
    let epoch = outcome.epoch_us.unwrap();
    let trace = since(&port.unwrap().world().unwrap().recorder.trace, epoch);
    (file, trace.until(epoch + length_us), epoch)
}

#[test]
fn all_29_patterns_are_exact() {
    let files = sessions("hamana_exp2");
    assert_eq!(
        files.len(),
        29,
        "25 two-point patterns and 4 one-point patterns"
    );
    let mut text = String::new();
    for path in files {
        let (file, trace, epoch) = stimulate(&path, 500_000);
        let expected = of_session(&file.session, epoch, epoch + 500_000);
        let violations = hal_sim::trace::check(&trace, &expected);
        assert!(
            violations.is_empty(),
            "{}: {:?}",
            path.display(),
            violations.first()
        );
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
    for path in sessions("") {
        let Ok(file) = SessionFile::load(&path) else {
            panic!("{}", path.display())
        };
        let is_constant = matches!(
            file.session.setpoints.course,
            host_core::session::Course::Amplitudes(_)
        );
        let is_triggered = file.session.channels.iter().any(|c| c.spec.train.triggered);
        if !is_constant || is_triggered {
            continue;
        }
        let (file, trace, epoch) = stimulate(&path, 2_000_000);
        let expected = of_session(&file.session, epoch, epoch + 2_000_000);
        let violations = hal_sim::trace::check(&trace, &expected);
        assert!(
            violations.is_empty(),
            "{}: {:?}",
            path.display(),
            violations.first()
        );
    }
}

#[test]
fn isolated_pulses_that_overlap_are_refused_with_the_reason() {
    let path = sessions("hamana_exp2")
        .into_iter()
        .find(|p| p.to_string_lossy().contains("_13_isolated"))
        .unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    for offset in ["offset_us = 0 }", "offset_us = 199 }"] {
        let overlapping = text.replace("offset_us = 10000 }", offset);
        let error = SessionFile::parse("overlap.toml", &overlapping).unwrap_err();
        assert!(error.to_string().contains("overlap"), "{error}");
    }
}

#[test]
fn sync_follows_the_first_phase_of_its_channel() {
    let path = sessions("")
        .into_iter()
        .find(|p| p.ends_with("ten_channels.toml"))
        .unwrap();
    let (file, trace, _) = stimulate(&path, 300_000);
    let channel = file.session.sync.expect("the session names a sync channel");
    let first = match file
        .session
        .channel(channel)
        .unwrap()
        .spec
        .train
        .shape
        .cathodic_first()
    {
        true => hal_sim::trace::State::Cathodic,
        false => hal_sim::trace::State::Anodic,
    };
    let mut highs = 0;
    for (t, levels) in &trace.levels {
        let levels: &Levels = levels;
        assert_eq!(levels.sync(), levels.state(channel) == first, "at {t}");
        highs += u32::from(levels.sync());
    }
    assert!(highs > 10);
}
