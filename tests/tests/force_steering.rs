//! Force control steered by the predicted force, on the whole device, judged by a muscle with
//! fatigue that shares no code with it.
//!
//! `cargo test -p tests --test suite force_steering -- --nocapture` prints the tables. The compared
//! cases were written down before they were run: see [`holds`] and [`COURSES`].

use crate::force_reach::{Pulse, channel, pulses, session};
use firmware::muscle::FatigueSpec;
use hal_sim::body::muscle::tiring::{Fatigue, FatiguingMuscle};
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use hal_sim::random::Random;
use host_core::run::DeviceName;
use host_core::session::Setpoint;
use tests::desk::play;

/// Motor threshold, mA, and slope of the recruitment, per mA, up to 20 mA.
const RECRUITS: (f64, f64) = (10.0, 0.3);
/// Model level without prediction: the inverse alone.
const ALONE: &str = "none";

/// Returns the fatigue of Ding's quadriceps, scaled to this muscle's strength.
fn fatigue(p: &Parameters) -> Fatigue {
    host_core::choice::fatigue(&FatigueSpec::scaled_to((p.a_n_per_s * 1e3).round() as u32))
}

/// Returns a muscle's mean force at some gain with a pulse every `period_us`, N, without further
/// fatigue.
fn steady(p: Parameters, gain: f64, period_us: u32) -> f64 {
    let mut muscle = FatiguingMuscle::new(p, Fatigue::NEVER);
    let mut mean = 0.0;
    for _ in 0..=(3_000_000 / period_us) {
        muscle.pulse(gain);
        mean = 0.0;
        for _ in 0..64 {
            muscle.pass(period_us / 64);
            mean += muscle.force() / 64.0;
        }
    }
    mean
}

/// Forces and pulses of a session with one muscle.
struct SessionForces {
    /// True force at each millisecond, N.
    forces: Vec<f64>,
    /// Muscle parameters after fatigue, every two seconds.
    tired: Vec<Parameters>,
    /// Reference force at each millisecond, N.
    wanted: Vec<f64>,
    /// Times of the pulses, ms.
    pulses: Vec<usize>,
    /// Times, s, and whether the device limited the force there.
    limiting: Vec<(f64, bool)>,
}

impl SessionForces {
    fn play(
        p: &Parameters,
        tires: bool,
        model: &str,
        force: &str,
        setpoints: &str,
        s: u64,
    ) -> Self {
        let how = if tires { fatigue(p) } else { Fatigue::NEVER };
        let table = if tires { "fatigue = {}\n" } else { "" };
        let text = channel(1, p, RECRUITS, force);
        let text = text.replace("max_frequency_hz = 60.0, max", "max");
        let file = session(
            s as f64,
            &format!("{text}model = \"{model}\"\n{table}"),
            setpoints,
        );
        let at = |ms: u64| match file.session.setpoints.at((ms + 1) * 1000) {
            Setpoint::Force { millinewton, .. } => f64::from(millinewton) * 1e-3,
            other => panic!("{other:?}"),
        };
        let wanted = (0..s * 1000).map(at).collect();
        let played = play(&file, &DeviceName::Native);
        assert_eq!(played.outcome.refused, 0);
        let epoch = played.epoch_us;
        let mut played_pulses = pulses(&played.trace, epoch + s * 1_000_000, 0, RECRUITS);
        played_pulses.retain(|pulse| pulse.0 >= epoch);
        let (forces, tired) = true_forces(
            FatiguingMuscle::new(*p, how),
            &played_pulses,
            epoch,
            s * 1000,
        );
        let samples = played.outcome.trial.samples.iter();
        Self {
            forces,
            tired,
            wanted,
            pulses: played_pulses
                .iter()
                .map(|p| ((p.0 - epoch) / 1000) as usize)
                .collect(),
            limiting: samples.map(|s| (s.t_s, s.limiting)).collect(),
        }
    }

    /// Returns the mean force of the complete periods that begin within these milliseconds, N.
    fn mean(&self, from: usize, to: usize) -> f64 {
        let pulses = &self.pulses[self.pulses.partition_point(|&at| at < from)..];
        let count = pulses.partition_point(|&at| at < to);
        let (Some(&from), Some(&to)) = (pulses.first(), pulses.get(count).or(pulses.last())) else {
            return 0.0;
        };
        self.forces[from..to].iter().sum::<f64>() / (to - from) as f64
    }

    /// Returns the root mean square error of the mean force over the surrounding 50 ms, N.
    fn rms(&self) -> f64 {
        let range = 1_500..self.forces.len() - 500;
        let off = |ms: usize| {
            let mean = self.forces[ms - 25..ms + 25].iter().sum::<f64>() / 50.0;
            (mean - self.wanted[ms]).powi(2)
        };
        (range.clone().map(off).sum::<f64>() / range.len() as f64).sqrt()
    }

    /// Returns whether the device limited the force throughout, and whether at any time, in these
    /// seconds.
    fn limiting(&self, from: f64, to: f64) -> (bool, bool) {
        let mut within = self.limiting.iter().filter(|l| l.0 > from && l.0 <= to);
        (within.clone().all(|l| l.1), within.any(|l| l.1))
    }
}

