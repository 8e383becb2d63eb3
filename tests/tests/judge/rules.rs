//! Each rule finds the trace that breaks it, and no other.

use super::scene::{Anodic, CODE, Cathodic, Grounded, Scene, StateInterval, biphasic, monophasic};
use super::second::judge_both;
use hal_sim::trace::judge::{
    Cause, Channel, Fault, Latched, Pump, QuietInterval, Rule, Stage, judge,
};
use hal_sim::trace::{CHANNELS, Levels, Trace};

pub const NONE: [Vec<Rule>; 2] = [Vec::new(), Vec::new()];

#[test]
fn right_traces_have_no_findings() {
    assert_eq!(Scene::biphasic(150, 200).rules(), NONE);
    assert_eq!(Scene::biphasic(150, 500).rules(), NONE);
    // Two pulses per burst, the second anodic first, with groundings in between.
    let mut burst = biphasic(200).to_vec();
    burst.extend([
        (410, 610, Anodic),
        (615, 815, Cathodic),
        (900, 1_100, Grounded),
    ]);
    let mut scene = Scene::with_pulses(150, &burst);
    scene.truth.channels[0].pulses_per_s = 100;
    assert_eq!(scene.rules(), NONE);
    // 12 mA, 200 µs, grounded for 1 ms: 5.1 V of bias, 0.51 µA through 10 MΩ. On a bare stage, a
    // monophasic train is direct current.
    let mut scene = Scene::with_pulses(150, &monophasic(200, 1_000));
    assert_eq!(scene.rules(), [vec![], vec![Rule::DirectCurrent]]);
    // Through 2.4 MΩ it would be 2.1 µA.
    scene.truth.hardware.bleed_ohm = 2.4e6;
    assert_eq!(
        scene.rules(),
        [Rule::DirectCurrent, Rule::DirectCurrent].map(|r| vec![r])
    );
}

#[test]
fn a_commanded_phase_over_500_us() {
    let found = Scene::biphasic(100, 501);
    let verdict = found.verdict();
    assert_eq!(
        found.rules(),
        [Rule::CommandedPhase, Rule::CommandedPhase].map(|r| vec![r])
    );
    let first = verdict.as_built.findings[0];
    assert_eq!((first.t_us, first.channel, first.count), (10_000, 0, 200));
    assert_eq!((first.amount, first.limit), (501.0, 500.0));
    let text = "10000 µs, channel 1: commanded phase 501.000 µs (limit 500.000), 200 times";
    assert_eq!(first.to_string(), text);
}

#[test]
fn any_phase_over_650_us() {
    // A failed one-shot; the phases balance, so that no other rule is broken.
    let mut scene = Scene::biphasic(100, 651);
    scene.truth.hardware.one_shot_us = 10_000;
    assert_eq!(scene.rules(), [vec![Rule::AnyPhase], vec![Rule::AnyPhase]]);
    // With the one-shot, the stage ends the first of them and disconnects itself.
    let saved = Scene::biphasic(100, 651);
    let verdict = saved.verdict();
    assert_eq!(saved.rules()[1], [Rule::AnyPhase]);
    let latch = Latched {
        t_us: 10_600,
        channel: 0,
        cause: Cause::Held,
    };
    assert_eq!(verdict.as_built.latched, [latch]);
    assert!(verdict.as_built.findings.iter().all(|f| f.count == 1));
    assert!(!saved.rules()[0].contains(&Rule::AnyPhase));
}

#[test]
fn current_above_the_wearers_limit() {
    // 100 mA configured, 300 mA built in.
    let mut scene = Scene::biphasic(100, 200);
    scene.truth.channels[0].stage = Stage::Current {
        full_scale_ma: 300.0,
    };
    assert_eq!(scene.rules(), [vec![Rule::Current], vec![Rule::Current]]);
    let amount = scene.verdict().as_built.findings[0].amount;
    assert!((amount - 36.0).abs() < 0.01, "{amount} mA");
    // Within 5 %.
    scene.truth.channels[0].limit_ma = 34.3;
    assert_eq!(scene.rules(), NONE);
    // A comparator at 30 mA ends it after 1 µs: late, but without direct current.
    scene.truth.channels[0].limit_ma = 15.0;
    scene.truth.channels[0].trip_ma = 30.0;
    let verdict = scene.verdict();
    assert_eq!(verdict.as_built.latched[0].cause, Cause::OverCurrent);
    assert_eq!(verdict.as_built.findings[0].count, 1);
    assert_eq!(verdict.bare.findings[0].count, 200);
}

