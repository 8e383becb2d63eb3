//! Tests of a haptic client over TCP: grabbing, lifting and letting go while `flexor serve`
//! simulates the board, and invalid requests.

use crate::program::{Board, command_result, test_folder, write_file};
use firmware::haptics::{Hold, Modulation, MotionPhase};
use firmware::link::{Code, Event, Request, Telemetry};
use firmware::units::Angle;
use host_core::link::{Connection, Error, Incoming, Port, TcpPort, stamp};
use host_core::session::Session;
use std::process::Command;

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples");
const ASSIST: &str = include_str!("../sessions/lift.toml");
const RESIST: &str = include_str!("../sessions/lift_resist.toml");

/// Returns a session for a computer that sometimes stalls, with an object held for at most
/// `hold_s`.
fn with_long_timeouts(text: &str, hold_s: &str) -> String {
    let hold = format!("longest_hold_s = {hold_s}\nstale_after_ms = 500");
    let mut text = text.to_owned();
    for (find, replace) in [
        ("longest_hold_s = 10", hold.as_str()),
        ("host_timeout_ms = 100\n", "host_timeout_ms = 1000\n"),
    ] {
        assert!(text.contains(find), "{find}");
        text = text.replace(find, replace);
    }
    text
}

/// Runs an example to its end; returns exit code, output and errors.
fn example(name: &str, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut python = Command::new("python3");
    python.arg(format!("{EXAMPLES}/{name}")).args(arguments);
    command_result(python.output().expect("python3, which the examples are in"))
}

#[test]
fn every_client_encodes_and_decodes_the_vectors() {
    for name in ["client.py", "hand.py", "lift.py"] {
        let (exit, output, error) = example(name, &["--selftest"]);
        assert_eq!(exit, Some(0), "{name}: {output}{error}");
        print!("{name}: {output}");
    }
}

/// Returns the amplitude of every channel at these angles of elbow and shoulder of both arms, in
/// the format of the example.
fn expected_amplitudes(session: &Session, degrees: [f64; 2], phase: MotionPhase) -> String {
    let joints = session.modulations.iter().flat_map(|joint| {
        let modulation = Modulation::new(&joint.spec).unwrap();
        let own = degrees[usize::from(joint.spec.joint) % 2];
        let angle = Angle::from_centideg((own * 100.0).round() as i16);
        modulation.amplitudes(angle, Some(phase))
    });
    let given = joints.filter(|(_, amplitude)| amplitude.get() > 0);
    let given = given.map(|(channel, amplitude)| {
        let channel = session.channels.iter().find(|item| item.index() == channel);
        let name = &channel.unwrap().name;
        format!("{name} {} mA", f64::from(amplitude.get()) / 1e3)
    });
    given.collect::<Vec<_>>().join(", ")
}

/// Parses the angles of elbow and shoulder from a line such as "…, 95.0° and 60.0°, …".
fn degrees(line: &str) -> [f64; 2] {
    let (_, from) = line.split_once("at ").unwrap();
    let (angles, _) = from.split_once(" degrees").unwrap();
    let (elbow, shoulder) = angles.split_once(" and ").unwrap();
    [elbow, shoulder].map(|text| text.parse().unwrap())
}

