//! Force control on the whole device: pulses, refusals, silence.

use crate::device_desk::*;
use firmware::control::{ForceControl, ForceSpec, HoldPolicy};
use firmware::link::{Code, Request};
use firmware::muscle::{CalciumForceSpec, MuscleLevel, MuscleSpec, Recruitment, RecruitmentSpec};
use firmware::pulse::{Partner, State as Line, TrainSpec, Trigger};
use firmware::safety::{ChannelSpec, State, WearerSpec};
use firmware::units::{Amplitude, Micros, us};
use proptest::prelude::*;

pub(crate) const BOOT: Micros = Micros::new(u32::MAX - 300_000);

/// Subject K01 of Lee 2020, table 4.
const K01: CalciumForceSpec = CalciumForceSpec {
    a_mn_per_s: 121_900,
    k_micro: 300_000,
    tau_c_us: 20_800,
    tau1_us: 33_100,
    tau2_us: 194_400,
};

pub(crate) const RECRUITMENT: RecruitmentSpec = RecruitmentSpec {
    motor_threshold: Amplitude::new(10_000),
    limit: Amplitude::new(20_000),
    reference: Amplitude::new(20_000),
    slope_micro: 300_000,
};

pub(crate) const FORCE: ForceSpec = ForceSpec {
    min_period_us: 12_500,
    hold: HoldPolicy::Extrapolate { max_ms: 100 },
    max_period_us: None,
};

/// [`FORCE`] with rates down to two pulses per second at motor threshold.
pub(crate) const RARE: ForceSpec = ForceSpec {
    max_period_us: Some(500_000),
    ..FORCE
};

/// Train at 25 Hz, so that the rate may rise to 80 Hz.
pub(crate) const SLOW: TrainSpec = TrainSpec {
    period_us: 40_000,
    ..PLAIN
};

pub(crate) fn muscle(channel: u8) -> Request {
    Request::Muscle {
        channel,
        spec: MuscleSpec::new(K01, RECRUITMENT),
    }
}

pub(crate) fn control(channel: u8, spec: ForceSpec) -> Request {
    Request::ForceControl { channel, spec }
}

pub(crate) fn force(channel: u8, millinewton: u32) -> Request {
    Request::Force {
        channel,
        at: None,
        millinewton,
        millinewton_per_s: Some(0),
    }
}

/// Returns the smallest force above zero and the largest force of a channel under force control,
/// mN.
pub(crate) fn force_range_mn(spec: &ForceSpec) -> (u32, u32) {
    let recruitment = Recruitment::new(RECRUITMENT).unwrap();
    let control = ForceControl::new(0, spec, K01, recruitment, SLOW.period_us).unwrap();
    control.force_range_mn()
}

pub(crate) fn max_force_mn() -> u32 {
    force_range_mn(&FORCE).1
}

/// Starts stimulation on channel 0 under force control and on channel 1 without it.
fn stimulating(host_timeout_ms: u16) -> TestHost {
    stimulating_by(FORCE, host_timeout_ms)
}

pub(crate) fn stimulating_by(spec: ForceSpec, host_timeout_ms: u16) -> TestHost {
    stimulating_on(MuscleLevel::None, spec, host_timeout_ms)
}

/// Does the same with this model level, whose prediction may correct the inverse.
fn stimulating_on(level: MuscleLevel, spec: ForceSpec, host_timeout_ms: u16) -> TestHost {
    let mut desk = TestHost::open(BOOT);
    let wearer = WearerSpec {
        host_timeout_ms,
        ..wearer()
    };
    desk.prepare(wearer, &[channel(SLOW), channel(PLAIN)]);
    let muscle = MuscleSpec {
        level,
        ..MuscleSpec::new(K01, RECRUITMENT)
    };
    desk.expect_ok(Request::Muscle {
        channel: 0,
        spec: muscle,
    });
    desk.expect_ok(control(0, spec));
    desk.start();
    desk
}

/// Returns the starts of a channel's pulses after `from`.
pub(crate) fn starts(desk: &TestHost, channel: usize, from: u64) -> Vec<u64> {
    let edges = driven_starts(&desk.record.levels, channel).into_iter();
    edges.filter(|&t| t > from).step_by(2).collect() // two phases
}

/// Returns the intervals between successive starts.
pub(crate) fn gaps(starts: &[u64]) -> Vec<u64> {
    starts.windows(2).map(|w| w[1] - w[0]).collect()
}