/// 36 mA where 15 are allowed: below the stage's comparator, above its bank's.
#[test]
fn a_banks_comparator_ends_what_is_above_its_level_after_10_us() {
    let mut scene = Scene::biphasic(100, 200);
    scene.truth.channels[0].stage = Stage::Current {
        full_scale_ma: 300.0,
    };
    // (bank, level in mA, whether the stage latches)
    for (bank, level_ma, latches) in [(0, 18.75, true), (0, 36.1, false), (1, 18.75, false)] {
        let mut trace = scene.trace();
        trace.record_trip(0, bank, (level_ma / 125.0 * 65_535.0) as u16);
        let verdict = judge_both(&trace, &scene.pump, &scene.truth, scene.end_us);
        let latched = Latched {
            t_us: 10_010,
            channel: 0,
            cause: Cause::OverCurrent,
        };
        let expected = if latches { vec![latched] } else { vec![] };
        assert_eq!(verdict.as_built.latched, expected, "{bank}: {level_ma} mA");
        let pulses = if latches { 1 } else { 200 };
        assert_eq!(verdict.as_built.findings[0].count, pulses);
        assert_eq!(verdict.bare.findings[0].count, 200);
    }
    // A level exceeded within a phase counts from that moment.
    scene.truth.channels[0].stage = Stage::Current {
        full_scale_ma: 100.0,
    };
    let mut trace = scene.trace();
    trace.record_trip(0, 0, 9_831); // 18.75 mA
    trace.record_dac(10_100, 0, 3 * CODE);
    let verdict = judge_both(&trace, &scene.pump, &scene.truth, scene.end_us);
    assert_eq!(verdict.as_built.latched[0].t_us, 10_110);
}

#[test]
fn a_load_that_falls_gives_a_voltage_stage_more_current_up_to_its_limiter() {
    let mut scene = Scene::biphasic(100, 200);
    let stage = Stage::Voltage {
        full_scale_v: 200.0,
    };
    scene.truth.channels[0] = Channel::steady(stage, 2_000.0, 15.0, 50);
    assert_eq!(scene.rules(), NONE);
    scene.truth.channels[0]
        .loads
        .push((1_000_000, Some(1_000.0)));
    assert_eq!(scene.rules(), [vec![Rule::Current], vec![Rule::Current]]);
    let found = scene.verdict().as_built.findings[0];
    assert_eq!((found.t_us, found.count), (1_010_000, 100));
    assert!((found.amount - 20.0).abs() < 1e-9, "{} mA", found.amount);
}

#[test]
fn net_direct_current() {
    // One second phase of a hundred is lost: 2.4 µC in that second.
    let mut scene = Scene::biphasic(100, 200);
    let lost = scene.stretches.remove(101);
    assert_eq!((lost.0, lost.2), (1_010_205, Anodic));
    assert_eq!(
        scene.rules(),
        [vec![Rule::DirectCurrent], vec![Rule::DirectCurrent]]
    );
    let found = scene.verdict().as_built.findings[0];
    assert!((found.amount - 2.4).abs() < 0.01, "{} µA", found.amount);
    // After a fault this is the one truncated pulse.
    scene.truth.faults.push(Fault { t_us: 1_000_000 });
    let verdict = scene.verdict();
    assert_eq!(scene.rules(), NONE);
    let [cut] = verdict.as_built.truncated[..] else {
        panic!("{:?}", verdict.as_built.truncated)
    };
    assert_eq!((cut.t_us, cut.channel), (1_010_000, 0));
    assert!((cut.charge_uc + 2.4).abs() < 0.01, "{} µC", cut.charge_uc);
    // A second one has no excuse.
    scene.stretches.remove(140);
    assert_eq!(scene.rules()[1], [Rule::DirectCurrent]);
}

