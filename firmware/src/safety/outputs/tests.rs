//! Window plans with one deliberate error each, and whole trains that are correct.

use super::*;
use crate::pulse::{
    Burst, BurstTime, Change, GroupSpec, Scheduler, Shape, Supply, TrainSpec, WINDOW_US,
};
use core::num::NonZeroU16;
use std::vec::Vec;
use std::{format, println};

const CODE: DacCode = DacCode::new(1000);
/// The channel whose pulse width may change.
const LIVE: u8 = 4;

/// A supply that alternates between widths of 100 and 300 µs where a train allows it, and
/// otherwise uses the train's own.
struct Always;
impl Supply for Always {
    fn burst(&mut self, channel: u8, time: BurstTime) -> Burst {
        let at = time.at;
        let is_wide = at.get().is_multiple_of(2);
        Burst {
            code: Some(CODE),
            width_us: NonZeroU16::new(if is_wide { 300 } else { 100 }).filter(|_| channel == LIVE),
        }
    }
    fn may_pulse(&mut self, _: u8, _: Micros) -> bool {
        true
    }
}

fn expected(spec: TrainSpec) -> Option<Expected> {
    Some(Expected {
        train: spec.validate().unwrap(),
        min_period_us: spec.period_us,
        max_code: CODE,
        max_code_us: 300_000,
    })
}

fn channels(specs: &[TrainSpec]) -> [Option<Expected>; CHANNELS] {
    let mut expectations = [None; CHANNELS];
    for (slot, spec) in expectations.iter_mut().zip(specs) {
        *slot = expected(*spec);
    }
    expectations
}

/// Passes the scheduler's windows to the check, each changed by `spoil`, and returns the first
/// rule broken.
fn play(
    specs: &[TrainSpec],
    groups: &[GroupSpec],
    spoil: impl Fn(u32, &mut WindowPlan),
) -> Result<(), BrokenRule> {
    let expectations = channels(specs);
    let trains = expectations.map(|e| e.map(|e| e.train));
    let groups: Vec<Group> = groups.iter().map(|g| g.check(&trains).unwrap()).collect();
    let epoch = Micros::new(u32::MAX - 30_000); // the clock wraps on the way
    let (mut scheduler, mut plan) = (Scheduler::new(), WindowPlan::new());
    scheduler.start(&trains, &groups, Some(0), epoch);
    let mut check = OutputCheck::new();
    check.arm(|channel| expectations[usize::from(channel)], &groups);
    for k in 0..400 {
        let start = epoch + us(k * WINDOW_US);
        scheduler.render(start, &mut Always, &mut plan).unwrap();
        spoil(k, &mut plan);
        check.check_window(&plan)?;
    }
    Ok(())
}

const PLAIN: TrainSpec = TrainSpec::biphasic(200, 40, 20_000);

fn doublets() -> TrainSpec {
    TrainSpec {
        burst_count: 2,
        burst_interval_us: 3_000,
        offset_us: 700,
        ..PLAIN
    }
}

fn grounded(offset_us: u32) -> TrainSpec {
    TrainSpec {
        offset_us,
        ..TrainSpec::monophasic(300, 1_000, 20_000)
    }
}

/// Returns a biphasic train with a grounding after each pulse.
fn given_back(offset_us: u32) -> TrainSpec {
    TrainSpec {
        offset_us,
        ground_us: 1_000,
        ..PLAIN
    }
}

#[test]
fn right_trains_break_no_rule() {
    let group = |partner| GroupSpec {
        members: 0b11,
        partner,
    };
    let none = |_: u32, _: &mut WindowPlan| ();
    assert_eq!(play(&[PLAIN, doublets()], &[], none), Ok(()));
    for partner in [Partner::Conducted, Partner::Isolated] {
        let plain_pair = [
            PLAIN,
            TrainSpec {
                offset_us: 900,
                ..PLAIN
            },
        ];
        assert_eq!(play(&plain_pair, &[group(partner)], none), Ok(()));
        let grounded_pair = [grounded(0), grounded(500)];
        assert_eq!(
            play(&grounded_pair, &[group(partner)], none),
            Ok(()),
            "{partner:?}"
        );
        let given_back_pair = [given_back(0), given_back(900)];
        assert_eq!(
            play(&given_back_pair, &[group(partner)], none),
            Ok(()),
            "{partner:?}"
        );
    }
}

/// Returns a function that moves change `n` of window `k` by `by` slots.
fn shift(k: u32, n: usize, by: i16) -> impl Fn(u32, &mut WindowPlan) {
    move |window, plan| {
        if window == k {
            let change: &mut Change = &mut plan.changes[n];
            change.slot = (i16::from(change.slot) + by) as u8;
        }
    }
}

