//! Timed amplitude orders at the pins.

use crate::device_desk::*;
use firmware::link::{Code, Decoder, Event, Request, Response};
use firmware::pulse::{TrainSpec, WINDOW_US};
use firmware::safety::{MAX_TIMED, State, StopCause, WearerSpec, limits};
use firmware::units::{Amplitude, Micros, us};
use proptest::prelude::*;

const WINDOW: u64 = WINDOW_US as u64;
const PERIOD: u64 = PLAIN.period_us as u64;

/// Boot time; the clock wraps a tenth of a second later, between an order and its time.
const BOOT: Micros = Micros::new(u32::MAX - 100_000);

/// Amplitude before the timed order.
const LOW_UA: u32 = 5_000;

fn timed(at: Micros, ua: u32) -> Request {
    Request::Amplitudes {
        at: Some(at),
        mask: 1,
        values: [Amplitude::new(ua)].into_iter().collect(),
        widths: heapless::Vec::new(),
    }
}

fn code(ua: u32) -> u16 {
    (u64::from(ua) * 65_535 / 100_000) as u16
}

/// Returns a device that stimulates one channel with [`LOW_UA`] after its rise.
fn running(wearer: WearerSpec) -> TestHost {
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer, &[channel(PLAIN)], LOW_UA);
    desk.wait(45_000);
    desk
}

/// Returns the start, µs since boot, and code of each burst of the first channel since `from`.
fn bursts(desk: &TestHost, from: u64) -> Vec<(u64, u16)> {
    let phases = driven_starts(&desk.record.levels, 0);
    let behind = |begin: u64| {
        let writes = desk.record.dac.iter().filter(|write| write.1 == 0);
        let last = writes.take_while(|write| write.0 < begin).last();
        last.map_or(0, |write| write.2)
    };
    let begins = phases.into_iter().skip(CHECK_PHASES).step_by(2);
    let begins = begins.filter(|begin| *begin >= from);
    begins.map(|begin| (begin, behind(begin))).collect()
}

/// Converts `t`, µs since boot, into device time.
fn device_time(t: u64) -> Micros {
    BOOT + us(t as u32)
}

/// Returns the start of the next burst, µs since boot.
fn next_burst(desk: &mut TestHost) -> u64 {
    let now = desk.since_boot_us();
    let last = bursts(desk, 0).last().expect("it stimulates").0;
    last + (now - last).next_multiple_of(PERIOD)
}

/// Waits `length_us` while the host sends keep-alives.
pub fn wait_alive(desk: &mut TestHost, length_us: u64) {
    let end = desk.since_boot_us() + length_us;
    while desk.since_boot_us() < end {
        desk.send(Request::KeepAlive);
        let left = end.saturating_sub(desk.since_boot_us()); // processing takes time
        desk.wait(left.min(20_000) as u32);
    }
}

/// Returns the numbers of the refused requests, with their codes.
fn refusals(desk: &mut TestHost) -> Vec<(Option<u16>, Code)> {
    let refusal = |heard| match heard {
        OwnedResponse::Refused(seq, code, _) => Some((seq, code)),
        _ => None,
    };
    desk.take_messages()
        .into_iter()
        .filter_map(refusal)
        .collect()
}

/// Returns the allowed range in the latest refusal.
fn refusal_range(desk: &TestHost) -> (i32, i32) {
    let (mut decoder, mut range) = (Decoder::default(), None);
    for &byte in &desk.record.bytes {
        if let Some(message) = decoder.push(byte) {
            if let Ok(Response::Refused { refusal, .. }) = postcard::from_bytes(message.unwrap()) {
                range = Some((refusal.min, refusal.max));
            }
            decoder.clear();
        }
    }
    range.expect("a refusal")
}

