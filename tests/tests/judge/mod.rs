//! Judgement of shipped sessions at the electrode: nothing severe, and no stage's interlock
//! triggers. Also tests the judge itself: each rule with a trace that breaks it, each line that
//! breaks, and a second judge in another language.

mod drawn;
mod interlock;
mod parts;
mod rules;
mod scene;
mod second;

use crate::chip_faults::{Bench, TWO_WINDOWS_US};
use firmware::lockstep::Sensors;
use firmware::units::Micros;
use hal_sim::chip::cpu::{Bus, Size};
use hal_sim::trace::judge::{
    Channel, Fault, Line, Pump, QuietInterval, Stage, StuckLine, Truth, judge,
};
use hal_sim::trace::{Levels, State};
use host_core::run::{DeviceName, SessionFile, power_on, simulated_port};
use second::judge_both;
use std::sync::{Arc, Mutex};
use studies::faults::declared_truth;
use tests::desk::{flashed_image, load_session, play, play_on, session_paths};

#[test]
fn shipped_sessions_are_not_severe() {
    let folders = ["", "hamana_exp2", "harris_wall"];
    let mut seen = 0;
    for path in folders.into_iter().flat_map(session_paths) {
        let mut file = SessionFile::load(&path).unwrap();
        file.session.duration_us = file.session.duration_us.min(3_000_000);
        let played = play(&file, &DeviceName::Native);
        let name = path.display();
        let mut truth = declared_truth(&file.session, &played.loads);
        // The native simulator has no pump pin.
        let verdict = judge_both(&played.trace, &Pump::Throughout, &truth, played.end_us);
        let findings: Vec<_> = verdict
            .as_built
            .findings
            .iter()
            .map(|f| f.to_string())
            .collect();
        assert!(findings.is_empty(), "{name}: {findings:?}");
        assert_eq!(verdict.as_built.latched, [], "{name}");
        assert_eq!(verdict.as_built.truncated, [], "{name}");
        // Current through a bleed resistor of 2.4 MΩ, the earlier bound in hardware.md.
        truth.hardware.bleed_ohm = 2.4e6;
        let verdict = judge(&played.trace, &Pump::Throughout, &truth, played.end_us);
        if let Some(worst) = verdict.as_built.findings.first() {
            println!("{name}, bleed of 2.4 MΩ: {worst}");
        }
        seen += usize::from(!played.trace.levels.is_empty());
    }
    assert!(seen > 30, "{seen} sessions with pulses");
}

/// Judges the flashed image's output, with the edges of its own pump.
#[test]
fn the_chips_own_play_is_not_severe() {
    for name in [
        "ten_channels.toml",
        "hamana_exp4_two_point_finger.toml",
        "full_load.toml",
    ] {
        let mut file = load_session(name);
        file.session.duration_us = file.session.duration_us.min(1_500_000);
        let mut board = power_on(&file.session, &flashed_image(), ()).unwrap();
        board.boot(&Sensors::default()).unwrap();
        let boot = Micros::new(board.now_us() as u32);
        let board = Arc::new(Mutex::new(board));
        let device = Box::new(Arc::clone(&board));
        let port = simulated_port(&file.session, 1, device, boot).unwrap();
        let played = play_on(&file, Box::new(port));
        let pump = board.lock().unwrap().around.pump().clone();
        let Pump::Runs(runs) = &pump else {
            panic!("{name}: a chip has a pump");
        };
        let supplied_us: u64 = runs.iter().map(|(first, last)| last - first).sum();
        assert!(supplied_us > 1_000_000, "{name}: {runs:?}");
        let truth = declared_truth(&file.session, &played.loads);
        let verdict = judge_both(&played.trace, &pump, &truth, played.end_us);
        let found = &verdict.as_built.findings;
        assert!(found.is_empty(), "{name}: {found:?}");
        assert_eq!(verdict.as_built.latched, [], "{name}");
        assert!(played.trace.levels.len() > 500, "{name}");
    }
}

/// Judges the output of a board that breaks during a pulse, until it is disconnected and after
/// that.
#[test]
fn what_a_broken_chip_puts_out_is_judged_alike() {
    /// Name of a defect, and the function that causes it.
    type Break = (&'static str, fn(&mut Bench));
    /// Registers of DMA2's stream 2, which erases port B's tape.
    const STREAM_2: u32 = 0x4002_6410 + 0x18 * 2;
    const NOTHING: &str = "nothing";
    const LINE: &str = "a line breaks on its way to its stage";
    let (bench, at) = Bench::stimulating_in_pulse();
    let breaks: [Break; 4] = [
        (NOTHING, |_| ()),
        ("the tape slips", |bench| {
            let (soc, cycle) = (&mut bench.board.around.soc, bench.board.cpu.cycle);
            let on = soc.read(STREAM_2, Size::Word, cycle).unwrap().value;
            soc.write(STREAM_2, Size::Word, on & !1, cycle).unwrap();
        }),
        ("interrupts masked", |bench| {
            bench.leave_critical_section();
            bench.board.cpu.registers.primask = true
        }),
        (LINE, |bench| {
            bench.board.around.broken = Levels(State::Anodic as u32);
        }),
    ];
    for (defect, break_it) in breaks {
        let mut bench = bench.clone();
        break_it(&mut bench);
        bench.run_us(40_000);
        let mut truth = Truth::default();
        let stage = Stage::Current {
            full_scale_ma: 24.0,
        };
        for channel in [0, 5] {
            let ohm = f64::from(Sensors::default().load_ohm[channel]);
            truth.channels[channel] = Channel::steady(stage, ohm, 18.0, 201);
        }
        if defect == LINE {
            truth.stuck.push(StuckLine {
                channel: 0,
                line: Line::Anodic,
                high: false,
                from_us: at,
            });
        } else if defect != NOTHING {
            truth.faults.push(Fault { t_us: at });
            let (from_us, until_us) = (at + TWO_WINDOWS_US, u64::MAX);
            truth.quiet.push(QuietInterval { from_us, until_us });
        }
        let pump = bench.board.around.pump().clone();
        let end_us = bench.board.now_us();
        let account = judge_both(&bench.record.trace, &pump, &truth, end_us).as_built;
        println!("{defect}: {:?}, {:?}", account.truncated, account.latched);
        assert_eq!(account.findings, [], "{defect}");
        assert_eq!(
            account.latched.len(),
            usize::from(defect == LINE),
            "{defect}"
        );
    }
}
