//! Sessions in steps give the same result as in one run, wherever the steps end.

use firmware::link::{Event, Request};
use firmware::safety::StopCause;
use firmware::units::Amplitude;
use hal_sim::random::word;
use host_core::link::{Error, Port};
use host_core::record::{Recorder, Trial};
use host_core::run::{
    Attachments, Control, DeviceName, Outcome, RunError, SessionFile, StepEnd, StepLimit, Stepper,
    begin_trial, run,
};
use std::path::Path;

const FINGER: &str = include_str!("../../sessions/ten_channels_and_finger.toml");
const WIDTHS: &str = include_str!("../../sessions/width_ramp.toml");
const TRIGGERED: &str = include_str!("../../sessions/trigger.toml");

fn file(text: &str, duration_us: u64) -> SessionFile {
    let mut file = SessionFile::parse("session.toml", text).unwrap();
    file.session.duration_us = duration_us;
    file
}

/// Plays the session in steps that end at random times of `seed`.
fn stepped(file: &SessionFile, seed: u64) -> Outcome {
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let mut stepper = Stepper::open(file, port, Attachments::default()).unwrap();
    stepper.configure().unwrap();
    stepper.arm().unwrap();
    stepper.start().unwrap();
    let mut steps = 0;
    loop {
        steps += 1;
        let to_us = stepper.time_us() + word(seed, steps) % 40_000;
        let until = match word(seed, steps) % 3 {
            0 => StepLimit::Event(to_us),
            _ => StepLimit::Time(to_us),
        };
        match stepper.step(until).unwrap() {
            StepEnd::Over => break,
            StepEnd::Reached => {
                let late_us = stepper.time_us() - to_us;
                assert!(late_us <= 2_000, "{late_us} µs late");
            }
            StepEnd::Event(..) => assert!(matches!(until, StepLimit::Event(_))),
        }
    }
    assert!(steps > 20, "{steps}");
    stepper.close(Ok(())).0
}

#[test]
fn where_steps_end_changes_nothing() {
    for text in [FINGER, WIDTHS, TRIGGERED] {
        let file = file(text, 1_500_000);
        let port = DeviceName::Native.open(&file.session, 1).unwrap();
        let (reference, _) = run(&file, port, None, |_| ());
        assert!(reference.error.is_none(), "{:?}", reference.error);
        for seed in 0..3 {
            let outcome = stepped(&file, seed);
            let parts = |outcome: &Outcome| {
                let Trial {
                    samples,
                    counters,
                    events,
                    markers,
                    pulses,
                    ..
                } = outcome.trial.clone();
                (samples, counters, events, markers, pulses)
            };
            assert!(outcome.error.is_none());
            assert_eq!(parts(&outcome), parts(&reference), "{seed}");
        }
    }
}

#[test]
fn a_step_ends_with_an_event() {
    let file = file(FINGER, 3_000_000);
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let mut stepper = Stepper::open(&file, port, Attachments::default()).unwrap();
    let mut until = |until| stepper.step(until).unwrap();
    // Before the start a step ends at once.
    assert_eq!(until(StepLimit::Time(u64::MAX)), StepEnd::Reached);
    stepper.configure().unwrap();
    stepper.arm().unwrap();
    stepper.start().unwrap();
    let mut until = |until| stepper.step(until).unwrap();
    assert_eq!(until(StepLimit::Time(500_000)), StepEnd::Reached);
    stepper.control(&Control::Pause).unwrap();
    let mut next = || stepper.step(StepLimit::Event(u64::MAX)).unwrap();
    let stopping = Event::Stopping(StopCause::Request);
    let is = |stepped, wanted| matches!(stepped, StepEnd::Event(_, event) if event == wanted);
    assert!(is(next(), stopping));
    assert!(is(next(), Event::Stopped(StopCause::Request)));
    let fallen_us = stepper.time_us();
    // The fall plus one pulse.
    assert!((500_000..560_000).contains(&fallen_us), "{fallen_us}");
    assert_eq!(
        stepper.step(StepLimit::Event(u64::MAX)).unwrap(),
        StepEnd::Over
    );
    let (outcome, _) = stepper.close(Ok(()));
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
}