/// An order takes effect in the window that contains its time: for a burst in that window, wherever
/// in the window both lie, and not for a burst in the window before.
#[test]
fn an_order_takes_effect_in_the_window_that_contains_its_time() {
    // The third puts the order after the burst's window, the last long before it.
    for (after, is_in_time) in [(0, true), (249, true), (250, false), (-1, true)] {
        for shift in [0, 1, 137] {
            let mut desk = TestHost::open(BOOT);
            desk.wait(shift);
            desk.run(wearer(), &[channel(PLAIN)], LOW_UA);
            desk.wait(45_000);
            let burst = next_burst(&mut desk) + 2 * PERIOD;
            let window = burst / WINDOW * WINDOW;
            let at = device_time(window.wrapping_add_signed(after));
            assert_eq!(desk.answer(timed(at, 10_000)), Ok(()));
            wait_alive(&mut desk, 5 * PERIOD);
            let codes: Vec<_> = bursts(&desk, burst - PERIOD).into_iter().take(3).collect();
            let there = if is_in_time { 10_000 } else { LOW_UA };
            let expected = [LOW_UA, there, 10_000].map(code);
            assert_eq!(codes[1].0, burst);
            assert_eq!(
                codes.iter().map(|code| code.1).collect::<Vec<_>>(),
                expected,
                "{after} {shift}"
            );
        }
    }
}

/// As many orders as may wait, one for each burst, are carried out in order across the clock's
/// wrap; one more is refused until the first is due.
#[test]
fn orders_are_carried_out_in_turn_and_no_more_wait_than_may() {
    let mut desk = running(wearer());
    let first = next_burst(&mut desk) + 5 * PERIOD;
    let due = |n: usize| device_time(first + n as u64 * PERIOD);
    let ua = |n: usize| 1_000 + 1_000 * n as u32;
    for n in 0..MAX_TIMED {
        desk.expect_ok(timed(due(n), ua(n)));
    }
    let more = timed(due(MAX_TIMED), 500);
    assert_eq!(
        desk.expect_refusal(more.clone()),
        refusal(Code::TooManyWaiting, "at")
    );
    let wait = first - desk.since_boot_us() + 1_000;
    wait_alive(&mut desk, wait);
    assert_eq!(desk.answer(more), Ok(()));
    wait_alive(&mut desk, (MAX_TIMED as u64 + 2) * PERIOD);
    let codes = bursts(&desk, first).into_iter().map(|burst| burst.1);
    let expected = (0..MAX_TIMED).map(ua).chain([500, 500]).map(code);
    assert_eq!(
        codes.take(MAX_TIMED + 2).collect::<Vec<_>>(),
        expected.collect::<Vec<_>>()
    );
    assert!(
        device_time(first).get() < BOOT.get(),
        "the clock wraps before"
    );
}

/// An order may lie one second after the start of the window that receives it, and not a
/// microsecond later.
#[test]
fn a_time_may_be_a_second_ahead() {
    for late_us in [0, 1] {
        let mut desk = running(wearer());
        // The first answer gives the phase of the window, so that the second order can come at the
        // same phase.
        let heard = desk.exchange(Request::KeepAlive);
        let sent = desk.now() - us(2_000);
        let Some(OwnedResponse::Ack(_, start)) = heard.last() else {
            panic!("{heard:?}");
        };
        let start = desk.now() + us((*start - sent).us().cast_unsigned());
        let at = start + us(limits::AHEAD_US + late_us);
        let expected = if late_us == 0 {
            Ok(())
        } else {
            Err(refusal(Code::TooFarAhead, "at"))
        };
        assert_eq!(desk.answer(timed(at, 10_000)), expected);
    }
}

