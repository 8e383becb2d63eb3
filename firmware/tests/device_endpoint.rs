//! Endpoint force on the whole device: setup, amplitudes, refusals, posture.

use crate::device_desk::*;
use crate::device_force::{FORCE, SLOW, control, muscle};
use firmware::bench::limb::{before_the_trunk, nominal_limb};
use firmware::control::{
    Endpoint, EndpointSpec, EndpointState, ForceImpossible, PostureSpec, WrenchError,
};
use firmware::device::{Draft, Mistake, Part, Rule};
use firmware::limb::{AXES, Limb, Lines, Wrench};
use firmware::link::{Code, Request, Telemetry, WrenchSample};
use firmware::safety::{ChannelSpec, Fault, State, WearerSpec};
use firmware::units::{Amplitude, Micros};
use std::convert::Infallible;

const BOOT: Micros = Micros::new(u32::MAX - 300_000);
/// Reference force towards the front, the right and up, mN; at most four muscles can contribute.
const WANTED: [i32; 3] = [-2_000, 3_000, 2_500];
const MEASURED: PostureSpec = PostureSpec::Measured { stale_after_ms: 40 };

fn fixed() -> PostureSpec {
    PostureSpec::Fixed(before_the_trunk().map(|angle| angle.to_centideg()))
}

fn arm_of(posture: PostureSpec, recruit_ms: u8) -> EndpointSpec {
    let limb = nominal_limb();
    EndpointSpec {
        offsets_um: limb.offsets_um,
        ranges_mdeg: limb.ranges_mdeg,
        recruit_ms,
        posture,
    }
}

fn lines() -> Lines {
    let mut lines = nominal_limb().lines;
    for line in &mut lines {
        line.limit = Amplitude::new(20_000);
    }
    lines
}

fn wrench(force_mn: [i32; 3]) -> Request {
    Request::Wrench { at: None, force_mn }
}

/// Starts stimulation with nine channels at 25 Hz and the arm that they drive.
fn stimulating(posture: PostureSpec, recruit_ms: u8) -> TestHost {
    let mut desk = TestHost::open(BOOT);
    let wearer = WearerSpec {
        host_timeout_ms: 1_000,
        ..wearer()
    };
    let trains = (0..9).map(|n| ChannelSpec {
        train: firmware::pulse::TrainSpec {
            offset_us: n * 2_000,
            ..SLOW
        },
        ..channel(SLOW)
    });
    desk.prepare(wearer, &trains.collect::<Vec<_>>());
    desk.expect_ok(Request::Limb(arm_of(posture, recruit_ms)));
    desk.expect_all_ok(lines().into_iter().map(Request::Line));
    desk.expect_ok(Request::Subscribe { period_ms: 5 });
    desk.start();
    desk
}

/// Sends every angle as measured now.
fn measure(desk: &mut TestHost, angles: [i16; AXES]) {
    let at = desk.now();
    for (joint, centideg) in (0u8..).zip(angles) {
        desk.expect_ok(Request::Measurement {
            joint,
            centideg,
            at,
        });
    }
}

fn nominal_angles() -> [i16; AXES] {
    before_the_trunk().map(|angle| angle.to_centideg())
}

/// Returns the last sample of the next `ms`.
fn last_sample_after(desk: &mut TestHost, ms: u32) -> Telemetry {
    desk.take_messages();
    desk.wait(ms * 1_000);
    desk.samples().pop().unwrap()
}

/// Computes a force's amplitude for each of the nine channels with the limb module itself.
fn expected(force_mn: [i32; 3]) -> Vec<Option<Amplitude>> {
    let mut spec = nominal_limb();
    spec.lines = lines();
    let limb = Limb::<f32>::new(&spec).unwrap();
    let [x, y, z] = force_mn.map(|mn| mn as f32 / 1e3);
    let given = limb.jacobians_at_posture(&before_the_trunk()).unwrap();
    let made = limb.recruit(&given, &Wrench::from_force(x, y, z)).unwrap();
    let order = |channel| made.orders.iter().find(|(value, _)| *value == channel);
    (0..9)
        .map(|channel| order(channel).map(|pair| pair.1))
        .collect()
}

