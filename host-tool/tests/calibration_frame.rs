//! Tests of the calibration's screen, cell by cell, for known states.

use host_core::calibration::{ElectrodeResult, Level, Phase, Step, View};
use host_tool::live::{ScreenState, draw_calibration};
use ratatui::Terminal;
use ratatui::backend::TestBackend;

fn view() -> View {
    let level = |units| Level::from_units(units);
    View {
        electrode: 3,
        of: 10,
        channel: 3,
        place: "index extensor".to_owned(),
        unit: "mA",
        step: Step::Threshold,
        phase: Phase::Ready,
        level: Level(7_500),
        raise: level(8.0),
        again: level(7.5),
        top: Level(24_000),
        found: ElectrodeResult {
            placement: level(8.0),
            ..ElectrodeResult::default()
        },
        t_s: 134.2,
        ..View::default()
    }
}

fn drawn(view: View) -> String {
    let mut sight = ScreenState {
        wearer: "W01".to_owned(),
        device: "native simulator".to_owned(),
        view: Some(view),
        ..ScreenState::default()
    };
    sight.note(
        120.5,
        "channel 3 armed: its electrode carries 1.00 mA".to_owned(),
        false,
    );
    sight.note(
        131.0,
        "E671 not now: the muscle rests for 0.4 s more".to_owned(),
        true,
    );
    let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
    terminal
        .draw(|frame| draw_calibration(frame, &sight))
        .unwrap();
    terminal.backend().to_string()
}

#[test]
fn ready_to_raise() {
    insta::assert_snapshot!(drawn(view()));
}

#[test]
fn given_and_too_much() {
    let view = View {
        phase: Phase::On,
        left_s: 0.4,
        given: Level(7_500),
        complains: true,
        ..view()
    };
    insta::assert_snapshot!(drawn(view));
}

#[test]
fn names_are_asked_for() {
    let view = View {
        step: Step::Points,
        question: Some(Step::Points.question()),
        ..view()
    };
    insta::assert_snapshot!(drawn(view));
}