fn true_forces(
    mut muscle: FatiguingMuscle,
    pulses: &[Pulse],
    epoch_us: u64,
    ms: u64,
) -> (Vec<f64>, Vec<Parameters>) {
    let mut due = pulses.iter().peekable();
    let (mut now_us, mut tired) = (epoch_us, Vec::new());
    let step = |ms| {
        let end_us = epoch_us + ms * 1000;
        while let Some(&(at_us, gain)) = due.next_if(|p| p.0 < end_us) {
            muscle.pass((at_us - now_us) as u32);
            muscle.pulse(gain);
            now_us = at_us;
        }
        muscle.pass((end_us - now_us) as u32);
        now_us = end_us;
        if ms % 2000 == 0 {
            tired.push(muscle.parameters());
        }
        muscle.force()
    };
    let forces = (1..=ms).map(step).collect();
    (forces, tired)
}

fn points(list: &[(f64, f64)]) -> String {
    let point = |&(s, n): &(f64, f64)| format!("{{ at_s = {s}, n = {n:.3} }}");
    let list: Vec<String> = list.iter().map(point).collect();
    let list = list.join(", ");
    format!("kind = \"force-ramp\"\nchannel = 1\npoints = [{list}]")
}

/// Ranges of rates: name, fields of a table `force`, and the shortest and longest period that they
/// allow, µs.
#[rustfmt::skip]
const RATES: [(&str, &str, u32, u32); 3] = [
    ("20 Hz", "max_frequency_hz = 20.0, hold = \"hold\"", 50_000, 50_000),
    ("20–60 Hz", "hold = \"hold\"", 16_667, 50_000),
    ("1–20 Hz", "max_frequency_hz = 20.0, min_frequency_hz = 1.0, hold = \"hold\"", 50_000, 1_000_000),
];

/// Returns forces to hold for a minute. For each of Lee's ten subjects, with the fatigue of Ding's
/// quadriceps scaled to their strength, and each of [`RATES`], there are four random forces between
/// the smallest and 80 % of the largest; at 1–20 Hz they stay below the force of threshold at 20
/// Hz.
fn holds() -> Vec<(usize, usize, f64)> {
    let mut random = Random::new(13);
    let mut forces = Vec::new();
    for (subject, p) in SUBJECTS.iter().enumerate() {
        for (rate, &(_, _, fastest_us, slowest_us)) in RATES.iter().enumerate() {
            let least = (RECRUITS.1 * (RECRUITS.0 - 20.0)).exp();
            let from = 1.05 * steady(*p, least, slowest_us);
            let to = match slowest_us {
                50_000 => 0.8 * steady(*p, 1.0, fastest_us),
                _ => steady(*p, least, 50_000),
            };
            for _ in 0..4 {
                forces.push((subject, rate, from + (to - from) * random.unit()));
            }
        }
    }
    forces
}

/// A fatigued muscle's force is held within 5 % while the muscle can still produce it, from the
/// third second on; afterwards the device reports that it cannot.
#[test]
fn a_tired_muscle_holds_what_it_can() {
    println!("            wanted   given to   first 2 s   worst after   inverse alone");
    let (mut worst, mut first) = (0f64, 0f64);
    for (subject, rate, n) in holds() {
        let p = &SUBJECTS[subject];
        let (name, fields, fastest_us, _) = RATES[rate];
        let setpoints = points(&[(0.0, n)]);
        let [steered, alone] = ["calcium-force-fatigue", ALONE]
            .map(|model| SessionForces::play(p, true, model, fields, &setpoints, 60));
        let can = |i: usize| steady(steered.tired[i], 1.0, fastest_us) / n;
        let off =
            |given: &SessionForces, i: usize| given.mean(2_000 * i, 2_000 * i + 2_000) / n - 1.0;
        let (mut ours, mut others, mut to_s) = (0f64, 0f64, 0);
        for i in 1..29 {
            let s = 2.0 * i as f64;
            // Largest possible force at the end of these two seconds.
            if can(i) >= 1.0 {
                ours = ours.max(off(&steered, i).abs());
                let other = off(&alone, i);
                others = if other.abs() > others.abs() {
                    other
                } else {
                    others
                };
                to_s = 2 * i + 2;
            }
            let (throughout, ever) = steered.limiting(s, s + 2.0);
            let label = format!("K{:02} {name} {n:.2} N at {s} s", subject + 1);
            // A second's fatigue is applied at once, so near the limit it may come early.
            assert!(can(i) < 1.06 || !throughout, "{label}: {}", can(i));
            assert!(can(i) < 1.2 || !ever, "{label}: {}", can(i));
            assert!(can(i - 1) > 0.94 || throughout, "{label}: {}", can(i - 1));
        }
        let begin = steered.mean(1_000, 2_000) / n - 1.0;
        println!(
            "K{:02} {name:8} {n:6.2} N {to_s:6} s {:9.1} % {:10.1} % {:13.1} %",
            subject + 1,
            1e2 * begin,
            1e2 * ours,
            1e2 * others
        );
        (worst, first) = (worst.max(ours), first.max(begin.abs()));
    }
    println!(
        "worst {:.2} %, in the first 2 s {:.2} %",
        1e2 * worst,
        1e2 * first
    );
    assert!(worst < 0.05, "{worst}");
}

