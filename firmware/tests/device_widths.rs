//! Pulse width as a live setpoint, at the pins: each burst has the last ordered pair of amplitude
//! and width, and no order exceeds a limit.

use crate::device_desk::*;
use crate::device_fuzz::hosts::near16;
use firmware::link::{Code, Request};
use firmware::pulse::{Shape, State as Line, TrainSpec};
use firmware::safety::{ChannelSpec, State, WearerSpec};
use firmware::units::{Amplitude, Micros};
use proptest::collection::vec;
use proptest::prelude::*;

/// Boot time; the clock wraps soon after the start.
const BOOT: Micros = Micros::new(u32::MAX - 100_000);

/// Train with 200 µs, up to 400 µs.
const LIVE: TrainSpec = TrainSpec {
    max_width_us: 400,
    ..PLAIN
};

/// Returns an order of amplitudes in µA and widths in µs for the first channels.
pub fn stimuli(pairs: &[(u32, u16)]) -> Request {
    Request::Amplitudes {
        at: None,
        mask: (1 << pairs.len()) - 1,
        values: pairs.iter().map(|(ua, _)| Amplitude::new(*ua)).collect(),
        widths: pairs.iter().map(|(_, us)| *us).collect(),
    }
}

/// Returns the driven intervals of a channel from `from_us` on, with the DAC code in force.
pub fn phases(desk: &TestHost, channel: usize, from_us: u64) -> Vec<(u64, u64, u16)> {
    let intervals = line_intervals(&desk.record.levels, channel, u64::MAX);
    let driven = intervals.into_iter().filter(|s| {
        matches!(s.1, Line::Anodic | Line::Cathodic) && s.0 >= from_us && s.2 != u64::MAX
    });
    let writes = desk.record.dac.iter();
    let own: Vec<_> = writes
        .filter(|(_, c, _)| usize::from(*c) == channel)
        .collect();
    let with_code = driven.map(|(from, _, to)| {
        let before = own.partition_point(|(t, ..)| *t <= from);
        let code = before.checked_sub(1).map_or(0, |n| own[n].2);
        (from, to - from, code)
    });
    with_code.collect()
}

/// In doublets, both phases of both pulses have the width and amplitude ordered before the burst.
#[test]
fn a_burst_has_the_pair_that_was_ordered_before_it() {
    let doublet = TrainSpec {
        burst_count: 2,
        burst_interval_us: 6_000,
        ..LIVE
    };
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer(), &[channel(doublet)], 10_000);
    desk.wait(61_000);
    let from = desk.since_boot_us();
    let orders = [
        (10_000, 10),
        (5_000, 400),
        (12_000, 123),
        (12_000, 200),
        (9_000, 399),
    ];
    // Each order comes between the two pulses of a burst and waits for the next burst.
    for order in orders {
        desk.expect_ok(stimuli(&[order]));
        desk.wait(20_000 - 1_000); // an answer takes a millisecond
    }
    desk.expect_ok(equal_amplitudes(1, 7_000)); // the train's own width again
    desk.wait(30_000);
    let seen = phases(&desk, 0, from);
    // From the first complete burst on.
    let pauses = seen
        .windows(2)
        .position(|window| window[1].0 - window[0].0 > 10_000);
    let seen = &seen[pauses.unwrap() + 1..];
    let bursts: Vec<_> = seen.chunks(4).filter(|burst| burst.len() == 4).collect();
    let shown = |burst: &&[(u64, u64, u16)]| {
        assert!(
            burst
                .iter()
                .all(|edge| (edge.1, edge.2) == (burst[0].1, burst[0].2)),
            "{burst:?}"
        );
        (burst[0].1, u32::from(burst[0].2))
    };
    let shown: Vec<_> = bursts.iter().map(shown).collect();
    let code = |ua: u32| (u64::from(ua) * 65_535 / 100_000) as u32;
    let mut wanted: Vec<_> = orders.map(|(ua, us)| (u64::from(us), code(ua))).to_vec();
    wanted.push((200, code(7_000)));
    let begins = shown
        .iter()
        .position(|pair| *pair == wanted[0])
        .expect("the first order");
    assert!(begins <= 1, "{shown:?}");
    assert_eq!(shown[begins..begins + wanted.len()], wanted);
}