fn mistakes(draft: &Draft) -> Vec<(Part, Rule)> {
    let mut found = Vec::new();
    let Ok(_) = draft.examine(|Mistake { part, rule }| {
        found.push((part, rule));
        Ok::<(), Infallible>(())
    });
    found
}

#[test]
fn a_wanted_force_becomes_the_room_s_amplitudes() {
    for posture in [fixed(), MEASURED] {
        let mut desk = stimulating(posture, 5);
        if posture == MEASURED {
            measure(&mut desk, nominal_angles());
        }
        assert_eq!(last_sample_after(&mut desk, 5).wrench, None);
        desk.expect_ok(wrench(WANTED));
        for _ in 0..8 {
            if posture == MEASURED {
                measure(&mut desk, nominal_angles());
            }
            desk.wait(10_000);
        }
        let sample = desk.samples().pop().unwrap();
        let expected_wrench = WrenchSample {
            reference_mn: WANTED,
            achievable_permille: 1000,
        };
        assert_eq!(
            (sample.wrench, sample.limiting),
            (Some(expected_wrench), false)
        );
        let expected = expected(WANTED);
        assert!(expected.iter().flatten().count() >= 2, "{expected:?}");
        let heard: Vec<_> = sample.amplitudes.iter().copied().collect();
        // Amplitudes agree to within the DAC steps of 100 mA full scale, in µA.
        let near = |(a, b): (&Option<Amplitude>, &Option<Amplitude>)| match (a, b) {
            (Some(a), Some(b)) => a.get().abs_diff(b.get()) <= 2,
            (a, b) => a == b,
        };
        assert!(
            heard.iter().zip(&expected).all(near),
            "{heard:?} {expected:?}"
        );
        // The force is set to zero.
        if posture != MEASURED {
            desk.expect_ok(wrench([0; 3]));
            let rest = last_sample_after(&mut desk, 60);
            assert!(rest.amplitudes.iter().all(Option::is_none), "{rest:?}");
        }
    }
}

#[test]
fn what_nobody_can_make_changes_nothing_and_names_its_share() {
    let mut desk = stimulating(fixed(), 5);
    desk.expect_ok(wrench(WANTED));
    let before = last_sample_after(&mut desk, 60);
    let too_much = WANTED.map(|mn| mn * 20);
    assert_eq!(
        desk.expect_refusal(wrench(too_much)),
        refusal(Code::WrenchOutOfReach, "force_mn")
    );
    assert_eq!(
        desk.expect_refusal(wrench([0, 0, 1_000_001])),
        refusal(Code::OutOfRange, "force_mn")
    );
    assert_eq!(
        last_sample_after(&mut desk, 60).amplitudes,
        before.amplitudes
    );
    // The named share is feasible, and hardly more is.
    let endpoint = Endpoint::new(&arm_of(fixed(), 5), &lines()).unwrap();
    let mut state = EndpointState::default();
    let now = Micros::new(0);
    let refused = endpoint
        .accept_force(&mut state, now, now, too_much)
        .unwrap_err();
    let WrenchError::Unmade(ForceImpossible::TooStrong { permille, .. }) = refused else {
        panic!("{refused:?}");
    };
    let share = |permille: u16| too_much.map(|mn| mn * i32::from(permille) / 1000);
    assert!(
        endpoint
            .accept_force(&mut state, now, now, share(permille))
            .is_ok()
    );
    let more = endpoint.accept_force(&mut state, now, now, share(permille + 2));
    assert!(matches!(more, Err(WrenchError::Unmade(_))), "{more:?}");
    desk.expect_ok(wrench(share(permille)));
}

