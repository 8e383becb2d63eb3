//! Telemetry: present values, and "none" where there is no value.

use crate::device_desk::*;
use crate::device_force::{FORCE, control, force, muscle};
use firmware::control::ForceSpec;
use firmware::link::{Request, Telemetry};
use firmware::pulse::TrainSpec;
use firmware::safety::State;
use firmware::units::{Amplitude, Micros};

const BOOT: Micros = Micros::new(u32::MAX - 300_000);

/// Returns the last sample of the next `ms`, with keep-alives.
fn last_sample_after(desk: &mut TestHost, ms: u32) -> Telemetry {
    for _ in 0..ms.div_ceil(10) {
        desk.send(Request::KeepAlive);
        desk.wait(10_000);
    }
    desk.samples().pop().unwrap()
}

#[test]
fn a_repeated_subscription_keeps_its_phase() {
    let mut desk = TestHost::open(BOOT);
    desk.expect_ok(Request::Subscribe { period_ms: 10 });
    desk.take_messages();
    for _ in 0..40 {
        desk.send(Request::Subscribe { period_ms: 10 }); // to compare clocks
        desk.wait(5_000);
    }
    let times: Vec<Micros> = desk.samples().iter().map(|s| s.at).collect();
    assert!((19..=20).contains(&times.len()), "{}", times.len());
    assert!(times.windows(2).all(|t| (t[1] - t[0]).us() == 10_000));
    // Another period starts a new subscription.
    desk.expect_ok(Request::Subscribe { period_ms: 20 });
    desk.take_messages();
    desk.wait(100_000);
    assert_eq!(desk.samples().len(), 5);
}

#[test]
fn what_is_not_there_is_none_and_the_state_is_told() {
    let mut desk = TestHost::open(BOOT);
    desk.expect_ok(Request::Subscribe { period_ms: 5 });
    let idle = last_sample_after(&mut desk, 20);
    assert_eq!((idle.state, idle.amplitudes.len()), (State::Idle, 0));
    desk.prepare(wearer(), &[channel(PLAIN); 2]);
    desk.expect_ok(ARM);
    let armed = last_sample_after(&mut desk, 20);
    assert_eq!(armed.state, State::Armed);
    assert_eq!(armed.amplitudes, [None, None]);
    desk.expect_ok(Request::Start);
    let silent = last_sample_after(&mut desk, 60);
    assert_eq!(silent.state, State::Stimulating);
    assert_eq!(silent.amplitudes, [None, None]);
    desk.expect_ok(equal_amplitudes(1, 10_000));
    let playing = last_sample_after(&mut desk, 60);
    assert_eq!(playing.amplitudes, [Some(Amplitude::new(10_000)), None]);
    for sample in [&idle, &armed, &silent, &playing] {
        assert_eq!(sample.reference_centideg, None);
        assert_eq!(sample.measured_centideg, None);
        assert_eq!(sample.effort_milli, None);
    }
    // An amplitude of 0 silences a channel with its next burst at the latest.
    desk.expect_ok(equal_amplitudes(1, 0));
    assert_eq!(last_sample_after(&mut desk, 30).amplitudes, [None, None]);
    desk.expect_ok(equal_amplitudes(1, 10_000));
    last_sample_after(&mut desk, 40);
    desk.expect_ok(Request::Stop);
    let falling = last_sample_after(&mut desk, 25);
    assert_eq!(falling.state, State::Stopping);
    assert!(falling.amplitudes[0] < Some(Amplitude::new(10_000)));
    let stopped = last_sample_after(&mut desk, 100);
    assert_eq!(stopped.state, State::Idle);
    assert_eq!(stopped.amplitudes, [None, None]);
}

/// A finite train that has ended emits nothing while another plays on.
#[test]
fn a_train_that_has_played_is_none() {
    let mut desk = TestHost::open(BOOT);
    let finite = TrainSpec {
        repeats: 3,
        ..PLAIN
    };
    desk.run(wearer(), &[without_rise(finite), channel(PLAIN)], 10_000);
    desk.expect_ok(Request::Subscribe { period_ms: 5 });
    let last = last_sample_after(&mut desk, 150);
    assert_eq!(last.amplitudes, [None, Some(Amplitude::new(10_000))]);
}

#[test]
fn a_force_of_nothing_has_no_amplitude_and_no_rate() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN)]);
    desk.expect_ok(muscle(0));
    let fixed = ForceSpec {
        min_period_us: PLAIN.period_us,
        ..FORCE
    };
    desk.expect_ok(control(0, fixed));
    desk.expect_ok(Request::Subscribe { period_ms: 5 });
    desk.start();
    let before = last_sample_after(&mut desk, 20).force_control[0];
    assert_eq!((before.reference_mn, before.period_us), (None, None));
    desk.expect_ok(force(0, 6_000));
    let during = last_sample_after(&mut desk, 60);
    assert_eq!(during.force_control[0].reference_mn, Some(6_000));
    assert_eq!(during.force_control[0].period_us, Some(20_000));
    assert!(
        during.amplitudes[0] > Some(Amplitude::new(10_000)),
        "{during:?}"
    );
    desk.expect_ok(force(0, 0));
    let none = last_sample_after(&mut desk, 10);
    assert_eq!(none.force_control[0].reference_mn, Some(0));
    assert_eq!(none.force_control[0].period_us, None);
    assert_eq!(none.amplitudes, [None]);
}
