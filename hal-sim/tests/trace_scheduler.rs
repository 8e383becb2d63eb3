//! The firmware's scheduler, judged by the independent checker: more than a million pulses of
//! random valid configurations of ten channels with different frequencies, bursts and groups,
//! across the wrap of the 32-bit clock.

use firmware::pulse::{
    Burst, BurstTime, CHANNELS, Group as FirmwareGroup, GroupSpec, Partner, Scheduler,
    Shape as FirmwareShape, Supply, Train, TrainError, TrainSpec as FirmwareSpec, WINDOW_US,
    WindowPlan, check_members,
};
use firmware::units::{DacCode, Micros, us};
use hal_sim::trace::{
    Expectation, Group, GroupKind, Levels, Limits, Polarity, Shape, Trace, TrainSpec, check,
};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use std::num::NonZeroU16;

const WINDOWS: u64 = 12_000;
const CASES: u32 = 500;
/// Time from the start of a window until its refill renders the next window, µs.
const REFILL_US: u64 = 2;

/// Amplitudes that differ from burst to burst, and so do the widths of trains that allow it.
struct VariedSupply {
    /// Largest width of each channel, µs; `None` for a fixed width.
    widest_us: [Option<u16>; CHANNELS],
}

impl Supply for VariedSupply {
    fn burst(&mut self, channel: u8, time: BurstTime) -> Burst {
        let at = time.at;
        let number = at.get() / 13 + u32::from(channel) * 977;
        let width_us = self.widest_us[usize::from(channel)].and_then(|widest_us| {
            let width_us = 10 + number % u32::from(widest_us - 9);
            // One burst in five has the train's own width.
            NonZeroU16::new(width_us as u16).filter(|_| !number.is_multiple_of(5))
        });
        Burst {
            code: Some(DacCode::new(number as u16)),
            width_us,
        }
    }
    fn may_pulse(&mut self, _: u8, _: Micros) -> bool {
        true
    }
}

fn spec() -> impl Strategy<Value = FirmwareSpec> {
    let shape = prop_oneof![
        Just(FirmwareShape::BiphasicCathodicFirst),
        Just(FirmwareShape::BiphasicAnodicFirst),
        Just(FirmwareShape::MonophasicCathodic),
        Just(FirmwareShape::MonophasicAnodic),
    ];
    let times = (10u16..=500, 0u16..=200, 1_000u16..3_000, 5_000u32..60_000);
    let burst = (
        1u8..=8,
        200u16..4_000,
        prop_oneof![3 => Just(0u16), 1 => 1u16..20],
        prop_oneof![1 => Just(0u16), 1 => 10u16..=500],
    );
    (shape, times, burst, 0.0..=1.0).prop_map(|(shape, times, burst, phase)| {
        let (width_us, gap_us, ground_us, period_us) = times;
        let (burst_count, burst_interval_us, repeats, max_width_us) = burst;
        let mut spec = FirmwareSpec {
            shape,
            width_us,
            max_width_us: if max_width_us < width_us {
                0
            } else {
                max_width_us
            },
            gap_us: if shape.is_biphasic() { gap_us } else { 0 },
            // Every other biphasic train is grounded too.
            ground_us: if shape.is_biphasic() && width_us % 2 == 0 {
                0
            } else {
                ground_us
            },
            period_us,
            offset_us: 0,
            burst_count,
            burst_interval_us: if burst_count > 1 {
                burst_interval_us
            } else {
                0
            },
            repeats,
            trigger: None,
            lists: false,
        };
        // If bursts are too fast, uses the smallest interval that the device allows.
        if let Err(TrainError::BurstOverlaps { min_interval_us }) = spec.validate() {
            spec.burst_interval_us = min_interval_us as u16;
        }
        if let Err(TrainError::BurstTooLong { min_period_us }) = spec.validate() {
            spec.period_us = min_period_us;
        }
        spec.offset_us = (phase * f64::from(spec.period_us)) as u32;
        spec
    })
}

/// Trains and groups that the device accepts.
#[derive(Debug)]
struct Scene {
    specs: Vec<FirmwareSpec>,
    groups: Vec<GroupSpec>,
    /// Time of the first window, and the delay of the trains' epoch after it.
    start: u32,
    lead_us: u32,
}

