//! Rules for the pins, judged from the outputs alone.

use crate::device_desk::*;
use firmware::link::{Code, Event, Request};
use firmware::pulse::{Partner, State as Line, TrainSpec, Trigger};
use firmware::safety::{ChannelSpec, Fault, State, StopCause, WearerSpec};
use firmware::units::Micros;

pub const BOOT: Micros = Micros::new(u32::MAX - 3_000_000);

/// Returns trains that make isolation difficult: bursts, long groundings, isolated partners.
fn scene(kind: usize) -> (Vec<ChannelSpec>, Option<Request>) {
    let group = |partner| Some(group(0b11, partner));
    let biphasic = TrainSpec {
        width_us: 500,
        gap_us: 200,
        period_us: 5_000,
        ..PLAIN
    };
    let burst = TrainSpec {
        width_us: 60,
        gap_us: 50,
        period_us: 5_003,
        burst_count: 8,
        burst_interval_us: 200,
        ..PLAIN
    };
    let long_ground = TrainSpec {
        width_us: 500,
        ground_us: 3_800,
        period_us: 5_000,
        ..MONO
    };
    let later = TrainSpec {
        offset_us: 900,
        period_us: 10_000,
        ..MONO
    };
    let earlier = TrainSpec {
        period_us: 10_000,
        ..MONO
    };
    match kind {
        0 => (vec![channel(biphasic); 2], None),
        1 => (
            vec![channel(burst), channel(biphasic)],
            group(Partner::Conducted),
        ),
        2 => (vec![channel(long_ground), channel(biphasic)], None),
        _ => (
            vec![channel(earlier), channel(later)],
            group(Partner::Isolated),
        ),
    }
}

/// Stimulates with 20 mA on the channels of test fixture `kind`.
pub fn running(kind: usize, wearer: WearerSpec, boot: Micros) -> TestHost {
    let (specs, group) = scene(kind); // 20 mA rms are within every limit
    let mut desk = TestHost::open(boot);
    desk.prepare(wearer, &specs);
    desk.expect_all_ok(group);
    desk.start();
    desk.expect_ok(equal_amplitudes(specs.len(), 20_000));
    desk
}

#[test]
fn silence_isolates_within_timeout_and_fall_for_every_timeout() {
    let mut cases = 0;
    let mut latest = 0;
    for host_timeout_ms in 20..=1000u16 {
        let kind = usize::from(host_timeout_ms) % 4;
        for fall_ms in [5, 7 + host_timeout_ms % 90, 100] {
            let wearer = WearerSpec {
                rise_ms: 1,
                fall_ms,
                host_timeout_ms,
                ..WearerSpec::default()
            };
            // Any phase relative to the windows, across the clock's wrap.
            let boot = Micros::new(u32::MAX - 200_000 - 37 * u32::from(host_timeout_ms));
            let mut desk = running(kind, wearer, boot);
            desk.wait(7_000 + u32::from(host_timeout_ms) * 13 % 5_000);
            desk.send(Request::KeepAlive);
            // `send` returns once the frame is processed, 40 µs after its arrival.
            let heard = desk.since_boot_us() - 40;
            let bound = u64::from(host_timeout_ms + fall_ms) * 1000;
            desk.wait(u32::from(host_timeout_ms + fall_ms) * 1000 + 60_000);
            let isolated = desk.isolated_since().expect("isolated");
            assert!(
                isolated <= heard + bound,
                "scene {kind}, timeout {host_timeout_ms}, fall {fall_ms}: {} µs late",
                isolated - heard - bound
            );
            latest = latest.max(isolated + 1_000_000 - heard - bound);
            assert_eq!(desk.state(), State::Idle);
            cases += 1;
        }
    }
    println!(
        "{cases} cases; latest edge {} µs before the bound",
        1_000_000 - latest
    );
}