#[test]
fn amplitude_answers_and_then_rate() {
    let mut desk = stimulating(1000);
    // No force has been requested.
    desk.wait(200_000);
    assert!(
        driven_starts(&desk.record.levels, 0)
            .iter()
            .all(|&t| t < 100_000)
    );

    let mut asked = |millinewton| {
        desk.expect_ok(force(0, millinewton));
        desk.wait(300_000);
        let from = desk.since_boot_us();
        desk.wait(400_000);
        let ua = last_code(&desk, 0) * 100_000 / 65_535;
        let gaps = gaps(&starts(&desk, 0, from));
        assert!(gaps.iter().all(|&gap| gap == gaps[0]), "{gaps:?}");
        (gaps.first().copied(), ua)
    };
    assert_eq!(asked(0).0, None);
    let (gentle_us, gentle_ua) = asked(2_000);
    assert_eq!(gentle_us, Some(40_000));
    assert!((12_000..19_000).contains(&gentle_ua), "{gentle_ua}");
    let (strong_us, strong_ua) = asked(max_force_mn() * 9 / 10);
    assert!((19_990..=20_000).contains(&strong_ua), "{strong_ua}");
    assert!((12_500..25_000).contains(&strong_us.unwrap()));
    let (full_us, full_ua) = asked(max_force_mn());
    assert!(full_us.unwrap().abs_diff(12_500) <= 3, "{full_us:?}");
    assert!((19_990..=20_000).contains(&full_ua));
    // The force returns to its earlier value.
    assert_eq!(asked(2_000), (gentle_us, gentle_ua));
}

#[test]
fn telemetry_tells_what_was_wanted_and_done() {
    let mut desk = stimulating_on(MuscleLevel::CalciumForce, FORCE, 1000);
    desk.expect_ok(Request::Subscribe { period_ms: 10 });
    desk.expect_ok(force(0, max_force_mn()));
    for _ in 0..10 {
        desk.wait(100_000);
        desk.expect_ok(force(0, max_force_mn()));
    }
    desk.take_messages();
    desk.wait(50_000);
    let sample = desk.samples().remove(0);
    assert_eq!(sample.force_control.len(), 1);
    assert_eq!(sample.force_control[0].reference_mn, Some(max_force_mn()));
    assert!(sample.force_control[0].period_us.unwrap().abs_diff(12_500) <= 3);
    // The model of the same muscle, including ripple, reaches the requested force.
    let got = f64::from(sample.forces_mn[0].unwrap()) / f64::from(max_force_mn());
    assert!((0.97..1.03).contains(&got), "{got}");
}

#[test]
fn a_setpoint_that_cannot_be_met_is_refused_by_name() {
    let mut desk = stimulating(1000);
    let timed = |at, millinewton_per_s| Request::Force {
        channel: 0,
        at,
        millinewton: 1,
        millinewton_per_s,
    };
    let early = Some(desk.now() - us(2_000_000));
    for (request, code, field) in [
        (
            force(0, max_force_mn() + 1),
            Code::ForceOutOfReach,
            "millinewton",
        ),
        (force(1, 100), Code::NoForceControl, "channel"),
        (force(10, 100), Code::OutOfRange, "channel"),
        (
            timed(None, Some(i32::MIN)),
            Code::OutOfRange,
            "millinewton_per_s",
        ),
        (timed(early, None), Code::SetpointTime, "at"),
        // A channel has one source of amplitudes: force control or the host.
        (equal_amplitudes(2, 1_000), Code::Controlled, "channel"),
    ] {
        assert_eq!(desk.expect_refusal(request), refusal(code, field));
    }
    desk.expect_ok(Request::Stop);
    desk.wait(200_000);
    let stopped = desk.expect_refusal(force(0, 100));
    assert_eq!(stopped, refusal(Code::NotArmed, "state"));
}

/// Returns the refusal on arming these channels and requests.
fn arming_refusal(
    wearer: WearerSpec,
    specs: &[ChannelSpec],
    requests: Vec<Request>,
) -> (Code, String) {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer, specs);
    desk.expect_all_ok(requests);
    desk.expect_refusal(ARM)
}