fn scene() -> impl Strategy<Value = Scene> {
    let specs = prop::collection::vec(spec(), CHANNELS);
    let kinds = prop::collection::vec(any::<Option<bool>>(), 3);
    let spread = prop::collection::vec(0u32..1_500, CHANNELS);
    (specs, kinds, spread, 0u32..2_000_000, 250u32..1_000).prop_map(
        |(mut specs, kinds, spread, before_wrap, lead_us)| {
            let mut groups = Vec::new();
            for (members, kind) in [[0, 1, 2], [3, 4, 5], [6, 7, 8]].into_iter().zip(kinds) {
                let Some(isolated) = kind else { continue };
                if isolated {
                    let period_us = specs[members[0]].period_us.max(12_000);
                    for (turn, &member) in members.iter().enumerate() {
                        let spec = &mut specs[member];
                        (spec.burst_count, spec.burst_interval_us) = (1, 0);
                        spec.period_us = period_us;
                        spec.offset_us = 1_300 * turn as u32 + spread[member] / 3;
                    }
                }
                groups.push(GroupSpec {
                    members: members.iter().fold(0, |set, member| set | 1 << member),
                    partner: if isolated {
                        Partner::Isolated
                    } else {
                        Partner::Conducted
                    },
                });
            }
            let start = u32::MAX - before_wrap;
            Scene {
                specs,
                groups,
                start,
                lead_us,
            }
        },
    )
}

impl Scene {
    fn render(&self, trains: &[Option<Train>; CHANNELS], groups: &[FirmwareGroup]) -> Trace {
        let mut scheduler = Scheduler::new();
        let epoch = Micros::new(self.start) + us(self.lead_us);
        scheduler.start(trains, groups, Some(0), epoch);
        let (mut trace, mut plan) = (Trace::default(), WindowPlan::new());
        let widest = |train: &Option<Train>| {
            let train = train.filter(Train::has_live_width)?;
            Some(train.widest_us())
        };
        let mut supply = VariedSupply {
            widest_us: std::array::from_fn(|c| widest(&trains[c])),
        };
        for window in 0..WINDOWS {
            let t_us = u64::from(self.start) + window * u64::from(WINDOW_US);
            scheduler
                .render(Micros::new(t_us as u32), &mut supply, &mut plan)
                .expect("no window is late or full");
            for &(channel, code) in &plan.dac {
                let written_us = t_us - u64::from(WINDOW_US) + REFILL_US;
                trace.record_dac(written_us, channel, code.get());
            }
            for change in &plan.changes {
                let levels = Levels(change.levels.0);
                trace.record_levels(t_us + u64::from(change.slot), levels);
            }
        }
        trace
    }

    fn expectation(&self) -> Expectation {
        let start_us = u64::from(self.start);
        let epoch_us = start_us + u64::from(self.lead_us);
        let groups = self.groups.iter().map(|group| Group {
            kind: match group.partner {
                Partner::Conducted => GroupKind::Conducted,
                Partner::Isolated => GroupKind::Isolated,
            },
            members: (0..10).filter(|c| group.members >> c & 1 == 1).collect(),
        });
        let specs = self.specs.iter().enumerate();
        Expectation {
            trains: specs
                .map(|(c, spec)| expected(c as u8, spec, epoch_us))
                .collect(),
            groups: groups.collect(),
            dead_time_us: 5,
            max_code: [u16::MAX; CHANNELS],
            max_code_us: [u64::MAX; CHANNELS],
            limits: Limits::default(),
            complete: true,
            end_us: start_us + WINDOWS * u64::from(WINDOW_US),
        }
    }
}

fn expected(channel: u8, spec: &FirmwareSpec, epoch_us: u64) -> TrainSpec {
    let first_us = epoch_us + u64::from(spec.offset_us);
    let end_us = match spec.repeats {
        0 => 1 << 40,
        bursts => first_us + u64::from(bursts) * u64::from(spec.period_us),
    };
    TrainSpec {
        channel,
        shape: match spec.shape {
            FirmwareShape::BiphasicCathodicFirst => Shape::Biphasic(Polarity::Cathodic),
            FirmwareShape::BiphasicAnodicFirst => Shape::Biphasic(Polarity::Anodic),
            FirmwareShape::MonophasicCathodic => Shape::Monophasic(Polarity::Cathodic),
            FirmwareShape::MonophasicAnodic => Shape::Monophasic(Polarity::Anodic),
        },
        width_us: spec.width_us.into(),
        widest_us: (spec.max_width_us > spec.width_us).then_some(spec.max_width_us.into()),
        gap_us: spec.gap_us.into(),
        period_us: spec.period_us.into(),
        offset_us: spec.offset_us.into(),
        burst_count: spec.burst_count.into(),
        burst_interval_us: spec.burst_interval_us.into(),
        ground_us: spec.ground_us.into(),
        epoch_us,
        active_us: epoch_us..end_us,
    }
}

