//! Properties of the calcium–force model for every muscle it accepts.

use crate::muscle_ladder::{spec, subjects};
use firmware::muscle::{CalciumForce, CalciumForceSpec, CalciumForceState, Gain};
use firmware::range::OutOfRange;
use firmware::units::{Force, Micros, us};
use fixed::types::U1F31;
use proptest::prelude::*;

/// Smallest and largest parameters that the constructor accepts: A, K, τc, τ1, τ2.
const LOWEST: [u32; 5] = [100, 2_000, 5_000, 2_000, 1_000];
const HIGHEST: [u32; 5] = [10_000_000, 5_000_000, 100_000, 200_000, 1_000_000];

fn spec_of([a_mn_per_s, k_micro, tau_c_us, tau1_us, tau2_us]: [u32; 5]) -> CalciumForceSpec {
    CalciumForceSpec {
        a_mn_per_s,
        k_micro,
        tau_c_us,
        tau1_us,
        tau2_us,
    }
}

/// Returns Lee's ten subjects.
fn table_4() -> Vec<CalciumForceSpec> {
    subjects().iter().map(|(_, muscle)| spec(muscle)).collect()
}

fn any_spec() -> impl Strategy<Value = CalciumForceSpec> {
    let range = |i: usize| LOWEST[i]..=HIGHEST[i];
    (range(0), range(1), range(2), range(3), range(4))
        .prop_map(|(a, k, c, t1, t2)| spec_of([a, k, c, t1, t2]))
        .prop_filter("a τ1 too short for its K and τ2", |spec| {
            CalciumForce::new(*spec).is_ok()
        })
}

fn full_scale(spec: &CalciumForceSpec) -> f64 {
    f64::from(spec.a_mn_per_s) * 1e-3 * f64::from(spec.tau1_us + spec.tau2_us) * 1e-6
}

fn newtons(muscle: &CalciumForce, state: &CalciumForceState) -> f64 {
    muscle.force(state).get().to_num()
}

/// Advances the state by `length_us`.
fn wait(muscle: &CalciumForce, state: &mut CalciumForceState, length_us: u32) {
    let to = state.at() + us(length_us);
    muscle.advance(state, to);
}

/// Applies a pulse at `length_us` after the state's time.
fn pulse_after(muscle: &CalciumForce, state: &mut CalciumForceState, length_us: u32, gain: Gain) {
    let at = state.at() + us(length_us);
    muscle.pulse(state, at, gain);
}

/// Applies `n` pulses at intervals of `period_us`, with ticks of 1 ms in between.
fn stimulate(
    muscle: &CalciumForce,
    state: &mut CalciumForceState,
    n: u32,
    period_us: u32,
    mut observer: impl FnMut(&CalciumForceState),
) {
    let start = state.at();
    for i in 0..n {
        muscle.pulse(state, start + us(i * period_us), Gain::FULL);
        observer(state);
        let end = start + us((i + 1) * period_us);
        while state.at() != end {
            let left = end.elapsed_since(state.at());
            wait(muscle, state, left.min(1000));
            observer(state);
        }
    }
}

#[test]
fn calcium_never_saturates_at_200_hz() {
    let slowest = spec_of([HIGHEST[0], LOWEST[1], HIGHEST[2], HIGHEST[3], HIGHEST[4]]);
    for spec in table_4().into_iter().chain([slowest]) {
        let muscle = CalciumForce::new(spec).unwrap();
        let mut state = CalciumForceState::at_rest(Micros::new(0));
        let (mut highest, mut strongest) = (0f64, 0f64);
        stimulate(&muscle, &mut state, 1000, 5000, |now| {
            highest = highest.max(muscle.calcium(now).to_num());
            strongest = strongest.max(newtons(&muscle, now));
        });
        // Eq. (2) summed over a train of equal periods.
        let limit = 1.0 / (1.0 - (-5000.0 / f64::from(spec.tau_c_us)).exp());
        assert!((highest / limit - 1.0).abs() < 2e-5, "{highest} {limit}");
        assert!(strongest < full_scale(&spec));
    }
}

