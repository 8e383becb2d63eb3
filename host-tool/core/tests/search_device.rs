//! Compares a search of the finger's motor threshold on the native simulator, through ordinary
//! requests, with the simulated finger's own threshold and the pulses in the trace.

use host_core::link::{Port, Signal, SimulatedPort};
use host_core::run::{DeviceName, SessionFile};
use host_core::search::{
    DeviceError, Finding, OnDevice, Operator, Question, SearchEnd, SearchFile, search,
};
use host_core::session::Session;
use std::path::Path;

/// Operator who is never asked, because a simulator answers.
struct NoOperator;

impl Operator for NoOperator {
    fn ask(&mut self, question: Question) {
        panic!("{question}");
    }

    fn reply(&mut self) -> Option<u8> {
        None
    }
}

fn session() -> Session {
    let path = "../sessions/hamana_exp4_two_point_finger.toml";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    SessionFile::load(&path).unwrap().session
}

fn found(fields: &str, seed: u64) -> (Finding<DeviceError>, Box<dyn Port>) {
    let text = format!("session = \"s.toml\"\n[[search]]\n{fields}");
    let file = SearchFile::parse(&text).unwrap();
    let stair = &file.searches[0];
    let session = session();
    let port = DeviceName::Native.open(&session, seed).unwrap();
    let mut nobody = NoOperator;
    let mut probe = OnDevice::start(port, &session, stair, &mut nobody, None, seed).unwrap();
    let finding = search(stair, &mut probe, |step| println!("{step:?}"));
    (finding, probe.stop().unwrap())
}

/// Counts the first phases in the trace: every pulse is cathodic first here. The electrode check
/// plays four pairs on each channel.
fn on_trace(port: &mut Box<dyn Port>, channels: usize) -> u64 {
    let trace = &port.world().unwrap().recorder.trace;
    let end_us = trace.levels.last().map_or(0, |level| level.0) + 1_000_000;
    let pulses: usize = trace.pulses(end_us).iter().map(Vec::len).sum();
    (pulses - 8 * channels) as u64
}

#[test]
fn the_finger_s_thresholds_are_found_at_the_cost_on_the_trace() {
    let body = session();
    let finger = body.finger().unwrap();
    let truths = [
        (
            1,
            finger.flexor_a.threshold_v,
            "start = 16.0\nstep = 2.0\nlimit = 28.0",
        ),
        (
            2,
            finger.flexor_b.threshold_v,
            "start = 17.5\nstep = 1.0\nlimit = 36.0",
        ),
    ];
    for (channel, truth, stair) in truths {
        for (kind, more) in [("threshold", ""), ("visible", "visible_deg = 2.0")] {
            let fields = format!("kind = \"{kind}\"\nchannel = {channel}\n{stair}\n{more}");
            let (finding, mut port) = found(&fields, 7);
            let step = if channel == 1 { 2.0 } else { 1.0 };
            let value = finding.value.unwrap().units();
            println!(
                "{kind} {channel}: {value} V against {truth} V, {} pulses",
                finding.pulses
            );
            assert!(matches!(finding.ended, SearchEnd::Found));
            assert!((value - truth).abs() <= step, "{value} {truth}");
            assert!(finding.low.units() <= truth && truth < finding.high.unwrap().units());
            assert_eq!(finding.pulses, on_trace(&mut port, body.channels.len()));
        }
    }
}

#[test]
fn a_ratio_is_found_for_both_points_together() {
    let fields = "kind = \"ratio\"\nof = [{ channel = 1, max = 28.0 }, { channel = 2, max = 36.0 }]\n\
                  start = 0.1\nstep = 0.1\nlimit = 1.0";
    let (finding, _) = found(fields, 3);
    // Two points pull together: they begin to move where the first of them does.
    let [a, b, _] = session().finger().unwrap().sites();
    let ratio = (a.threshold_v / a.max_v).min(b.threshold_v / b.max_v);
    let high = finding.high.unwrap().units();
    assert!(finding.low.units() <= ratio && ratio < high, "{finding:?}");
}

#[test]
fn a_simulated_person_rates_what_it_gets() {
    let fields = "kind = \"maximum\"\nchannel = 1\nstart = 4.0\nstep = 4.0\nlimit = 28.0\n\
                  rating = 6\nsimulated_rating = { none = 10.0, ten = 30.0, noise = 0.0 }";
    let (finding, _) = found(fields, 3);
    // 24 V is rated 7: too strong, and presented once.
    assert_eq!(
        (finding.low.units(), finding.high.unwrap().units()),
        (20.0, 24.0)
    );
    assert_eq!(finding.trail.len(), 6);
}

