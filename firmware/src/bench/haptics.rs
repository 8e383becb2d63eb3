//! The virtual wall.

use super::{Bench, Checksum, Clock};
use crate::control::SensorSource;
use crate::haptics::{CoContraction, PreWall, Side, Wall, WallSpec, WallState};
use crate::units::{Amplitude, Angle, Micros, us};

/// Everything that a wall can have.
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

/// A limb that swings through pre-wall and wall, ticked every millisecond.
pub(super) fn rows<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    bench.row(
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
                answer.amplitudes(&orders.amplitudes);
                answer.word(orders.penetration.get().to_bits().cast_unsigned());
            }
            answer
        },
        |_, answer, sum| sum.word(answer.value()),
    );
    Some(())
}
