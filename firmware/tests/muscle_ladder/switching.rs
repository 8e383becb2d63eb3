//! Changes of model level: no step in force between two models, and a start at rest after a level
//! without a model.

use super::twins::{self, FatigueMode, Pulse};
use super::{START, ladder, newtons, peak, run, subjects, train};
use firmware::muscle::{
    CalciumForceSpec, FatigueSpec, Gain, Model, MuscleLevel, MuscleModel, NoFatigue, TabulatedForce,
};
use firmware::units::{Micros, us};
use fixed::types::U1F31;
use proptest::prelude::*;

fn any_rung() -> impl Strategy<Value = MuscleLevel> {
    prop::sample::select(MuscleLevel::ALL.to_vec())
}

fn any_spec() -> impl Strategy<Value = CalciumForceSpec> {
    (
        100u32..=10_000_000,
        2_000u32..=5_000_000,
        5_000u32..=100_000,
        2_000u32..=200_000,
        1_000u32..=1_000_000,
    )
        .prop_map(|(a, k, c, t1, t2)| CalciumForceSpec {
            a_mn_per_s: a,
            k_micro: k,
            tau_c_us: c,
            tau1_us: t1,
            tau2_us: t2,
        })
}

fn any_fatigue() -> impl Strategy<Value = FatigueSpec> {
    (
        0u32..=10_000,
        0u32..=100_000_000,
        0u32..=100_000_000,
        10_000u32..=1_000_000,
    )
        .prop_map(|(a, k, t, fat)| FatigueSpec {
            alpha_a_milli_per_s2: a,
            alpha_k_nano_per_n_s: k,
            alpha_tau1_nano_per_n: t,
            tau_fat_ms: fat,
        })
}

proptest! {
    /// For any muscle, any pulses, and a change to any level at any time, force is continuous or
    /// begins at zero, stays within full scale, and becomes exactly zero at the end.
    #[test]
    fn no_change_of_rung_steps(
        spec in any_spec(),
        fatigue in any_fatigue(),
        start in any::<u32>(),
        first in any_rung(),
        events in prop::collection::vec(
            (0u32..60_000, any::<u32>(), prop::option::of(any_rung()), 0u32..40), 1..120),
    ) {
        let ladder = MuscleModel::new(spec, Some(fatigue), first).unwrap();
        let full = f64::from(spec.a_mn_per_s) * 1e-3 * f64::from(200_000 + spec.tau2_us) * 1e-6;
        let mut now = firmware::units::Micros::new(start);
        let mut state = ladder.at_rest(now);
        for (gap, gain, level, ticks) in events {
            ladder.pulse(&mut state, now + us(gap % 1500), Gain::new(U1F31::from_bits(gain)));
            now += us(gap);
            ladder.advance(&mut state, now);
            if let Some(level) = level {
                let before = ladder.predicted_force(&TabulatedForce::NONE, &state);
                ladder.switch(&mut state, level, now).unwrap();
                prop_assert_eq!(state.model_level(), level);
                let after = ladder.predicted_force(&TabulatedForce::NONE, &state);
                prop_assert_eq!(after.is_some(), level != MuscleLevel::None);
                if let Some(after) = after {
                    prop_assert_eq!(after, before.unwrap_or_default());
                }
            }
            for _ in 0..ticks {
                now += us(1000);
                ladder.advance(&mut state, now);
                let force = newtons(&ladder, &state);
                prop_assert!((0.0..=full * (1.0 + 1e-6) + 1e-4).contains(&force));
            }
        }
        now += us(30_000_000);
        ladder.advance(&mut state, now);
        prop_assert_eq!(newtons(&ladder, &state), 0.0);
    }
}

#[test]
fn a_rung_that_tires_needs_its_parameters() {
    let (_, m) = subjects().remove(0);
    let ladder = MuscleModel::new(super::spec(&m), None, MuscleLevel::CalciumForce).unwrap();
    let mut state = ladder.at_rest(START);
    assert_eq!(
        ladder.switch(&mut state, MuscleLevel::CalciumForceFatigue, START),
        Err(NoFatigue)
    );
    assert_eq!(state.model_level(), MuscleLevel::CalciumForce);
}

/// Returns the end of a tick of `run`.
fn at(tick: u64) -> Micros {
    START + us((tick * 1000) as u32)
}

/// In a train of 2 s the level is different from 0.6 to 0.9 s. From 1.6 s on, force equals that of
/// an unchanged level, except for 0.3 s of work without fatigue.
#[test]
fn a_detour_is_forgotten() {
    for hz in [15.0, 20.0, 40.0, 100.0] {
        let pulses = train(hz, 0, 2000);
        for home in MuscleLevel::ALL {
            for by in MuscleLevel::ALL {
                let (mut meanwhile, mut late) = (0f64, 0f64);
                for (_, m) in subjects() {
                    let ladder = ladder(&m, home);
                    let straight = run(&ladder, &pulses, 2000, |_, _| ());
                    let changed = run(&ladder, &pulses, 2000, |tick, state| match tick {
                        600 => ladder.switch(state, by, at(tick)).unwrap(),
                        900 => ladder.switch(state, home, at(tick)).unwrap(),
                        _ => {}
                    });
                    let top = peak(&straight).max(f64::MIN_POSITIVE);
                    let off = |i: usize| (straight[i] - changed[i]).abs() / top * 100.0;
                    meanwhile = (600..900).map(off).fold(meanwhile, f64::max);
                    late = (1600..2000).map(off).fold(late, f64::max);
                }
                println!("{hz} Hz, {home:?} by {by:?}: {meanwhile:.2} %, later {late:.4} %");
                let bound = match (home, by) {
                    (MuscleLevel::None, _) => continue, // nothing to compare with
                    // 0.7 s after rest, e^(−0.7/0.2275) of K01's force is still missing.
                    (MuscleLevel::CalciumForceFatigue, MuscleLevel::None) => 4.7 + 1.5,
                    (_, MuscleLevel::None) => 4.7,
                    (MuscleLevel::CalciumForceFatigue, _) => 1.5,
                    _ => 0.0,
                };
                assert!(late <= bound, "{home:?} by {by:?} at {hz} Hz: {late} %");
            }
        }
    }
}

/// After a minute's work the level below continues with the fatigued muscle.
#[test]
fn a_tired_muscle_stays_tired_on_the_rung_below() {
    let (_, m) = subjects().remove(0);
    let pulses: Vec<Pulse> = train(40.0, 0, 30_000);
    let top = ladder(&m, MuscleLevel::CalciumForceFatigue);
    let straight = run(&top, &pulses, 30_000, |_, _| ());
    let (fresh, _) = twins::tiring(&m, FatigueMode::Never, &pulses, 30_000);
    for by in [MuscleLevel::None, MuscleLevel::CalciumForce] {
        let below = run(&top, &pulses, 30_000, |tick, state| match tick {
            27_700 => top.switch(state, by, at(tick)).unwrap(),
            28_000 => top
                .switch(state, MuscleLevel::CalciumForce, at(tick))
                .unwrap(),
            _ => {}
        });
        let (tired, now) = (straight[29_990], below[29_990]);
        println!(
            "by {by:?}: {now:.3} N, tiring on {tired:.3} N, fresh {:.3} N",
            fresh[29_990]
        );
        assert!((now / tired - 1.0).abs() < 0.1, "{now} {tired}");
        assert!(tired < 0.8 * fresh[29_990]);
    }
}