#[test]
fn where_no_muscle_helps_nothing_is_taken() {
    // Only the biceps is configured.
    let biceps = lines().into_iter().take(1).collect();
    let endpoint = Endpoint::new(&arm_of(fixed(), 5), &biceps).unwrap();
    let (mut state, now) = (EndpointState::default(), Micros::new(0));
    let mut found = [0; 2];
    for sign in [-1, 1] {
        let force = [0, 0, 5_000 * sign];
        match endpoint.accept_force(&mut state, now, now, force) {
            Err(WrenchError::Unmade(ForceImpossible::NoMuscleHelps)) => found[0] += 1,
            Ok(()) => found[1] += 1,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(found, [1, 1]);
}

#[test]
fn a_stale_angle_is_the_sensor_s_fault() {
    let mut desk = stimulating(MEASURED, 5);
    // Without any measurement no force is possible, and this is no error.
    assert_eq!(
        desk.expect_refusal(wrench(WANTED)),
        refusal(Code::NoPosture, "sc_protraction")
    );
    desk.wait(200_000);
    assert_eq!(desk.state(), State::Stimulating);
    measure(&mut desk, nominal_angles());
    desk.expect_ok(wrench(WANTED));
    // One axis is not measured.
    for _ in 0..10 {
        let at = desk.now();
        for joint in 0..8 {
            let centideg = nominal_angles()[usize::from(joint)];
            desk.send(Request::Measurement {
                joint,
                centideg,
                at,
            });
        }
        desk.wait(10_000);
    }
    assert_eq!(desk.state(), State::Fault);
    assert_eq!(desk.fault(), Some(Fault::SensorStale));
}

#[test]
fn an_angle_beyond_belief_is_the_sensor_s_fault() {
    let mut desk = stimulating(MEASURED, 5);
    // 20° and a little more beyond 130°.
    let (at, joint, centideg) = (desk.now(), 6, 15_100);
    desk.expect_ok(Request::Measurement {
        joint,
        centideg,
        at,
    });
    desk.wait(2_000);
    assert_eq!(desk.fault(), Some(Fault::SensorRange));
}

/// The arm leaves the postures in which the force is possible, and the output stays off until it
/// returns.
#[test]
fn a_force_that_can_no_longer_be_made_is_given_not_at_all() {
    let mut desk = stimulating(MEASURED, 5);
    let hold = |desk: &mut TestHost, angles: [i16; AXES]| {
        desk.samples();
        for _ in 0..10 {
            measure(desk, angles);
            desk.expect_ok(Request::KeepAlive);
        }
        desk.wait(10_000);
        desk.samples().pop().unwrap()
    };
    measure(&mut desk, nominal_angles());
    desk.expect_ok(wrench(WANTED));
    let given = hold(&mut desk, nominal_angles());
    assert!(given.amplitudes.iter().any(Option::is_some));
    // Flexed beyond the wearer's range, but still plausible.
    let mut away = nominal_angles();
    away[6] = 13_500;
    let lost = hold(&mut desk, away);
    assert!(lost.amplitudes.iter().all(Option::is_none), "{lost:?}");
    assert!(lost.limiting);
    assert_eq!(
        lost.wrench
            .map(|wrench| (wrench.reference_mn, wrench.achievable_permille)),
        Some((WANTED, 0))
    );
    assert_eq!(
        desk.expect_refusal(wrench(WANTED)),
        refusal(Code::OutOfRange, "el_flexion")
    );
    let back = hold(&mut desk, nominal_angles());
    assert_eq!(back.amplitudes, given.amplitudes);
    assert_eq!(desk.state(), State::Stimulating);
}

/// Of forces that change every 5 ms, every tenth is recruited at a period of 50 ms.
#[test]
fn it_recruits_at_its_own_period() {
    for (recruit_ms, most) in [(5, 40), (50, 4)] {
        let endpoint = Endpoint::new(&arm_of(fixed(), recruit_ms), &lines()).unwrap();
        let mut state = EndpointState::default();
        let mut seen = Vec::new();
        for ms in 0..200_u32 {
            let now = BOOT + firmware::units::us(ms * 1000);
            if ms % 5 == 0 {
                let force = WANTED.map(|mn| mn * ms.cast_signed() / 200);
                endpoint.accept_force(&mut state, now, now, force).unwrap();
            }
            seen.extend(endpoint.tick(&mut state, now).unwrap().map(|_| ms));
        }
        assert_eq!(seen.len(), most, "{seen:?}");
        let apart = u32::from(recruit_ms);
        assert!(seen.windows(2).all(|two| two[1] - two[0] == apart));
    }
}

#[test]
fn every_mistake_of_an_arm_is_named() {
    let mut spec = arm_of(fixed(), 4);
    spec.ranges_mdeg[4] = (0, 90_000);
    spec.offsets_um[2] = [0; 3];
    let PostureSpec::Fixed(angles) = &mut spec.posture else {
        unreachable!();
    };
    angles[6] = 13_001;
    let mut found = Vec::new();
    spec.report_mistakes(&mut |range| found.push(range.to_string()));
    assert_eq!(
        found,
        [
            "offsets_um is 0; allowed: 10000 to 1000000",
            "ranges_mdeg is 90000; allowed: 0 to 80000",
            "recruit_ms is 4; allowed: 5 to 50",
            "el_flexion is 130010; allowed: 0 to 130000",
        ]
    );
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(SLOW), channel(SLOW)]);
    assert_eq!(
        desk.expect_refusal(Request::Limb(spec)),
        refusal(Code::OutOfRange, "offsets_um")
    );
    let mut line = lines()[0].clone();
    line.gain_mn_per_ma = 0;
    assert_eq!(
        desk.expect_refusal(Request::Line(line)),
        refusal(Code::OutOfRange, "gain_mn_per_ma")
    );
    // A line without an arm.
    desk.expect_ok(Request::Line(lines()[0].clone()));
    assert_eq!(desk.expect_refusal(ARM), refusal(Code::NoLimb, "limb"));
    assert_eq!(desk.refusal_code(wrench(WANTED)), Some(Code::NotArmed));
    desk.expect_ok(Request::Limb(arm_of(fixed(), 5)));
    desk.expect_ok(ARM);
    assert_eq!(
        desk.refusal_code(equal_amplitudes(1, 1_000)),
        Some(Code::Controlled)
    );
}