#[test]
fn starting_and_falling_silent_isolates_as_soon() {
    for delay in (0..1_000).step_by(37) {
        let wearer = WearerSpec {
            fall_ms: 5,
            host_timeout_ms: 20,
            ..wearer()
        };
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer, &scene(0).0);
        desk.expect_ok(ARM);
        desk.expect_ok(equal_amplitudes(2, 20_000));
        desk.wait(delay);
        desk.send(Request::Start);
        let heard = desk.since_boot_us() - 40;
        desk.wait(100_000);
        let isolated = desk.isolated_since().unwrap();
        assert!(isolated <= heard + 25_000, "{}", isolated - heard);
    }
}

#[test]
fn a_grounding_that_would_outlast_the_fall_is_refused() {
    let mut desk = TestHost::open(BOOT);
    let wearer = WearerSpec {
        fall_ms: 5,
        ..wearer()
    };
    desk.expect_ok(Request::Wearer(wearer));
    let spec = channel(TrainSpec {
        ground_us: 3_801,
        ..MONO
    });
    let refused = desk.expect_refusal(Request::Channel { channel: 0, spec });
    assert_eq!(refused, refusal(Code::OutOfRange, "ground_us"));
}

/// Nothing is driven after the last pulse of the stop, at any phase.
#[test]
fn the_hand_stop_ends_pulses_at_once_even_during_a_fall() {
    for delay in (0..6_000u32).step_by(90) {
        for falling in [false, true] {
            let wearer = WearerSpec {
                fall_ms: 100,
                ..wearer()
            };
            let mut desk = running(1, wearer, BOOT);
            desk.wait(12_000 + delay);
            if falling {
                desk.expect_ok(Request::Stop);
            }
            desk.wait(1_000);
            desk.sensors.hand_stop = false;
            let opened = desk.since_boot_us();
            desk.wait(150_000);
            // Two windows are rendered already; pulses that they began end within 2 ms.
            let isolated = desk.isolated_since().unwrap();
            assert!(
                isolated <= opened + 500 + 1_200,
                "{delay} {falling}: {}",
                isolated - opened
            );
            assert_eq!(desk.state(), State::Idle);
            for c in 0..2 {
                let net: i64 = line_intervals(&desk.record.levels, c, 0)
                    .iter()
                    .map(|s| match s.1 {
                        Line::Anodic => (s.2 - s.0).cast_signed(),
                        Line::Cathodic => -(s.2 - s.0).cast_signed(),
                        _ => 0,
                    })
                    .sum();
                assert_eq!(net, 0);
            }
        }
    }
}

#[test]
fn a_hand_stop_taken_up_later_works_too() {
    let mut desk = TestHost::open(BOOT);
    desk.sensors.hand_stop = false;
    desk.run(wearer(), &[channel(PLAIN)], 10_000);
    desk.sensors.hand_stop = true;
    desk.wait(5_000);
    desk.sensors.hand_stop = false;
    desk.wait(10_000);
    assert_eq!(desk.state(), State::Idle);
}

/// Stimulates on two channels at 200 Hz, the second `offset_us` after the first, and disconnects
/// the second electrode.
fn electrode_off(offset_us: u32) -> TestHost {
    let train = |offset_us| TrainSpec {
        offset_us,
        period_us: 5_000,
        ..PLAIN
    };
    let mut desk = TestHost::open(BOOT);
    let channels = [channel(train(0)), channel(train(offset_us))];
    desk.run(wearer(), &channels, 15_000);
    desk.wait(20_000);
    desk.sensors.load_ohm[0] = u32::MAX;
    desk.wait(45_000);
    desk
}

#[test]
fn an_electrode_that_comes_off_while_stimulating_is_a_fault() {
    let mut desk = electrode_off(2_500);
    assert_eq!(desk.fault(), Some(Fault::ElectrodeOff));
    assert_eq!(desk.state(), State::Fault);
}

/// One current sense serves all stages, so overlapping currents cannot be told apart
/// (docs/reference/hardware.md, open points).
#[test]
fn channels_that_always_overlap_are_not_judged() {
    let mut desk = electrode_off(0);
    assert_eq!(desk.fault(), None);
    assert_eq!(desk.state(), State::Stimulating);
}

fn triggered(period_us: u32, offset_us: u32) -> ChannelSpec {
    without_rise(TrainSpec {
        trigger: Some(Trigger::Start),
        repeats: 1,
        period_us,
        offset_us,
        ..PLAIN
    })
}

