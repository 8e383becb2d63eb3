//! Every committed session file parses, and a device takes it, arms and runs.

use std::path::{Path, PathBuf};

use firmware::control::{LawSpec, SensorSource};
use firmware::device::Identity;
use firmware::link::message::ResetCause;
use firmware::link::{Decoder, Event, Kind, Request, Response, SCHEMA, ToDevice, encode};
use firmware::lockstep::{Lockstep, Sensors, Sink};
use firmware::pulse::{Levels, Partner};
use firmware::safety::State;
use firmware::units::{Amplitude, DacCode, Micros, us};
use host_core::session::{LawName, Problem, Session, Setpoint};

pub(crate) fn files() -> Vec<PathBuf> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|e| e == "toml") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions");
    walk(&folder, &mut found);
    found.sort();
    found
}

fn load(name: &str) -> Session {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions");
    Session::load(folder.join(name)).unwrap()
}

/// What the device answers, and how many bursts got an amplitude.
#[derive(Default)]
struct Heard {
    bytes: Vec<u8>,
    nonzero_codes: usize,
}

impl Sink for Heard {
    fn levels(&mut self, _: Micros, _: Levels) {}
    fn dac(&mut self, _: Micros, _: u8, code: DacCode) {
        self.nonzero_codes += usize::from(code.get() > 0);
    }
    fn bytes(&mut self, _: Micros, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }
}

/// The firmware behind its real link.
struct Device {
    board: Lockstep,
    sensors: Sensors,
    heard: Heard,
    session: u16,
    seq: u16,
}

impl Device {
    fn new(sensors: Sensors) -> Self {
        let identity = Identity {
            kind: Kind::Native,
            unique_id: [0; 3],
            reset: ResetCause::PowerOn,
            last_fault: None,
            first_session: 1,
        };
        let mut device = Self {
            board: Lockstep::new(identity, Micros::new(u32::MAX - 200_000)),
            sensors,
            heard: Heard::default(),
            session: 0,
            seq: 0,
        };
        device.ask(Request::Hello { schema: SCHEMA });
        device
    }

    fn run(&mut self, length_us: u32) {
        let to = self.board.now() + us(length_us);
        self.board.advance(to, &self.sensors, &mut self.heard);
    }

    /// Sends a request; panics on a refusal, a fault or an unwanted stop.
    fn ask(&mut self, request: Request) {
        self.seq += 1;
        let (session, seq) = (self.session, self.seq);
        let frame = encode(&ToDevice {
            session,
            seq,
            request,
        })
        .unwrap();
        let at = self.board.now() + us(100);
        self.board
            .receive(at, &frame, &self.sensors, &mut self.heard);
        self.run(2_000);
        self.listen();
    }

    fn listen(&mut self) {
        let mut decoder = Decoder::default();
        for byte in std::mem::take(&mut self.heard.bytes) {
            let Some(message) = decoder.push(byte) else {
                continue;
            };
            match postcard::from_bytes::<Response>(message.unwrap()).unwrap() {
                Response::Hello(info) => self.session = info.session,
                Response::Ack { .. } | Response::Status { .. } | Response::Telemetry(_) => {}
                // Arming tells what each electrode read.
                Response::Event {
                    event: Event::Electrode { .. },
                    ..
                } => {}
                unwanted => panic!("{unwanted:?}"),
            }
            decoder.clear();
        }
    }
}

/// From setpoint to setpoint, µs.
const TURN_US: u32 = 23_000;

/// How many setpoints a session is played for: two bursts at the slowest rate
/// that force control may come to, and ten at least.
fn turns(session: &Session) -> u64 {
    let forces = session.channels.iter().filter_map(|c| c.force.as_ref());
    let slowest_us = forces.filter_map(|force| force.max_period_us).max();
    u64::from((2 * slowest_us.unwrap_or(0)).div_ceil(TURN_US)).max(10)
}

/// Configures, arms and runs a device for a quarter of a second, or for two bursts
/// at the slowest rate.
fn play(session: &Session) -> Device {
    let mut sensors = Sensors::default();
    if let Some(SensorSource::Adc {
        code_at_0,
        code_at_100,
    }) = session.joint.as_ref().map(|joint| joint.sensor)
    {
        sensors.joint = Some(u16::midpoint(code_at_0, code_at_100));
    }
    let mut device = Device::new(sensors);
    for request in session.requests() {
        device.ask(request);
    }
    device.ask(Request::Arm);
    for _ in 0..100 {
        if device.board.state() != State::Armed {
            device.run(20_000);
            device.listen();
        }
    }
    assert_eq!(device.board.state(), State::Armed);
    device.ask(Request::Start);
    device.heard.nonzero_codes = 0;
    for index in 0..turns(session) {
        let due_us = session.setpoints.due_us(index);
        device.ask(session.setpoints.at(due_us).request(None));
        for setpoint in session.setpoints.with(due_us) {
            device.ask(setpoint.request(None));
        }
        device.run(TURN_US);
    }
    device.listen();
    assert_eq!(device.board.state(), State::Stimulating);
    device
}