#[test]
fn the_draft_tells_all_that_parts_break_together() {
    let mut draft = Draft::default();
    let slow = channel(SLOW);
    for channel in 0..3 {
        draft.set_channel(channel, slow).unwrap();
    }
    draft.set_endpoint(arm_of(fixed(), 5)).unwrap();
    let lines_missing = mistakes(&draft);
    assert!(
        matches!(lines_missing[..], [(Part::Limb, Rule::Range(e))] if e.field == "lines"),
        "{lines_missing:?}"
    );
    // On a channel of force control, on a joint's channel, above the limit, and on a missing
    // channel.
    for request in [muscle(0), control(0, FORCE), joint(1, 2, 5_000, 15_000)] {
        draft.configure(&request).unwrap().unwrap();
    }
    let arm_lines = lines();
    for mut line in [
        arm_lines[0].clone(),
        arm_lines[1].clone(),
        arm_lines[3].clone(),
    ] {
        line.limit = Amplitude::new(20_000 + u32::from(line.channel == 1));
        draft.set_line(line).unwrap();
    }
    let limit = Amplitude::new(20_000);
    let (channel, field) = (1, "limit");
    let above = Rule::AboveLimit {
        channel,
        field,
        limit,
    };
    assert_eq!(
        mistakes(&draft),
        [
            (Part::Limb, Rule::JointAndLimb),
            (Part::Line(0), Rule::Controlled),
            (Part::Line(1), above),
            (Part::Line(1), Rule::Controlled),
            (Part::Line(3), Rule::NoTrain { channel: 3 }),
        ]
    );
    assert_eq!(draft.controlled_channels(), 0b1111);
    // A line replaces that of its channel, whatever the order of requests.
    let sum = draft.checksum();
    draft.set_line(arm_lines[0].clone()).unwrap();
    assert_eq!(draft.checksum(), sum);
    draft.clear();
    assert_eq!(draft.controlled_channels(), 0);
}