/// An order due in the window that receives it, or earlier, is carried out at once. If it was due
/// earlier, it is counted each time.
#[test]
fn a_late_order_is_carried_out_at_once_and_counted() {
    let half = 1_u32 << 31;
    let mut desk = running(wearer());
    let mut counted = 0;
    for (ahead_us, is_late) in [
        (0_i64, false),
        (-1, true),
        (249, false),
        (-2_000_000, true),
        (-i64::from(half) + 1_000, true),
    ] {
        let heard = desk.exchange(Request::KeepAlive);
        let sent = desk.now() - us(2_000);
        let Some(OwnedResponse::Ack(_, start)) = heard.last() else {
            panic!("{heard:?}");
        };
        let start = desk.now() + us((*start - sent).us().cast_unsigned());
        let at = Micros::new(start.get().wrapping_add(ahead_us as u32));
        counted += u32::from(is_late);
        let ua = 6_000 + 1_000 * counted;
        let from = desk.since_boot_us();
        desk.expect_ok(timed(at, ua));
        wait_alive(&mut desk, 2 * PERIOD);
        assert_eq!(bursts(&desk, from + 500)[0].1, code(ua), "{ahead_us}");
        assert_eq!(desk.status().counters.late_setpoints, counted, "{ahead_us}");
    }
    // A refused order is not carried out.
    let past = desk.now() - us(1_000);
    assert_eq!(
        desk.refusal_code(timed(past, 20_001)),
        Some(Code::AboveWearerLimit)
    );
    assert_eq!(desk.status().counters.late_setpoints, counted);
}

/// Orders must be at least a window apart and may not precede a waiting order; an order without a
/// time, or with a past time, does not wait for its turn.
#[test]
fn times_never_go_back() {
    let mut desk = running(wearer());
    let latest = desk.now() + us(500_000);
    desk.expect_ok(timed(latest, 8_000));
    for before in [-100_000_i32, 0, 249] {
        let at = Micros::new(latest.get().wrapping_add_signed(before));
        assert_eq!(
            desk.expect_refusal(timed(at, 9_000)),
            refusal(Code::TimeGoesBack, "at")
        );
        // The refusal gives the soonest allowed time relative to the window that judged it, up to
        // half a millisecond after its arrival.
        let (least, most) = refusal_range(&desk);
        let soonest = (latest + us(WINDOW_US) - desk.now()).us();
        assert!(
            (0..=2_000).contains(&(least - soonest)),
            "{least} {soonest}"
        );
        assert_eq!(most, 1_000_000);
    }
    desk.expect_ok(timed(latest + us(250), 9_000));
    let from = desk.since_boot_us();
    desk.expect_ok(equal_amplitudes(1, 7_000));
    wait_alive(&mut desk, PERIOD);
    assert_eq!(bursts(&desk, from + 500)[0].1, code(7_000));
    let from = desk.since_boot_us();
    desk.expect_ok(timed(desk.now() - us(10), 6_000));
    wait_alive(&mut desk, PERIOD);
    assert_eq!(bursts(&desk, from + 500)[0].1, code(6_000));
    wait_alive(&mut desk, 500_000);
    assert_eq!(
        bursts(&desk, 0).last().map(|burst| burst.1),
        Some(code(9_000))
    );
}

/// An order is checked against the limits on arrival, in the same states as an untimed one.
#[test]
fn it_is_judged_when_it_comes() {
    let mut desk = TestHost::open(BOOT);
    let ahead = |desk: &TestHost, ua| timed(desk.now() + us(100_000), ua);
    let order = ahead(&desk, 1_000);
    assert_eq!(desk.refusal_code(order), Some(Code::NotArmed));
    desk.prepare(wearer(), &[channel(PLAIN)]);
    desk.expect_ok(ARM);
    let order = ahead(&desk, 20_001);
    assert_eq!(desk.refusal_code(order), Some(Code::AboveWearerLimit));
    let order = ahead(&desk, 20_000);
    assert_eq!(desk.refusal_code(order), None); // armed
    desk.expect_ok(Request::Start);
    let order = Request::Amplitudes {
        at: Some(desk.now() + us(200_000)),
        mask: 2,
        values: [Amplitude::new(1)].into_iter().collect(),
        widths: heapless::Vec::new(),
    };
    assert_eq!(desk.refusal_code(order), Some(Code::NoTrain));
    wait_alive(&mut desk, 250_000);
    assert_eq!(
        bursts(&desk, 0).last().map(|burst| burst.1),
        Some(code(20_000))
    );
}

