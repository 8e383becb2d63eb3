//! Trains that a board with one supply for its stages refuses, compared with the phases themselves,
//! µs by µs.

use crate::device_desk::*;
use firmware::device::{Draft, Part, Rule};
use firmware::pulse::{CHANNELS, DEAD_TIME_US, GroupSpec, Partner, Shape, TrainSpec, Trigger};
use firmware::safety::{
    ChannelSpec, Origin, SetupError, StageKind, StageSupply, StageTable, Stages, WearerSpec,
};
use proptest::prelude::*;
use std::convert::Infallible;

const SHAPES: [Shape; 4] = [
    Shape::BiphasicCathodicFirst,
    Shape::BiphasicAnodicFirst,
    Shape::MonophasicCathodic,
    Shape::MonophasicAnodic,
];

fn draft_with_supply(supply: Option<StageSupply>) -> Draft {
    let stages = [Some(StageKind::Current {
        full_scale_ua: 100_000,
    }); CHANNELS];
    let origin = Origin::Owner;
    Draft::for_stages(Stages::Stored(StageTable {
        origin,
        supply,
        stages,
    }))
}

/// Returns the pairs for which a setup with these trains is refused.
fn refused_pairs(
    mut draft: Draft,
    trains: &[TrainSpec],
    groups: &[GroupSpec],
) -> Result<Vec<(u8, u8)>, Vec<Rule>> {
    draft.set_wearer(WearerSpec::default()).unwrap();
    for (number, train) in (0u8..).zip(trains) {
        let spec = ChannelSpec {
            limit: firmware::units::Amplitude::new(1_000),
            ..channel(*train)
        };
        draft.set_channel(number, spec).unwrap();
    }
    draft.set_groups(groups.iter().copied().collect()).unwrap();
    let (mut pairs, mut others) = (Vec::new(), Vec::new());
    let setup = draft.examine(|mistake| {
        match mistake.rule {
            Rule::Setup(SetupError::Opposed { channel, other }) => {
                assert_eq!(mistake.part, Part::Setup);
                pairs.push((channel, other));
            }
            other => others.push(other),
        }
        Ok::<(), Infallible>(())
    });
    let Ok(setup) = setup;
    assert_eq!(setup.is_some(), pairs.is_empty() && others.is_empty());
    if others.is_empty() {
        Ok(pairs)
    } else {
        Err(others)
    }
}

fn is_refused(a: TrainSpec, b: TrainSpec, groups: &[GroupSpec]) -> bool {
    let refused = refused_pairs(
        draft_with_supply(Some(StageSupply::Common)),
        &[a, b],
        groups,
    );
    refused.unwrap() == [(0, 1)]
}

fn of_shape(shape: Shape, width_us: u16) -> TrainSpec {
    TrainSpec {
        shape,
        ..match shape.is_biphasic() {
            true => TrainSpec::biphasic(width_us, 100, 20_000),
            false => TrainSpec::monophasic(width_us, 1_000, 20_000),
        }
    }
}

/// Returns, for each µs of `span_us`, whether `train` drives a cathodic and whether an anodic
/// phase.
fn driven_signs(train: &TrainSpec, widths: [u16; 2], span_us: u32) -> Vec<[bool; 2]> {
    let mut signs = vec![[false; 2]; span_us as usize];
    let first = usize::from(!train.shape.cathodic_first());
    let mut start = train.offset_us;
    while start < span_us {
        for pulse in 0..u32::from(train.burst_count) {
            for width_us in widths {
                let width = u32::from(width_us);
                let begin = start + pulse * u32::from(train.burst_interval_us);
                let second = begin + width + u32::from(train.gap_us.max(DEAD_TIME_US));
                let mut drive = |from: u32, sign: usize| {
                    for t in from..(from + width).min(span_us) {
                        signs[t as usize][sign] = true;
                    }
                };
                drive(begin, first);
                if train.shape.is_biphasic() {
                    drive(second, 1 - first);
                }
            }
        }
        start += train.period_us;
    }
    signs
}

