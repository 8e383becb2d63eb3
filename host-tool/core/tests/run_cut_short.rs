//! Early ends of a session in simulated time: the reason is reported, the record is kept, and the
//! outputs are isolated.

use firmware::safety::State;
use hal_sim::body::Load;
use hal_sim::world::World;
use host_core::link::{Connection, Port, SimulatedPort};
use host_core::record::{self, Recorder};
use host_core::run::{SessionFile, acknowledge, begin_trial, run};
use std::io;
use std::path::Path;

/// Returns a session with one channel at 50 Hz and the default host timeout.
fn session() -> SessionFile {
    let text = include_str!("../../tests/one_channel.toml");
    let text = text.replace("duration_s = 30.0", "duration_s = 4.0");
    SessionFile::parse("one.toml", &text.replace("host_timeout_ms = 1000\n", "")).unwrap()
}

/// Time of the disturbance, µs after boot.
const AT_US: u64 = 2_000_000;

#[derive(Clone, Copy)]
enum Disturbance {
    Nothing,
    /// The link breaks, and the operating system reports it.
    Gone,
    /// No more messages arrive, without an error.
    Silent,
    /// This computer is suspended, and then all pending messages arrive at once.
    Asleep,
    /// Something changes in the simulated world.
    World(fn(&mut World)),
}

/// A port to a simulated board with a disturbance.
struct Accident {
    port: SimulatedPort,
    happening: Disturbance,
}

impl Accident {
    fn is_over(&self) -> bool {
        self.port.world.now_us() >= AT_US
    }
}

impl Port for Accident {
    fn now_us(&mut self) -> u64 {
        self.port.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        match self.happening {
            Disturbance::Gone if self.is_over() => Err(io::ErrorKind::BrokenPipe.into()),
            Disturbance::Silent if self.is_over() => Ok(()),
            _ => self.port.send(frame),
        }
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        if !self.is_over() {
            return self.port.receive(until_us.min(AT_US));
        }
        match self.happening {
            Disturbance::Gone => Err(io::ErrorKind::BrokenPipe.into()),
            Disturbance::Silent => {
                while !self.port.receive(until_us)?.is_empty() {}
                Ok(Vec::new())
            }
            Disturbance::Asleep => {
                self.happening = Disturbance::Nothing;
                self.port.world.run_until(AT_US + 5_000_000)?;
                self.port.receive(until_us)
            }
            Disturbance::World(change) => {
                change(&mut self.port.world);
                self.port.receive(until_us)
            }
            Disturbance::Nothing => self.port.receive(until_us),
        }
    }

    fn world(&mut self) -> Option<&mut World> {
        Some(&mut self.port.world)
    }
}

