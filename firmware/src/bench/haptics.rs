//! Benchmarks of the virtual wall and of modulated joints.

use super::{Bench, Checksum, Clock};
use crate::control::SensorSource;
use crate::haptics::{
    CoContraction, Form, JOINTS, ModulatedSpec, Modulation, ModulationSpec, Modulations,
    ModulationsState, PreWall, QuarticSpec, Side, Wall, WallSpec, WallState,
};
use crate::units::{Amplitude, Angle, Micros, us};

/// A wall with all optional parts.
const WALL: WallSpec = WallSpec {
    at_mdeg: 90_000,
    side: Side::Flexion,
    channel: 0,
    max: Amplitude::new(80_000),
    stiffness: 8_900,
    damping: 200,
    cutoff_mhz: 10_000,
    pre_wall: Some(PreWall {
        depth_mdeg: 9_000,
        begin: Amplitude::new(20_000),
        end: Amplitude::new(40_000),
    }),
    co_contraction: Some(CoContraction {
        channel: 1,
        amplitude: Amplitude::new(40_000),
    }),
    angle_min_mdeg: 0,
    angle_max_mdeg: 150_000,
    sensor: SensorSource::Adc {
        code_at_0: 500,
        code_at_100: 2_500,
    },
    stale_after_ms: 10,
};

/// A share that rises to 0.88 and falls again.
const SHARE: QuarticSpec = QuarticSpec([100_000, 700_000, 1_300_000, 900_000, 400_000]);
/// The share whose search for extremes takes longest: 25 halvings.
const LONGEST: QuarticSpec = QuarticSpec([2_697_166, 3_730_286, -3_361_313, 6_843_367, 2_388_290]);

/// Returns the specification of one of two arms' joints, with both muscles in both phases.
fn joint(joint: u8, share: QuarticSpec) -> ModulationSpec {
    let muscle = |channel| ModulatedSpec {
        channel,
        base: Amplitude::new(20_000),
        form: Form::AboveThreshold {
            threshold: Amplitude::new(8_000),
        },
        lift: Some(share),
        drop: Some(share),
    };
    ModulationSpec {
        joint,
        phase_joint: joint & !1,
        dead_band_centideg_per_s: 800,
        cutoff_mhz: 2_000,
        angle_min_mdeg: 10_000,
        angle_max_mdeg: 120_000,
        stale_after_ms: 50,
        max_hold_ms: 600_000,
        flexor: muscle(joint * 2), // 0…7 of 0…3
        extensor: muscle(joint * 2 + 1),
    }
}

/// Measures two arms that move up and down in 2 s, measured every millisecond, with an object held.
pub(super) fn run_lift_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    let mut joints = Modulations::default();
    for number in 0..JOINTS as u8 {
        joints.push(Modulation::new(&joint(number, SHARE)).ok()?);
    }
    bench.measure(
        "modulation_tick",
        2000,
        (joints, ModulationsState::default(), Micros::new(0)),
        |(joints, state, now), random| {
            *now += us(1000);
            let way = now.get() / 1000 % 2_000; // 0…1999
            let way = way.min(2_000 - way); // up, and down again
            for number in 0..JOINTS as u8 {
                let angle = (1_500 + way * 10 + random.between(0, 20)) as i16; // below 2^14
                let angle = Angle::from_centideg(angle);
                let _ = joints.accept_measurement(state, *now, *now, number, angle);
            }
            let _ = joints.set_held(state, *now, true);
        },
        |(joints, state, now), ()| {
            let mut answer = Checksum::default();
            if let Ok(orders) = joints.tick(state, *now) {
                for (channel, amplitude) in orders.amplitudes {
                    answer.add_word(u32::from(channel) << 24 | amplitude.get());
                }
            }
            answer
        },
        |_, answer, sum| sum.add_word(answer.value()),
    );
    let longest = joint(0, LONGEST);
    bench.measure(
        "modulation_check",
        20,
        longest,
        |_, _| (),
        |spec, ()| {
            let mut mistakes = 0u32;
            spec.report_mistakes(&mut |_| mistakes = mistakes.saturating_add(1));
            mistakes
        },
        |_, mistakes, sum| sum.add_word(*mistakes),
    );
    Some(())
}

/// Measures a limb that swings through pre-wall and wall, with a tick every millisecond.
pub(super) fn run_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    bench.measure(
        "wall_tick",
        1000,
        (Wall::new(&WALL).ok()?, WallState::default(), Micros::new(0)),
        |(_, _, now), random| {
            *now += us(1000);
            // Sweeps 75…105° in 0.3 s, with noise; fits i16.
            let sweep = 7_500 + now.get() / 1000 * 10 % 3_000;
            Angle::from_centideg((sweep + random.between(0, 50)) as i16)
        },
        |(wall, state, now), angle| {
            let mut answer = Checksum::default();
            if let Ok(orders) = wall.tick(state, *now, Some(*angle)) {
                answer.add_amplitudes(&orders.amplitudes);
                answer.add_word(orders.penetration.get().to_bits().cast_unsigned());
            }
            answer
        },
        |_, answer, sum| sum.add_word(answer.value()),
    );
    Some(())
}
