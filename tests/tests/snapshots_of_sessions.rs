//! A copy of a running session on the chip simulator continues exactly like the original. The
//! tests of `host_core` check the same for the native simulator.

use host_core::run::{Attachments, DeviceName, StepEnd, StepLimit, Stepper};
use tests::desk::load_session;

#[test]
fn a_copy_of_a_session_on_the_chip_goes_on_as_the_session_does() {
    let mut file = load_session("ten_channels.toml");
    file.session.duration_us = 600_000;
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
