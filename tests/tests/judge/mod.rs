//! What shipped sessions come to at the electrode: nothing severe, and no stage's
//! interlock in their way.

use firmware::lockstep::Sensors;
use firmware::units::Micros;
use hal_sim::trace::judge::{Pump, judge};
use host_core::run::{DeviceName, SessionFile, power_on, simulated};
use std::sync::{Arc, Mutex};
use studies::faults::declared_truth;
use tests::desk::{flashed, load, play, play_on, shipped_in};

#[test]
fn shipped_sessions_are_not_severe() {
    let folders = ["", "hamana_exp2", "harris_wall"];
    let mut seen = 0;
    for path in folders.into_iter().flat_map(shipped_in) {
        let mut file = SessionFile::load(&path).unwrap();
        file.session.duration_us = file.session.duration_us.min(3_000_000);
        let played = play(&file, &DeviceName::Native);
        let name = path.display();
        let mut truth = declared_truth(&file.session, &played.loads);
        // The native simulator has no pump pin.
        let verdict = judge(&played.trace, &Pump::Throughout, &truth, played.end_us);
        let told: Vec<_> = verdict
            .as_built
            .findings
            .iter()
            .map(|f| f.to_string())
            .collect();
        assert!(told.is_empty(), "{name}: {told:?}");
        assert_eq!(verdict.as_built.latched, [], "{name}");
        assert_eq!(verdict.as_built.truncated, [], "{name}");
        // What a bleed of 2.4 MΩ would pass, hardware.md's bound before.
        truth.hardware.bleed_ohm = 2.4e6;
        let verdict = judge(&played.trace, &Pump::Throughout, &truth, played.end_us);
        if let Some(worst) = verdict.as_built.findings.first() {
            println!("{name}, bleed of 2.4 MΩ: {worst}");
        }
        seen += usize::from(!played.trace.levels.is_empty());
    }
    assert!(seen > 30, "{seen} sessions with pulses");
}

/// What the flashed image puts out itself, and the edges of its own pump.
#[test]
fn the_chips_own_play_is_not_severe() {
    for name in [
        "ten_channels.toml",
        "hamana_exp4_two_point_finger.toml",
        "full_load.toml",
    ] {
        let mut file = load(name);
        file.session.duration_us = file.session.duration_us.min(1_500_000);
        let mut board = power_on(&file.session, &flashed(), ()).unwrap();
        board.boot(&Sensors::default()).unwrap();
        let boot = Micros::new(board.now_us() as u32);
        let board = Arc::new(Mutex::new(board));
        let device = Box::new(Arc::clone(&board));
        let port = simulated(&file.session, 1, device, boot).unwrap();
        let played = play_on(&file, Box::new(port));
        let pump = board.lock().unwrap().around.pump().clone();
        let Pump::Runs(runs) = &pump else {
            panic!("{name}: a chip has a pump");
        };
        let supplied_us: u64 = runs.iter().map(|(first, last)| last - first).sum();
        assert!(supplied_us > 1_000_000, "{name}: {runs:?}");
        let truth = declared_truth(&file.session, &played.loads);
        let verdict = judge(&played.trace, &pump, &truth, played.end_us);
        let found = &verdict.as_built.findings;
        assert!(found.is_empty(), "{name}: {found:?}");
        assert_eq!(verdict.as_built.latched, [], "{name}");
        assert!(played.trace.levels.len() > 500, "{name}");
    }
}
