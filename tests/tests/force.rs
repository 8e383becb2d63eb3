//! Force control end to end: a session file, the whole device, its pins, and the simulator's own
//! muscles, which share no code with the device.
//!
//! `cargo test -p tests --test suite force -- --nocapture` prints how well ten subjects' forces
//! follow. This is no evidence about people: the device knows each muscle's parameters exactly.

use crate::force_reach::{channel, control, session};
use hal_sim::body::muscle::{Muscle, Parameters, SUBJECTS, Step};
use hal_sim::trace::Trace;
use host_core::run::DeviceName;
use host_core::session::{Session, Setpoint};
use tests::desk::{load_session, play};

const END_US: u64 = 9_000_000;
/// Judged interval, after the first second, in which the amplitude rises.
const FROM_MS: usize = 1_500;
const TO_MS: usize = 8_500;

/// Returns the force of the channel's pulses at each millisecond, N.
fn force(p: &Parameters, trace: &Trace, epoch_us: u64) -> Vec<f64> {
    let pulses = &trace.pulses(epoch_us + END_US)[0];
    let mut pulses = pulses.iter().filter(|p| p.start_us >= epoch_us).peekable();
    let mut muscle = Muscle::new(*p);
    let (full_step, mut now) = (Step::new(p, 1e-3), epoch_us);
    (0..END_US / 1000)
        .map(|ms| {
            let end = epoch_us + (ms + 1) * 1000;
            let mut is_whole = true;
            while let Some(pulse) = pulses.next_if(|p| p.start_us < end) {
                let amplitude_ma = f64::from(pulse.code) * 50.0 / 65_535.0;
                // A code is rounded down, so that of the threshold lies just below it.
                if amplitude_ma < 9.999 {
                    continue;
                }
                muscle.step(&Step::new(p, (pulse.start_us - now) as f64 * 1e-6));
                muscle.pulse((0.3 * (amplitude_ma - 20.0)).exp());
                (now, is_whole) = (pulse.start_us, false);
            }
            if is_whole {
                muscle.step(&full_step);
            } else {
                muscle.step(&Step::new(p, (end - now) as f64 * 1e-6));
            }
            now = end;
            muscle.force()
        })
        .collect()
}

/// Returns the reference force at each millisecond, N.
fn wanted(session: &Session) -> Vec<f64> {
    let at = |ms: u64| match session.setpoints.at((ms + 1) * 1000) {
        Setpoint::Force { millinewton, .. } => f64::from(millinewton) * 1e-3,
        other => panic!("{other:?}"),
    };
    (0..END_US / 1000).map(at).collect()
}

/// Returns two root mean square errors, N: of the mean force over the surrounding 50 ms, and of the
/// force itself with its ripple.
fn errors(wanted: &[f64], force: &[f64]) -> (f64, f64) {
    let rms = |error: &dyn Fn(usize) -> f64| {
        let sum: f64 = (FROM_MS..TO_MS).map(|ms| error(ms).powi(2)).sum();
        (sum / (TO_MS - FROM_MS) as f64).sqrt()
    };
    let mean = |ms: usize| force[ms - 25..ms + 25].iter().sum::<f64>() / 50.0;
    (
        rms(&|ms| mean(ms) - wanted[ms]),
        rms(&|ms| force[ms] - wanted[ms]),
    )
}