/// Rules that depend on the moment are applied when the order is due: it is acknowledged, and
/// refused then.
#[test]
fn a_step_too_large_is_refused_when_it_is_due() {
    let wearer = WearerSpec {
        max_step_ua: 2_000,
        ..wearer()
    };
    let mut desk = running(wearer);
    let before = desk.status().counters.refused;
    let due = desk.since_boot_us() + 100_000;
    let seq = desk.seq;
    desk.expect_ok(timed(device_time(due), 10_000));
    let wait = due - desk.since_boot_us() - 1_000;
    wait_alive(&mut desk, wait);
    assert_eq!(refusals(&mut desk), []);
    wait_alive(&mut desk, 2_000);
    assert_eq!(refusals(&mut desk), [(Some(seq), Code::TooLargeStep)]);
    wait_alive(&mut desk, 2 * PERIOD);
    assert_eq!(
        bursts(&desk, 0).last().map(|burst| burst.1),
        Some(code(LOW_UA))
    );
    assert_eq!(desk.status().counters.refused, before + 1);
}

/// A waiting order does not count as a keep-alive; its arrival does.
#[test]
fn orders_that_wait_do_not_keep_a_host_alive() {
    let mut desk = running(wearer());
    let from = desk.now();
    for n in 1..=9 {
        desk.send(timed(from + us(n * 90_000), 6_000 + 1_000 * n));
    }
    desk.wait(1_000_000);
    let is_silent = |h: &OwnedResponse| {
        matches!(
            h,
            OwnedResponse::Event(_, Event::Stopping(StopCause::HostSilent))
        )
    };
    let heard = desk.take_messages();
    assert_eq!(heard.iter().filter(|h| is_silent(h)).count(), 1);
    let heard_us = u64::from(wearer().host_timeout_ms) * 1_000;
    let end = bursts(&desk, 0).last().unwrap().0;
    let fall = u64::from(wearer().fall_ms) * 1_000;
    let from = (from - BOOT).us().cast_unsigned().into();
    assert!(end > from && end <= from + heard_us + fall, "{from} {end}");
    // The first was due at 90 ms; the second would have been due at 180 ms.
    assert!(
        bursts(&desk, from)
            .iter()
            .all(|burst| burst.1 <= code(7_000))
    );
}

/// End of stimulation or arming while an order waits.
#[derive(Clone, Copy, Debug)]
enum End {
    Stop,
    Fault,
    Silence,
    HandStop,
    Hello,
    /// Takeover by another host, once the device is at rest.
    Owner,
    /// `Stop` on a device that was armed but not started.
    Disarm,
    /// The trains end by themselves.
    Finished,
}

/// Ends the stimulation; then the device is at rest or, after a `Hello`, unchanged.
fn carry_out(desk: &mut TestHost, end: End) {
    match end {
        End::Stop | End::Disarm => {
            desk.expect_ok(Request::Stop);
            desk.wait(60_000);
        }
        End::Fault => {
            desk.sensors.over_current = true;
            desk.wait(1_000);
            desk.sensors.over_current = false;
            desk.expect_ok(Request::Acknowledge);
            desk.wait(110_000);
        }
        End::Silence => desk.wait(170_000),
        End::HandStop => {
            desk.sensors.hand_stop = false;
            desk.wait(60_000);
            desk.sensors.hand_stop = true;
        }
        End::Hello => {
            desk.hello();
        }
        End::Owner => {
            desk.wait(170_000);
            desk.session = desk.session.wrapping_add(17);
            desk.hello();
        }
        End::Finished => wait_alive(desk, 100_000),
    }
}