/// Returns whether opposite signs come closer than the dead time.
fn signs_meet(a: &[[bool; 2]], b: &[[bool; 2]]) -> bool {
    let dead = usize::from(DEAD_TIME_US);
    [(0, 1), (1, 0)].into_iter().any(|(own, its)| {
        let (mut last_own, mut last_its) = (None, None);
        a.iter().zip(b).enumerate().any(|(t, (a, b))| {
            last_own = if a[own] { Some(t) } else { last_own };
            last_its = if b[its] { Some(t) } else { last_its };
            let is_near = |last: Option<usize>| last.is_some_and(|last| t - last <= dead);
            a[own] && is_near(last_its) || b[its] && is_near(last_own)
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// Tests trains of one width with periods whose distances all occur within a second.
    #[test]
    fn what_is_refused_is_what_can_meet(
        shapes in (0..4_usize, 0..4_usize),
        widths in (10..500_u16, 10..500_u16),
        offsets in (0..20_000_u32, 0..20_000_u32),
        near in any::<bool>(),
        apart in -1_300..1_300_i32,
        periods in prop::sample::select(vec![
            (20_000, 20_000), (20_000, 40_000), (20_000, 25_000), (24_000, 20_000),
        ]),
        counts in (1..4_u8, 1..4_u8),
    ) {
        let train = |shape: usize, width, offset_us, period_us, burst_count| TrainSpec {
            offset_us,
            period_us,
            burst_count,
            burst_interval_us: if burst_count > 1 { 2_600 } else { 0 },
            ..of_shape(SHAPES[shape], width)
        };
        let second = match near {
            true => offsets.0.saturating_add_signed(apart).min(20_000),
            false => offsets.1,
        };
        let a = train(shapes.0, widths.0, offsets.0, periods.0, counts.0);
        let b = train(shapes.1, widths.1, second, periods.1, counts.1);
        // Twice the longest common multiple, plus an offset.
        let span = 260_000;
        let (pa, pb) = (driven_signs(&a, [widths.0; 2], span), driven_signs(&b, [widths.1; 2], span));
        prop_assert_eq!(is_refused(a, b, &[]), signs_meet(&pa, &pb), "{:?} {:?}", a, b);
    }
}

/// Tests the effect of each field of a pair.
#[test]
fn pairs_that_can_oppose_are_refused_and_others_are_not() {
    let cathodic = of_shape(Shape::MonophasicCathodic, 200);
    let anodic = of_shape(Shape::MonophasicAnodic, 200);
    let later = |train: TrainSpec, offset_us| TrainSpec { offset_us, ..train };
    let isolated = [GroupSpec {
        members: 0b11,
        partner: Partner::Isolated,
    }];
    let conducted = [GroupSpec {
        partner: Partner::Conducted,
        ..isolated[0]
    }];
    let triggered = |train| TrainSpec {
        trigger: Some(Trigger::Start),
        ..train
    };
    let live = |train| TrainSpec {
        max_width_us: 400,
        ..train
    };
    let lists = |train| TrainSpec {
        lists: true,
        ..train
    };
    let every = |train, period_us| TrainSpec { period_us, ..train };
    let cases: [(&str, TrainSpec, TrainSpec, &[GroupSpec], bool); 22] = [
        ("one sign", cathodic, cathodic, &[], false),
        (
            "one sign, any rate",
            cathodic,
            every(cathodic, 19_999),
            &[],
            false,
        ),
        ("opposite", cathodic, anodic, &[], true),
        (
            "within the dead time",
            cathodic,
            later(anodic, 204),
            &[],
            true,
        ),
        (
            "behind the dead time",
            cathodic,
            later(anodic, 205),
            &[],
            false,
        ),
        (
            "before, by the dead time",
            later(cathodic, 205),
            anodic,
            &[],
            false,
        ),
        (
            "at the period's end",
            later(cathodic, 19_796),
            anodic,
            &[],
            true,
        ),
        ("biphasic together", PLAIN, PLAIN, &[], false),
        ("second on first", PLAIN, later(PLAIN, 300), &[], true),
        ("second behind first", PLAIN, later(PLAIN, 505), &[], false),
        (
            "other order",
            PLAIN,
            of_shape(Shape::BiphasicAnodicFirst, 200),
            &[],
            true,
        ),
        ("widths that part", PLAIN, live(PLAIN), &[], true),
        (
            "widths far apart",
            PLAIN,
            later(live(PLAIN), 2_000),
            &[],
            false,
        ),
        (
            "rates that meet",
            PLAIN,
            every(later(PLAIN, 9_000), 19_999),
            &[],
            true,
        ),
        (
            "rates that do not",
            PLAIN,
            every(later(PLAIN, 9_000), 40_000),
            &[],
            false,
        ),
        (
            "triggered and not",
            PLAIN,
            triggered(later(PLAIN, 9_000)),
            &[],
            true,
        ),
        (
            "triggered",
            triggered(PLAIN),
            triggered(later(PLAIN, 9_000)),
            &[],
            true,
        ),
        (
            "triggered, isolated",
            triggered(PLAIN),
            triggered(later(PLAIN, 9_000)),
            &isolated,
            false,
        ),
        (
            "triggered, conducted",
            triggered(PLAIN),
            triggered(later(PLAIN, 9_000)),
            &conducted,
            true,
        ),
        ("isolated", PLAIN, later(PLAIN, 9_000), &isolated, false),
        ("lists", PLAIN, lists(later(PLAIN, 9_000)), &[], true),
        ("lists of one sign", cathodic, lists(cathodic), &[], false),
    ];
    for (name, a, b, groups, refused) in cases {
        assert_eq!(is_refused(a, b, groups), refused, "{name}");
        assert_eq!(is_refused(b, a, groups), refused, "{name}, exchanged");
    }
}

/// A table without a supply counts as one with a common supply. A separate supply, or a simulator
/// without stages, causes no refusal. Each pair is named.
#[test]
fn a_supply_that_is_common_or_undeclared_refuses_every_pair_by_name() {
    let anodic_first = of_shape(Shape::BiphasicAnodicFirst, 200);
    let trains = [PLAIN, PLAIN, anodic_first];
    for supply in [None, Some(StageSupply::Common)] {
        let refused = refused_pairs(draft_with_supply(supply), &trains, &[]);
        assert_eq!(refused, Ok(vec![(0, 2), (1, 2)]), "{supply:?}");
    }
    for draft in [
        draft_with_supply(Some(StageSupply::Separate)),
        Draft::default(),
    ] {
        assert_eq!(refused_pairs(draft, &trains, &[]), Ok(Vec::new()));
    }
}
