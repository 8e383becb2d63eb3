//! Requests that count as a sign of life: protocol.md's list compared with a device, request by
//! request.

use super::{PROTOCOL, messages, read, types};
use firmware::link::{Event, Request};
use firmware::muscle::MuscleLevel;
use firmware::pulse::TrainSpec;
use firmware::safety::{ListedPulse, StopCause};
use firmware::units::{Amplitude, Micros};
use host_core::link::{Connection, Error, Incoming, Port};
use host_core::run::DeviceName;
use std::collections::BTreeSet;
use tests::desk;

/// Host silence timeout of all wearers here, ms.
const TIMEOUT_MS: u16 = 100;

/// Setup with its setpoint requests.
struct Scene {
    setup: Vec<Request>,
    port: Box<dyn Port>,
    setpoints: Vec<Request>,
}

impl Scene {
    /// Returns the setup of a shipped session.
    fn shipped(name: &str, setpoints: Vec<Request>) -> Self {
        let file = desk::load_session(name);
        let port = DeviceName::Native.open(&file.session, 1).unwrap();
        let first = file.session.setpoints.at(0).to_request(None);
        let setpoints = setpoints.into_iter().chain([first]).collect();
        let mut setup = file.session.setup_requests();
        for request in &mut setup {
            if let Request::Wearer(spec) = request {
                spec.host_timeout_ms = TIMEOUT_MS;
            }
        }
        Self {
            setup,
            port,
            setpoints,
        }
    }

    /// Returns a channel that takes lists of pulses.
    fn lists() -> Self {
        let train = TrainSpec {
            lists: true,
            ..TrainSpec::biphasic(200, 50, 20_000)
        };
        let spec = desk::channel(train, 100_000, 20_000);
        let setup = vec![
            Request::Wearer(desk::wearer(TIMEOUT_MS)),
            Request::Channel { channel: 0, spec },
        ];
        let pulse = ListedPulse {
            after_us: 0,
            amplitude: Amplitude::new(1_000),
            width_us: 200,
        };
        let pulses = [pulse].into_iter().collect();
        let port = Box::new(host_core::link::SimulatedPort::new(desk::world(
            Micros::new(0),
        )));
        Self {
            setup,
            port,
            setpoints: vec![
                Request::Pulses { channel: 0, pulses },
                messages::amplitudes(&[(0, 1_000)]),
            ],
        }
    }
}

/// One setup for each kind of setpoint.
const SCENES: [fn() -> Scene; 5] = [
    Scene::lists,
    || Scene::shipped("hamana_exp4_two_point_finger.toml", vec![]),
    || Scene::shipped("force_ramp.toml", levels()),
    || Scene::shipped("endpoint_force.toml", vec![]),
    || Scene::shipped("lift.toml", vec![Request::ObjectHeld { held: false }]),
];

/// Returns requests that select no muscle model on any channel.
fn levels() -> Vec<Request> {
    let level = MuscleLevel::None;
    let levels = (0u8..10).map(|channel| Request::MuscleLevel { channel, level });
    levels.collect()
}

/// Returns the variant name of a request.
fn name(request: &Request) -> String {
    let value = serde_json::to_value(request).unwrap();
    let object = value.as_object().and_then(|object| object.keys().next());
    object.map_or_else(|| value.as_str().unwrap().to_owned(), String::clone)
}

/// Returns whether a request 60 ms after the last `KeepAlive` is accepted, and whether it delays
/// the stop: to 160 ms after it instead of 100.
fn request_effect(scene: Scene, request: Request) -> (bool, bool) {
    let (mut client, _) = Connection::open(scene.port).unwrap();
    for request in scene.setup {
        client.request(request).unwrap();
    }
    client.arm().unwrap();
    client.start().unwrap();
    // The rise is complete.
    let first = scene.setpoints.into_iter().next_back().unwrap();
    let _ = client.request(first); // refused if a measurement must come first
    let wait = |client: &mut Connection<Box<dyn Port>>, ms: u64| {
        let until = client.port().now_us() + ms * 1_000;
        while client.next(until).unwrap().is_some() {}
    };
    let mut last = client.keep_alive().unwrap();
    for _ in 0..3 {
        wait(&mut client, 50);
        last = client.keep_alive().unwrap();
    }
    wait(&mut client, 60);
    let request = match request {
        // Uses a plausible time of measurement.
        Request::Measurement { joint, .. } => Request::Measurement {
            joint: joint % 2,
            centideg: 4_000,
            at: host_core::link::stamp(last),
        },
        other => other,
    };
    let is_taken = match client.request(request) {
        // An answer of another kind is not awaited here.
        Ok(_) | Err(Error::NoAnswer { .. }) => true,
        Err(Error::Refused(_)) => false,
        Err(error) => panic!("{error}"),
    };
    let until = client.port().now_us() + 300_000;
    while let Some(incoming) = client.next(until).unwrap() {
        if let Incoming::Event(at, Event::Stopping(StopCause::HostSilent)) = incoming {
            let after_ms = (at - last) / 1_000;
            assert!(
                (98..=101).contains(&after_ms) || (158..=162).contains(&after_ms),
                "{after_ms}"
            );
            return (is_taken, after_ms > 130);
        }
    }
    (is_taken, false)
}

/// Returns the requests between protocol.md's marks.
fn listed() -> BTreeSet<String> {
    let text = read(PROTOCOL);
    let (_, list) = text.split_once("<!-- alive:begin -->").unwrap();
    let (list, _) = list.split_once("<!-- alive:end -->").unwrap();
    let names = list.split('`').skip(1).step_by(2);
    names.map(str::to_owned).collect()
}

/// Requests that are refused during stimulation, whatever they carry.
const NEVER_TAKEN: [&str; 8] = [
    "Acknowledge",
    "Arm",
    "Channel",
    "EnterBootLoader",
    "ForceControl",
    "Muscle",
    "Start",
    "StoreStages",
];

#[test]
fn protocol_md_lists_what_keeps_a_host_alive() {
    let (mut taken, mut alive) = (BTreeSet::new(), BTreeSet::new());
    for scene in SCENES {
        let vectors = messages::requests().into_iter();
        let vectors = vectors.map(|(_, sent)| sent.request);
        let own = scene();
        for request in vectors.chain(own.setup).chain(own.setpoints) {
            let name = name(&request);
            // `Stop` ends stimulation by itself; requests already found need no further test.
            if name == "Stop" || alive.contains(&name) {
                continue;
            }
            let (is_taken, is_alive) = request_effect(scene(), request);
            assert!(is_taken || !is_alive, "{name} is refused, and keeps alive");
            taken.extend(is_taken.then(|| name.clone()));
            alive.extend(is_alive.then_some(name));
        }
    }
    // Forwarded as a `KeepAlive`, as the list notes separately.
    assert!(alive.remove("SimulateTrigger"));
    assert_eq!(alive, listed());
    // Every other request was actually tested.
    let types = types();
    let variants = types["Request"]
        .iter()
        .map(|(row, _)| row.split_once(' ').unwrap().1);
    for variant in variants.filter(|variant| *variant != "Stop") {
        let is_possible = !NEVER_TAKEN.contains(&variant);
        assert_eq!(
            taken.contains(variant),
            is_possible,
            "{variant} while stimulating"
        );
    }
}
