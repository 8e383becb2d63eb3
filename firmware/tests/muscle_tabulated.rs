//! Tests of the tabulated calcium–force model: its error over all muscles that have a table, and the
//! properties that it has as the integrated model has them.
//!
//! `cargo test -p firmware --test suite muscle_tabulated -- --nocapture` prints the errors.

use crate::muscle_ladder::twins::{self, FatigueMode, Muscle, Pulse};
use crate::muscle_ladder::{START, error_pct, spec, subjects, train};
use firmware::muscle::{
    CalciumForce, CalciumForceSpec, Gain, Model, MuscleLevel, MuscleModel, TabulatedForce,
    TabulatedForceState,
};
use firmware::units::{Force, Micros, us};
use fixed::types::U1F31;
use proptest::prelude::*;

/// Resolution of a reported force, N.
const RESOLUTION_N: f64 = 1.0 / 65_536.0;

struct Random(u32);

impl Random {
    fn part(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1u32 << 24)
    }

    /// Returns a value whose logarithm is uniform.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.part())
    }

    /// Generates pulses at `hz` for a second, every one displaced by up to 45 % of a period, and a
    /// single one if none falls into that second.
    fn scattered(&mut self, hz: f64, has_gains: bool) -> Vec<Pulse> {
        let gain = |random: &mut Self| match has_gains {
            true => 0.1 + 0.9 * random.part(),
            false => 1.0,
        };
        let period = 1e6 / hz;
        let pulses = (0..hz.ceil() as u32).map(|i| {
            let at = (f64::from(i) + 0.5 + 0.9 * (self.part() - 0.5)) * period;
            (at as u64, gain(self))
        });
        let pulses: Vec<Pulse> = pulses.filter(|p| p.0 < 1_000_000).collect();
        match pulses.is_empty() {
            true => vec![(250, gain(self))],
            false => pulses,
        }
    }
}

fn reference(muscle: &Muscle, pulses: &[Pulse], ms: u64) -> Vec<f64> {
    twins::tiring(muscle, FatigueMode::Never, pulses, ms).0
}

/// Returns the force of the table, advanced in ticks of 1 ms.
fn tabulated(table: &TabulatedForce, pulses: &[Pulse], ms: u64) -> Vec<f64> {
    let mut state = TabulatedForceState::at_rest(START);
    let mut pulses = pulses.iter().peekable();
    let mut samples = vec![];
    for sample in 0..=ms {
        while let Some((at, gain)) = pulses.next_if(|p| p.0 <= sample * 1000) {
            let gain = Gain::new(U1F31::from_num(*gain));
            table.pulse(&mut state, START + us(*at as u32), gain);
        }
        table.advance(&mut state, START + us((sample * 1000) as u32));
        samples.push(table.force(&state).get().to_num());
    }
    samples
}

/// Returns the error beyond the resolution of the answer, % of the peak.
fn error_beyond_resolution_pct(truth: &[f64], measured: &[f64]) -> f64 {
    let nearer = truth.iter().zip(measured).map(|(truth, measured)| {
        let off = measured - truth;
        truth + off.signum() * (off.abs() - RESOLUTION_N).max(0.0)
    });
    error_pct(truth, &nearer.collect::<Vec<_>>())
}

#[test]
fn every_subject_is_within_two_thousandths_of_a_percent() {
    let mut random = Random(48);
    let mut worst = 0f64;
    for (name, subject) in subjects() {
        let table = TabulatedForce::new(&spec(&subject)).expect("all subjects have tables");
        for hz in [10.0, 20.0, 30.0, 40.0, 50.0, 70.0, 100.0] {
            for pulses in [
                train(hz, 0, 1000),
                random.scattered(hz, false),
                random.scattered(hz, true),
            ] {
                let truth = reference(&subject, &pulses, 1500);
                let error = error_pct(&truth, &tabulated(&table, &pulses, 1500));
                if error > worst {
                    println!("{name}, {hz} Hz: {error:.5} %");
                    worst = error;
                }
            }
        }
    }
    assert!(worst <= 0.002, "{worst} %");
    assert!(worst >= 0.0002, "{worst} %: a tenth of what is stated");
}

