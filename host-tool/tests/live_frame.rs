//! Tests of the dashboard, cell by cell, for known states.

use firmware::link::{
    Counters, Event, HelloInfo, Kind, Refusal, SCHEMA, Status, message::ResetCause,
};
use firmware::safety::{Fault, FaultRecord, Stages, State, StopCause};
use firmware::units::Micros;
use host_core::record::Sample;
use host_core::run::{Observation, SessionFile};
use host_tool::live::{Model, draw, status_json, status_text};
use ratatui::Terminal;
use ratatui::backend::TestBackend;

const FINGER: &str = include_str!("../sessions/hamana_exp4_two_point_finger.toml");
const TEN_AND_FINGER: &str = include_str!("../sessions/ten_channels_and_finger.toml");
const TEN: &str = include_str!("../sessions/ten_channels.toml");

fn model(session: &str) -> Model {
    let file = SessionFile::parse("session.toml", session).unwrap();
    let mut model = Model::new("native simulator", Some(&file));
    model.observe(Observation::Hello(&HelloInfo {
        seq: 0,
        session: 1,
        schema: SCHEMA,
        version: [0, 1, 0],
        kind: Kind::Native,
        unique_id: [0; 3],
        at: Micros::new(0),
        state: State::Idle,
        reset: ResetCause::PowerOn,
        last_fault: None,
        dead_time_us: 5,
        stages: Stages::AsConfigured,
        option_bytes: None,
        board: "".try_into().unwrap(),
        crystal_hz: 0,
    }));
    model
}

fn status(state: State, fault: Option<FaultRecord>) -> Status {
    Status {
        at: Micros::new(12_000_000),
        state,
        fault,
        counters: Counters {
            frames: 1265,
            bad_frames: 2,
            lost_frames: 3,
            setpoints: 1080,
            refused: 1,
            pulses: 1978,
            ..Counters::default()
        },
        remaining: None,
    }
}

/// Feeds 12 s of a finger that follows a sine 4° late, clamped at the end.
fn play(model: &mut Model) {
    let channels = model.channels.len();
    let forces = model.channels.iter().filter(|c| c.force.is_some());
    let forces = forces.count();
    let is_joint = model.has_joint;
    for tick in 0..=1200 {
        let t_s = f64::from(tick) * 0.01;
        let sine = |t: f64| 45.0 + 40.0 * (t * std::f64::consts::TAU * 0.2).sin();
        model.observe(Observation::Sample(&Sample {
            t_s,
            target_deg: is_joint.then(|| sine(t_s)),
            measured_deg: is_joint.then(|| sine(t_s - 0.1) - 4.0),
            limiting: tick == 1190,
            amplitudes: (0..channels).map(|c| Some(14.0 - c as f64)).collect(),
            forces_n: (0..forces).map(|c| Some(1.5 + c as f64)).collect(),
            ..Sample::default()
        }));
    }
    model.observe(Observation::Status(&status(State::Stimulating, None)));
    let refusal = Refusal::new(firmware::link::Code::SetpointTime, "at");
    model.observe(Observation::Refused(11.5, &refusal.into()));
}

fn screen(model: &Model, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| draw(frame, model)).unwrap();
    terminal.backend().to_string()
}

fn faulted() -> Model {
    let mut model = model(FINGER);
    play(&mut model);
    let record = FaultRecord::new(Fault::OverCurrent, Micros::new(12_000_000));
    model.observe(Observation::Event(12.0, &Event::Faulted(record)));
    model.silent_s = 1.25;
    model
}

#[test]
fn sessions_fit_terminals() {
    for (name, session, width, height) in [
        ("a_finger_follows_at_80_by_24", FINGER, 80, 24),
        ("a_finger_follows_at_120_by_40", FINGER, 120, 40),
        (
            "ten_channels_and_a_finger_fit_80_by_24",
            TEN_AND_FINGER,
            80,
            24,
        ),
        ("without_a_joint_the_bars_have_the_room", TEN, 80, 24),
    ] {
        let mut model = model(session);
        play(&mut model);
        insta::assert_snapshot!(name, screen(&model, width, height));
    }
}
#[test]
fn a_fault_is_shown_with_nothing_on() {
    let model = faulted();
    let shown = screen(&model, 80, 24);
    assert!(shown.contains(" FAULT ") && shown.contains("fault 6: OverCurrent"));
    assert!(shown.contains("NO DATA  for 1.2 s") && !shown.contains("LIMITING"));
    assert!(shown.contains(" 0.0 of 28.0 V"));
    insta::assert_snapshot!(shown);
}

#[test]
fn a_stop_is_seen_at_once() {
    let mut model = model(FINGER);
    play(&mut model);
    assert!(model.is_on() && model.is_limiting());
    model.observe(Observation::Event(
        12.1,
        &Event::Stopping(StopCause::Request),
    ));
    assert!(model.is_on());
    model.observe(Observation::Event(
        12.2,
        &Event::Stopped(StopCause::Request),
    ));
    assert_eq!(model.state, State::Idle);
    assert_eq!(model.amplitude(0), 0.0);
    model.observe(Observation::Status(&status(State::Idle, None)));
    assert!(screen(&model, 80, 24).contains(" IDLE "));
}

#[test]
fn any_terminal_size_is_survived() {
    let model = faulted();
    let nothing = Model::new("/dev/ttyACM0", None);
    for width in [1, 2, 7, 20, 33, 50, 79, 200] {
        for height in [1, 2, 5, 9, 14, 23, 60] {
            assert!(!screen(&model, width, height).is_empty());
            assert!(!screen(&nothing, width, height).is_empty());
        }
    }
}

#[test]
fn lines_tell_the_same_and_each_note_once() {
    let mut model = model(FINGER);
    play(&mut model);
    insta::assert_snapshot!(status_text(&model, 0));
    assert_eq!(status_text(&model, model.noted).matches('|').count(), 0);
    let status = status_json(&model, 0);
    assert_eq!(status["state"], "stimulating");
    assert_eq!(status["kind"], "native");
    assert_eq!(status["channels"][1]["amplitude"], 13.0);
    assert_eq!(status["channels"][2]["force_n"], 3.5);
    assert_eq!(status["counters"]["lost"], 3);
    assert_eq!(status["events"].as_array().unwrap().len(), 1);
    let later = status_json(&model, model.noted);
    assert!(later["events"].as_array().unwrap().is_empty());
}