#[test]
fn what_a_channel_may_not_have_is_refused_by_name() {
    let wearer = WearerSpec {
        max_charge_nc: 4_000,
        ..wearer()
    };
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer, &[channel(LIVE), channel(PLAIN)], 1_000);
    let out = |field| Err(refusal(Code::OutOfRange, field));
    let count = |field| Err(refusal(Code::AmplitudeCount, field));
    let charge = Err(refusal(Code::ChargeAtWidth, "max_charge_nc"));
    let cases = [
        (stimuli(&[(1_000, 0)]), out("widths")),
        (stimuli(&[(1_000, 9)]), out("widths")),
        (stimuli(&[(1_000, 10)]), Ok(())),
        (stimuli(&[(1_000, 400)]), Ok(())),
        (stimuli(&[(1_000, 401)]), out("widths")),
        (stimuli(&[(1_000, 501)]), out("widths")),
        (stimuli(&[(1_000, 65_535)]), out("widths")),
        // 4 µC are 10 mA for 400 µs or 20 mA for 200 µs.
        (stimuli(&[(10_000, 400)]), Ok(())),
        (stimuli(&[(10_001, 400)]), charge.clone()),
        (stimuli(&[(20_000, 200)]), Ok(())),
        (stimuli(&[(20_000, 201)]), charge.clone()),
        (
            stimuli(&[(20_001, 10)]),
            Err(refusal(Code::AboveWearerLimit, "values")),
        ),
        // A channel with a fixed width accepts only its own.
        (stimuli(&[(1_000, 300), (1_000, 200)]), Ok(())),
        (stimuli(&[(1_000, 300), (1_000, 201)]), out("widths")),
        // An order is accepted as a whole or not at all.
        (stimuli(&[(20_000, 201), (1_000, 200)]), charge),
        (
            Request::Amplitudes {
                at: None,
                mask: 0b11,
                values: [1_000, 1_000].map(Amplitude::new).into_iter().collect(),
                widths: [200].into_iter().collect(),
            },
            count("widths"),
        ),
        (
            Request::Amplitudes {
                at: None,
                mask: 0b1,
                values: [Amplitude::new(1_000)].into_iter().collect(),
                widths: [200, 200].into_iter().collect(),
            },
            count("widths"),
        ),
    ];
    for (request, expected) in cases {
        let shown = format!("{request:?}");
        assert_eq!(desk.answer(request), expected, "{shown}");
    }
    assert_eq!(desk.state(), State::Stimulating);
}

#[test]
fn a_muscle_is_not_armed_under_a_live_width() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(LIVE)]);
    let spec = crate::device_rungs::SPEC;
    desk.expect_ok(Request::Muscle { channel: 0, spec });
    assert_eq!(
        desk.expect_refusal(ARM),
        refusal(Code::WidthChanges, "max_width_us")
    );
}

/// Width at which the limits of rms and density are checked: 10 mm² allow 200 µA rms, 2 mA for two
/// phases of 100 µs in 20 ms.
#[test]
fn a_train_is_armed_at_the_width_that_heats_most() {
    let spec = |max_width_us| ChannelSpec {
        limit: Amplitude::new(2_000),
        area_mm2: 10,
        ..channel(TrainSpec {
            width_us: 50,
            max_width_us,
            ..PLAIN
        })
    };
    let mut desk = TestHost::open(BOOT);
    let ask = |max_width_us| Request::Channel {
        channel: 0,
        spec: spec(max_width_us),
    };
    desk.expect_ok(ask(100));
    let refused = desk.expect_refusal(ask(101));
    assert_eq!(refused, refusal(Code::DensityLimit, "area_mm2"));
    // Widths that the wearer's charge limit excludes do not count.
    desk.expect_ok(Request::Wearer(WearerSpec {
        max_charge_nc: 200,
        ..wearer()
    }));
    desk.expect_ok(ask(500));
}

/// The charge allowance counts the played width: at 4 µC per pulse and 50 Hz, 10 mC are used up
/// after 2500 pulses; at 0.1 µC hardly any is used.
#[test]
fn the_dose_counts_the_width_that_is_played() {
    let pulses_until = |order| {
        let wearer = WearerSpec {
            max_dose_mc: 10,
            ..wearer()
        };
        let mut desk = TestHost::open(BOOT);
        desk.run(wearer, &[channel(LIVE)], 10_000);
        let from = desk.since_boot_us();
        desk.expect_ok(stimuli(&[order]));
        for _ in 0..60_000 / 50 {
            desk.expect_ok(Request::KeepAlive);
            desk.wait(49_000);
            if desk.state() != State::Stimulating {
                break;
            }
        }
        let pulses = phases(&desk, 0, from).len() / 2;
        (desk.state() == State::Stimulating, pulses)
    };
    let (plays_on, pulses) = pulses_until((10_000, 400));
    assert!(!plays_on && (2_495..=2_505).contains(&pulses), "{pulses}");
    let (plays_on, pulses) = pulses_until((10_000, 10));
    assert!(plays_on && pulses > 2_900, "{pulses}");
}