/// Draws muscles with log-uniform parameters over the whole range, at 0.5 to 200 Hz, half of them
/// with gains down to 0.1, and takes every corner of the range.
#[test]
fn every_muscle_with_a_table_is_within_its_bound() {
    let mut random = Random(4801);
    let ends = [(0.002, 5.0), (0.005, 0.1), (0.002, 0.2), (0.001, 1.0f64)];
    let (mut with_table, mut accepted) = (0, 0);
    let mut worst = (0f64, String::new());
    for n in 0..616 {
        let [k, tau_c, tau1, tau2] = [0, 1, 2, 3].map(|i| {
            let (low, high) = ends[i];
            let value = match n {
                0..16 => [low, high][n >> i & 1],
                _ => random.between(low, high),
            };
            (value * 1e6).round() * 1e-6 // rounded as a host sends it
        });
        let muscle = Muscle {
            a: 10_000.0,
            k,
            tau_c,
            tau1,
            tau2,
        };
        if CalciumForce::new(spec(&muscle)).is_err() {
            continue;
        }
        accepted += 1;
        let Some(table) = TabulatedForce::new(&spec(&muscle)) else {
            continue;
        };
        with_table += 1;
        for (hz, has_gains) in [(0.5, n % 2 == 0), (random.between(0.5, 200.0), n % 2 != 0)] {
            let pulses = random.scattered(hz, has_gains);
            let truth = reference(&muscle, &pulses, 1500);
            let error = error_beyond_resolution_pct(&truth, &tabulated(&table, &pulses, 1500));
            if error > worst.0 {
                worst = (error, format!("{muscle:?} at {hz} Hz"));
            }
        }
    }
    println!(
        "{with_table} of {accepted}, worst {:.5} % of {}",
        worst.0, worst.1
    );
    assert!(worst.0 <= 0.005, "{} % of {}", worst.0, worst.1);
    assert!(
        worst.0 >= 0.0005,
        "{} %: a tenth of what is stated",
        worst.0
    );
    let share = f64::from(with_table) / f64::from(accepted);
    assert!((0.76..0.84).contains(&share), "{share}");
}

/// Tests that neither a short τ1, nor a weak twitch, nor a parameter out of range has a table.
#[test]
fn muscles_that_a_table_does_not_fit_have_none() {
    let k01 = CalciumForceSpec {
        a_mn_per_s: 121_900,
        k_micro: 300_000,
        tau_c_us: 20_800,
        tau1_us: 33_100,
        tau2_us: 194_400,
    };
    assert!(TabulatedForce::new(&k01).is_some());
    for (why, without) in [
        (
            "τ1",
            CalciumForceSpec {
                tau1_us: 2_100,
                ..k01
            },
        ),
        (
            "weak",
            CalciumForceSpec {
                k_micro: 5_000_000,
                tau_c_us: 5_000,
                tau2_us: 1_000_000,
                ..k01
            },
        ),
        (
            "range",
            CalciumForceSpec {
                a_mn_per_s: 0,
                ..k01
            },
        ),
    ] {
        assert!(TabulatedForce::new(&without).is_none(), "{why}");
    }
}

#[test]
fn force_reaches_exactly_zero_and_soon() {
    for (name, subject) in subjects() {
        let table = TabulatedForce::new(&spec(&subject)).unwrap();
        let mut state = TabulatedForceState::at_rest(START);
        for n in 0..500 {
            table.pulse(&mut state, START + us(n * 5_000), Gain::FULL);
        }
        let mut before = table.force(&state);
        let mut steps = 0;
        while !state.is_at_rest() {
            let to = state.at() + us(1000);
            table.advance(&mut state, to);
            let force = table.force(&state);
            let has_calcium = table.calcium(&state) > 0;
            // Two units of the state's format.
            let grain = 2f64.powi(-28) * 500.0;
            let rise = force.get().to_num::<f64>() - before.get().to_num::<f64>();
            assert!(
                rise <= grain + RESOLUTION_N || has_calcium,
                "{name}: {rise}"
            );
            before = force;
            steps += 1;
            assert!(steps <= 2_500, "{name} is still not at rest");
        }
        assert_eq!(
            (before, table.calcium(&state).to_bits()),
            (Force::default(), 0)
        );
    }
}