#[test]
fn each_way_to_be_wrong_is_told() {
    let verdict = |spoil: &dyn Fn(u32, &mut WindowPlan)| play(&[PLAIN], &[], spoil);
    // In the second pulse: a first phase of 199 µs, one of 201 µs, and a gap of 39 µs.
    assert_eq!(verdict(&shift(80, 1, -1)), Err(BrokenRule::Phase));
    assert_eq!(verdict(&shift(80, 1, 1)), Err(BrokenRule::Phase));
    assert_eq!(verdict(&shift(80, 2, -1)), Err(BrokenRule::Phase));
    // A pulse 1 µs early: its first phase is also too long, but the early start is found first.
    let early = [TrainSpec {
        offset_us: 100,
        ..PLAIN
    }];
    assert_eq!(
        play(&early, &[], shift(80, 0, -1)),
        Err(BrokenRule::Spacing)
    );
    // The second phase is on the same line as the first, or absent.
    let levels = |k: u32, n: usize, levels: Levels| {
        move |window: u32, plan: &mut WindowPlan| {
            if window == k {
                plan.changes[n].levels = levels;
            }
        }
    };
    let cathodic = Levels::ISOLATED.with_channel(0, OutputState::Cathodic);
    assert_eq!(verdict(&levels(80, 2, cathodic)), Err(BrokenRule::Phase));
    let grounds = Levels::ISOLATED.with_channel(0, OutputState::Grounded);
    assert_eq!(verdict(&levels(80, 1, grounds)), Err(BrokenRule::Phase));
    // A channel that is not armed is driven, and one is grounded without a reason.
    let other = Levels::ISOLATED.with_channel(7, OutputState::Anodic);
    assert_eq!(verdict(&levels(80, 1, other)), Err(BrokenRule::Channel));
    let idle = Levels::ISOLATED.with_channel(7, OutputState::Grounded);
    assert_eq!(verdict(&levels(0, 1, idle)), Err(BrokenRule::Grounding));
    // DAC codes that are too large or on a wrong channel.
    let code = |channel, code| {
        move |window: u32, plan: &mut WindowPlan| {
            if window == 80 {
                plan.dac[0] = (channel, DacCode::new(code));
            }
        }
    };
    assert_eq!(verdict(&code(0, 1001)), Err(BrokenRule::Code));
    assert_eq!(verdict(&code(3, 1)), Err(BrokenRule::Channel));
    // A window that does not begin where the previous one ended.
    let jump = |window: u32, plan: &mut WindowPlan| {
        if window == 40 {
            plan.initial = Levels::ISOLATED.with_channel(0, OutputState::Cathodic);
        }
    };
    assert_eq!(verdict(&jump), Err(BrokenRule::Start));
    // A grounding that is 1 µs too short, found with the edge that ends it.
    let mono = [grounded(0)];
    assert_eq!(
        play(&mono, &[], shift(5, 0, -1)),
        Err(BrokenRule::Grounding)
    );
    // An omitted grounding: the next pulse would start with residual charge.
    let left_out = |window: u32, plan: &mut WindowPlan| {
        if (1..6).contains(&window) {
            plan.initial = Levels::ISOLATED;
            for change in &mut plan.changes {
                change.levels = Levels::ISOLATED;
            }
        }
    };
    assert!(play(&mono, &[], left_out).is_err());
    // The same errors after two phases, and a grounding without a reason.
    let biphasic = [given_back(0)];
    assert_eq!(
        play(&biphasic, &[], shift(85, 0, -1)),
        Err(BrokenRule::Grounding)
    );
    let none = |window: u32, plan: &mut WindowPlan| match window {
        1 => plan.changes[0].levels = Levels::ISOLATED,
        _ if window != 0 => left_out(window, plan),
        _ => (),
    };
    assert_eq!(play(&biphasic, &[], none), Err(BrokenRule::Grounding));
    assert_eq!(verdict(&levels(81, 0, grounds)), Err(BrokenRule::Grounding));
}

/// With a variable width, each burst's announced width passes. A width that the train does not
/// allow, that has too much charge, or that differs from the announced one is refused.
#[test]
fn a_live_width_is_the_announced_one_and_within_its_bounds() {
    let live = TrainSpec {
        max_width_us: 300,
        period_us: 20_001, // so that bursts begin at odd times and at even ones
        burst_count: 2,
        burst_interval_us: 1_000,
        ..PLAIN
    };
    let mut specs = [PLAIN; LIVE as usize + 1];
    for (spec, offset_us) in specs.iter_mut().zip([2_000, 4_000, 6_000, 8_000]) {
        spec.offset_us = offset_us;
    }
    specs[usize::from(LIVE)] = live;
    let width = |by: fn(u16) -> u16| {
        move |_: u32, plan: &mut WindowPlan| {
            for pulse in plan
                .pulses
                .iter_mut()
                .filter(|pulse_start| pulse_start.channel == LIVE)
            {
                pulse.width_us = by(pulse.width_us);
            }
        }
    };
    assert_eq!(play(&specs, &[], width(|us| us)), Ok(()));
    assert_eq!(
        play(&specs, &[], width(|us| us - 1)),
        Err(BrokenRule::Phase)
    );
    assert_eq!(
        play(&specs, &[], width(|us| us + us / 300)),
        Err(BrokenRule::Width)
    );
    assert_eq!(play(&specs, &[], width(|_| 9)), Err(BrokenRule::Width));
    assert_eq!(play(&specs, &[], width(|_| 0)), Err(BrokenRule::Width));
    let code = |_: u32, plan: &mut WindowPlan| {
        for pulse in plan
            .pulses
            .iter_mut()
            .filter(|pulse_start| pulse_start.width_us == 300)
        {
            pulse.code = DacCode::new(1_001);
        }
    };
    assert_eq!(play(&specs, &[], code), Err(BrokenRule::Width));
}