#[test]
fn the_caller_of_a_live_session_gives_its_setpoints() {
    let text = "title = \"live\"\nduration_s = 0.2\n[wearer]\nhost_timeout_ms = 100\n\
        [[channel]]\nnumber = 1\nname = \"flexor\"\nlimit = 15.0\n\
        stage = { kind = \"current\", full_scale_ma = 100.0 }\n\
        train = { shape = \"biphasic-cathodic-first\", width_us = 200, frequency_hz = 50.0 }\n\
        [setpoints]\nkind = \"amplitudes\"\nrate_hz = 50\n\
        values = [{ channel = 1, value = 1.0 }]\n";
    let wanted = |ma: u32| Request::Amplitudes {
        at: None,
        mask: 1,
        values: [Amplitude::new(1_000 * ma)].into_iter().collect(),
        widths: Default::default(), // the train's own width
    };
    let file = SessionFile::parse("live.toml", text).unwrap();
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let stepper = Stepper::open(&file, port, Attachments::default()).unwrap();
    let mut stepper = stepper.with_live_setpoints();
    stepper.configure().unwrap();
    stepper.arm().unwrap();
    stepper.request(wanted(8)).unwrap();
    stepper.start().unwrap();
    // This step is longer than the session and than the host timeout, and ends exactly at its
    // limit.
    let stepped = stepper.step(StepLimit::Time(777_777)).unwrap();
    assert_eq!((stepped, stepper.time_us()), (StepEnd::Reached, 777_777));
    stepper.post(wanted(16)).unwrap();
    let ran = stepper.step(StepLimit::Time(900_000)).map(drop);
    assert!(matches!(ran, Err(RunError::Link(Error::Refused(_)))));
    let (outcome, mut port) = stepper.close(ran);
    let trial = outcome.trial;
    assert!(trial.samples.is_empty());
    assert!(trial.pulses.is_some_and(|pulses| pulses > 35));
    let dac = &port.world().unwrap().recorder.trace.dac;
    let most = dac.iter().map(|write| u32::from(write.code)).max();
    assert_eq!(most, Some(65_535 * 8 / 100));
}

#[test]
fn a_session_of_its_own_is_stepped_on_another_thread_and_recorded() {
    let folder = std::env::temp_dir().join(format!("flexor-steps-{}", std::process::id()));
    let file = file(WIDTHS, 400_000);
    let into = folder.clone();
    let played = std::thread::spawn(move || {
        let recorder = Recorder::create(&into, 0, &begin_trial(&file)).unwrap();
        let port = DeviceName::Native.open(&file.session, 1).unwrap();
        let attached = Attachments {
            recorder: Some(Box::new(Box::new(recorder))),
            ..Attachments::default()
        };
        let mut stepper = Stepper::open_owned(file, port, attached).unwrap();
        stepper.configure().unwrap();
        stepper.arm().unwrap();
        stepper.start().unwrap();
        assert_eq!(
            stepper.step(StepLimit::Time(u64::MAX)).unwrap(),
            StepEnd::Over
        );
        let (outcome, _) = stepper.close(Ok(()));
        outcome.trial
    });
    let trial = played.join().unwrap();
    let rows = std::fs::read_to_string(first_folder(&folder).join("samples.csv")).unwrap();
    assert_eq!(rows.lines().count(), trial.samples.len() + 1);
    std::fs::remove_dir_all(folder).unwrap();
}

fn first_folder(dir: &Path) -> std::path::PathBuf {
    let mut inside = std::fs::read_dir(dir)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    inside.find(|path| path.is_dir()).unwrap()
}