#[test]
fn a_gap_of_35_minutes_is_one_call() {
    let table = TabulatedForce::new(&spec(&subjects()[0].1)).unwrap();
    let mut state = TabulatedForceState::at_rest(Micros::new(u32::MAX - 1_000_000));
    for n in 0..40 {
        let at = Micros::new(u32::MAX - 1_000_000) + us(n * 25_000);
        table.pulse(&mut state, at, Gain::FULL);
    }
    let end = state.at() + us(35 * 60 * 1_000_000);
    table.advance(&mut state, end);
    assert!(state.is_at_rest());
    assert_eq!(state.at(), end);
    table.advance(&mut state, end - us(1)); // a past time changes nothing
    assert_eq!(state.at(), end);
    // Rest lasts for any time, and a gap begins at any time of it.
    table.advance(&mut state, end + us(17 * 60 * 1_000_000));
    let later = end + us(17 * 60 * 1_000_000) + us(35 * 60 * 1_000_000);
    table.advance(&mut state, later);
    assert_eq!(state.at(), later);
    for _ in 0..5 {
        let end = state.at() + us(35 * 60 * 1_000_000);
        table.advance(&mut state, end);
        assert_eq!(
            (state.is_at_rest(), table.force(&state)),
            (true, Force::default())
        );
    }
}

/// Tests that the force goes on where the integrated model left it, at any time of a train.
#[test]
fn a_table_that_is_adopted_continues_the_force() {
    for (name, subject) in subjects() {
        let spec = spec(&subject);
        let model = MuscleModel::new(spec, None, MuscleLevel::CalciumForce).unwrap();
        let table = TabulatedForce::new(&spec).unwrap();
        for adopted_ms in [0, 1, 37, 260, 999, 1_400] {
            let mut state = model.at_rest(START);
            let (mut forces, mut pulses) = (vec![], vec![]);
            for ms in 0..=1500u32 {
                let now = START + us(ms * 1000);
                if ms % 33 == 1 && ms < 1_000 {
                    let at = now - us(400);
                    pulses.push((u64::from(ms) * 1000 - 400, 0.7));
                    model.pulse_by(&table, &mut state, at, Gain::new(U1F31::from_num(0.7)));
                }
                model.advance_by(&table, &mut state, now);
                if ms == adopted_ms {
                    model.adopt(&table, &mut state);
                }
                let force = model.predicted_force(&table, &state).unwrap();
                forces.push(force.get().to_num());
            }
            let error = error_pct(&reference(&subject, &pulses, 1500), &forces);
            // The bound of the integrated model, whose error the table takes over.
            assert!(
                error <= 0.005,
                "{name}, adopted at {adopted_ms} ms: {error} %"
            );
        }
    }
}

/// Tests the change late in the decay of a twitch, in the last rows of a table and below them, of
/// muscles whose force follows calcium closely or outlasts it.
#[test]
fn a_table_that_is_adopted_late_continues_the_force() {
    for (k, tau_c, tau1, tau2) in [
        (0.007_488, 0.005_262, 0.038_656, 0.490_821),
        (0.014_179, 0.007_638, 0.025_388, 0.938_529),
        (5.0, 0.06, 0.04, 0.001),
        (5.0, 0.04, 0.024, 0.04),
        (5.0, 0.05, 0.2, 0.001),
    ] {
        let muscle = Muscle {
            a: 10_000.0,
            k,
            tau_c,
            tau1,
            tau2,
        };
        let spec = spec(&muscle);
        let model = MuscleModel::new(spec, None, MuscleLevel::CalciumForce).unwrap();
        let table = TabulatedForce::new(&spec).expect("it has a table");
        let truth = reference(&muscle, &[(250, 1.0)], 700);
        for adopted_ms in (10..640).step_by(7) {
            let mut state = model.at_rest(START);
            model.pulse_by(&table, &mut state, START + us(250), Gain::FULL);
            let mut forces = vec![0.0];
            for ms in 1..=700u32 {
                model.advance_by(&table, &mut state, START + us(ms * 1000));
                if ms == adopted_ms {
                    model.adopt(&table, &mut state);
                }
                let force = model.predicted_force(&table, &state).unwrap();
                forces.push(force.get().to_num());
            }
            let error = error_pct(&truth, &forces);
            assert!(
                error <= 0.02,
                "{muscle:?}, adopted at {adopted_ms} ms: {error} %"
            );
        }
    }
}