#[test]
fn every_file_runs_on_a_device() {
    let files = files();
    assert!(files.len() >= 34, "{} files", files.len());
    for file in files {
        let session = Session::load(&file).unwrap_or_else(|e| panic!("{file:?}: {e}"));
        println!("{}", file.display());
        let device = play(&session);
        // A trigger, or an arm in the wall, is yet to come.
        let waits =
            session.wall.is_some() || session.channels.iter().all(|c| c.spec.train.triggered);
        assert_eq!(device.heard.nonzero_codes > 0, !waits, "{file:?}");
        assert_eq!(session.notes, [""; 0], "{file:?}");
    }
}

#[test]
fn experiment_4_is_as_printed() {
    let session = load("hamana_exp4_two_point.toml");
    assert_eq!(session.duration_us, 30_000_000);
    assert_eq!(session.measure, Some((10_000_000, 30_000_000)));
    let joint = session.joint.as_ref().unwrap();
    let points = joint.flexors.iter().chain([&joint.extensor]);
    let ranges: Vec<_> = points
        .map(|p| (p.channel, p.threshold.get(), p.max.get()))
        .collect();
    let expected = [
        (0, 20_000, 28_000),
        (1, 25_000, 36_000),
        (2, 14_000, 26_000),
    ];
    assert_eq!(ranges, expected);
    assert_eq!(joint.law, LawSpec::ALONE);
    let trains: Vec<_> = session.channels.iter().map(|c| c.spec.train).collect();
    let offsets: Vec<_> = trains.iter().map(|t| t.offset_us).collect();
    assert_eq!(offsets, [0, 2_000, 10_000]);
    assert!(trains.iter().all(|t| t.period_us == 20_000));
    let (centideg, centideg_per_s) = (8500, 0);
    let top = Setpoint::Angle {
        centideg,
        centideg_per_s,
    };
    assert_eq!(session.setpoints.at(1_250_000), top);
}

#[test]
fn another_law_brings_its_own_gains_and_runs() {
    for law in [LawName::Paper, LawName::Pid, LawName::Recommended] {
        for name in ["one_point_a", "one_point_b", "two_point"] {
            let session = load(&format!("hamana_exp4_{name}.toml"));
            let session = session.with_law(law).unwrap();
            let joint = session.joint.as_ref().unwrap();
            assert_eq!(joint.law, law.spec(false));
            assert_eq!(joint.law_period_ms, law.spec(false).default_period_ms());
            assert_eq!(joint.cutoff_mhz, law.spec(false).default_cutoff_mhz());
            play(&session);
        }
    }
    let e = load("trigger.toml").with_law(LawName::Paper).unwrap_err();
    assert!(matches!(e.problem(), Problem::NoJoint { .. }));
}

#[test]
fn experiment_2_has_the_patterns_of_figure_5() {
    // Delay of B after A, and whether the partner is isolated.
    let mut two = Vec::new();
    let mut one = Vec::new();
    for file in files() {
        let name = file.file_stem().unwrap().to_str().unwrap().to_owned();
        if file.parent().unwrap().file_name().unwrap() != "hamana_exp2" {
            continue;
        }
        let session = Session::load(&file).unwrap();
        let offset = |i: usize| i64::from(session.channels[i].spec.train.offset_us);
        let isolated = session.groups[0].partner == Partner::Isolated;
        assert_eq!(name.contains("isolated"), isolated, "{name}");
        let Setpoint::Amplitudes(values) = session.setpoints.at(0) else {
            panic!("{name}: no amplitudes");
        };
        let values: Vec<_> = values.iter().map(|&(_, v)| v).collect();
        let (a, b) = (Amplitude::new(26_000), Amplitude::new(30_000));
        if values == [a, b] {
            let delay = offset(1) - offset(0);
            assert!(name.contains(&format!("_{}us", delay.abs())), "{name}");
            assert_eq!(name.contains("b_to_a"), delay < 0, "{name}");
            two.push((isolated, delay));
        } else {
            let point = if values == [a, Amplitude::new(0)] {
                'a'
            } else {
                'b'
            };
            assert!(point == 'a' || values == [Amplitude::new(0), b], "{name}");
            assert!(name.contains(&format!("one_point_{point}")), "{name}");
            one.push((isolated, point));
        }
    }
    let both_orders = |isolated, delays: &[i64]| {
        let delays = delays.iter().flat_map(|&pd| [pd, -pd]);
        delays.map(|pd| (isolated, pd)).collect::<Vec<_>>()
    };
    let mut expected = vec![(false, 0), (false, 10_000), (true, 10_000)];
    let conducted = [50, 100, 150, 200, 500, 1000, 2000, 5000];
    expected.extend(both_orders(false, &conducted));
    expected.extend(both_orders(true, &[1000, 2000, 5000]));
    two.sort_unstable();
    expected.sort_unstable();
    assert_eq!(two, expected);
    one.sort_unstable();
    assert_eq!(one, [(false, 'a'), (false, 'b'), (true, 'a'), (true, 'b')]);
}