/// Where the wearer limits steps, a wider phase is a step: 2 mA at 200 µs are 1 mA at 400.
#[test]
fn a_width_may_not_rise_faster_than_an_amplitude() {
    let wearer = WearerSpec {
        max_step_ua: 1_000,
        ..wearer()
    };
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer, &[channel(LIVE)], 10_000);
    desk.wait(60_000);
    let mut ask = |pair| {
        let code = desk.refusal_code(stimuli(&[pair]));
        desk.wait(20_000);
        code
    };
    // 10 mA · 220 µs are 11 mA at the train's own 200 µs.
    assert_eq!(ask((10_000, 221)), Some(Code::TooLargeStep));
    assert_eq!(ask((10_000, 220)), None);
    assert_eq!(ask((11_000, 219)), Some(Code::TooLargeStep));
    assert_eq!(ask((11_000, 218)), None);
    // A larger amplitude with a shorter phase is limited too.
    assert_eq!(ask((13_000, 100)), Some(Code::TooLargeStep));
    assert_eq!(ask((12_000, 100)), None);
}

/// Generates an order to two channels and the wait after it.
fn orders() -> impl Strategy<Value = Vec<([(u32, u16); 2], u32)>> {
    let pair = || {
        (
            prop_oneof![1 => Just(0), 6 => 0u32..=24_000],
            near16(10, 500),
        )
    };
    vec(((pair(), pair()), 1_000u32..45_000), 5..40)
        .prop_map(|rows| rows.into_iter().map(|((a, b), us)| ([a, b], us)).collect())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// For any sequence of orders, no phase at the pins exceeds the wearer's charge, no burst heats
    /// an electrode beyond its limits, and the device reports no fault of its own.
    #[test]
    fn no_sequence_of_setpoints_passes_a_limit(
        orders in orders(),
        max_charge_nc in 500u32..6_000,
        rise_ms in 1u16..200,
        max_widths in (200u16..=500, 200u16..=500),
        area_mm2 in 20u32..200,
    ) {
        let wearer = WearerSpec { max_charge_nc, rise_ms, host_timeout_ms: 200, ..wearer() };
        let trains = [
            TrainSpec { width_us: 100, max_width_us: max_widths.0, ..PLAIN },
            TrainSpec {
                shape: Shape::MonophasicAnodic,
                width_us: 60,
                max_width_us: max_widths.1,
                offset_us: 3_333,
                ..MONO
            },
        ];
        let specs = trains.map(|train| ChannelSpec {
            limit: Amplitude::new((max_charge_nc * 1000 / u32::from(train.width_us)).min(20_000)),
            area_mm2,
            ..channel(train)
        });
        let mut desk = TestHost::open(BOOT);
        desk.expect_ok(Request::Wearer(wearer));
        let mut is_taken = true;
        for (channel, spec) in (0u8..).zip(specs) {
            is_taken &= desk.refusal_code(Request::Channel { channel, spec }).is_none();
        }
        prop_assume!(is_taken);
        desk.start();
        let from = desk.since_boot_us();
        for (pairs, wait_us) in orders {
            if let Some(code) = desk.refusal_code(stimuli(&pairs)) {
                let by_limit = [Code::ChargeAtWidth, Code::AboveWearerLimit, Code::OutOfRange];
                prop_assert!(by_limit.contains(&code), "{code:?}");
            }
            desk.expect_ok(Request::KeepAlive); // a refused request does not count as a keep-alive
            desk.wait(wait_us);
        }
        prop_assert_eq!(desk.state(), State::Stimulating);
        for (index, spec) in specs.iter().enumerate() {
            let phases_each = if spec.train.shape.is_biphasic() { 2.0 } else { 1.0 };
            for (at, width_us, code) in phases(&desk, index, from) {
                // The current of the code in µA, rounded up.
                let ua = (u64::from(code) * 100_000).div_ceil(65_535);
                let pc = ua * width_us;
                prop_assert!(pc <= u64::from(max_charge_nc) * 1000, "{pc} pC at {at}");
                let square = (ua * ua) as f64 * width_us as f64 * phases_each;
                let rms = (square / f64::from(spec.train.period_us)).sqrt();
                let max = f64::from(area_mm2 * 20);
                prop_assert!(rms <= max + 1e-6, "{rms} of {max} µA rms at {at}");
            }
        }
    }
}
