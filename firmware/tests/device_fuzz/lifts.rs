//! Random joints whose stimulation follows their angles.

use super::hosts::{near, near16};
use firmware::haptics::{Form, ModulatedSpec, ModulationSpec, QuarticSpec};
use firmware::units::Amplitude;
use proptest::array::uniform5;
use proptest::option;
use proptest::prelude::*;

/// Generates shares mostly between 0 and 1.
fn share() -> impl Strategy<Value = QuarticSpec> {
    prop_oneof![
        20 => uniform5(0i32..1_000_000).prop_map(QuarticSpec),
        5 => uniform5(-600_000i32..1_600_000).prop_map(QuarticSpec),
        1 => uniform5(any::<i32>()).prop_map(QuarticSpec),
    ]
}

fn muscle() -> impl Strategy<Value = ModulatedSpec> {
    (
        near(0, 3),
        near(1, 12_000),
        option::of(near(0, 3_000)),
        option::of(share()),
        option::of(share()),
    )
        .prop_map(|(channel, base, threshold, lift, drop)| ModulatedSpec {
            channel: channel as u8,
            base: Amplitude::new(base),
            form: threshold.map_or(Form::Scaled, |threshold| Form::AboveThreshold {
                threshold: Amplitude::new(threshold),
            }),
            lift,
            drop,
        })
}

pub fn lift() -> impl Strategy<Value = ModulationSpec> {
    (
        (near(0, 1), prop_oneof![4 => Just(0u8), 1 => 0u8..5]),
        (near16(10, 20_000), near(500, 20_000)),
        prop_oneof![3 => Just((0, 100_000)), 1 => any::<(i32, i32)>()],
        (near16(2, 500), near(100, 2_000)),
        (muscle(), muscle()),
    )
        .prop_map(
            |((joint, phase_joint), (dead_band, cutoff_mhz), angles, times, muscles)| {
                ModulationSpec {
                    joint: joint as u8,
                    phase_joint,
                    dead_band_centideg_per_s: dead_band,
                    cutoff_mhz,
                    angle_min_mdeg: angles.0,
                    angle_max_mdeg: angles.1,
                    stale_after_ms: times.0,
                    max_hold_ms: times.1,
                    flexor: muscles.0,
                    extensor: muscles.1,
                }
            },
        )
}
