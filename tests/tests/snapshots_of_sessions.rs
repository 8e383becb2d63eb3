//! A copy of a running session: both continue exactly like the original.

use host_core::run::{Attachments, DeviceName, SessionFile, StepEnd, StepLimit, Stepper};
use tests::desk::load_session;

fn file() -> SessionFile {
    let mut file = load_session("ten_channels.toml");
    file.session.duration_us = 600_000;
    file
}

#[test]
fn a_copy_of_a_session_on_the_chip_goes_on_as_the_session_does() {
    let file = file();
    let port = DeviceName::Chip.open(&file.session, 1).unwrap();
    let mut stepper = Stepper::open(&file, port, Attachments::default()).unwrap();
    stepper.configure().unwrap();
    stepper.arm().unwrap();
    stepper.start().unwrap();
    stepper.step(StepLimit::Time(250_000)).unwrap();
    let mut copy = stepper
        .snapshot()
        .expect("the chip simulator can be copied");
    assert_eq!(copy.time_us(), stepper.time_us());
    // The copy runs first, which shows whether it shares state with the original.
    assert_eq!(copy.step(StepLimit::Time(u64::MAX)).unwrap(), StepEnd::Over);
    let (copied, _) = copy.close(Ok(()));
    assert_eq!(
        stepper.step(StepLimit::Time(u64::MAX)).unwrap(),
        StepEnd::Over
    );
    let (original, _) = stepper.close(Ok(()));
    assert!(original.error.is_none() && copied.error.is_none());
    assert!(original.trial.samples.len() > 40 && original.trial.pulses > Some(100));
    assert_eq!(copied.trial.samples, original.trial.samples);
    assert_eq!(copied.trial.counters, original.trial.counters);
    assert_eq!(copied.trial.pulses, original.trial.pulses);
}

#[test]
fn a_session_in_this_process_cannot_be_copied() {
    let file = file();
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let stepper = Stepper::open(&file, port, Attachments::default()).unwrap();
    assert!(stepper.snapshot().is_none());
}
