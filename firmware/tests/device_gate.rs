//! Trains that play while the trigger input is active, judged from the pins.

use crate::device_desk::*;
use crate::device_safety::BOOT;
use firmware::link::Request;
use firmware::pulse::{Partner, State as Line, TrainSpec, Trigger, WINDOW_US};
use firmware::safety::{ChannelSpec, State};
use std::collections::BTreeSet;

/// Activates the input now and keeps it active for `us`.
fn hold(desk: &mut TestHost, us: u32) {
    desk.sensors.trigger = Some(desk.now());
    desk.sensors.held = true;
    desk.wait(1);
    desk.sensors.trigger = None;
    desk.wait(us - 1);
    desk.sensors.held = false;
}

fn gated_channel(train: TrainSpec) -> ChannelSpec {
    without_rise(TrainSpec {
        trigger: Some(Trigger::Gated),
        ..train
    })
}

/// Returns start and end of a channel's phases after the electrode check.
fn phases(desk: &TestHost, channel: usize, from_us: u64) -> Vec<(u64, u64)> {
    let is_driven = |line| matches!(line, Line::Cathodic | Line::Anodic);
    let intervals = line_intervals(&desk.record.levels, channel, u64::MAX);
    let phases = intervals.into_iter().filter(|s| is_driven(s.1));
    phases
        .map(|s| (s.0, s.2))
        .filter(|s| s.0 >= from_us)
        .collect()
}

fn starts(phases: &[(u64, u64)]) -> Vec<u64> {
    phases.iter().step_by(2).map(|phase| phase.0).collect()
}

/// A train plays from exactly 1000 µs after the edge until 1000 µs after the window whose refill
/// finds the input released, at every phase of both.
#[test]
fn a_gated_train_plays_while_the_input_is_held() {
    let spec = gated_channel(TrainSpec {
        period_us: 10_000,
        ..PLAIN
    });
    for length in (253..36_000).step_by(487) {
        let mut desk = TestHost::open(BOOT);
        desk.run(wearer(), &[spec], 10_000);
        let (from, mut expected) = (desk.since_boot_us(), Vec::new());
        for _ in 0..3 {
            desk.wait(5_000);
            let on = desk.since_boot_us();
            hold(&mut desk, length);
            let window = u64::from(WINDOW_US);
            // A refill comes 2 µs into its window.
            let found = (desk.since_boot_us() - 2).next_multiple_of(window);
            expected.extend((on + 1_000..found + 1_000).step_by(10_000));
            desk.expect_ok(Request::KeepAlive);
            desk.wait(12_000);
        }
        assert_eq!(starts(&phases(&desk, 0, from)), expected, "{length} µs");
        assert_eq!(desk.status().counters.idle_triggers, 0);
        assert_eq!(desk.state(), State::Stimulating);
    }
}

/// An edge that comes and goes between two refills plays nothing, and is counted.
#[test]
fn an_edge_that_is_not_held_plays_nothing() {
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer(), &[gated_channel(PLAIN)], 10_000);
    let from = desk.since_boot_us();
    for _ in 0..50 {
        let phase = desk.since_boot_us() % u64::from(WINDOW_US);
        desk.wait(1_003 + (WINDOW_US - phase as u32) % WINDOW_US);
        hold(&mut desk, 200);
        desk.expect_ok(Request::KeepAlive);
    }
    assert_eq!(phases(&desk, 0, from), []);
    assert_eq!(desk.status().counters.idle_triggers, 50);
}

/// An input that is active at the start plays nothing, however long, before a refill has found it
/// released.
#[test]
fn a_gate_that_is_held_at_the_start_waits_for_its_release() {
    for bounces in [false, true] {
        let mut desk = TestHost::open(BOOT);
        desk.sensors.held = true;
        desk.run(wearer(), &[gated_channel(PLAIN)], 10_000);
        let from = desk.since_boot_us();
        if bounces {
            desk.sensors.trigger = Some(desk.now());
            desk.wait(1);
            desk.sensors.trigger = None;
        }
        desk.keep_alive(10, 50_000);
        desk.sensors.held = false;
        desk.wait(2_000);
        assert_eq!(phases(&desk, 0, from), []);
        hold(&mut desk, 50_000);
        assert_eq!(phases(&desk, 0, from).len(), 6, "three pulses in 50 ms");
    }
}

