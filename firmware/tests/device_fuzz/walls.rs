//! Random virtual walls.

use super::hosts::{near, near16, sensor};
use firmware::haptics::{CoContraction, PreWall, Side, WallSpec};
use firmware::units::Amplitude;
use proptest::option;
use proptest::prelude::*;

pub fn wall() -> impl Strategy<Value = WallSpec> {
    let pre_wall = (near(100, 45_000), near(0, 10_000), near(0, 20_000)).prop_map(
        |(depth_mdeg, begin, end)| PreWall {
            depth_mdeg,
            begin: Amplitude::new(begin),
            end: Amplitude::new(end),
        },
    );
    let antagonist = (near(1, 3), near(1, 20_000)).prop_map(|(channel, amplitude)| CoContraction {
        channel: channel as u8,
        amplitude: Amplitude::new(amplitude),
    });
    (
        prop_oneof![3 => Just((0, 100_000)), 1 => any::<(i32, i32)>()],
        prop_oneof![3 => 0i32..100_000, 1 => any::<i32>()],
        any::<bool>(),
        (near(0, 0), near(1, 20_000), near(1, 200_000)),
        (near(0, 20_000), near(500, 20_000)),
        option::of(pre_wall),
        option::of(antagonist),
        sensor(),
        near16(2, 500),
    )
        .prop_map(
            |(angles, at_mdeg, flexion, main, damper, pre_wall, co_contraction, sensor, stale)| {
                let (channel, max, stiffness) = main;
                WallSpec {
                    at_mdeg,
                    side: if flexion {
                        Side::Flexion
                    } else {
                        Side::Extension
                    },
                    channel: channel as u8,
                    max: Amplitude::new(max),
                    stiffness,
                    damping: damper.0,
                    cutoff_mhz: damper.1,
                    pre_wall,
                    co_contraction,
                    angle_min_mdeg: angles.0,
                    angle_max_mdeg: angles.1,
                    sensor,
                    stale_after_ms: stale,
                }
            },
        )
}