#[test]
fn a_million_random_pulses_are_exact() {
    let config = Config {
        cases: CASES,
        ..Config::default()
    };
    let mut runner = TestRunner::new(config);
    let tally = std::cell::Cell::new((0usize, 0usize, 0usize, 0usize));
    let result = runner.run(&scene(), |scene| {
        let trains = std::array::from_fn(|c| scene.specs[c].validate().ok());
        prop_assert!(trains.iter().all(Option::is_some), "{:?}", scene.specs);
        let (pulses, conducted, isolated, refused) = tally.get();
        let checked: Result<Vec<_>, _> = scene.groups.iter().map(|g| g.check(&trains)).collect();
        let Ok(groups) = check_members(&scene.groups).and(checked) else {
            tally.set((pulses, conducted, isolated, refused + 1));
            return Ok(());
        };
        let trace = scene.render(&trains, &groups);
        let expectation = scene.expectation();
        prop_assert_eq!(check(&trace, &expectation), []);
        let seen: usize = trace.pulses(expectation.end_us).iter().map(Vec::len).sum();
        let group_count = |kind| expectation.groups.iter().filter(|g| g.kind == kind).count();
        tally.set((
            pulses + seen,
            conducted + group_count(GroupKind::Conducted),
            isolated + group_count(GroupKind::Isolated),
            refused,
        ));
        Ok(())
    });
    let (pulses, conducted, isolated, refused) = tally.get();
    println!(
        "{pulses} pulses in {} configurations, {conducted} conducted and {isolated} isolated \
         groups; {refused} configurations refused",
        CASES as usize - refused,
    );
    if let Err(error) = result {
        panic!("{error}");
    }
    assert!(pulses > 1_000_000 && conducted > 50 && isolated > 50);
}

/// Plays a minute of biphasic pulses from the scheduler, 12 mA at 400 µs and 50 Hz, through a stage
/// whose phases differ by 1 %. Returns the net direct current at the end, µA.
fn direct_current_of(ground_us: u16) -> f64 {
    use hal_sim::trace::judge::{Channel, Pump, Stage, Truth};
    const CODE: u16 = 7_864; // 12 mA at a full scale of 100 mA
    struct Steady;
    impl Supply for Steady {
        fn burst(&mut self, _: u8, _: BurstTime) -> Burst {
            Burst::with_own_width(DacCode::new(CODE))
        }
        fn may_pulse(&mut self, _: u8, _: Micros) -> bool {
            true
        }
    }
    let spec = FirmwareSpec {
        ground_us,
        offset_us: 1_000,
        ..FirmwareSpec::biphasic(400, 5, 20_000)
    };
    let train = spec.validate().unwrap();
    let (mut scheduler, mut plan) = (Scheduler::new(), WindowPlan::new());
    let trains = std::array::from_fn(|c| (c == 0).then_some(train));
    scheduler.start(&trains, &[], None, Micros::new(0));
    let mut trace = Trace::default();
    trace.record_dac(0, 0, CODE);
    let end_us = 60_000_000;
    for start in (0..end_us).step_by(WINDOW_US as usize) {
        let window = Micros::new(start);
        scheduler.render(window, &mut Steady, &mut plan).unwrap();
        for change in &plan.changes {
            trace.record_levels(
                (start + u32::from(change.slot)).into(),
                Levels(change.levels.0),
            );
        }
    }
    let mut truth = Truth::default();
    let full_scale_ma = 100.0;
    truth.channels[0] = Channel::steady(Stage::Current { full_scale_ma }, 2_000.0, 15.0, 50);
    truth.channels[0].mismatch = 0.01;
    truth.hardware.bleed_ohm = 2.4e6; // smallest value that hardware.md allows
    let verdict = hal_sim::trace::judge(&trace, &Pump::Throughout, &truth, end_us.into());
    verdict.as_built.direct_ua[0]
}

#[test]
fn grounding_takes_what_two_phases_differ_by() {
    let [without, with] = [0, 1_000].map(direct_current_of);
    println!("1 % at 12 mA, 400 µs, 50 Hz, after 60 s: {without:.3} µA, grounded {with:.3} µA");
    assert!((without - 2.4).abs() < 0.01, "{without} µA");
    assert!(with <= 1.0, "{with} µA");
}