/// Advances by `us`, with a trigger edge at the very end.
fn trigger_after(desk: &mut TestHost, us: u32) {
    desk.wait(us - 1);
    desk.sensors.trigger = Some(desk.now());
    desk.wait(1);
    desk.sensors.trigger = None;
}

#[test]
fn no_trigger_rate_passes_the_period() {
    for every in [700, 1_300, 2_501, 4_999, 5_000, 5_001, 9_000] {
        let mut desk = TestHost::open(BOOT);
        desk.run(wearer(), &[triggered(5_000, 0)], 10_000);
        for i in 0..100 {
            trigger_after(&mut desk, every);
            if i % 10 == 0 {
                desk.send(Request::KeepAlive);
            }
        }
        desk.wait(2_000);
        let starts: Vec<u64> = driven_starts(&desk.record.levels, 0)
            .into_iter()
            .skip(CHECK_PHASES)
            .step_by(2)
            .collect();
        assert!(starts.len() > 10, "{every}: {}", starts.len());
        let fastest = starts.windows(2).map(|p| p[1] - p[0]).min().unwrap();
        assert!(fastest >= 5_000, "triggers every {every}: {fastest} µs");
        if every >= 5_000 {
            assert_eq!(starts.len(), 100, "{every}");
        }
    }
}

#[test]
fn a_kept_trigger_is_seen_once_and_starts_after_exactly_a_millisecond() {
    for phase in 0..250 {
        let mut desk = TestHost::open(BOOT);
        desk.run(wearer(), &[triggered(5_000, 0)], 10_000);
        desk.wait(5_000 + phase);
        let at = desk.now();
        let t = desk.since_boot_us();
        desk.sensors.trigger = Some(at);
        for _ in 0..20 {
            desk.wait(1_000);
        }
        assert_eq!(desk.state(), State::Stimulating);
        let starts = driven_starts(&desk.record.levels, 0);
        assert_eq!(starts[CHECK_PHASES..].to_vec(), [t + 1_000, t + 1_300]);
    }
}

/// Edges start and end a toggled train: bursts lie between 1000 µs after each odd edge and 1000 µs
/// after the following even edge, at every phase of the end.
#[test]
fn a_toggled_train_plays_from_edge_to_edge() {
    let spec = channel(TrainSpec {
        trigger: Some(Trigger::Toggle),
        period_us: 10_000,
        ..PLAIN
    });
    for length in (25_000..36_000).step_by(500).chain([30_000 - 1, 30_001]) {
        let mut desk = TestHost::open(BOOT);
        desk.run(wearer(), &[spec], 10_000);
        let mut expected = Vec::new();
        for _ in 0..3 {
            trigger_after(&mut desk, 5_000);
            let on = desk.since_boot_us() - 1 + 1_000;
            desk.expect_ok(Request::KeepAlive);
            let since = desk.since_boot_us() - (on - 1_000);
            trigger_after(&mut desk, length - since as u32 + 1);
            let off = on + u64::from(length);
            expected.extend((on..off).step_by(10_000));
            desk.expect_ok(Request::KeepAlive);
            // Its last period has to be over.
            desk.wait(12_000);
        }
        let starts = driven_starts(&desk.record.levels, 0).into_iter();
        let starts: Vec<u64> = starts.skip(CHECK_PHASES).step_by(2).collect();
        assert_eq!(starts, expected, "{length} µs");
        assert_eq!(desk.state(), State::Stimulating);
    }
}

#[test]
fn isolated_partners_stay_apart_whatever_the_triggers() {
    for every in (900..14_000).step_by(410) {
        let mut desk = TestHost::open(BOOT);
        let specs = [triggered(20_000, 0), triggered(20_000, 10_000)];
        desk.prepare(wearer(), &specs);
        desk.expect_ok(group(0b11, Partner::Isolated));
        desk.start();
        desk.expect_ok(equal_amplitudes(2, 10_000));
        for i in 0..60 {
            trigger_after(&mut desk, every);
            if i % 4 == 0 {
                desk.send(Request::KeepAlive);
            }
        }
        let overlap = desk.record.levels.iter().find(|(_, l)| {
            let is_driven = |c| matches!(l.state(c), Line::Anodic | Line::Cathodic);
            is_driven(0) && is_driven(1)
        });
        assert_eq!(overlap, None, "triggers every {every}");
        assert!(driven_starts(&desk.record.levels, 1).len() > 4);
    }
}

