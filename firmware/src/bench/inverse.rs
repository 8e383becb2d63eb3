//! Benchmarks of inverse models: force → pulses, angle → effort.

use super::muscle::{FORCE, RECRUITMENT};
use super::{Bench, Clock};
use crate::control::{FeedForward, WearerModel};
use crate::muscle::{CalciumForceSpec, Inverse, Recruitment};
use crate::units::{Angle, AngularRate, Force, ForceRate};
use fixed::types::I16F16;

/// Slowest and fastest period, 20 and 60 Hz.
const PERIODS_US: (u32, u32) = (50_000, 16_667);

/// Wearer's model of a finger with two flexor points, from an earlier simulated limb.
pub(super) const FINGER: WearerModel = WearerModel {
    rest_mdeg: 5_000,
    stiffness_unm_per_rad: 120_000,
    damping_unm_s_per_rad: 18_000,
    flexion_unm: 484_000,
    extension_unm: 150_000,
    torque_loss_milli: 250,
    curvature_milli: 1_200,
    lead_ms: 100,
};

pub(super) fn run_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    let curve = Recruitment::new(RECRUITMENT).ok()?;
    let (slowest, fastest) = PERIODS_US;
    let inverse = Inverse::new(FORCE, &curve, slowest, fastest, slowest).ok()?;
    // A tick of force control without the setpoint track: lag compensation, then amplitude and
    // period.
    bench.measure(
        "inverse_force",
        1000,
        (curve, inverse),
        |(_, inverse), random| {
            // Up to a tenth beyond the largest force; below 2^31.
            let most = inverse.force_range().1.get().to_bits().cast_unsigned();
            let force = random.between(0, most + most / 10).cast_signed();
            let rate = random.between(0, 40 << 16).cast_signed() - (20 << 16);
            (
                Force::new(I16F16::from_bits(force)),
                ForceRate::new(I16F16::from_bits(rate)),
            )
        },
        |(curve, inverse), &(force, rate)| {
            let drive = inverse.drive(curve, inverse.compensate_lag(force, rate));
            (drive.amplitude.get(), drive.period_us)
        },
        |_, &(amplitude, period_us), sum| {
            sum.add_word(amplitude);
            sum.add_word(period_us);
        },
    );
    // The table of one muscle, as the request for force control computes it.
    bench.measure(
        "inverse_table",
        20,
        curve,
        |_, random| random.between(10_000, 20_000),
        |curve, &fastest_us| {
            let inverse = Inverse::new(FORCE, curve, slowest, fastest_us, slowest);
            inverse.map_or(Force::default(), |inverse| inverse.force_range().1)
        },
        |_, most, sum| sum.add_word(most.get().to_bits().cast_unsigned()),
    );
    // The feed-forward of the nominal wearer.
    bench.measure(
        "feed_forward",
        1000,
        FeedForward::new(&FINGER, 0, 100_000).ok()?,
        |_, random| {
            // 0…100°, in 0.01°; fits i16. ±50 °/s.
            let target = Angle::from_centideg(random.between(0, 10_000) as i16);
            let rate = random.between(0, 100 << 16).cast_signed() - (50 << 16);
            (target, AngularRate::new(I16F16::from_bits(rate)))
        },
        |inverse, &(target, rate)| inverse.effort(target, rate).to_bits(),
        |_, &effort, sum| sum.add_word(effort as u32), // ±2^24
    );
    Some(())
}

/// Measures the longest table that any request needs: the maximum number of periods, each in the
/// maximum number of steps.
pub(super) fn run_slow_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    /// Muscle with a τ1 at which the model's steps are the longest, under a train of 10 Hz.
    const MUSCLE: CalciumForceSpec = CalciumForceSpec {
        tau1_us: 4_000,
        tau2_us: 1_000_000,
        ..FORCE
    };
    const TRAIN_US: u32 = 100_000;
    bench.measure(
        "inverse_table_slow",
        20,
        Recruitment::new(RECRUITMENT).ok()?,
        // 50 steps of 2 ms each.
        |_, random| {
            let fastest_us = random.between(98_001, TRAIN_US);
            (fastest_us, random.between(500_000, 2_000_000))
        },
        |curve, &(fastest_us, slowest_us)| {
            let inverse = Inverse::new(MUSCLE, curve, TRAIN_US, fastest_us, slowest_us);
            inverse.map_or_else(
                |_| <(Force, Force)>::default(),
                |inverse| inverse.force_range(),
            )
        },
        |_, (least, most), sum| {
            sum.add_word(least.get().to_bits().cast_unsigned());
            sum.add_word(most.get().to_bits().cast_unsigned());
        },
    );
    Some(())
}