/// At rest above and on each shelf, the amplitudes are those of the quartics at the client's
/// angles; after letting go, they are zero.
#[test]
#[cfg(unix)]
fn a_game_engine_lifts_live() {
    let folder = test_folder("lift_live");
    for (text, deeds) in [(ASSIST, &["high", "middle", "low"][..]), (RESIST, &["low"])] {
        let text = with_long_timeouts(text, "20");
        let file = write_file(&folder, "it.toml", &text);
        let session = Session::parse("it.toml", &text).unwrap();
        let board = Board::tcp(&folder);
        let arguments = [&[&*board.at, file.to_str().unwrap()], deeds].concat();
        let (exit, output, error) = example("lift.py", &arguments);
        assert_eq!(exit, Some(0), "{output}{error}");
        let mut lines = output.lines();
        for shelf in deeds {
            for (place, phase) in [("above", MotionPhase::Lift), ("on", MotionPhase::Drop)] {
                let line = lines.next().unwrap();
                let where_ = format!("{place} the {shelf} shelf at ");
                assert!(line.starts_with(&where_), "{where_}: {output}");
                let given = expected_amplitudes(&session, degrees(line), phase);
                assert!(
                    line.ends_with(&format!(" (held): {given}")),
                    "{given}: {output}"
                );
                assert_eq!(given.matches(" mA").count(), 4, "{given}");
            }
            let line = lines.next().unwrap();
            assert!(line.starts_with("released at "), "{output}");
            assert!(line.ends_with(" (released): no stimulation"), "{output}");
        }
    }
}

/// An object that a client forgets is released by the device, which then refuses orders until the
/// client releases it, too, and grabs again. A client that lets an object fall ends its
/// stimulation.
#[test]
#[cfg(unix)]
fn what_a_client_forgets_or_lets_fall_ends() {
    let folder = test_folder("lift_forgotten");
    let file = write_file(&folder, "it.toml", with_long_timeouts(ASSIST, "3"));
    let board = Board::tcp(&folder);
    let arguments = [&*board.at, file.to_str().unwrap(), "forget", "fall"];
    let (exit, output, error) = example("lift.py", &arguments);
    assert_eq!(exit, Some(0), "{output}{error}");
    let lines: Vec<&str> = output.lines().collect();
    let (over, refused) = (lines[0], lines[1]);
    assert!(over.contains("HoldExpired"), "{output}");
    assert_eq!(
        refused,
        "E322: the object was held for longer than 3 s; release it first"
    );
    let ways = [
        "released at",
        "grabbed again at",
        "released at",
        "on the way up at",
        "dropped at",
    ];
    for (way, line) in ways.into_iter().zip(&lines[2..]) {
        assert!(line.starts_with(way), "{way}: {output}");
        let stimulates = line.contains("left biceps") && line.contains("(held)");
        let is_still = line.ends_with("(released): no stimulation");
        let is_held = way.starts_with("grabbed") || way.starts_with("on");
        assert_eq!((stimulates, is_still), (is_held, !is_held), "{line}");
    }
}

/// Mistakes that only the client can detect are refused by name before any message to a device.
#[test]
fn a_client_s_own_mistakes_never_reach_a_device() {
    let folder = test_folder("lift_mistaken");
    let nobody = "tcp:127.0.0.1:1";
    let lift = write_file(&folder, "lift.toml", ASSIST);
    let other = write_file(&folder, "other.toml", "title = \"no joints\"\n");
    let broken = write_file(&folder, "broken.toml", "title = \n");
    for (file, deed, part) in [
        (
            &lift,
            "attic",
            "no shelf or action attic; choose from high, middle, low, forget, fall",
        ),
        (&other, "low", "has no [[modulation]]"),
        (&broken, "low", "Invalid value"),
        (&folder.join("nowhere.toml"), "low", "No such file"),
        (&lift, "low", "refused"), // the connection
    ] {
        let (exit, output, error) = example("lift.py", &[nobody, file.to_str().unwrap(), deed]);
        assert_eq!((exit, output.as_str()), (Some(1), ""), "{error}");
        assert!(error.contains(part), "{part}: {error}");
        assert!(!error.contains("Traceback"), "{error}");
    }
}

/// A client of a board that is armed with a session's setup.
struct Wire(Connection<TcpPort>);

impl Wire {
    fn armed(board: &Board, session: &Session) -> Self {
        let port = TcpPort::connect(board.at.strip_prefix("tcp:").unwrap()).unwrap();
        let (mut client, _) = Connection::open(port).unwrap();
        for request in session.setup_requests() {
            client.request(request).unwrap();
        }
        client.subscribe(5).unwrap();
        client.arm().unwrap();
        Self(client)
    }