/// Operator who allows some increases, refuses the next one, and sees no movement.
struct Watching {
    allowed: u32,
    asked: Vec<Question>,
}

impl Operator for Watching {
    fn ask(&mut self, question: Question) {
        self.asked.push(question);
    }

    fn reply(&mut self) -> Option<u8> {
        let raises = self
            .asked
            .iter()
            .filter(|q| matches!(q, Question::Raise(..)));
        let is_refused = raises.count() > self.allowed as usize;
        Some(u8::from(
            matches!(self.asked.last(), Some(Question::Raise(..))) && !is_refused,
        ))
    }
}

/// A simulator that exposes only bytes to this process, like a board.
struct Board(SimulatedPort);

impl Port for Board {
    fn now_us(&mut self) -> u64 {
        self.0.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> std::io::Result<()> {
        self.0.send(frame)
    }

    fn receive(&mut self, until_us: u64) -> std::io::Result<Vec<u8>> {
        self.0.receive(until_us)
    }
}

fn board(session: &Session) -> Board {
    let device = Box::new(hal_sim::native::native_seeded(
        firmware::units::Micros::new(0),
        1,
    ));
    let boot = firmware::units::Micros::new(0);
    Board(host_core::run::simulated_port(session, 1, device, boot).unwrap())
}

#[test]
fn a_board_is_never_raised_without_its_operator() {
    let session = session();
    let stair = "start = 16.0\nstep = 2.0\nlimit = 28.0";
    let text = |more: &str| {
        format!(
            "session = \"s.toml\"\n[[search]]\nkind = \"threshold\"\nchannel = 1\n{stair}\n{more}"
        )
    };
    let blind = SearchFile::parse(&text("")).unwrap();
    let mut operator = Watching {
        allowed: 3,
        asked: Vec::new(),
    };
    let refused = OnDevice::start(
        board(&session),
        &session,
        &blind.searches[0],
        &mut operator,
        None,
        1,
    );
    assert!(matches!(refused.err(), Some(DeviceError::NoSensor)));
    let eye = SearchFile::parse(&text("observer = \"eye\"")).unwrap();
    let stair = &eye.searches[0];
    let mut probe =
        OnDevice::start(board(&session), &session, stair, &mut operator, None, 1).unwrap();
    let finding = search(stair, &mut probe, |_| {});
    let mut port = probe.stop().unwrap().0;
    assert!(matches!(finding.ended, SearchEnd::Refused(level) if level.units() == 22.0));
    assert_eq!((finding.low.units(), finding.trail.len()), (20.0, 3));
    // Three increases and a question after each, then the increase that was refused.
    assert_eq!(operator.asked.len(), 7);
    let full_scale = 60.0;
    let highest = port
        .world
        .recorder
        .trace
        .dac
        .iter()
        .map(|write| write.code)
        .max()
        .unwrap();
    assert!(
        f64::from(highest) / 65_535.0 * full_scale < 20.1,
        "{highest}"
    );
    let _ = port.now_us();
}

#[test]
fn a_signal_ends_it_and_the_trail_stays() {
    let session = session();
    let text = "session = \"s.toml\"\n[[search]]\nkind = \"threshold\"\nchannel = 1\n\
                start = 16.0\nstep = 2.0\nlimit = 28.0";
    let file = SearchFile::parse(text).unwrap();
    let port = DeviceName::Native.open(&session, 1).unwrap();
    let interruption = host_core::link::Interruption::default();
    let (mut nobody, asked) = (NoOperator, Some(interruption.clone()));
    let stair = &file.searches[0];
    let mut probe = OnDevice::start(port, &session, stair, &mut nobody, asked, 1).unwrap();
    let finding = search(stair, &mut probe, |step| {
        if step.level.units() == 18.0 {
            interruption.raise_signal(Signal::Interrupt);
        }
    });
    assert!(matches!(
        finding.ended,
        SearchEnd::Failed(DeviceError::Link(host_core::link::Error::Interrupted(_)))
    ));
    assert_eq!((finding.low.units(), finding.trail.len()), (18.0, 2));
    probe.stop().unwrap();
}