/// An input that stays active through a stop plays nothing after the next start either.
#[test]
fn a_stop_ends_what_is_gated_and_the_next_start_waits() {
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer(), &[gated_channel(PLAIN)], 10_000);
    let from = desk.since_boot_us();
    hold(&mut desk, 90_000);
    desk.sensors.held = true;
    desk.expect_ok(Request::Stop);
    let stopped = desk.since_boot_us();
    desk.wait(200_000);
    assert_eq!(desk.state(), State::Idle);
    let seen = phases(&desk, 0, from);
    assert!(seen.len() >= 10 && seen.iter().all(|p| p.1 < stopped + 100_000));
    desk.start();
    desk.expect_ok(equal_amplitudes(1, 10_000));
    let from = desk.since_boot_us();
    desk.keep_alive(10, 50_000);
    assert_eq!(phases(&desk, 0, from), []);
}

/// A contact that bounces within pulses, windows and periods changes no width of a phase and no
/// interval between pulses; the state after bouncing decides.
#[test]
fn a_gate_that_chatters_changes_no_pulse() {
    let plain = |period_us, repeats| TrainSpec {
        period_us,
        repeats,
        ..PLAIN
    };
    let contacts = [
        (60, 70),
        (130, 90),
        (310, 290),
        (700, 400),
        (2_600, 1_300),
        (40, 5_300),
    ];
    for (on, off) in contacts {
        for train in [plain(20_000, 0), plain(5_000, 0), plain(5_000, 2)] {
            let period = u64::from(train.period_us);
            let mut desk = TestHost::open(BOOT);
            desk.run(wearer(), &[gated_channel(train)], 10_000);
            let from = desk.since_boot_us();
            for _ in 0..8 {
                let until = desk.since_boot_us() + 40_000;
                while desk.since_boot_us() < until {
                    hold(&mut desk, on);
                    desk.wait(off);
                }
                desk.expect_ok(Request::KeepAlive);
            }
            let held = desk.since_boot_us();
            hold(&mut desk, 90_000);
            let released = desk.since_boot_us();
            desk.expect_ok(Request::KeepAlive);
            desk.wait(50_000);
            let seen = phases(&desk, 0, from);
            let widths: BTreeSet<u64> = seen.iter().map(|p| p.1 - p.0).collect();
            assert_eq!(widths, BTreeSet::from([200]), "{on}/{off}");
            let seen = starts(&seen);
            let closest = seen.windows(2).map(|p| p[1] - p[0]).min();
            assert!(closest.unwrap() >= period, "{on}/{off}: {closest:?} µs");
            assert!(seen.iter().all(|t| *t < released + 1_250), "{on}/{off}");
            let last = seen.iter().filter(|t| **t >= held + 1_000).count() as u64;
            // One period may have to end first.
            let expected = if train.repeats == 0 {
                90_000 / period
            } else {
                2
            };
            assert!(
                (expected - 1..=expected + 1).contains(&last),
                "{on}/{off}: {last} of {expected}"
            );
        }
    }
}

/// Members of an isolated group begin together, and only when all of them may.
#[test]
fn isolated_partners_stay_apart_whatever_the_gate() {
    for (on, off) in [(900, 300), (7_300, 900), (21_000, 400), (33_000, 13_000)] {
        let train = |offset_us| gated_channel(TrainSpec { offset_us, ..PLAIN });
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &[train(0), train(10_000)]);
        desk.expect_ok(group(0b11, Partner::Isolated));
        desk.start();
        desk.expect_ok(equal_amplitudes(2, 10_000));
        let from = desk.since_boot_us();
        for _ in 0..30 {
            hold(&mut desk, on);
            desk.wait(off);
            desk.expect_ok(Request::KeepAlive);
        }
        let [first, second] = [0, 1].map(|channel| starts(&phases(&desk, channel, from)));
        assert!(!first.is_empty(), "{on}/{off}");
        for at in &first {
            let near = second.iter().map(|other| other.abs_diff(*at)).min();
            assert!(
                near.is_none_or(|near| near >= 10_000),
                "{on}/{off}: {near:?}"
            );
        }
    }
}