    /// Returns the reason of the refusal, if there is one.
    fn send(&mut self, request: Request) -> Option<Code> {
        match self.0.request(request) {
            Ok(_) => None,
            Err(Error::Refused(refused)) => Some(refused.code().unwrap()),
            Err(e) => panic!("{e}"),
        }
    }

    fn send_held(&mut self, held: bool) -> Option<Code> {
        self.send(Request::ObjectHeld { held })
    }

    fn send_angle(&mut self, joint: u8, centideg: i16) -> Option<Code> {
        // Time of the latest answer, which is never in the future.
        let at = stamp(self.0.request(Request::KeepAlive).unwrap());
        self.send(Request::Measurement {
            joint,
            centideg,
            at,
        })
    }

    /// Returns the first sample with this state of the object, within 2 s and without a fault.
    fn wait_for_hold(&mut self, hold: Hold) -> Telemetry {
        let is = |telemetry: &Telemetry| {
            telemetry
                .lift
                .as_ref()
                .is_some_and(|lift| lift.hold == hold)
        };
        let until = self.0.port().now_us() + 2_000_000;
        while let Some(incoming) = self.0.next(until).unwrap() {
            match incoming {
                Incoming::Telemetry(_, sample) if is(&sample) => return *sample,
                Incoming::Event(_, event) => {
                    assert!(!matches!(event, Event::Faulted(_)), "{event:?}");
                }
                _ => {}
            }
        }
        panic!("no such sample");
    }
}

#[test]
fn held_makes_sense_or_is_refused_by_number() {
    let folder = test_folder("lift_nonsense");
    let text = with_long_timeouts(ASSIST, "20");
    let session = Session::parse("it.toml", &text).unwrap();
    let board = Board::tcp(&folder);
    let mut wire = Wire::armed(&board, &session);
    // Held before any angle, then with three of four.
    assert_eq!(wire.send_held(true), Some(Code::NoAngle));
    for joint in 0..3 {
        assert_eq!(wire.send_angle(joint, 4_000), None);
    }
    match wire.0.request(Request::ObjectHeld { held: true }) {
        Err(Error::Refused(refused)) => {
            assert_eq!(refused.code(), Some(Code::NoAngle));
            assert!(refused.to_string().contains("(joint 3)"), "{refused}");
        }
        other => panic!("{other:?}"),
    }
    // A joint that does not exist, an impossible angle.
    assert_eq!(wire.send_angle(4, 4_000), Some(Code::NoModulation));
    assert_eq!(wire.send_angle(9, 4_000), Some(Code::OutOfRange));
    // A release without a hold is allowed: a release is never refused.
    assert_eq!(wire.send_held(false), None);
    wire.0.start().unwrap();
    for joint in 0..4 {
        assert_eq!(wire.send_angle(joint, 4_000), None);
    }
    assert_eq!(wire.send_held(false), None);
    assert_eq!(wire.send_held(true), None);
    assert_eq!(wire.send_held(true), None); // repeated, without effect
    wire.wait_for_hold(Hold::Held);
    // Bytes that are not a frame end nothing.
    wire.0.port().send(&[7, 0, 1, 2, 3, 0]).unwrap();
    wire.wait_for_hold(Hold::Held);
    assert_eq!(wire.send_held(false), None);
    let let_go = wire.wait_for_hold(Hold::Released);
    assert!(let_go.amplitudes.iter().all(Option::is_none), "{let_go:?}");
    wire.0.stop().unwrap();
    // Without modulation in the setup, nothing can be held.
    let text = crate::program::SESSION;
    let other = Session::parse("one.toml", text).unwrap();
    drop(wire);
    drop(board);
    let board = Board::tcp(&folder);
    let mut wire = Wire::armed(&board, &other);
    assert_eq!(wire.send_held(true), Some(Code::NoModulation));
    assert_eq!(wire.send_held(false), Some(Code::NoModulation));
}