/// Tests the longest τc that a train of bursts allows, and the longest bursts that each subject's
/// τc allows, at the smallest intervals.
#[test]
fn calcium_never_saturates_in_a_burst_that_is_allowed() {
    let mut refused = 0;
    for count in 1..=8u8 {
        for period_us in [5_000, 7_500, 10_000, 20_000, 50_000, 200_000] {
            let slowest = CalciumForceSpec {
                tau_c_us: 100_000,
                ..table_4()[0]
            };
            let longest = match slowest.check_train(count, period_us) {
                Ok(()) => 100_000,
                Err(e) => e.max.cast_unsigned(),
            };
            refused += u32::from(longest < 100_000);
            let spec = CalciumForceSpec {
                tau_c_us: longest,
                ..slowest
            };
            spec.check_train(count, period_us).unwrap();
            let muscle = CalciumForce::new(spec).unwrap();
            let mut state = CalciumForceState::at_rest(Micros::new(0));
            let mut highest = 0.0f64;
            for n in 0..400u32 {
                for pulse in 0..u32::from(count) {
                    let at = Micros::new(n * period_us + pulse * 200);
                    muscle.pulse(&mut state, at, Gain::FULL);
                    muscle.advance(&mut state, at + us(1));
                    highest = highest.max(muscle.calcium(&state).to_num());
                }
            }
            let together = 1.0 - (-f64::from(period_us) / f64::from(longest)).exp();
            let bound = f64::from(count) / together;
            assert!(bound <= 24.0, "{count} every {period_us}: {bound}");
            assert!(
                highest < 23.99 && highest > 0.9 * bound,
                "{highest} of {bound}"
            );
        }
    }
    assert!(refused > 10, "{refused}");
}

#[test]
fn force_reaches_exactly_zero_and_soon() {
    let slowest = spec_of([HIGHEST[0], LOWEST[1], HIGHEST[2], HIGHEST[3], HIGHEST[4]]);
    let cases = table_4().into_iter().map(|spec| (spec, 2_500));
    for (spec, bound_ms) in cases.chain([(slowest, 7_000)]) {
        let muscle = CalciumForce::new(spec).unwrap();
        let mut state = CalciumForceState::at_rest(Micros::new(0));
        stimulate(&muscle, &mut state, 500, 5000, |_| ());
        let mut steps = 0;
        while !state.is_at_rest() {
            let before = muscle.force(&state);
            wait(&muscle, &mut state, 1000);
            assert!(muscle.force(&state) <= before || muscle.calcium(&state) > 0);
            steps += 1;
            assert!(steps <= bound_ms, "{spec:?} still not at rest");
        }
        assert_eq!(muscle.force(&state), Force::default());
    }
}