#[test]
fn what_cannot_be_controlled_is_refused_at_arming() {
    let with = |min_period_us| {
        let spec = ForceSpec {
            min_period_us,
            ..FORCE
        };
        vec![muscle(0), control(0, spec)]
    };
    let falling = ForceSpec {
        max_period_us: Some(39_999),
        ..FORCE
    };
    let slow = channel(SLOW);
    // Mean-force control needs at least 10 Hz.
    let twitches = channel(TrainSpec {
        period_us: 100_001,
        ..PLAIN
    });
    let burst = channel(TrainSpec {
        burst_count: 2,
        burst_interval_us: 5_000,
        ..SLOW
    });
    let triggered = channel(TrainSpec {
        trigger: Some(Trigger::Start),
        ..SLOW
    });
    // The muscle's own limit must lie within that of the channel.
    let low = ChannelSpec {
        limit: Amplitude::new(19_999),
        ..slow
    };
    #[rustfmt::skip]
    let cases = [
        (slow, vec![control(0, FORCE)], Code::NoMuscle, "muscle"),
        (slow, with(40_001), Code::OutOfRange, "min_period_us"),
        (slow, vec![muscle(0), control(0, falling)], Code::OutOfRange, "max_period_us"),
        (twitches, with(50_000), Code::OutOfRange, "period_us"),
        (burst, with(12_500), Code::OutOfRange, "burst_count"),
        (triggered, with(12_500), Code::OutOfRange, "trigger"),
        (low, with(12_500), Code::AboveWearerLimit, "limit"),
        (channel(PLAIN), vec![muscle(1), control(1, FORCE)], Code::NoTrain, "force"),
    ];
    for (spec, requests, code, field) in cases {
        let refused = arming_refusal(wearer(), &[spec], requests);
        assert_eq!(refused, refusal(code, field));
    }
    // 20 mA, 2 · 500 µs: 3.16 mA rms at 25 Hz, 8.16 mA at 166 Hz.
    let wide = channel(TrainSpec {
        width_us: 500,
        ..SLOW
    });
    let tight = WearerSpec {
        max_rms_ua: 5_000,
        ..wearer()
    };
    let refused = arming_refusal(tight, &[wide], vec![muscle(0), control(0, FORCE)]);
    assert_eq!(refused, refusal(Code::RmsLimit, "limit"));
}

/// Returns the latest DAC code of a channel, 0 if there is none.
pub(crate) fn last_code(desk: &TestHost, channel: u8) -> u32 {
    let mut codes = desk.record.dac.iter().rev();
    let found = codes.find(|(_, c, _)| *c == channel);
    found.map_or(0, |&(_, _, code)| code.into())
}

#[test]
fn all_channels_can_be_under_force_control() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(SLOW); 10]);
    for channel in 0..10 {
        desk.expect_ok(muscle(channel));
        desk.expect_ok(control(channel, FORCE));
    }
    desk.start();
    for _ in 0..40 {
        for channel in 0..10 {
            // Each channel has its own force, from a seventh of the largest to the largest.
            let share = 3 + u32::from(channel) * 2;
            desk.expect_ok(force(channel, max_force_mn() * share / 21));
        }
        desk.wait(10_000);
    }
    assert_eq!(desk.state(), State::Stimulating);
    let codes: Vec<u32> = (0..10).map(|channel| last_code(&desk, channel)).collect();
    assert!(
        codes.is_sorted() && codes[0] > 0 && codes[0] < codes[1],
        "{codes:?}"
    );
    let pulses = |channel| driven_starts(&desk.record.levels, channel).len();
    assert!(pulses(9) > 2 * pulses(0), "rate rises with force");
}

/// A table is computed as soon as all its inputs are there, and again after any change, in any
/// order: arming uses the latest values.
#[test]
fn the_order_of_requests_does_not_matter() {
    let strong = |a_mn_per_s| Request::Muscle {
        channel: 0,
        spec: MuscleSpec::new(CalciumForceSpec { a_mn_per_s, ..K01 }, RECRUITMENT),
    };
    let slow = |period_us| Request::Channel {
        channel: 0,
        spec: channel(TrainSpec { period_us, ..SLOW }),
    };
    let faster = ForceSpec {
        min_period_us: 20_000,
        ..FORCE
    };
    let orders = [
        vec![slow(40_000), strong(121_900), control(0, FORCE)],
        vec![control(0, FORCE), strong(121_900), slow(40_000)],
        vec![
            strong(121_900),
            control(0, faster),
            slow(40_000),
            control(0, FORCE),
        ],
        vec![
            strong(60_000),
            control(0, FORCE),
            slow(50_000),
            strong(121_900),
            slow(40_000),
        ],
    ];
    let mut courses = orders.into_iter().map(|requests| {
        let mut desk = TestHost::open(BOOT);
        desk.expect_ok(Request::Wearer(WearerSpec {
            host_timeout_ms: 1000,
            ..wearer()
        }));
        desk.expect_all_ok(requests);
        desk.start();
        desk.expect_ok(force(0, max_force_mn() * 4 / 5));
        let from = desk.since_boot_us();
        desk.wait(500_000);
        let gaps = gaps(&starts(&desk, 0, from + 200_000));
        assert!(gaps.len() > 10);
        (gaps[..10].iter().sum::<u64>(), last_code(&desk, 0))
    });
    let first = courses.next().unwrap();
    assert!(courses.all(|course| course == first), "{first:?}");
}

