//! Reported edges of sync and trigger, compared with the pins.

use crate::device_desk::*;
use crate::device_timed::wait_alive;
use firmware::link::{Event, Request};
use firmware::pulse::{Levels, TrainSpec, Trigger, WINDOW_US};
use firmware::units::Micros;

/// Boot time; the clock wraps a tenth of a second later.
const BOOT: Micros = Micros::new(u32::MAX - 100_000);

/// Returns the rising edges of the sync output, µs since boot.
fn sync_edges(desk: &TestHost) -> Vec<u64> {
    let mut last = false;
    let rises = desk.record.levels.iter().filter(|(_, levels)| {
        let is = levels.0 & Levels::SYNC != 0;
        std::mem::replace(&mut last, is) != is && is
    });
    rises.map(|(t, _)| *t).collect()
}

/// Returns the times of `event`, µs since boot.
fn event_times(desk: &TestHost, event: Event) -> Vec<u64> {
    let at = |heard| match heard {
        OwnedResponse::Event(at, e) if e == event => Some((at - BOOT).us().cast_unsigned().into()),
        _ => None,
    };
    decode(&desk.record.bytes)
        .into_iter()
        .filter_map(at)
        .collect()
}

/// Every leading edge of sync is reported, including those of the fall and excluding those of the
/// electrode check; of several in one window, only the first.
#[test]
fn leading_edges_of_sync_are_told_with_their_time() {
    let doublet = TrainSpec {
        burst_count: 3,
        burst_interval_us: 1_001,
        ..PLAIN
    };
    let near = TrainSpec {
        gap_us: 5,
        width_us: 50,
        burst_count: 2,
        burst_interval_us: 200,
        ..PLAIN
    };
    for train in [PLAIN, doublet, near] {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &[channel(PLAIN), channel(train)]);
        desk.expect_ok(Request::Sync { channel: Some(1) });
        desk.start();
        desk.expect_ok(equal_amplitudes(2, 10_000));
        wait_alive(&mut desk, 200_000);
        desk.expect_ok(Request::Stop);
        desk.wait(100_000);
        let mut edges = sync_edges(&desk);
        assert!(edges.len() > 10);
        edges.dedup_by_key(|edge| *edge / u64::from(WINDOW_US));
        assert_eq!(event_times(&desk, Event::SyncEdge), edges, "{train:?}");
        assert!(event_times(&desk, Event::TriggerEdge).is_empty());
    }
}

/// Every edge is reported during stimulation, with or without a train that waits for it.
#[test]
fn edges_of_the_trigger_are_told_while_stimulating() {
    let once = without_rise(TrainSpec {
        trigger: Some(Trigger::Start),
        repeats: 1,
        ..PLAIN
    });
    let mut desk = TestHost::open(BOOT);
    let edge = |desk: &mut TestHost| {
        let t = desk.since_boot_us();
        desk.sensors.trigger = Some(desk.now());
        desk.wait(1_000);
        desk.sensors.trigger = None;
        t
    };
    desk.prepare(wearer(), &[once]);
    edge(&mut desk);
    desk.start();
    desk.expect_ok(equal_amplitudes(1, 10_000));
    let mut edges = Vec::new();
    for wait_us in [3_001, 60_017, 30_113] {
        edges.push(edge(&mut desk)); // the second edge comes before the train's period is over
        wait_alive(&mut desk, wait_us);
    }
    desk.expect_ok(Request::Stop);
    desk.wait(100_000);
    edge(&mut desk);
    assert_eq!(event_times(&desk, Event::TriggerEdge), edges);
    assert!(event_times(&desk, Event::SyncEdge).is_empty());
    assert_eq!(desk.status().counters.idle_triggers, 3);
}
