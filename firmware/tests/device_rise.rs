//! Limits on the rise of amplitude and charge, at the pins, for any orders of a host and any
//! triggers.

use crate::device_desk::*;
use crate::device_widths::phases;
use firmware::link::{Code, Request};
use firmware::pulse::{TrainSpec, Trigger};
use firmware::safety::{ChannelSpec, WearerSpec};
use firmware::units::{Amplitude, Micros};
use proptest::prelude::*;

/// Boot time; the clock wraps soon after the start.
const BOOT: Micros = Micros::new(u32::MAX - 150_000);

const PERIOD_US: u32 = 20_000;

/// Train at 50 Hz, 20 to 400 µs.
const LIVE: TrainSpec = TrainSpec {
    max_width_us: 400,
    ..TrainSpec::biphasic(200, 100, PERIOD_US)
};

const LIMIT_UA: u32 = 60_000;

fn spec(train: TrainSpec, start_ua: u32) -> ChannelSpec {
    ChannelSpec {
        limit: Amplitude::new(LIMIT_UA),
        start: Amplitude::new(start_ua),
        area_mm2: 20_000,
        ..channel(train)
    }
}

fn one_second_rise(rise_bursts: u16) -> WearerSpec {
    WearerSpec {
        rise_ms: 1_000,
        rise_bursts,
        max_charge_nc: 24_000,
        host_timeout_ms: 1_000,
        ..WearerSpec::default()
    }
}

fn order(ua: u32, width_us: u16) -> Request {
    Request::Amplitudes {
        at: None,
        mask: 1,
        values: [Amplitude::new(ua)].into_iter().collect(),
        widths: [width_us].into_iter().collect(),
    }
}

/// Start of a burst, its amplitude in µA and its width in µs.
type Burst = (u64, f64, u64);

fn bursts(desk: &TestHost, from: u64) -> Vec<Burst> {
    let phases = phases(desk, 0, from);
    let first = phases.iter().step_by(2);
    let ua = |code: u16| f64::from(code) * 100_000.0 / 65_535.0;
    first.map(|p| (p.0, ua(p.2), p.1)).collect()
}

/// Returns every burst that exceeds the one before by more than the rule allows, from an
/// independent formulation of the rule; one DAC step is tolerated.
fn jumps(bursts: &[Burst], start_ua: u32, rise_bursts: u16) -> Vec<(Burst, Burst)> {
    let limit = f64::from(LIMIT_UA);
    let (period, rise) = (f64::from(PERIOD_US), 1e6);
    let part = (1.0 / (f64::from(rise_bursts) + 1.0)).min(period / (rise + period));
    // 24 µC are 120 mA at the train's own 200 µs.
    let first = [part * limit, part * 120_000.0];
    let measures = |b: &Burst| [b.1, b.1 * b.2 as f64 / 200.0];
    let mut jumps = Vec::new();
    let mut before: Option<Burst> = None;
    for burst in bursts {
        let most = match before {
            // An amplitude below the DAC's first step does not count as a start of the rise.
            Some(before) if before.1 > 0.0 && burst.0 - before.0 <= 2 * u64::from(PERIOD_US) => {
                let since = (burst.0 - before.0) as f64;
                let by = (limit * since / rise).min(limit / f64::from(rise_bursts));
                measures(&before).map(|m| m + by)
            }
            _ => first,
        };
        let step = 100_000.0 / 65_535.0 * 2.5;
        let is_high = |(m, most): (f64, f64)| m > most.max(start_ua.into()) + step;
        if measures(burst).into_iter().zip(most).any(is_high) {
            jumps.push((before.unwrap_or_default(), *burst));
        }
        before = Some(*burst);
    }
    jumps
}

#[test]
fn a_faint_amplitude_is_no_licence_for_a_strong_one() {
    // 10 µA until the second is nearly over, and for five seconds.
    for wait in [47, 250] {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(one_second_rise(1), &[spec(LIVE, 0)]);
        desk.start();
        let from = desk.since_boot_us();
        for _ in 0..wait {
            desk.expect_ok(order(10, 200));
            desk.wait(20_000);
        }
        for _ in 0..60 {
            desk.expect_ok(order(LIMIT_UA, 200));
            desk.wait(20_000);
        }
        let seen = bursts(&desk, from);
        assert_eq!(jumps(&seen, 0, 1), []);
        assert!(seen.last().unwrap().1 > 59_990.0, "{seen:?}");
    }
}

#[test]
fn a_width_does_not_jump() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(one_second_rise(1), &[spec(LIVE, 0)]);
    desk.start();
    let from = desk.since_boot_us();
    for width_us in [20, 400] {
        for _ in 0..80 {
            desk.expect_ok(order(50_000, width_us));
            desk.wait(20_000);
        }
    }
    let seen = bursts(&desk, from);
    assert_eq!(jumps(&seen, 0, 1), []);
    assert_eq!(
        seen.last().map(|b| (b.1 > 49_990.0, b.2)),
        Some((true, 400))
    );
}