#[test]
fn an_isolated_group_keeps_its_rates() {
    let apart = TrainSpec {
        offset_us: 10_000,
        ..SLOW
    };
    let specs = [channel(SLOW), channel(apart)];
    let fixed = ForceSpec {
        min_period_us: SLOW.period_us,
        ..FORCE
    };
    // A rate that can only fall changes as well.
    let falling = ForceSpec {
        min_period_us: SLOW.period_us,
        ..RARE
    };
    for changing in [FORCE, falling] {
        let isolated = group(0b11, Partner::Isolated);
        let requests = vec![isolated, muscle(1), control(1, changing)];
        let refused = arming_refusal(wearer(), &specs, requests);
        assert_eq!(refused, refusal(Code::RateChanges, "groups"));
    }
    let explicit = ForceSpec {
        max_period_us: Some(SLOW.period_us),
        ..fixed
    };
    for (partner, spec) in [
        (Partner::Isolated, fixed),
        (Partner::Isolated, explicit),
        (Partner::Conducted, FORCE),
        (Partner::Conducted, RARE),
    ] {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &specs);
        desk.expect_all_ok([group(0b11, partner), muscle(1), control(1, spec)]);
        desk.expect_ok(ARM);
    }
}

#[test]
fn a_joint_and_force_control_do_not_share_a_channel() {
    let joint = joint(0, 1, 10_000, 20_000);
    let requests = vec![muscle(0), control(0, FORCE), joint];
    let refused = arming_refusal(wearer(), &[channel(SLOW), channel(SLOW)], requests);
    assert_eq!(refused, refusal(Code::Controlled, "force"));
}

#[test]
fn forces_keep_the_session_alive_and_silence_ends_it() {
    let mut desk = stimulating(50);
    for _ in 0..20 {
        desk.expect_ok(force(0, 3_000));
        desk.wait(30_000);
        assert_eq!(desk.state(), State::Stimulating);
    }
    // A refused setpoint does not count as a keep-alive.
    for _ in 0..5 {
        assert!(desk.answer(force(0, u32::MAX)).is_err());
        desk.wait(20_000);
    }
    desk.wait(100_000);
    assert_eq!(desk.state(), State::Idle);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// For any sequence of forces, pulses are never closer than at the highest rate nor further
    /// apart than at the lowest, never above the limit, and always complete.
    #[test]
    fn any_forces_keep_the_limits(
        steps in prop::collection::vec((0..=100u32, 1_000..60_000u32, any::<Option<i16>>()), 5..40),
        is_rare: bool,
    ) {
        let mut desk = stimulating_by(if is_rare { RARE } else { FORCE }, 1000);
        // Forces are near threshold, where rates are slow, or span the whole range.
        let top = if is_rare { 2 * force_range_mn(&FORCE).0 } else { max_force_mn() };
        for (percent, wait_us, rate) in steps {
            desk.expect_ok(Request::Force {
                channel: 0,
                at: None,
                millinewton: top * percent / 100,
                millinewton_per_s: rate.map(i32::from),
            });
            desk.wait(wait_us);
        }
        prop_assert_eq!(desk.state(), State::Stimulating);
        let end = desk.since_boot_us();
        let pulses: Vec<_> = line_intervals(&desk.record.levels, 0, end)
            .into_iter()
            .filter(|s| s.2 < end && matches!(s.1, Line::Cathodic | Line::Anodic))
            .skip(CHECK_PHASES)
            .collect();
        for pair in pulses.chunks_exact(2) {
            prop_assert_eq!((pair[0].1, pair[1].1), (Line::Cathodic, Line::Anodic));
            prop_assert_eq!((pair[0].2 - pair[0].0, pair[1].2 - pair[1].0), (200, 200));
            prop_assert_eq!(pair[1].0 - pair[0].2, 100);
        }
        let starts: Vec<u64> = pulses.iter().step_by(2).map(|s| s.0).collect();
        prop_assert!(gaps(&starts).iter().all(|&gap| gap >= 12_500), "{starts:?}");
        let limit = 20_000 * 65_535 / 100_000;
        prop_assert!(desk.record.dac.iter().all(|(_, _, code)| u32::from(*code) <= limit));
    }
}