/// Tests that a model without a force keeps none with a table, and begins at rest with it.
#[test]
fn a_table_follows_the_model_level() {
    let subject = spec(&subjects()[3].1);
    let model = MuscleModel::new(subject, None, MuscleLevel::CalciumForce).unwrap();
    let table = TabulatedForce::new(&subject).unwrap();
    let mut state = model.at_rest(START);
    model.adopt(&table, &mut state);
    model.pulse_by(&table, &mut state, START, Gain::FULL);
    let later = START + us(40_000);
    model.advance_by(&table, &mut state, later);
    assert!(model.predicted_force(&table, &state) > Some(Force::default()));
    model.switch(&mut state, MuscleLevel::None, later).unwrap();
    model.pulse_by(&table, &mut state, later, Gain::FULL);
    assert_eq!(model.predicted_force(&table, &state), None);
    model
        .switch(&mut state, MuscleLevel::CalciumForce, later)
        .unwrap();
    assert_eq!(
        model.predicted_force(&table, &state),
        Some(Force::default())
    );
}

#[test]
fn a_pulse_below_threshold_changes_nothing() {
    let table = TabulatedForce::new(&spec(&subjects()[4].1)).unwrap();
    let mut state = TabulatedForceState::at_rest(Micros::new(7));
    table.pulse(&mut state, Micros::new(7), Gain::ZERO);
    assert!(state.is_at_rest());
    table.pulse(&mut state, Micros::new(9), Gain::FULL);
    let before = state;
    table.pulse(&mut state, Micros::new(9), Gain::ZERO);
    assert_eq!(state, before);
}

fn any_table() -> impl Strategy<Value = (CalciumForceSpec, TabulatedForce)> {
    let part = |low: f64, high: f64| (0.0..=1.0).prop_map(move |p| low * (high / low).powf(p));
    (
        part(2e3, 5e6),
        part(5e3, 1e5),
        part(2e3, 2e5),
        part(1e3, 1e6),
    )
        .prop_filter_map("no table", |(k, tau_c, tau1, tau2)| {
            let spec = CalciumForceSpec {
                a_mn_per_s: 10_000_000,
                k_micro: k as u32,
                tau_c_us: tau_c as u32,
                tau1_us: tau1 as u32,
                tau2_us: tau2 as u32,
            };
            Some((spec, TabulatedForce::new(&spec)?))
        })
}

proptest! {
    /// For any muscle with a table, pulses (bursts of any density, any gain) and ticks, force stays
    /// between 0 and full scale, and calcium below saturation; afterwards comes rest.
    #[test]
    fn force_stays_within_full_scale(
        (spec, table) in any_table(),
        start in any::<u32>(),
        steps in prop::collection::vec((0u32..30_000, 1u32..9, any::<u32>()), 1..200),
    ) {
        let mut state = TabulatedForceState::at_rest(Micros::new(start));
        let scale = f64::from(spec.tau1_us + spec.tau2_us) * 1e-2 * (1.0 + 1e-6) + 1e-4;
        for (gap, burst, gain) in steps {
            let begin = state.at();
            for i in 1..=burst {
                let at = begin + us(i * (gap / 8));
                table.pulse(&mut state, at, Gain::new(U1F31::from_bits(gain)));
            }
            for _ in 0..=gap / 1000 {
                let to = state.at() + us(1000);
                table.advance(&mut state, to);
                let force = table.force(&state).get().to_num::<f64>();
                prop_assert!((0.0..=scale).contains(&force), "{} of {}", force, scale);
                prop_assert!(table.calcium(&state) <= 24);
            }
        }
        let end = state.at() + us(7_000_000);
        table.advance(&mut state, end);
        prop_assert!(state.is_at_rest());
    }

    /// Neither the clock's wrap nor additional calls of `advance` have an effect: the time within
    /// the table is exact.
    #[test]
    fn runs_depend_neither_on_their_start_nor_on_further_readings(
        (_, table) in any_table(),
        start in any::<u32>(),
        gaps in prop::collection::vec((0u32..100_000, 1u32..5_000), 1..60),
    ) {
        let run = |start: u32, is_split: bool| {
            let mut state = TabulatedForceState::at_rest(Micros::new(start));
            let mut forces = vec![];
            for &(gap, piece) in &gaps {
                let at = state.at() + us(gap);
                while is_split && (at - state.at()).us() > piece.cast_signed() {
                    let to = state.at() + us(piece);
                    table.advance(&mut state, to);
                }
                table.pulse(&mut state, at, Gain::FULL);
                table.advance(&mut state, at + us(1000));
                forces.push(table.force(&state));
            }
            forces
        };
        let whole = run(0, false);
        prop_assert_eq!(&whole, &run(start, false));
        prop_assert_eq!(&whole, &run(start, true));
    }
}
