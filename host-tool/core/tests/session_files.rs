//! Every committed session file can be parsed, and a device accepts, arms and runs it.

use std::path::{Path, PathBuf};

use firmware::control::{LawSpec, SensorSource};
use firmware::link::{Event, Request};
use firmware::pulse::Partner;
use firmware::safety::State;
use firmware::units::{Amplitude, Micros};
use host_core::link::{Connection, Incoming, Port, SimulatedPort};
use host_core::run::create_body;
use host_core::session::{Course, LawName, Problem, Session, SessionLimb, Setpoint};

use crate::link_native::native_world;

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

pub(crate) fn load(name: &str) -> Session {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions");
    Session::load(folder.join(name)).unwrap()
}

/// Lets time pass and checks that the device reports no refusal, fault or stop.
fn listen(client: &mut Connection<SimulatedPort>, us: u64) {
    let until = client.port().now_us() + us;
    while let Some(incoming) = client.next(until).unwrap() {
        let is_reading = matches!(incoming, Incoming::Event(_, Event::Electrode { .. }));
        let is_telemetry = matches!(incoming, Incoming::Telemetry(..));
        let is_edge = matches!(incoming, Incoming::Event(_, Event::SyncEdge));
        assert!(is_reading || is_telemetry || is_edge, "{incoming:?}");
    }
}
/// Interval between setpoints, µs.
const TURN_US: u64 = 23_000;

/// Returns the number of setpoints to play: at least ten, and enough for two bursts at the lowest
/// rate that force control may use.
fn turns(session: &Session) -> u64 {
    let forces = session.channels.iter().filter_map(|c| c.force.as_ref());
    let slowest_us = forces.filter_map(|force| force.max_period_us).max();
    (2 * u64::from(slowest_us.unwrap_or(0)))
        .div_ceil(TURN_US)
        .max(10)
}

/// Sends the angles of the session's arm at rest, if they are measured.
fn measure(client: &mut Connection<SimulatedPort>, session: &Session) {
    if session.limb.as_ref().is_some_and(SessionLimb::is_measured) {
        let body = create_body(session, 1).unwrap();
        let at = Micros::new(client.port().world.now_us() as u32);
        for (joint, deg) in (0u8..).zip(body.posture_deg().unwrap()) {
            let centideg = (deg * 100.0).round() as i16;
            let measured = Request::Measurement {
                joint,
                centideg,
                at,
            };
            client.request(measured).unwrap();
        }
    }
}

/// Configures, arms and runs a device for a quarter of a second, or for two bursts at the lowest
/// rate. Returns the number of bursts with an amplitude.
fn play(session: &Session) -> usize {
    // The clock wraps during the run.
    let mut world = native_world(Micros::new(u32::MAX - 200_000));
    if let Some(joint) = &session.joint
        && let SensorSource::Adc {
            code_at_0,
            code_at_100,
        } = joint.sensor
    {
        world.sensors.joint = Some(u16::midpoint(code_at_0, code_at_100));
    }
    let (mut client, _) = Connection::open(SimulatedPort::new(world)).unwrap();
    for request in session.setup_requests() {
        client.request(request).unwrap();
    }
    client.arm().unwrap();
    assert_eq!(client.status().unwrap().state, State::Armed);
    measure(&mut client, session);
    client.start().unwrap();
    let armed = client.port().world.recorder.trace.dac.len();
    for index in 0..turns(session) {
        let due_us = session.setpoints.due_us(index);
        measure(&mut client, session);
        client
            .request(session.setpoints.at(due_us).to_request(None))
            .unwrap();
        for setpoint in session.setpoints.accompanying_at(due_us) {
            client.request(setpoint.to_request(None)).unwrap();
        }
        if !session.setpoints.programs.is_empty() {
            let programs = Setpoint::Amplitudes(session.setpoints.programs.at(due_us));
            client.request(programs.to_request(None)).unwrap();
        }
        listen(&mut client, TURN_US);
    }
    assert_eq!(client.status().unwrap().state, State::Stimulating);
    let writes = &client.port().world.recorder.trace.dac[armed..];
    writes.iter().filter(|write| write.code > 0).count()
}
#[test]
fn every_file_runs_on_a_device() {
    let files = files();
    assert!(files.len() >= 34, "{} files", files.len());
    for file in files {
        let session = Session::load(&file).unwrap_or_else(|e| panic!("{file:?}: {e}"));
        println!("{}", file.display());
        // These sessions have no output yet: they wait for a trigger, for the arm to reach the
        // wall, for an object to be held, or for the first amplitude.
        let is_triggered = session
            .channels
            .iter()
            .all(|c| c.spec.train.trigger.is_some());
        let rises = match &session.setpoints.course {
            Course::Stimulus(_, course) => course.at(0).amplitude == Amplitude::ZERO,
            Course::Held(points) => !points[0].1,
            _ => false,
        };
        let waits = session.wall.is_some() || is_triggered || rises;
        assert_eq!(play(&session) > 0, !waits, "{file:?}");
        assert_eq!(session.notes, [""; 0], "{file:?}");
    }
}

#[test]
fn experiment_4_is_as_printed() {
    let session = load("hamana_exp4_two_point_finger.toml");
    assert_eq!(session.duration_us, 30_000_000);
    assert_eq!(session.measure, Some((10_000_000, 30_000_000)));
    let joint = session.joint.as_ref().unwrap();
    let points = joint.flexors.iter().chain([&joint.extensor]);
    let ranges: Vec<_> = points
        .map(|p| (p.channel, p.threshold.get(), p.max.get()))
        .collect();
    let [a, b] = [(0, 20_000, 28_000), (1, 25_000, 36_000)];
    assert_eq!(ranges, [a, b, (2, 14_000, 26_000)]);
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
    let mut single_points = Vec::new();
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
        let values: Vec<_> = values.iter().map(|&(_, v)| v.amplitude).collect();
        let (a, b) = (Amplitude::new(26_000), Amplitude::new(30_000));
        if values == [a, b] {
            let delay = offset(1) - offset(0);
            assert!(name.contains(&format!("_{}us", delay.abs())), "{name}");
            assert_eq!(name.contains("b_to_a"), delay < 0, "{name}");
            two.push((isolated, delay));
        } else {
            let is_a = values == [a, Amplitude::new(0)];
            let point = if is_a { 'a' } else { 'b' };
            assert!(point == 'a' || values == [Amplitude::new(0), b], "{name}");
            assert!(name.contains(&format!("one_point_{point}")), "{name}");
            single_points.push((isolated, point));
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
    single_points.sort_unstable();
    assert_eq!(
        single_points,
        [(false, 'a'), (false, 'b'), (true, 'a'), (true, 'b')]
    );
}