/// After any end no waiting order plays, also not in the next session, and none is reported.
#[test]
fn nothing_that_waits_survives_an_end() {
    use End::{Disarm, Fault, Finished, HandStop, Hello, Owner, Silence, Stop};
    for end in [
        Stop, Fault, Silence, HandStop, Hello, Owner, Disarm, Finished,
    ] {
        let train = TrainSpec {
            repeats: if let Finished = end { 7 } else { 0 },
            ..PLAIN
        };
        let mut desk = TestHost::open(BOOT);
        desk.sensors.hand_stop = true;
        desk.prepare(wearer(), &[without_rise(train)]);
        desk.expect_ok(ARM);
        if !matches!(end, Disarm) {
            desk.expect_all_ok([Request::Start, equal_amplitudes(1, LOW_UA)]);
            wait_alive(&mut desk, 3 * PERIOD);
        }
        // One order would be due during a fall, the others after the next start.
        let now = desk.now();
        for ahead_us in [25_000, 900_000, 950_000] {
            desk.expect_ok(timed(now + us(ahead_us), 15_000));
        }
        let from = desk.since_boot_us();
        desk.take_messages();
        carry_out(&mut desk, end);
        assert_eq!(refusals(&mut desk), [], "{end:?}");
        let is_due = desk.since_boot_us() - from > 25_000;
        if !matches!(end, Hello) {
            assert_eq!(desk.state(), State::Idle, "{end:?}");
            desk.prepare(wearer(), &[channel(PLAIN)]);
            desk.expect_all_ok([ARM, Request::Start, equal_amplitudes(1, LOW_UA)]);
        }
        assert!(
            desk.since_boot_us() - from < 900_000,
            "{end:?}: it is due behind the start"
        );
        let heard = desk.take_messages().len();
        assert!(heard < 30 && (is_due || matches!(end, Hello)), "{end:?}");
        wait_alive(&mut desk, 1_000_000);
        assert_eq!(refusals(&mut desk), [], "{end:?}");
        let is_first_due = matches!(end, Silence | Owner | Finished);
        let high = bursts(&desk, from + if is_first_due { 180_000 } else { 0 });
        assert!(
            high.len() > 10 && high.iter().all(|high| high.1 <= code(LOW_UA)),
            "{end:?}"
        );
    }
}

/// Without an end, the waiting orders play.
#[test]
fn what_waits_plays_without_an_end() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN)]);
    desk.expect_ok(ARM);
    let now = desk.now();
    desk.expect_ok(timed(now + us(900_000), 15_000)); // armed, and started before the order is due
    desk.expect_all_ok([Request::Start, equal_amplitudes(1, LOW_UA)]);
    wait_alive(&mut desk, 1_000_000);
    let codes: Vec<u16> = bursts(&desk, 0).into_iter().map(|burst| burst.1).collect();
    assert!(codes.contains(&code(LOW_UA)) && codes.last() == Some(&code(15_000)));
}

/// Next action of a host or wearer.
#[derive(Clone, Copy, Debug)]
enum Move {
    /// Order this far ahead, µs.
    Ahead(u32),
    Wait(u32),
    Stop,
    HandStop,
    OverCurrent,
    Hello,
    /// Acknowledges faults, arms and starts.
    Start,
}

fn moves() -> impl Strategy<Value = Vec<Move>> {
    let strategy = prop_oneof![
        6 => (0_u32..1_000_000).prop_map(Move::Ahead),
        6 => (1_000_u32..300_000).prop_map(Move::Wait),
        1 => Just(Move::Stop),
        1 => Just(Move::HandStop),
        1 => Just(Move::OverCurrent),
        1 => Just(Move::Hello),
        3 => Just(Move::Start),
    ];
    proptest::collection::vec(strategy, 1..40)
}