/// A fault splits a phase in two for 1 µs. The pulse's first part is excused and the rest is not,
/// although both together may be balanced.
#[test]
fn an_excuse_makes_no_pulse_worse() {
    /// Replaces the pulse at 1.01 s by `first_us` cathodic, then 100 µs and `rest_us` anodic.
    fn cut_in_two(first_us: u64, rest_us: u64) -> Scene {
        let mut scene = Scene::biphasic(100, 200);
        let (at, rest) = (1_010_000, 1_010_106 + first_us);
        let parts = [
            (at, at + first_us, Cathodic),
            (rest - 101, rest - 1, Anodic),
            (rest, rest + rest_us, Anodic),
        ];
        scene.stretches.splice(100..102, parts);
        scene.truth.channels[0].pulses_per_s = 51; // its rest begins as a pulse
        scene.truth.faults.push(Fault { t_us: 1_000_000 });
        scene
    }
    // (first phase, rest of the second, excused, severe): 1 µs is 12 nC.
    let cases = [
        (200, 99, -1.2, None),
        // With the pulse included: −1.2 µC and this.
        (200, 183, -1.2, None),
        (200, 184, -1.2, Some(1.008)),
        // With the pulse excluded: this alone.
        (400, 83, -3.6, None),
        (400, 84, -3.6, Some(1.008)),
    ];
    for (first_us, rest_us, excused_uc, severe_ua) in cases {
        let scene = cut_in_two(first_us, rest_us);
        let verdict = scene.verdict();
        for account in [&verdict.as_built, &verdict.bare] {
            let [cut] = account.truncated[..] else {
                panic!("{:?}", account.truncated)
            };
            assert!((cut.charge_uc - excused_uc).abs() < 1e-3, "{cut:?}");
            let [found, expected] = [account.findings.first().map(|f| f.amount), severe_ua];
            let is_near = |(a, b): (f64, f64)| (a - b).abs() < 1e-3;
            assert_eq!(found.is_some(), expected.is_some(), "{rest_us}: {found:?}");
            assert!(found.zip(expected).is_none_or(is_near), "{found:?}");
        }
    }
    // A second that begins between the two parts must not count the rest alone either.
    let mut scene = cut_in_two(200, 99);
    let later = Scene::biphasic(150, 200).stretches.into_iter().skip(200);
    let later = later.map(|(start, end, state)| (start - 250, end - 250, state));
    scene.stretches.extend(later);
    scene.truth.channels[0].pulses_per_s = 52; // 250 µs earlier
    scene.end_us = 3_000_000;
    assert_eq!(scene.rules(), NONE);
    // Each of two faults excuses its own pulse: this one cut a pulse off, which stays excluded.
    let mut scene = cut_in_two(200, 99);
    scene.stretches.remove(142);
    assert_eq!(scene.rules()[1], [Rule::DirectCurrent]);
    scene.truth.faults.push(Fault { t_us: 1_200_000 });
    assert_eq!(scene.rules(), NONE);
}

/// A line is on for 1 µs shortly before a pulse, whose first phase then counts as the second phase
/// of that pulse. As a whole they are balanced, in every second.
#[test]
fn what_comes_before_a_pulse_takes_no_part_of_it() {
    let mut scene = Scene::biphasic(150, 200);
    for stretch in &mut scene.stretches {
        let later = if stretch.0 > 2_000_000 { 0 } else { 250 };
        (stretch.0, stretch.1) = (stretch.0 + later, stretch.1 + later);
    }
    scene.stretches.insert(100, (1_009_800, 1_009_801, Anodic));
    scene.truth.channels[0].pulses_per_s = 52;
    assert_eq!(scene.rules()[1], [Rule::DirectCurrent]);
    scene.truth.faults.push(Fault { t_us: 1_000_000 });
    assert_eq!(scene.rules(), NONE);
}

#[test]
fn the_charge_of_a_truncated_pulse() {
    // 110 mA held for 640 µs: 70 µC.
    let mut scene = Scene::with_pulses(50, &biphasic(200));
    scene.truth.channels[0] = Channel {
        limit_ma: 150.0,
        trip_ma: 200.0,
        ..Channel::steady(
            Stage::Current {
                full_scale_ma: 110.0,
            },
            500.0,
            0.0,
            50,
        )
    };
    scene.truth.hardware.one_shot_us = 650;
    scene.code = u16::MAX;
    scene.truth.faults.push(Fault { t_us: 500_000 });
    scene.stretches.truncate(50);
    scene.stretches.push((510_000, 510_640, Cathodic));
    let expected_rules = [vec![Rule::TruncatedCharge], vec![Rule::TruncatedCharge]];
    assert_eq!(scene.rules(), expected_rules);
    scene.stretches[50].1 = 510_590;
    assert_eq!(scene.rules(), NONE, "64.9 µC");
}

#[test]
fn a_rate_above_what_was_checked() {
    let mut scene = Scene::biphasic(150, 200);
    scene.truth.channels[0].pulses_per_s = 49;
    assert_eq!(scene.rules(), [vec![Rule::Rate], vec![Rule::Rate]]);
    let found = scene.verdict().as_built.findings[0];
    assert_eq!(
        (found.amount, found.limit, found.t_us),
        (50.0, 49.0, 990_000)
    );
}

#[test]
fn output_past_a_deadline() {
    let mut scene = Scene::biphasic(100, 200);
    scene.truth.quiet.push(QuietInterval {
        from_us: 1_010_100,
        until_us: 1_050_100,
    });
    assert_eq!(
        scene.rules(),
        [vec![Rule::PastDeadline], vec![Rule::PastDeadline]]
    );
    let found = scene.verdict().as_built.findings[0];
    assert_eq!(
        (found.t_us, found.amount, found.count),
        (1_010_100, 40_000.0, 5)
    );
    // Without the pump there is no output.
    scene.pump = Pump::from_edges((0..40_380).map(|n| n * 25), 300);
    assert_eq!(scene.rules(), [vec![], vec![Rule::PastDeadline]]);
}

