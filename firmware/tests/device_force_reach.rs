//! Forces below that of threshold amplitude, on the whole device.

use crate::device_desk::*;
use crate::device_force::{
    BOOT, FORCE, RARE, SLOW, control, force, force_range_mn, gaps, last_code, max_force_mn, muscle,
    starts, stimulating_by,
};
use firmware::control::ForceGap;
use firmware::link::{ForceSample, Request};
use firmware::safety::{State, WearerSpec};

/// Requests `millinewton` for `wait_us`. Returns the last sample of channel 0, and whether it was
/// limiting.
fn sampled(desk: &mut TestHost, millinewton: u32, wait_us: u32) -> (bool, ForceSample) {
    for _ in 0..wait_us / 50_000 {
        desk.expect_ok(force(0, millinewton));
        desk.wait(50_000);
    }
    let sample = desk.samples().pop().unwrap();
    (sample.limiting, sample.force_control[0])
}

/// A force below that of threshold is either reached by a slower rate or reported as out of reach,
/// with the two nearest forces that are within reach.
#[test]
fn below_threshold_force_is_had_by_rate_or_said_to_be_out_of_reach() {
    let at_threshold = force_range_mn(&FORCE).0;
    let least = force_range_mn(&RARE).0;
    assert!(5 * least < at_threshold, "{least} {at_threshold} mN");
    let gap = |upper_mn| {
        let lower_mn = 0;
        Some(ForceGap { lower_mn, upper_mn })
    };
    let mut desk = stimulating_by(FORCE, 1000);
    desk.expect_ok(Request::Subscribe { period_ms: 10 });
    for (asked, limiting) in [
        (0, None),
        (1, gap(at_threshold)),
        (at_threshold * 2 / 5, gap(at_threshold)),
        (at_threshold * 3 / 5, gap(at_threshold)),
        (at_threshold - 1, gap(at_threshold)),
        (at_threshold, None),
        (max_force_mn(), None),
    ] {
        let from = desk.since_boot_us() + 200_000;
        let (is_limiting, sample) = sampled(&mut desk, asked, 500_000);
        assert_eq!(
            (is_limiting, sample.gap),
            (limiting.is_some(), limiting),
            "{asked} mN"
        );
        // The nearer of the two is chosen, as before.
        let is_silent = starts(&desk, 0, from).is_empty();
        assert_eq!(is_silent, 2 * asked < at_threshold, "{asked} mN");
    }

    let mut desk = stimulating_by(RARE, 1000);
    desk.expect_ok(Request::Subscribe { period_ms: 10 });
    let mut before_us = 500_001;
    for asked in [least, 2 * least, at_threshold / 2, at_threshold - 1] {
        let from = desk.since_boot_us() + 1_000_000;
        let (is_limiting, sample) = sampled(&mut desk, asked, 3_000_000);
        assert_eq!((is_limiting, sample.gap), (false, None), "{asked} mN");
        let gaps = gaps(&starts(&desk, 0, from));
        assert!(
            gaps.iter().all(|&gap| gap == gaps[0]),
            "{asked} mN: {gaps:?}"
        );
        assert!(
            gaps[0] < before_us && gaps[0] > 40_000,
            "{asked} mN: {gaps:?}"
        );
        before_us = gaps[0];
        let threshold = 10_000 * 65_535 / 100_000;
        assert!(last_code(&desk, 0).abs_diff(threshold) <= 1);
    }
    // Less than one pulse every half second gives.
    let (is_limiting, sample) = sampled(&mut desk, least / 3, 500_000);
    assert_eq!((is_limiting, sample.gap), (true, gap(least)));
}

/// Two pulses per second are further apart than host silence plus fall: afterwards the channel is
/// as silent as any other.
#[test]
fn a_slow_rate_outlives_neither_silence_nor_stop() {
    for ends in [None, Some(Request::Stop)] {
        let mut desk = stimulating_by(RARE, 50);
        for _ in 0..40 {
            desk.expect_ok(force(0, force_range_mn(&RARE).0));
            desk.wait(40_000);
        }
        assert_eq!(desk.state(), State::Stimulating);
        let last = desk.since_boot_us();
        if let Some(stop) = ends {
            desk.expect_ok(stop);
        }
        desk.wait(3_000_000);
        assert_eq!(desk.state(), State::Idle);
        let after = starts(&desk, 0, last + 50_000 + 50_000 + 1_000);
        assert!(after.is_empty(), "{after:?} after {last}");
    }
}

/// The wearer's rise counts bursts too: at a slow rate the first has half of the requested
/// amplitude and the second all of it, and none exceeds it.
#[test]
fn a_slow_rate_rises_as_any() {
    let mut desk = TestHost::open(BOOT);
    let wearer = WearerSpec {
        rise_ms: 300,
        host_timeout_ms: 1000,
        ..wearer()
    };
    desk.prepare(wearer, &[channel(SLOW)]);
    desk.expect_ok(muscle(0));
    desk.expect_ok(control(0, RARE));
    desk.start();
    let from = desk.since_boot_us();
    for _ in 0..60 {
        desk.expect_ok(force(0, force_range_mn(&RARE).0));
        desk.wait(50_000);
    }
    let codes = desk
        .record
        .dac
        .iter()
        .filter(|&&(at, c, _)| c == 0 && at > from);
    let codes: Vec<u32> = codes.map(|&(_, _, code)| code.into()).collect();
    let threshold = 10_000 * 65_535 / 100_000;
    assert!(codes[0].abs_diff(threshold / 2) <= 1, "{codes:?}");
    let risen = codes[1..].iter().all(|code| code.abs_diff(threshold) <= 1);
    assert!(risen && codes.len() > 3, "{codes:?}");
}