#[test]
fn its_own_memory_is_sealed() {
    let expectations = channels(&[PLAIN]);
    for flip in [
        (|c| c.lines[0].pulses ^= 1) as fn(&mut OutputCheck),
        |c| c.lines[0].since += us(4),
        |c| c.expected[0].as_mut().unwrap().min_period_us ^= 1 << 14,
        |c| c.expected[0].as_mut().unwrap().max_code = DacCode::new(u16::MAX),
        |c| c.expected[0].as_mut().unwrap().max_code_us ^= 1 << 20,
        |c| c.lines[0].width_us ^= 1 << 6,
        |c| c.levels.0 ^= 1,
    ] {
        let mut check = OutputCheck::new();
        check.arm(|channel| expectations[usize::from(channel)], &[]);
        flip(&mut check);
        let mut plan = WindowPlan::new();
        let found = (0..8 * CHANNELS as u32).find_map(|k| {
            plan.reset(Micros::new(k * WINDOW_US), Levels::ISOLATED);
            check.check_window(&plan).err()
        });
        assert_eq!(found, Some(BrokenRule::Memory));
    }
}

/// Tests every transition of two lines, at every part of a pulse and after every time: drive never
/// follows the opposite drive, no phase has a wrong length, nothing is skipped.
#[test]
fn no_step_leads_from_drive_to_opposite_drive() {
    use OutputState::{Anodic, Cathodic, Grounded, Isolated};
    const WIDTH: u32 = 200;
    let parts = [
        Part::Rest,
        Part::First,
        Part::Gap,
        Part::Second,
        Part::Discharge,
    ];
    let is_driven = |state| matches!(state, Cathodic | Anodic);
    let (biphasic, monophasic) = (
        TrainSpec::biphasic(200, 0, 20_000),
        TrainSpec::monophasic(200, 1_000, 20_000),
    );
    let shapes = [
        (Shape::BiphasicCathodicFirst, biphasic),
        (Shape::BiphasicAnodicFirst, biphasic),
        (Shape::MonophasicCathodic, monophasic),
        (Shape::MonophasicAnodic, monophasic),
    ];
    let mut taken = 0;
    for (shape, spec) in shapes {
        let expected = expected(TrainSpec { shape, ..spec }).unwrap();
        let gap_us = u32::from(expected.train.gap_us());
        let states = [Isolated, Cathodic, Anodic, Grounded];
        let steps = states.map(|old| states.map(|new| (old, new)));
        let reached = |part: &Part| match part {
            Part::Gap | Part::Second => shape.is_biphasic(),
            Part::Rest | Part::First | Part::Discharge => true,
        };
        for part in parts.into_iter().filter(reached) {
            for (old, new) in steps.into_iter().flatten().filter(|(old, new)| old != new) {
                for lasted in 0..=2_000 {
                    let (pulse, burst) = (Micros::new(0), Micros::new(0));
                    let mut line = Line {
                        part,
                        pulse,
                        burst,
                        pulses: 1,
                        ..Line::RESTING
                    };
                    line.since = Micros::new(40_000);
                    let at = line.since + us(lasted);
                    if line.check_edge(Some(&expected), at, (old, new)).is_err() {
                        continue;
                    }
                    taken += 1;
                    let message = format!("{shape:?}, {part:?}: {old:?} to {new:?}, {lasted} µs");
                    // While a phase is in progress the account says so; otherwise the levels were
                    // changed without the account.
                    let drives = matches!(part, Part::First | Part::Second);
                    assert!(!(drives && is_driven(new)), "{message}");
                    assert!(!drives || lasted == WIDTH, "{message}");
                    assert!(
                        part != Part::Gap || lasted == gap_us && gap_us >= 5,
                        "{message}"
                    );
                    assert!(part != Part::Gap || line.part == Part::Second, "{message}");
                    assert!(!is_driven(new) || line.is_pulsing(), "{message}");
                }
            }
        }
    }
    println!("{taken} steps taken");
    assert!(taken > 0);
}
