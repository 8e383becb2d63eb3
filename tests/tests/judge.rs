//! What shipped sessions come to at the electrode: nothing severe, and no stage's
//! interlock in their way.

use firmware::safety::StageSpec;
use hal_sim::body::Load;
use hal_sim::trace::judge::{Channel, Pump, Stage, Truth, judge};
use host_core::run::{DeviceName, SessionFile};
use tests::desk::{Played, play, shipped_in};

/// Pulses of a channel's electrode check, far below any threshold: they count into the
/// second that follows.
const CHECK_PULSES: usize = 8;

/// The session's own declarations taken for true, and the body's electrodes.
fn truth(file: &SessionFile, played: &Played) -> Truth {
    let mut truth = Truth::default();
    for channel in &file.session.channels {
        let index = usize::from(channel.index());
        let spec = &channel.spec;
        let limit = f64::from(spec.limit.get()) * 1e-3;
        let (stage, limit_ma) = match spec.stage {
            StageSpec::Current { full_scale_ua } => {
                let full_scale_ma = f64::from(full_scale_ua) * 1e-3;
                (Stage::Current { full_scale_ma }, limit)
            }
            StageSpec::Voltage {
                full_scale_mv,
                load_ohm,
            } => {
                let full_scale_v = f64::from(full_scale_mv) * 1e-3;
                let limit_ma = 1e3 * limit / f64::from(load_ohm);
                (Stage::Voltage { full_scale_v }, limit_ma)
            }
        };
        let Load::Ohms(ohm) = played.loads[index] else {
            continue;
        };
        // Where the device steers the rate by force, up to what the file allows.
        let period_us = channel
            .force
            .map_or(spec.train.period_us, |f| f.min_period_us);
        let bursts = 1_000_000_u32.div_ceil(period_us);
        let pulses = bursts as usize * usize::from(spec.train.burst_count);
        truth.channels[index] = Channel::steady(stage, ohm, limit_ma, pulses + CHECK_PULSES);
    }
    truth
}

#[test]
fn shipped_sessions_are_not_severe() {
    let folders = ["", "hamana_exp2", "harris_wall"];
    let mut seen = 0;
    for path in folders.into_iter().flat_map(shipped_in) {
        let mut file = SessionFile::load(&path).unwrap();
        file.session.duration_us = file.session.duration_us.min(3_000_000);
        let played = play(&file, &DeviceName::Native);
        let name = path.display();
        let mut truth = truth(&file, &played);
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
