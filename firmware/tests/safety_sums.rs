//! Sums over the common return, compared with a sum over every microsecond.

use firmware::pulse::{CHANNELS, Shape, TrainSpec, Trigger};
use firmware::safety::{Channel, ChannelSpec, SetupError, StageSpec, SumError, Sums, WearerSpec};
use firmware::units::{Amplitude, MicroAmps};
use proptest::prelude::*;

fn channel(train: TrainSpec, limit_ua: u32) -> Option<Channel> {
    let spec = ChannelSpec {
        train,
        stage: StageSpec::Current {
            full_scale_ua: 100_000,
        },
        limit: Amplitude::new(limit_ua),
        start: Amplitude::new(0),
        area_mm2: 20_000,
    };
    spec.validate(&WearerSpec::default().validate().unwrap())
        .ok()
}

fn all(trains: &[(TrainSpec, u32)]) -> [Option<Channel>; CHANNELS] {
    let mut channels = [None; CHANNELS];
    for (slot, &(train, limit_ua)) in channels.iter_mut().zip(trains) {
        *slot = channel(train, limit_ua);
        assert!(slot.is_some(), "{train:?}");
    }
    channels
}

const PLAIN: TrainSpec = TrainSpec::biphasic(200, 100, 20_000);

fn at(offset_us: u32) -> TrainSpec {
    TrainSpec { offset_us, ..PLAIN }
}

/// Returns the largest sum of one sign, and the rms of the larger of both signs, µA, in 60 ms.
fn walk(trains: &[(TrainSpec, u32)]) -> (u32, f64) {
    const LENGTH_US: u32 = 60_000;
    let mut sums = vec![[0u32; 2]; LENGTH_US as usize];
    for (spec, ua) in trains {
        let train = spec.validate().unwrap();
        let second = u32::from(spec.width_us) + u32::from(train.gap_us());
        let first_sign = usize::from(spec.shape.cathodic_first());
        let phases = [(0, first_sign), (second, 1 - first_sign)];
        let phases = &phases[..1 + usize::from(spec.shape.is_biphasic())];
        for burst in 0..LENGTH_US / spec.period_us {
            for pulse in 0..spec.burst_count {
                for (lag, sign) in phases {
                    let start = spec.offset_us + burst * spec.period_us;
                    let start = start + train.pulse_offset_us(pulse) + lag;
                    for t in start..start + u32::from(spec.width_us) {
                        sums[(t % LENGTH_US) as usize][*sign] += ua;
                    }
                }
            }
        }
    }
    let largest = sums.iter().map(|pair| pair[0].max(pair[1]));
    let square: f64 = largest.clone().map(|ua| f64::from(ua).powi(2)).sum();
    let rms = (square / f64::from(LENGTH_US)).sqrt();
    (largest.max().unwrap(), rms)
}