#[test]
fn a_gate_or_toggle_that_opens_begins_a_rise() {
    for trigger in [Trigger::Gated, Trigger::Toggle] {
        let mut desk = TestHost::open(BOOT);
        let train = TrainSpec {
            trigger: Some(trigger),
            ..TrainSpec::biphasic(200, 100, PERIOD_US)
        };
        desk.run(one_second_rise(1), &[spec(train, 0)], 50_000);
        let from = desk.since_boot_us();
        let edge = |desk: &mut TestHost, held: bool| {
            desk.sensors.held = held;
            desk.sensors.trigger = (held || trigger == Trigger::Toggle).then(|| desk.now());
            desk.wait(1);
            desk.sensors.trigger = None;
        };
        // The contact closes for less than two periods, then for more.
        for closed_us in [22_000, 200_000] {
            edge(&mut desk, true);
            for _ in 0..30 {
                desk.expect_ok(Request::KeepAlive);
                desk.wait(50_000);
            }
            edge(&mut desk, false);
            desk.expect_ok(Request::KeepAlive);
            desk.wait(closed_us);
        }
        edge(&mut desk, true);
        desk.wait(30_000);
        let seen = bursts(&desk, from);
        let first = 50_000.0 * 20.0 / 1_020.0;
        let rises = seen.iter().filter(|b| (b.1 - first).abs() < 5.0).count();
        assert_eq!(rises, 3, "{trigger:?}: {seen:?}");
    }
}

#[test]
fn counted_trains_play_what_is_ordered_or_are_refused() {
    for (repeats, burst_count, start_ua) in [(1, 1, 8_000), (48, 1, 8_000), (7, 2, 8_000)] {
        let train = TrainSpec {
            repeats,
            burst_count,
            burst_interval_us: if burst_count > 1 { 5_000 } else { 0 },
            ..PLAIN
        };
        let mut desk = TestHost::open(BOOT);
        desk.prepare(one_second_rise(1), &[spec(train, start_ua)]);
        desk.expect_ok(ARM);
        desk.expect_ok(equal_amplitudes(1, 8_000));
        let heard = desk.exchange(equal_amplitudes(1, 8_001));
        let refused = heard.iter().find_map(|h| match h {
            OwnedResponse::Refused(_, code, field) => Some((*code, field.clone())),
            _ => None,
        });
        assert_eq!(refused, Some(refusal(Code::AboveStart, "start")));
        let from = desk.since_boot_us();
        desk.expect_ok(Request::Start);
        for _ in 0..60 {
            desk.send(Request::KeepAlive);
            desk.wait(20_000);
        }
        let seen = bursts(&desk, from);
        assert_eq!(seen.len(), usize::from(repeats) * usize::from(burst_count));
        assert!(seen.iter().all(|b| (b.1 - 8_000.0).abs() < 2.0), "{seen:?}");
    }
}

#[test]
fn a_list_that_rises_too_fast_is_refused() {
    use firmware::safety::ListedPulse;
    let train = TrainSpec {
        lists: true,
        ..LIVE
    };
    let mut desk = TestHost::open(BOOT);
    desk.run(one_second_rise(1), &[spec(train, 6_000)], 10_000);
    desk.keep_alive(60, 20_000);
    let list = |pulses: &[(u32, u32, u16)]| Request::Pulses {
        channel: 0,
        pulses: pulses
            .iter()
            .map(|&(after_us, ua, width_us)| ListedPulse {
                after_us,
                amplitude: Amplitude::new(ua),
                width_us,
            })
            .collect(),
    };
    let steep = Err(refusal(Code::ListTooSteep, "amplitude"));
    // 60 mA per second are 1.2 mA per period.
    assert_eq!(desk.answer(list(&[(0, 11_201, 200)])), steep);
    assert_eq!(
        desk.answer(list(&[(0, 11_200, 200), (20_000, 12_401, 200)])),
        steep
    );
    assert_eq!(desk.answer(list(&[(0, 10_000, 225)])), steep);
    // After a pause a rise would begin, with only the amplitude that `start` allows.
    assert_eq!(desk.answer(list(&[(20_001, 6_001, 200)])), steep);
    assert_eq!(
        desk.answer(list(&[(0, 5_000, 200), (40_001, 6_001, 200)])),
        steep
    );
    // The rise that begins after a pause continues.
    let after_pause = [(0, 5_000, 200), (40_001, 6_000, 200), (20_000, 7_200, 200)];
    assert_eq!(desk.answer(list(&after_pause)), steep);
    desk.expect_ok(list(&[
        (0, 5_000, 200),
        (40_001, 6_000, 200),
        (20_000, 6_000, 200),
        (20_000, 5_000, 200),
    ]));
    let from = desk.since_boot_us();
    desk.keep_alive(20, 20_000);
    let seen = bursts(&desk, from);
    assert_eq!(jumps(&seen, 6_000, 1), []);
    assert!(seen.iter().any(|b| (b.1 - 6_000.0).abs() < 2.0), "{seen:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// No orders of a host make a burst exceed the one before by more than the rule allows.
    #[test]
    fn no_orders_make_a_jump(
        orders in prop::collection::vec((prop_oneof![Just(0), 1..20u32, 1..=LIMIT_UA], 50..=400u16, 1..9u32), 40),
        start_ua in prop_oneof![Just(0), 0..10_000u32],
        rise_bursts in 1..40u16,
    ) {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(one_second_rise(rise_bursts), &[spec(LIVE, start_ua)]);
        desk.start();
        let from = desk.since_boot_us();
        for (ua, width_us, periods) in orders {
            desk.expect_ok(order(ua, width_us));
            desk.wait(periods * PERIOD_US);
        }
        let seen = bursts(&desk, from);
        prop_assert_eq!(jumps(&seen, start_ua, rise_bursts), []);
    }
}
