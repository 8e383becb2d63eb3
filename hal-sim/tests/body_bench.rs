//! A wrist on the test rig: its response to pulses, and the effect of each ablation.

use hal_sim::body::bench::{Foreign, Generator, Kind, SensorSpec, Wrist, WristSpec};
use hal_sim::body::muscle::reference;
use hal_sim::body::{Body, Drive, Load, Pulse};

/// Plays a second at `hz` and `ma`, then half a second of rest. Returns the forces every ms,
/// advanced by `step_us`.
fn play_second(spec: WristSpec, (hz, ma): (u64, f64), step_us: u64) -> (Vec<f64>, Vec<f64>) {
    let mut wrist = Wrist::new(spec, 3).unwrap();
    for place in 0..hz {
        wrist.pulse(&Pulse {
            t_us: place * (1_000_000 / hz),
            channel: 0,
            drive: Drive::Milliamps(ma),
            width_us: 400,
            conducted: false,
        });
    }
    let (mut force, mut read) = (Vec::new(), Vec::new());
    for end_us in (step_us..=1_500_000).step_by(step_us as usize) {
        wrist.advance(end_us);
        force.push(wrist.force_n());
        read.push(wrist.instrument_n().unwrap());
    }
    (force, read)
}

fn with_foreign(spec: WristSpec, kind: Kind, size: f64) -> WristSpec {
    let foreign = Some(Foreign { kind, size });
    let generator = Generator {
        foreign,
        ..spec.generator
    };
    WristSpec { generator, ..spec }
}

#[test]
fn at_the_reference_it_is_table_4_s_model() {
    for subject in 0..10 {
        let spec = WristSpec::subject(subject).unwrap();
        let (force, _) = play_second(spec, (40, spec.reference_ma), 1_000);
        let truth = reference::integrate(
            &spec.generator.parameters,
            &reference::train(40.0, 40),
            1.5,
            1e-3,
        );
        let peak = truth
            .iter()
            .map(|sample| sample.force_n)
            .fold(0.0, f64::max);
        // The reference begins at 0; the body's first millisecond ends at 1.
        for (ours, theirs) in force.iter().zip(truth.iter().skip(1)) {
            assert!((ours - theirs.force_n).abs() < 1e-6 * peak, "K{subject}");
        }
    }
}

#[test]
fn what_is_read_does_not_depend_on_the_steps_of_time() {
    let spec = WristSpec::subject(0).unwrap();
    for kind in Kind::ALL {
        let spec = with_foreign(spec, kind, 0.7);
        let (fine, coarse) = (
            play_second(spec, (30, 12.0), 1_000),
            play_second(spec, (30, 12.0), 50_000),
        );
        let every = |samples: &[f64]| {
            samples
                .iter()
                .skip(49)
                .step_by(50)
                .copied()
                .collect::<Vec<_>>()
        };
        assert_eq!((every(&fine.0), every(&fine.1)), coarse, "{kind:?}");
    }
}

#[test]
fn departures_of_no_size_are_none_and_of_size_one_are_seen() {
    let spec = WristSpec::subject(3).unwrap();
    let (plain, read) = play_second(spec, (40, spec.reference_ma), 1_000);
    let peak = plain.iter().copied().fold(0.0, f64::max);
    for kind in Kind::ALL {
        let none = play_second(
            with_foreign(spec, kind, 0.0),
            (40, spec.reference_ma),
            1_000,
        );
        assert_eq!(none, (plain.clone(), read.clone()), "{kind:?}");
        let (force, other) = play_second(
            with_foreign(spec, kind, 1.0),
            (40, spec.reference_ma),
            1_000,
        );
        let (ours, theirs) = match kind {
            Kind::SensorDrift => (&other, &read),
            _ => (&force, &plain),
        };
        let off = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs());
        let off = off.fold(0.0, f64::max) / peak;
        let least = if kind == Kind::SensorDrift {
            0.001
        } else {
            0.02
        };
        assert!((least..1.0).contains(&off), "{kind:?}: {off}");
    }
    let nothing = with_foreign(spec, Kind::Sag, 1.5);
    assert_eq!(Wrist::new(nothing, 1).unwrap_err().0, "foreign.size");
}

/// Table 2: the pool has the printed ratio of forces, and its force begins below the printed I_MT.
#[test]
fn force_rises_from_nothing_below_the_printed_threshold() {
    for subject in 0..10 {
        let spec = WristSpec::subject(subject).unwrap();
        let (i_mt, forces) = hal_sim::body::bench::wrist::PRINTED[subject];
        let ratio: f64 = forces.iter().map(|[least, most]| least / most).product();
        assert!((spec.recruited(i_mt, 400.0) / ratio.cbrt() - 1.0).abs() < 1e-6);
        assert_eq!(spec.recruited(0.799 * i_mt, 400.0), 0.0);
        let foot = spec.recruited(0.81 * i_mt, 400.0);
        assert!(foot > 0.0 && foot < 0.05, "K{subject}: {foot}");
        // A shorter pulse of the same current recruits less.
        assert!(spec.recruited(i_mt, 200.0) < spec.recruited(i_mt, 400.0));
    }
}

#[test]
fn without_an_electrode_there_is_no_force() {
    let spec = WristSpec::subject(0).unwrap();
    let sensor = SensorSpec {
        noise_n: 0.0,
        offset_n: 0.0,
        drift_n_per_s: 0.0,
        ..spec.sensor
    };
    let mut wrist = Wrist::new(WristSpec { sensor, ..spec }, 1).unwrap();
    wrist.loads_mut()[0] = Load::Open;
    for place in 0..40 {
        wrist.pulse(&Pulse {
            t_us: 25_000 * place,
            channel: 0,
            drive: Drive::Milliamps(12.0),
            width_us: 400,
            conducted: false,
        });
    }
    wrist.advance(1_000_000);
    assert_eq!((wrist.force_n(), wrist.instrument_n()), (0.0, Some(0.0)));
}