fn train(periods: &'static [u32]) -> impl Strategy<Value = (TrainSpec, u32)> {
    let shape = prop::sample::select(vec![
        Shape::BiphasicCathodicFirst,
        Shape::BiphasicAnodicFirst,
        Shape::MonophasicCathodic,
        Shape::MonophasicAnodic,
    ]);
    let numbers = (
        10..=300u16,
        0..=200u16,
        0..4_000u32,
        1..=3u8,
        1_000..=30_000u32,
    );
    let period = prop::sample::select(periods.to_vec());
    (shape, numbers, period).prop_map(
        |(shape, (width_us, gap, offset_us, count, ua), period_us)| {
            let biphasic = shape.is_biphasic();
            let spec = TrainSpec {
                shape,
                gap_us: if biphasic { gap } else { 0 },
                ground_us: if biphasic { 0 } else { 1_000 },
                offset_us,
                burst_count: count,
                burst_interval_us: if count > 1 { 1_400 } else { 0 },
                ..TrainSpec::biphasic(width_us, 0, period_us)
            };
            (spec, ua)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn of_one_period_the_largest_sum_is_exact(
        trains in prop::collection::vec(train(&[20_000]), 1..8)
    ) {
        let sums = Sums::of(&all(&trains));
        let (peak, rms) = walk(&trains);
        prop_assert_eq!(sums.peak.get(), peak);
        prop_assert!(f64::from(sums.rms.get()) >= rms, "{:?} {}", sums, rms);
    }

    #[test]
    fn of_several_periods_no_sum_is_too_low(
        trains in prop::collection::vec(train(&[5_000, 7_500, 10_000, 12_000, 20_000]), 1..8)
    ) {
        let sums = Sums::of(&all(&trains));
        let (peak, rms) = walk(&trains);
        prop_assert!(sums.peak.get() >= peak, "{:?} {}", sums, peak);
        prop_assert!(f64::from(sums.rms.get()) >= rms, "{:?} {}", sums, rms);
    }
}

/// A sum that equals the wearer's limit exactly is accepted.
#[test]
fn a_whole_sum_is_not_rounded_up() {
    // 400 of 16,000 µs are a fortieth: ten trains that do not overlap give half their current.
    let train = |n: u32| TrainSpec {
        period_us: 16_000,
        ..at(1_000 * n)
    };
    let trains: Vec<_> = (0..10).map(|n| (train(n), 6_000)).collect();
    let sums = Sums::of(&all(&trains));
    assert_eq!(sums.rms.get(), 3_000);
    // Ten that coincide give 6 mA · 10 / √40 = 9.4868 mA.
    let trains = vec![(train(0), 6_000); 10];
    assert_eq!(Sums::of(&all(&trains)).rms.get(), 9_487);
}

#[test]
fn ten_channels_at_once_are_told_with_their_sum() {
    let wearer = WearerSpec::default().validate().unwrap();
    let ten = |limit_ua: u32, step_us: u32| {
        let trains: Vec<_> = (0..10).map(|n| (at(n * step_us), limit_ua)).collect();
        Sums::of(&all(&trains))
    };
    let (sum, max) = (MicroAmps::new(201_000), MicroAmps::new(200_000));
    assert_eq!(ten(20_000, 0).check(&wearer), Ok(()));
    assert_eq!(
        ten(20_100, 0).check(&wearer),
        Err(SumError::Peak { sum, max })
    );
    println!("ten channels at once: limit 200 mA, 10 x 20.1 mA refused with 201 mA");
    // At 300 µs apart, each first phase meets the second phase of the previous train, which has the
    // other sign; at 2 ms nothing meets. Ten times 40 mA at 200 µs and 50 Hz are 5.657 mA rms each,
    // and √10 times as much together, rounded up once.
    assert_eq!(ten(40_000, 300).peak.get(), 40_000);
    let apart = ten(40_000, 2_000);
    assert_eq!((apart.peak.get(), apart.rms.get()), (40_000, 17_889));
    // All at once the sum is ten times as large, above 50 mA.
    let together = Sums {
        peak: max,
        ..ten(40_000, 0)
    };
    let (sum, max) = (MicroAmps::new(56_569), MicroAmps::new(50_000));
    assert_eq!(together.check(&wearer), Err(SumError::Rms { sum, max }));
    // 2 mA/cm² at a return of 5 cm² are 10 mA.
    let small = WearerSpec {
        return_area_mm2: 500,
        ..WearerSpec::default()
    };
    let (sum, max) = (MicroAmps::new(17_889), MicroAmps::new(10_000));
    let refused = apart.check(&small.validate().unwrap());
    assert_eq!(refused, Err(SumError::Rms { sum, max }));
}

/// A channel that may pulse at any time can overlap every other with a phase of the same sign.
#[test]
fn triggered_trains_and_rates_that_change_may_meet_any() {
    let triggered = TrainSpec {
        trigger: Some(Trigger::Start),
        ..at(2_000)
    };
    let anodic = TrainSpec {
        shape: Shape::MonophasicAnodic,
        gap_us: 0,
        ground_us: 1_000,
        ..at(4_000)
    };
    let peak = |trains: &[(TrainSpec, u32)]| Sums::of(&all(trains)).peak.get();
    assert_eq!(peak(&[(at(0), 10_000), (at(2_000), 20_000)]), 20_000);
    assert_eq!(peak(&[(at(0), 10_000), (triggered, 20_000)]), 30_000);
    let cathodic = TrainSpec {
        shape: Shape::MonophasicCathodic,
        trigger: Some(Trigger::Start),
        ..anodic
    };
    assert_eq!(peak(&[(anodic, 10_000), (cathodic, 20_000)]), 20_000);
    let mut changing = all(&[(at(0), 10_000), (at(2_000), 20_000)]);
    changing[1].as_mut().unwrap().min_period_us = 15_000;
    assert_eq!(Sums::of(&changing).peak.get(), 30_000);
}

#[test]
fn density_is_limited_by_the_electrode() {
    let wearer = WearerSpec::default().validate().unwrap();
    let spec = |area_mm2, limit_ua| ChannelSpec {
        train: PLAIN,
        stage: StageSpec::Current {
            full_scale_ua: 100_000,
        },
        limit: Amplitude::new(limit_ua),
        start: Amplitude::new(0),
        area_mm2,
    };
    // 400 µs every 20 ms: √0.02 of the current.
    let check = |area_mm2, limit_ua| spec(area_mm2, limit_ua).validate(&wearer).map(|_| ());
    let max = MicroAmps::new(2_000);
    assert_eq!(check(100, 14_142), Ok(()));
    assert_eq!(check(100, 14_143), Err(SetupError::Density { max }));
    assert!(matches!(check(0, 1), Err(SetupError::Range(e)) if e.field == "area_mm2"));
}