/// Name, disturbance, required parts of the message, and whether the fault must be acknowledged
/// before the next session.
type Row = (&'static str, Disturbance, &'static [&'static str], bool);

#[rustfmt::skip]
const ROWS: [Row; 6] = [
    ("gone", Disturbance::Gone, &["E502 lost the device", "reconnect and run again"], false),
    ("silent", Disturbance::Silent, &["E501 the device did not answer setpoints", "is the device powered"], false),
    ("asleep", Disturbance::Asleep, &["E509 this computer did not run this program for 499", "HostSilent", "suspended, asleep or too busy", "run again", "is kept"], false),
    ("over-current", Disturbance::World(|world| world.sensors.over_current = true), &["E512", "fault 6: OverCurrent", "--acknowledge", "is kept"], true),
    ("electrode off", Disturbance::World(|world| world.body.loads_mut()[0] = Load::Open), &["E512", "fault 7: ElectrodeOff", "--acknowledge", "is kept"], true),
    ("hand-held stop", Disturbance::World(|world| world.sensors.hand_stop = false), &["E512", "stopping: HandStop", "close it", "is kept"], false),
];
#[test]
fn the_reason_is_named_and_the_record_is_kept() {
    ROWS.into_iter().for_each(check);
}

fn check((name, happening, says, is_faulted): Row) {
    let file = session();
    let port = accident(&file, happening);
    let out = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("cut_short")
        .join(name);
    let _ = std::fs::remove_dir_all(&out);
    record::write_run(&out, &record::Run::default()).unwrap();
    let mut recorder = Recorder::create(&out, 0, &begin_trial(&file)).unwrap();
    let (outcome, port) = run(&file, port, Some(&mut recorder), |_| ());
    let message = outcome.error.expect(name).to_string();
    for part in says {
        assert!(message.contains(part), "{name}: no `{part}` in {message}");
    }
    // The record must be readable even though the recorder did not finish it.
    drop(recorder);
    let kept = &record::load(&out).unwrap().trials[0];
    assert_eq!(kept.samples, outcome.trial.samples, "{name}");
    let last = kept.samples.last().expect(name).t_s;
    // Telemetry continues while the run waits for isolated outputs.
    assert!((1.8..2.5).contains(&last), "{name}: {last} s");
    assert_eq!(outcome.trial.duration_s, last, "{name}");
    let mut events = kept.events.iter();
    assert!(events.any(|(_, text)| *text == message), "{name}");
    let [read] = kept.electrode_check[..] else {
        panic!("{name}: {:?}", kept.electrode_check);
    };
    assert_eq!((read.channel, read.load_ohm), (1, None), "{name}");
    // A current stage: the measured current equals the applied one within one count of the current
    // sense.
    let off_ma = (read.applied - read.current_ma).abs();
    assert!(off_ma < 0.03, "{name}: {read:?}");
    let mut port = port.expect(name);
    let now = port.now_us();
    port.port.world.run_until(now + 500_000).unwrap();
    assert_eq!(port.port.world.recorder.trace.last_levels().0, 0, "{name}");
    runs_again(name, is_faulted, port, &file);
}

/// After the cause is gone, the next session runs, if necessary after acknowledging the fault.
fn runs_again(name: &str, is_faulted: bool, mut port: Accident, file: &SessionFile) {
    port.happening = Disturbance::Nothing;
    let world = &mut port.port.world;
    (world.sensors.over_current, world.sensors.hand_stop) = (false, true);
    world.body.loads_mut()[0] = Load::NOMINAL;
    if is_faulted {
        let (outcome, back) = run(file, port, None, |_| ());
        let message = outcome.error.expect(name).to_string();
        assert!(message.contains("E306"), "{name}: {message}");
        assert!(message.contains("--acknowledge"), "{name}: {message}");
        port = acknowledge(back.unwrap()).unwrap();
    }
    let (outcome, port) = run(file, port, None, |_| ());
    assert!(outcome.error.is_none(), "{name}: {:?}", outcome.error);
    let (_, info) = Connection::open(port.unwrap()).unwrap();
    assert_eq!(info.state, State::Idle, "{name}");
}

/// Opens a native board with the session's wearer.
fn accident(file: &SessionFile, happening: Disturbance) -> Accident {
    let boot = firmware::units::Micros::new(0);
    let device = Box::new(hal_sim::native::native(boot));
    let port = host_core::run::simulated_port(&file.session, 1, device, boot).unwrap();
    Accident { port, happening }
}

/// A host whose every setpoint is refused counts as silent on the device, but the message does not
/// claim that the computer stalled.
#[test]
fn refused_setpoints_are_the_reason_that_is_named() {
    let text = session().text;
    let (text, _) = text.split_once("[setpoints]").unwrap();
    let text = text.replace("rise_ms = 10\n", "rise_ms = 10\nmax_step_ma = 2.0\n")
        + "[setpoints]\nkind = \"amplitude-ramp\"\nchannel = 1\nrate_hz = 50\npoints = [\
           { at_s = 0.0, value = 1.0 }, { at_s = 2.0, value = 1.0 }, \
           { at_s = 2.01, value = 10.0 }, { at_s = 4.0, value = 10.0 }]\n";
    let file = SessionFile::parse("steps.toml", &text).unwrap();
    let port = accident(&file, Disturbance::Nothing);
    let (outcome, _) = run(&file, port, None, |_| ());
    assert!(outcome.refused > 0);
    let message = outcome.error.unwrap().to_string();
    for part in [
        "E512",
        "HostSilent",
        "E237",
        "smaller steps",
        "host_timeout_ms",
    ] {
        assert!(message.contains(part), "no `{part}` in {message}");
    }
    assert!(!message.contains("cable"), "{message}");
}