#[test]
fn high_voltage_follows_the_pump() {
    let mut scene = Scene::biphasic(100, 200);
    let runs = vec![(0, 1_009_800), (1_600_000, 2_100_000)];
    scene.pump = Pump::Runs(runs);
    // 100 µs of a phase remain when the supply fails: not balanced.
    let verdict = scene.verdict();
    let [found] = verdict.as_built.findings[..] else {
        panic!("{:?}", verdict.as_built.findings)
    };
    assert_eq!(found.rule, Rule::DirectCurrent);
    assert!((found.amount - 1.2).abs() < 0.01, "{} µA", found.amount);
    assert_eq!(verdict.as_built.latched, []);
    let edges = [0, 100, 399, 699, 1_000];
    assert_eq!(
        Pump::from_edges(edges, 300),
        Pump::Runs(vec![(0, 399), (699, 699), (1_000, 1_000)])
    );
}

#[test]
fn one_percent_of_mismatch_is_direct_current_unless_it_is_grounded() {
    // 12 mA, 400 µs, 50 Hz: 240 µA each way, with a difference of 2.4 µA.
    let grounded = [biphasic(400).as_slice(), &[(805, 1_805, Grounded)]].concat();
    let mut seen = [0.0; 2];
    let pulses = [biphasic(400).to_vec(), grounded];
    for (seen, pulse) in seen.iter_mut().zip(pulses) {
        let mut scene = Scene::with_pulses(60 * 50, &pulse);
        scene.truth.channels[0].mismatch = 0.01;
        // The smallest resistance that hardware.md allows reaches this fastest.
        scene.truth.hardware.bleed_ohm = 2.4e6;
        let verdict = scene.verdict();
        *seen = verdict.as_built.direct_ua[0];
        let is_found = !verdict.as_built.findings.is_empty();
        assert_eq!(is_found, *seen > 1.0, "{:?}", verdict.as_built.findings);
    }
    let [without, with] = seen;
    println!("1 % at 12 mA, 400 µs, 50 Hz, after 60 s: {without:.3} µA, grounded {with:.3} µA");
    assert!((without - 2.4).abs() < 0.01, "{without} µA");
    assert!(with <= 1.0, "{with} µA");
}

/// A monophasic train leaves 5 V on a voltage stage's series capacitor, which following pulses
/// discharge. That charge is not theirs, and truncates none of them.
#[test]
fn what_a_capacitor_gives_back_cuts_no_pulse() {
    let after = |pulse: &[StateInterval], count: u64| {
        let mut scene = Scene::with_pulses(49, &monophasic(200, 1_000));
        let stage = Stage::Voltage {
            full_scale_v: 200.0,
        };
        scene.truth.channels[0] = Channel::steady(stage, 2_000.0, 20.0, 60);
        scene.truth.hardware.bleed_ohm = 1e9;
        for at in (0..count).map(|n| 1_000_000 + 5_000 * n) {
            let pulse = pulse.iter().map(|&(a, b, state)| (at + a, at + b, state));
            scene.stretches.extend(pulse);
        }
        scene.end_us = 1_100_000;
        scene.verdict().as_built.findings
    };
    assert_eq!(after(&biphasic(100), 8), []);
    // A pulse without a second phase counts by itself: 12 mA.
    assert_eq!(after(&[(0, 83, Cathodic)], 1), []);
    let [found] = after(&[(0, 84, Cathodic)], 1)[..] else {
        panic!("84 µs")
    };
    assert_eq!(found.rule, Rule::DirectCurrent);
    assert!((found.amount - 1.0).abs() < 0.01, "{} µA", found.amount);
}

#[test]
fn a_minute_of_ten_channels_is_judged_at_once() {
    let scene = Scene::biphasic(60 * 50, 200);
    let mut trace = Trace::default();
    let mut truth = scene.truth.clone();
    for channel in 0..CHANNELS as u8 {
        trace.record_dac(0, channel, CODE);
        truth.channels[usize::from(channel)] = scene.truth.channels[0].clone();
    }
    for (t_us, levels) in &scene.trace().levels {
        for channel in 0..CHANNELS as u8 {
            let state = levels.state(0);
            let at = t_us + u64::from(channel) * 1_000;
            trace
                .levels
                .push((at, Levels::ISOLATED.with_channel(channel, state)));
        }
    }
    trace.levels.sort_by_key(|entry| entry.0);
    let begin = std::time::Instant::now();
    let verdict = judge(&trace, &scene.pump, &truth, scene.end_us);
    let took = begin.elapsed();
    assert_eq!(
        (verdict.as_built.findings, verdict.bare.findings),
        (vec![], vec![])
    );
    println!("{} changes of ten channels: {took:?}", trace.levels.len());
}