/// Plays `moves`; each order has its own amplitude. Returns the number of bursts with the amplitude
/// of an order.
fn play(moves: &[Move]) -> Result<usize, TestCaseError> {
    let mut desk = TestHost::open(BOOT);
    desk.sensors.hand_stop = true;
    desk.prepare(wearer(), &[channel(PLAIN)]);
    // For each order: the earliest and latest time at which it may play, and its code.
    let mut orders: Vec<(u64, u64, u16)> = Vec::new();
    // `grace` covers the two rendered windows or, after a stop, the fall.
    let end = |desk: &mut TestHost, orders: &mut Vec<(u64, u64, u16)>, grace: u64| {
        let now = desk.since_boot_us();
        for order in orders {
            order.1 = order.1.min(now + grace);
        }
    };
    for (n, item) in moves.iter().enumerate() {
        let was = desk.state();
        match *item {
            Move::Ahead(ahead_us) => {
                let ua = LOW_UA + 100 * (1 + n as u32);
                let due = desk.since_boot_us() + u64::from(ahead_us);
                let at = device_time(due);
                if desk.answer(timed(at, ua)).is_ok() {
                    orders.push((due.saturating_sub(WINDOW), u64::MAX, code(ua)));
                }
            }
            Move::Wait(us) => wait_alive(&mut desk, us.into()),
            Move::Stop => {
                desk.expect_ok(Request::Stop);
                end(&mut desk, &mut orders, 60_000);
            }
            Move::HandStop => {
                desk.sensors.hand_stop = false;
                desk.wait(2_000);
                end(&mut desk, &mut orders, 1_000);
                desk.sensors.hand_stop = true;
            }
            Move::OverCurrent => {
                desk.sensors.over_current = true;
                desk.wait(1_000);
                desk.sensors.over_current = false;
                end(&mut desk, &mut orders, 0);
            }
            Move::Hello => {
                // Orders already carried out remain in force; waiting orders do not.
                let now = desk.since_boot_us();
                desk.hello();
                orders.retain(|order| order.0 <= now + 2 * WINDOW);
                desk.prepare(wearer(), &[]);
                desk.refusal_code(Request::Channel {
                    channel: 0,
                    spec: channel(PLAIN),
                });
            }
            Move::Start => {
                desk.refusal_code(Request::Acknowledge);
                wait_alive(&mut desk, 120_000);
                if desk.refusal_code(ARM).is_none() {
                    end(&mut desk, &mut orders, 0);
                    desk.expect_all_ok([Request::Start, equal_amplitudes(1, LOW_UA)]);
                }
            }
        }
        let is_dead = matches!(desk.state(), State::Idle | State::Fault);
        if is_dead && !matches!(was, State::Idle | State::Fault) {
            end(&mut desk, &mut orders, 60_000);
        }
    }
    wait_alive(&mut desk, 1_000_000);
    let mut played = 0;
    for (begin, played_code) in bursts(&desk, 0) {
        let is_low = played_code <= code(LOW_UA);
        let is_ordered = orders.iter().any(|&(from, to, code)| {
            // A fall lowers the code.
            played_code <= code && (from..=to).contains(&begin)
        });
        prop_assert!(is_low || is_ordered, "{played_code} at {begin}: {orders:?}");
        played += usize::from(!is_low);
    }
    Ok(played)
}

/// P212: for any host and wearer, no timed order plays before the window of its time, and none
/// after the end of the stimulation or arming in which it came.
#[test]
fn no_timed_order_plays_out_of_its_time_or_session() {
    let played = std::cell::Cell::new(0);
    let config = ProptestConfig {
        cases: 150,
        ..ProptestConfig::default()
    };
    let result = proptest::test_runner::TestRunner::new(config).run(&moves(), |moves| {
        played.set(played.get() + play(&moves)?);
        Ok(())
    });
    if let Err(e) = result {
        panic!("{e}");
    }
    assert!(
        played.get() > 500,
        "the attack is too weak: {}",
        played.get()
    );
}
