//! Programs in a run: every burst is as the program specifies.

use host_core::run::{SessionFile, run, simulated_port};

use crate::session_programs::{BENCH, Bench, assert_played};

/// The built-in reciprocal session, as `flexor run` plays it on the native device.
#[test]
fn a_run_plays_the_pair_in_turn_burst_by_burst() {
    let text = include_str!("../../sessions/reciprocal.toml").replace("30.0", "9.0");
    let file = SessionFile::parse("reciprocal.toml", &text).unwrap();
    let boot = firmware::units::Micros::new(u32::MAX - 2_000_000);
    let device = Box::new(hal_sim::native::native(boot));
    let port = simulated_port(&file.session, 1, device, boot).unwrap();
    let (outcome, port) = run(&file, port, None, |_| ());
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    assert_eq!(outcome.refused, 0);
    let bench = |offset_us| Bench {
        period_us: 25_000,
        offset_us,
        own_us: 250,
        ..BENCH
    };
    let trace = &port.unwrap().world.recorder.trace;
    // Excludes the fall, which begins when the session ends.
    let epoch_us = outcome.epoch_us.unwrap();
    let trace = trace.up_to(epoch_us + file.session.duration_us - 1);
    let benches = [(0, bench(0)), (1, bench(12_500))];
    assert_played(&benches, &file.session, &trace, epoch_us);
}