/// A toggled train waits so long that the clock returns to the time of its last burst; it rises
/// again from zero.
#[test]
fn a_train_that_waits_longer_than_the_clock_rises_anew() {
    let mut desk = TestHost::open(BOOT);
    let slow = WearerSpec {
        host_timeout_ms: 1_000,
        rise_ms: 100,
        ..wearer()
    };
    let toggled = channel(TrainSpec {
        trigger: Some(Trigger::Toggle),
        ..PLAIN
    });
    desk.run(slow, &[toggled], 10_000);
    trigger_after(&mut desk, 20_000);
    desk.wait(300_000);
    trigger_after(&mut desk, 20_000);
    desk.wait(100_000);
    let codes = |desk: &TestHost| desk.record.dac.iter().map(|d| d.2).collect::<Vec<_>>();
    let risen = *codes(&desk).last().unwrap();
    assert!(risen > 6_000);
    let last = desk.record.dac.last().unwrap().0;
    // One second before the clock would make the last burst look recent.
    while desk.since_boot_us() < last + (1 << 32) - 500_000 {
        desk.wait(400_000);
        desk.send(Request::KeepAlive);
    }
    let left = last + (1 << 32) + 20_000 - desk.since_boot_us();
    let played = desk.record.dac.len();
    trigger_after(&mut desk, left as u32);
    desk.wait(20_000);
    let first = codes(&desk)[played];
    assert!(
        first.abs_diff(risen / 6) <= 1,
        "a period of 20 ms in a rise of 100: {first}"
    );
    desk.wait(200_000);
    assert_eq!(codes(&desk).last(), Some(&risen));
}

#[test]
fn a_normal_stop_stays_one_when_the_host_stops_measuring_with_it() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(
        WearerSpec {
            fall_ms: 100,
            ..wearer()
        },
        &[channel(PLAIN); 2],
    );
    desk.expect_ok(joint(0, 1, 2_000, 10_000));
    desk.expect_ok(ARM);
    let stream = |desk: &mut TestHost| {
        for _ in 0..30 {
            desk.expect_ok(angle(4_000));
            desk.measure(3_000);
            desk.wait(10_000);
        }
    };
    // Streaming may begin before the start, for as long as arming lasts.
    stream(&mut desk);
    desk.expect_ok(Request::Start);
    stream(&mut desk);
    assert!(driven_starts(&desk.record.levels, 0).len() > 10);
    desk.expect_ok(Request::Stop);
    desk.wait(200_000);
    assert!(has_event(
        &desk.take_messages(),
        Event::Stopped(StopCause::Request)
    ));
    // During stimulation, the same silence of the sensor is a fault.
    desk.expect_ok(ARM);
    desk.measure(3_000);
    desk.expect_ok(Request::Start);
    desk.keep_alive(10, 10_000);
    assert_eq!(desk.fault(), Some(Fault::SensorStale));
}

/// A flood of accepted setpoints must not delay a fault.
#[test]
fn every_request_of_a_flood_is_answered() {
    let mut desk = running(0, wearer(), BOOT);
    desk.take_messages();
    let at = desk.now();
    desk.write((0..100).map(|i| match i % 3 {
        0 => equal_amplitudes(2, 100),
        1 => Request::Measurement {
            joint: 0,
            centideg: 0,
            at,
        },
        _ => Request::Status,
    }));
    desk.wait(5_000);
    let answers = desk
        .take_messages()
        .iter()
        .filter(|h| {
            matches!(
                h,
                OwnedResponse::Ack(..) | OwnedResponse::Refused(..) | OwnedResponse::Status(..)
            )
        })
        .count();
    assert_eq!(answers, 100);
}
