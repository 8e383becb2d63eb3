use super::*;
use crate::pulse::{Shape, TrainSpec, Trigger, train::tests::PLAIN};
use crate::units::{DacCode, us};

struct Always;
impl Supply for Always {
    fn burst(&mut self, _: u8, _: BurstTime) -> Burst {
        Burst::with_own_width(DacCode::new(1000))
    }
    fn may_pulse(&mut self, _: u8, _: Micros) -> bool {
        true
    }
}

fn edges(
    specs: &[TrainSpec],
    groups: &[Group],
    windows: u32,
    epoch: Micros,
) -> std::vec::Vec<(i32, Levels)> {
    let mut trains = [None; CHANNELS];
    for (train, spec) in trains.iter_mut().zip(specs) {
        *train = Some(spec.validate().unwrap());
    }
    let mut scheduler = Scheduler::new();
    scheduler.start(&trains, groups, Some(0), epoch);
    let mut plan = WindowPlan::new();
    let mut out = std::vec::Vec::new();
    for k in 0..windows {
        let start = epoch + us(k * WINDOW_US);
        scheduler.render(start, &mut Always, &mut plan).unwrap();
        for c in &plan.changes {
            out.push((((start + us(c.slot.into())) - epoch).us(), c.levels));
        }
    }
    out
}

#[test]
fn a_grounding_after_two_phases_has_its_length() {
    let spec = TrainSpec {
        ground_us: 1_000,
        ..PLAIN
    };
    let s = |state| Levels::ISOLATED.with_channel(0, state);
    let sync = |l: Levels| Levels(l.0 | Levels::SYNC);
    for shape in [Shape::BiphasicCathodicFirst, Shape::BiphasicAnodicFirst] {
        let seen = edges(&[TrainSpec { shape, ..spec }], &[], 20, Micros::new(0));
        let (first, second) = match shape {
            Shape::BiphasicCathodicFirst => (State::Cathodic, State::Anodic),
            _ => (State::Anodic, State::Cathodic),
        };
        let expected = [
            (0, sync(s(first))),
            (200, Levels::ISOLATED),
            (300, s(second)),
            (500, s(State::Grounded)),
            (1_500, Levels::ISOLATED),
        ];
        assert_eq!(seen, expected);
    }
}

#[test]
fn biphasic_edges_fall_on_their_microsecond_across_the_wrap() {
    let spec = TrainSpec {
        offset_us: 130,
        ..PLAIN
    };
    let s = |state| Levels::ISOLATED.with_channel(0, state);
    let sync = |l: Levels| Levels(l.0 | Levels::SYNC);
    for epoch in [Micros::new(0), Micros::new(u32::MAX - 150)] {
        assert_eq!(
            edges(&[spec], &[], 100, epoch),
            [
                (130, sync(s(State::Cathodic))),
                (330, Levels::ISOLATED),
                (430, s(State::Anodic)),
                (630, Levels::ISOLATED),
                (20_130, sync(s(State::Cathodic))),
                (20_330, Levels::ISOLATED),
                (20_430, s(State::Anodic)),
                (20_630, Levels::ISOLATED),
            ]
        );
    }
}

#[test]
fn an_interrupted_grounding_starts_again() {
    let mono = TrainSpec {
        shape: Shape::MonophasicCathodic,
        gap_us: 0,
        ground_us: 1000,
        ..PLAIN
    };
    let other = TrainSpec {
        offset_us: 700,
        ..mono
    };
    let mut trains = [None; CHANNELS];
    trains[0] = Some(mono.validate().unwrap());
    trains[1] = Some(other.validate().unwrap());
    let spec = crate::pulse::GroupSpec {
        members: 3,
        partner: Partner::Isolated,
    };
    let group = spec.check(&trains).unwrap();
    let states: std::vec::Vec<_> = edges(&[mono, other], &[group], 79, Micros::new(0))
        .into_iter()
        .map(|(t, l)| (t, l.state(0), l.state(1)))
        .collect();
    use State::*;
    assert_eq!(
        states,
        [
            (0, Cathodic, Isolated),
            (200, Grounded, Isolated),
            (700, Isolated, Cathodic),
            (900, Grounded, Grounded),
            (1900, Isolated, Isolated),
        ]
    );
}

#[test]
fn a_missed_window_is_an_error() {
    let mut trains = [None; CHANNELS];
    trains[0] = Some(PLAIN.validate().unwrap());
    let mut scheduler = Scheduler::new();
    scheduler.start(&trains, &[], None, Micros::new(0));
    let late = scheduler.render(Micros::new(250), &mut Always, &mut WindowPlan::new());
    assert_eq!(late, Err(RenderError::Late));
}

#[test]
fn a_trigger_starts_a_prepared_train_once() {
    let spec = TrainSpec {
        trigger: Some(Trigger::Start),
        repeats: 1,
        ..PLAIN
    };
    let mut trains = [None; CHANNELS];
    trains[4] = Some(spec.validate().unwrap());
    let mut scheduler = Scheduler::new();
    scheduler.start(&trains, &[], None, Micros::new(0));
    let mut plan = WindowPlan::new();
    scheduler
        .render(Micros::new(0), &mut Always, &mut plan)
        .unwrap();
    assert!(plan.changes.is_empty() && !scheduler.is_finished());
    assert_eq!(scheduler.trigger(Micros::new(77)), 1);
    assert_eq!(scheduler.trigger(Micros::new(99)), 0);
    let mut starts = std::vec::Vec::new();
    for k in 1..400 {
        scheduler
            .render(Micros::new(k * 250), &mut Always, &mut plan)
            .unwrap();
        starts.extend(plan.pulses.iter().map(|p| p.at));
    }
    assert_eq!(starts, [Micros::new(1077)]);
}

