//! What shipped sessions come to at the electrode: nothing severe, and no stage's
//! interlock in their way.

use hal_sim::trace::judge::{Pump, judge};
use host_core::run::{DeviceName, SessionFile};
use studies::faults::declared_truth;
use tests::desk::{play, shipped_in};

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