/// Returns the reference trajectories for a muscle with a largest force of `n` newtons.
fn courses(n: f64) -> [(&'static str, String); 4] {
    let points = |list: &[(f64, f64)]| {
        let point = |&(s, part): &(f64, f64)| format!("{{ at_s = {s}, n = {:.3} }}", part * n);
        let list: Vec<String> = list.iter().map(point).collect();
        format!("kind = \"force-ramp\"\npoints = [{}]", list.join(", "))
    };
    let sine = |hz: f64| {
        let (offset, amplitude) = (0.45 * n, 0.35 * n);
        let sizes = format!("offset_n = {offset:.6}\namplitude_n = {amplitude:.6}");
        format!("kind = \"force-sine\"\n{sizes}\nfrequency_hz = {hz}")
    };
    let steps = [
        (0.0, 0.3),
        (3.0, 0.3),
        (3.000_1, 0.7),
        (6.0, 0.7),
        (6.000_1, 0.2),
    ];
    let ramp = [(0.0, 0.1), (2.0, 0.1), (4.0, 0.9), (5.0, 0.9), (7.0, 0.1)];
    [
        ("steps", points(&steps)),
        ("ramp", points(&ramp)),
        ("sine 0.5 Hz", sine(0.5)),
        ("sine 1 Hz", sine(1.0)),
    ]
}

/// Returns the mean over the subjects of [`errors`], relative to each subject's largest force.
fn mean_errors(hold: &str) -> [(f64, f64); 4] {
    let mut means = [(0.0, 0.0); 4];
    for p in &SUBJECTS {
        let most: f64 = control(p, None).force_range().1.get().to_num();
        for ((_, course), mean) in courses(most).into_iter().zip(&mut means) {
            let channel = channel(1, p, (10.0, 0.3), &format!("hold = \"{hold}\""));
            let file = session(9.1, &channel, &format!("channel = 1\n{course}"));
            let played = play(&file, &DeviceName::Native);
            assert_eq!(played.outcome.refused, 0);
            let force = force(p, &played.trace, played.epoch_us);
            let (smooth, raw) = errors(&wanted(&file.session), &force);
            mean.0 += smooth / most / SUBJECTS.len() as f64;
            mean.1 += raw / most / SUBJECTS.len() as f64;
        }
    }
    means
}

/// Ten channels under force control: their forces are requested, predicted and reported in the same
/// way by the native simulator and the flashed image.
#[test]
fn ten_forces_at_once_are_followed_on_both_simulators() {
    let mut file = load_session("ten_forces.toml");
    file.session.duration_us = 3_000_000;
    for device in [DeviceName::Native, DeviceName::Chip] {
        let outcome = play(&file, &device).outcome;
        assert_eq!(outcome.refused, 0);
        let samples = outcome.trial.samples.iter().filter(|s| s.t_s > 1.0);
        let mut squares = [0.0; 10];
        let mut count = 0.0;
        for sample in samples {
            assert_eq!((sample.wanted_n.len(), sample.forces_n.len()), (10, 10));
            let pairs = sample.wanted_n.iter().zip(&sample.forces_n);
            for (square, (wanted, force)) in squares.iter_mut().zip(pairs) {
                *square += (wanted.unwrap() - force.unwrap()).powi(2);
            }
            count += 1.0;
        }
        let rms = squares.map(|square| (square / count).sqrt());
        println!("{device:?}: wanted less predicted force with its ripple, N rms: {rms:.2?}");
        assert!(count > 150.0);
        // Covers the ripple of 20 Hz trains and the error at the corners of ramps; a channel that
        // is not driven would be 2 N off or more.
        assert!(rms.iter().all(|rms| *rms < 0.5), "{rms:?}");
    }
}

/// Held setpoints have no rate, so the muscle's lag is not compensated; extrapolated setpoints
/// compensate it. A step has no rate either way. At 1 Hz muscles cannot relax as fast as the
/// reference.
#[test]
fn forces_follow_what_is_wanted() {
    let bounds = [
        ("hold", [8e-2, 5e-2, 11e-2, 19e-2]),
        ("extrapolate", [8e-2, 4e-3, 9e-3, 5e-2]),
    ];
    for (hold, bounds) in bounds {
        let names = courses(1.0).map(|(name, _)| name);
        for ((name, (smooth, raw)), bound) in names.into_iter().zip(mean_errors(hold)).zip(bounds) {
            let (smooth_pct, raw_pct) = (1e2 * smooth, 1e2 * raw);
            let line = format!("{hold:11} {name:11} {smooth_pct:5.2} % of the most");
            println!("{line}, {raw_pct:5.2} % with ripple");
            // Bounded from both sides: half the error would mean that something changed.
            assert!((bound / 2.0..bound).contains(&smooth), "{line}");
        }
    }
}