/// Returns the starts of one channel's bursts, with periods set before given windows.
fn starts(
    spec: TrainSpec,
    changes: &[(u32, u32)],
    windows: u32,
    epoch: Micros,
) -> std::vec::Vec<i32> {
    let mut trains = [None; CHANNELS];
    trains[0] = Some(spec.validate().unwrap());
    let mut scheduler = Scheduler::new();
    scheduler.start(&trains, &[], None, epoch);
    let mut plan = WindowPlan::new();
    let mut out = std::vec::Vec::new();
    for k in 0..windows {
        let start = epoch + us(k * WINDOW_US);
        for &(_, period_us) in changes.iter().filter(|(window, _)| *window == k) {
            scheduler.set_period(0, period_us, start);
        }
        scheduler.render(start, &mut Always, &mut plan).unwrap();
        out.extend(plan.pulses.iter().map(|p| (p.at - epoch).us()));
    }
    out
}

#[test]
fn a_period_changes_between_pulses() {
    for epoch in [Micros::new(0), Micros::new(u32::MAX - 30_000)] {
        let starts = |changes: &[(u32, u32)]| starts(PLAIN, changes, 240, epoch);
        assert_eq!(starts(&[]), [0, 20_000, 40_000]);
        // Before the first burst: that burst stays, the following bursts move.
        assert_eq!(starts(&[(0, 15_000)]), [0, 15_000, 30_000, 45_000]);
        // The waiting burst moves nearer, and further away.
        assert_eq!(starts(&[(20, 10_000)])[..3], [0, 10_000, 20_000]);
        assert_eq!(starts(&[(20, 30_000)]), [0, 30_000]);
        // A start that has passed already moves to the window rendered next.
        assert_eq!(starts(&[(60, 10_000)])[..3], [0, 15_000, 25_000]);
        // Inside a pulse (0 to 500 µs): from the next burst on.
        assert_eq!(starts(&[(1, 7_000)])[..3], [0, 7_000, 14_000]);
        // Changing the period back and forth has no lasting effect.
        let there_and_back = [(20, 10_000), (21, 20_000), (22, 10_000), (23, 20_000)];
        assert_eq!(starts(&there_and_back), [0, 20_000, 40_000]);
    }
}

#[test]
fn a_period_never_hurries_the_first_burst_nor_a_finished_train() {
    let late = TrainSpec {
        offset_us: 12_345,
        ..PLAIN
    };
    assert_eq!(
        starts(late, &[(3, 6_000)], 80, Micros::new(0)),
        [12_345, 18_345]
    );
    let once = TrainSpec {
        repeats: 1,
        ..PLAIN
    };
    assert_eq!(starts(once, &[(3, 6_000)], 80, Micros::new(0)), [0]);
}

proptest::proptest! {
    /// For any sequence of periods, bursts are never closer than the shortest ordered nor further
    /// apart than the longest, and no edge is late.
    #[test]
    fn bursts_keep_their_distance(
        changes in proptest::collection::vec((0..800u32, 5_000..60_000u32), 0..40),
        epoch: u32,
    ) {
        let all = || changes.iter().map(|&(_, period)| period).chain([PLAIN.period_us]);
        let (least, most) = (all().min().unwrap(), all().max().unwrap());
        let starts = starts(PLAIN, &changes, 800, Micros::new(epoch));
        for pair in starts.windows(2) {
            let distance = (pair[1] - pair[0]).cast_unsigned();
            proptest::prop_assert!((least..=most).contains(&distance), "{distance}");
        }
    }
}

/// Flips occur at rest between two pulses and inside a pulse: no window is rendered with them.
#[test]
fn a_bit_that_changes_by_itself_is_found_before_an_edge_comes_of_it() {
    for windows in [3, 81] {
        for way in 0.. {
            let mut trains = [None; CHANNELS];
            trains[0] = Some(PLAIN.validate().unwrap());
            let (mut scheduler, mut plan) = (Scheduler::new(), WindowPlan::new());
            let epoch = Micros::new(0);
            scheduler.start(&trains, &[], None, epoch);
            let at = |k: u32| epoch + us(k * WINDOW_US);
            for k in 0..windows {
                scheduler.render(at(k), &mut Always, &mut plan).unwrap();
            }
            let Some(name) = scheduler.lanes[0].as_mut().unwrap().flip(way) else {
                break;
            };
            let mut rendered = (windows..windows + 8 * CHANNELS as u32)
                .map(|k| scheduler.render(at(k), &mut Always, &mut plan));
            let found = rendered.find_map(Result::err);
            assert_eq!(
                found,
                Some(RenderError::Memory),
                "{name} after {windows} windows"
            );
        }
    }
}

#[test]
fn what_lanes_share_is_sealed_too() {
    type Flip = fn(&mut Scheduler);
    let flips: [(&str, Flip); 3] = [
        ("picture", |s| s.picture.0 ^= 1),
        ("levels", |s| s.levels.0 ^= 1 << 4),
        ("next edge", |s| {
            s.next = s.next.map(|next| next + us(1 << 10))
        }),
    ];
    for (name, flip) in flips {
        let mut trains = [None; CHANNELS];
        trains[0] = Some(PLAIN.validate().unwrap());
        let (mut scheduler, mut plan) = (Scheduler::new(), WindowPlan::new());
        scheduler.start(&trains, &[], None, Micros::new(0));
        scheduler
            .render(Micros::new(0), &mut Always, &mut plan)
            .unwrap();
        flip(&mut scheduler);
        let found = scheduler.render(Micros::new(WINDOW_US), &mut Always, &mut plan);
        assert_eq!(found, Err(RenderError::Memory), "{name}");
    }
}