/// 0.5 s on at 40 Hz and 0.15 s off, too short to come to rest: 923 times.
#[test]
fn ten_minutes_of_on_and_off_do_not_drift() {
    for spec in table_4() {
        let muscle = CalciumForce::new(spec).unwrap();
        let mut state = CalciumForceState::at_rest(Micros::new(u32::MAX - 300_000_000));
        let mut settled = vec![];
        for cycle in 0..923 {
            let mut forces = vec![];
            let end = state.at() + us(650_000);
            stimulate(&muscle, &mut state, 20, 25_000, |now| {
                forces.push(newtons(&muscle, now));
            });
            while state.at() != end {
                wait(&muscle, &mut state, 1000);
            }
            assert!(!state.is_at_rest());
            if cycle == 19 {
                settled = forces;
            } else if cycle == 922 {
                // Rounding causes a cycle of a few 2^-31 of full scale: at most one step of the
                // reported force.
                for (now, then) in forces.iter().zip(&settled) {
                    assert!(
                        (now - then).abs() <= 2f64.powi(-16),
                        "{spec:?}: {now} {then}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_gap_of_35_minutes_is_one_call() {
    let muscle = CalciumForce::new(table_4()[0]).unwrap();
    let mut state = CalciumForceState::at_rest(Micros::new(u32::MAX - 1_000_000));
    stimulate(&muscle, &mut state, 40, 25_000, |_| ());
    let end = state.at() + us(35 * 60 * 1_000_000);
    muscle.advance(&mut state, end);
    assert!(state.is_at_rest());
    assert_eq!(state.at(), end);
    muscle.advance(&mut state, end - us(1)); // a past time changes nothing
    assert_eq!(state.at(), end);
}

/// Steps of 1 µs cause 1000 times as many roundings and a different method error.
#[test]
fn microsecond_steps_stay_within_two_hundredths_of_a_percent() {
    for spec in table_4() {
        let muscle = CalciumForce::new(spec).unwrap();
        let (mut coarse, mut fine) = (
            CalciumForceState::at_rest(Micros::new(0)),
            CalciumForceState::at_rest(Micros::new(0)),
        );
        let (mut worst, mut peak) = (0f64, 0f64);
        for ms in 0..1500u32 {
            if ms < 1000 && ms % 50 == 0 {
                muscle.pulse(&mut coarse, Micros::new(ms * 1000), Gain::FULL);
                muscle.pulse(&mut fine, Micros::new(ms * 1000), Gain::FULL);
            }
            muscle.advance(&mut coarse, Micros::new((ms + 1) * 1000));
            for us in 1..=1000 {
                muscle.advance(&mut fine, Micros::new(ms * 1000 + us));
            }
            let (a, b) = (newtons(&muscle, &coarse), newtons(&muscle, &fine));
            (worst, peak) = (worst.max((a - b).abs()), peak.max(b));
        }
        println!("{spec:?}: {:.4} %", worst / peak * 100.0);
        assert!(worst / peak < 2e-4, "{spec:?}: {}", worst / peak);
    }
}

#[test]
fn a_pulse_below_threshold_changes_nothing() {
    let muscle = CalciumForce::new(table_4()[4]).unwrap();
    let mut state = CalciumForceState::at_rest(Micros::new(7));
    muscle.pulse(&mut state, Micros::new(7), Gain::ZERO);
    assert!(state.is_at_rest());
    muscle.pulse(&mut state, Micros::new(9), Gain::FULL);
    let before = state;
    muscle.pulse(&mut state, Micros::new(9), Gain::ZERO);
    assert_eq!(state, before);
}

#[test]
fn every_parameter_is_refused_just_outside_its_range() {
    let middle = [121_900, 300_000, 20_800, 33_100, 194_400];
    let fields = ["a_mn_per_s", "k_micro", "tau_c_us", "tau1_us", "tau2_us"];
    for (i, field) in fields.into_iter().enumerate() {
        let (min, max) = (LOWEST[i], HIGHEST[i]);
        let with = |given: u32| {
            let mut values = middle;
            values[i] = given;
            CalciumForce::new(spec_of(values)).err()
        };
        for given in [0, min - 1, max + 1, u32::MAX] {
            let refusal = OutOfRange {
                field,
                value: given.into(),
                min: min as i32,
                max: max as i32,
            };
            assert_eq!(with(given), Some(refusal));
        }
        assert_eq!((with(min), with(max)), (None, None));
    }
    // Remaining τ1 at the ends of K and τ2: 20 τ2/(K − 20).
    let [least, enough] = [10_101, 10_102].map(|tau1| {
        CalciumForce::new(spec_of([100_000, LOWEST[1], 20_000, tau1, HIGHEST[4]])).err()
    });
    let refusal = OutOfRange {
        field: "tau1_us",
        value: 10_101,
        min: 10_102,
        max: HIGHEST[3] as i32,
    };
    assert_eq!((least, enough), (Some(refusal), None));
    let refusal = CalciumForce::new(spec_of([0; 5])).unwrap_err();
    assert_eq!(
        refusal.to_string(),
        "a_mn_per_s is 0; allowed: 100 to 10000000"
    );
}

proptest! {
    /// For any muscle, pulses (bursts of any density, any gain) and ticks, force stays between 0
    /// and full scale, and calcium below saturation.
    #[test]
    fn force_stays_within_full_scale(
        spec in any_spec(),
        start in any::<u32>(),
        steps in prop::collection::vec((0u32..30_000, 1u32..9, any::<u32>()), 1..200),
    ) {
        let muscle = CalciumForce::new(spec).unwrap();
        let mut state = CalciumForceState::at_rest(Micros::new(start));
        let scale = full_scale(&spec) * (1.0 + 1e-6) + 1e-4;
        for (gap, burst, gain) in steps {
            let begin = state.at();
            for i in 1..=burst {
                let at = begin + us(i * (gap / 8));
                muscle.pulse(&mut state, at, Gain::new(U1F31::from_bits(gain)));
            }
            for _ in 0..=gap / 1000 {
                wait(&muscle, &mut state, 1000);
                let force = newtons(&muscle, &state);
                prop_assert!((0.0..=scale).contains(&force), "{} of {}", force, scale);
                prop_assert!(muscle.calcium(&state) <= 24);
            }
        }
        wait(&muscle, &mut state, 7_000_000);
        prop_assert!(state.is_at_rest());
    }

    /// The clock's wrap has no effect.
    #[test]
    fn runs_do_not_depend_on_when_they_start(
        which in 0usize..10,
        start in any::<u32>(),
        gaps in prop::collection::vec(0u32..100_000, 1..60),
    ) {
        let muscle = CalciumForce::new(table_4()[which]).unwrap();
        let run = |start: u32| {
            let mut state = CalciumForceState::at_rest(Micros::new(start));
            let mut forces = vec![];
            for &gap in &gaps {
                pulse_after(&muscle, &mut state, gap, Gain::FULL);
                wait(&muscle, &mut state, 1000);
                forces.push(muscle.force(&state));
            }
            forces
        };
        let into_wrap = u32::MAX - gaps.iter().sum::<u32>() / 2;
        prop_assert_eq!(run(0), run(start));
        prop_assert_eq!(run(0), run(into_wrap));
    }

    /// Additional calls of `advance` change force by less than 0.02 % of the run's peak.
    #[test]
    fn splitting_time_changes_little(
        which in 0usize..10,
        gaps in prop::collection::vec(
            (5_000u32..60_000, prop::collection::vec(1u32..5_000, 0..40)), 5..40),
    ) {
        let muscle = CalciumForce::new(table_4()[which]).unwrap();
        let (mut whole, mut split) =
            (CalciumForceState::at_rest(Micros::new(0)), CalciumForceState::at_rest(Micros::new(0)));
        let (mut worst, mut peak) = (0f64, 0f64);
        for (gap, pieces) in gaps {
            let at = whole.at() + us(gap);
            for piece in pieces {
                let to = split.at() + us(piece);
                if to.is_before(at) {
                    muscle.advance(&mut split, to);
                }
            }
            for state in [&mut whole, &mut split] {
                muscle.pulse(state, at, Gain::FULL);
                muscle.advance(state, at);
            }
            let (a, b) = (newtons(&muscle, &whole), newtons(&muscle, &split));
            (worst, peak) = (worst.max((a - b).abs()), peak.max(a));
        }
        prop_assert!(worst <= 2e-4 * peak, "{} of {}", worst, peak);
    }

    /// Eq. (3) is linear in A: a constant gain scales the force.
    #[test]
    fn constant_gain_scales_force(which in 0usize..10, gain in 0.01f64..1.0) {
        let muscle = CalciumForce::new(table_4()[which]).unwrap();
        let run = |gain: Gain| {
            let mut state = CalciumForceState::at_rest(Micros::new(0));
            for i in 0..25 {
                muscle.pulse(&mut state, Micros::new(i * 20_000), gain);
            }
            muscle.advance(&mut state, Micros::new(25 * 20_000));
            newtons(&muscle, &state)
        };
        let (full, part) = (run(Gain::FULL), run(Gain::new(U1F31::from_num(gain))));
        prop_assert!((part - gain * full).abs() < 3e-5, "{} {}", part, gain * full);
    }
}