/// Reference trajectories as shares of the largest force, for twelve seconds.
const COURSES: [(&str, &[(f64, f64)]); 4] = [
    ("hold", &[(0.0, 0.4)]),
    (
        "steps",
        &[
            (0.0, 0.3),
            (3.0, 0.3),
            (3.0001, 0.7),
            (6.0, 0.7),
            (6.0001, 0.2),
            (9.0, 0.2),
            (9.0001, 0.9),
        ],
    ),
    (
        "on, off",
        &[
            (0.0, 0.5),
            (2.0, 0.5),
            (2.0001, 0.0),
            (4.0, 0.0),
            (4.0001, 0.5),
            (6.0, 0.5),
            (6.0001, 0.0),
        ],
    ),
    (
        "ramps",
        &[
            (0.0, 0.1),
            (2.0, 0.1),
            (4.0, 0.9),
            (5.0, 0.9),
            (7.0, 0.1),
            (10.0, 0.7),
        ],
    ),
];

/// For a muscle without fatigue and with an exact model, the prediction can only correct errors of
/// the inverse's table, and loses almost nothing.
#[test]
fn a_rested_muscle_is_given_what_it_was_given() {
    let sine = |hz: f64, n: f64| {
        let sizes = format!("offset_n = {:.6}\namplitude_n = {:.6}", 0.45 * n, 0.35 * n);
        format!("kind = \"force-sine\"\nchannel = 1\n{sizes}\nfrequency_hz = {hz}")
    };
    println!("rms error, % of the most, mean of ten subjects and worst: alone, steered");
    for hold in ["hold", "extrapolate"] {
        for course in 0..7 {
            let mut errors = [(0f64, 0f64); 2];
            let mut name = String::new();
            for p in &SUBJECTS {
                let n = 0.98 * steady(*p, 1.0, 16_667);
                let setpoints = match COURSES.get(course) {
                    Some((course, list)) => {
                        name = (*course).to_owned();
                        let list: Vec<_> = list.iter().map(|&(s, part)| (s, part * n)).collect();
                        points(&list)
                    }
                    None => {
                        let hz = [0.2, 0.5, 1.0][course - COURSES.len()];
                        name = format!("sine {hz} Hz");
                        sine(hz, n)
                    }
                };
                let fields = format!("hold = \"{hold}\"");
                let rms = [ALONE, "calcium-force"].map(|model| {
                    SessionForces::play(p, false, model, &fields, &setpoints, 12).rms() / n
                });
                for (error, rms) in errors.iter_mut().zip(rms) {
                    *error = (error.0 + rms / 10.0, error.1.max(rms));
                }
                assert!(rms[1] < rms[0] + 3e-3, "{hold} {name}: {rms:?}");
            }
            let [alone, steered] = errors.map(|(mean, worst)| (1e2 * mean, 1e2 * worst));
            println!(
                "{hold:11} {name:11} {:5.2} {:5.2}   {:5.2} {:5.2}",
                alone.0, alone.1, steered.0, steered.1
            );
            assert!(steered.0 < alone.0 + 0.1, "{hold} {name}");
        }
    }
}

/// The ripple of slow pulses does not disturb the control: the mean over each period is as
/// accurate.
#[test]
fn ripple_does_not_upset_what_is_held() {
    println!("mean error of all periods and worst period, %: alone, steered");
    let fields = "min_frequency_hz = 0.5, hold = \"hold\"";
    for part in [0.025, 0.05, 0.1, 0.2, 0.4, 0.8] {
        for (i, p) in SUBJECTS.iter().enumerate() {
            let least = (RECRUITS.1 * (RECRUITS.0 - 20.0)).exp();
            let n = part * steady(*p, least, 50_000);
            let found = [ALONE, "calcium-force"].map(|model| {
                let given = SessionForces::play(p, false, model, fields, &points(&[(0.0, n)]), 40);
                let pairs = given.pulses.windows(2).filter(|pair| pair[0] > 1_000);
                let off = |pair: &[usize]| given.mean(pair[0], pair[1]) / n - 1.0;
                let errors: Vec<f64> = pairs.map(off).collect();
                let mean = errors.iter().sum::<f64>() / errors.len() as f64;
                let worst = errors.iter().fold(0f64, |worst, off| worst.max(off.abs()));
                let [.., before, last] = given.pulses[..] else {
                    panic!("pulses");
                };
                (1e3 / (last - before) as f64, 1e2 * mean, 1e2 * worst)
            });
            let [(hz, mean, worst), (_, steered, steered_worst)] = found;
            println!(
                "K{:02} {n:6.3} N {hz:5.2} Hz {mean:5.2} {worst:5.2}   {steered:5.2} {steered_worst:5.2}",
                i + 1
            );
            assert!(steered.abs() < mean.abs() + 0.5, "K{:02} {n} N", i + 1);
            assert!(steered_worst < worst + 1.0, "K{:02} {n} N", i + 1);
        }
    }
}
