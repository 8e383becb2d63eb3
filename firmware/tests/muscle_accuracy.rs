//! The fixed-point calcium–force model against the golden solution and, for
//! every subject, rate and pulse timing, against a floating-point reference
//! that itself is held to the golden solution.
//!
//! `cargo test -p firmware --test suite muscle_accuracy -- --nocapture`
//! prints the table of errors; adding `--ignored` prints the cost of a tick.

use firmware::muscle::{CalciumForce, CalciumForceSpec, CalciumForceState, Gain};
use firmware::units::Micros;

const TABLE_4: &str = include_str!("../../tests/golden/lee2020/table4_force_model.csv");
const GOLDEN: &str = include_str!("../../tests/golden/lee2020/golden_force.csv");

/// Every run starts so that the 32-bit clock wraps within it.
const START: Micros = Micros(u32::MAX - 400_000);

/// A in N/s, K, τc, τ1, τ2 in s.
struct Subject {
    name: String,
    parameters: [f64; 5],
}

impl Subject {
    fn fixed(&self) -> CalciumForce {
        let [a, k, tau_c, tau1, tau2] = self.parameters;
        let whole = |value: f64, unit: f64| (value / unit).round() as u32;
        CalciumForce::new(CalciumForceSpec {
            a_mn_per_s: whole(a, 1e-3),
            k_micro: whole(k, 1e-6),
            tau_c_us: whole(tau_c, 1e-6),
            tau1_us: whole(tau1, 1e-6),
            tau2_us: whole(tau2, 1e-6),
        })
        .unwrap()
    }
}

fn subjects() -> Vec<Subject> {
    let rows = TABLE_4.lines().skip(1).map(|row| {
        let mut cells = row.split(',');
        let name = cells.next().unwrap().to_owned();
        let mut next = |unit: f64| cells.next().unwrap().parse::<f64>().unwrap() * unit;
        let parameters = [next(1.0), next(1.0), next(1e-3), next(1e-3), next(1e-3)];
        Subject { name, parameters }
    });
    rows.collect()
}

/// A pulse: microseconds from the start, and gain.
type Pulse = (u32, f64);

/// Force every millisecond for `ms` milliseconds: exact C, and for F the
/// classical Runge–Kutta method at 25 µs, split at pulses.
fn reference(subject: &Subject, pulses: &[Pulse], ms: u32) -> Vec<f64> {
    let [a, k, tau_c, tau1, tau2] = subject.parameters;
    let rate = |c: f64, f: f64, gain: f64| {
        let x = c / (k + c);
        a * gain * x - f / (tau1 + tau2 * x)
    };
    let (mut c, mut f, mut gain, mut now) = (0.0, 0.0, 0.0, 0);
    let mut pulses = pulses.iter().peekable();
    let mut samples = vec![];
    for sample in 0..=ms {
        loop {
            let next_pulse = pulses.peek().map_or(u32::MAX, |p| p.0);
            let until = next_pulse.min(sample * 1000).min(now + 25);
            if until > now {
                let h = f64::from(until - now) * 1e-6;
                let (middle, end) = (c * (-h / 2.0 / tau_c).exp(), c * (-h / tau_c).exp());
                let k1 = rate(c, f, gain);
                let k2 = rate(middle, f + h / 2.0 * k1, gain);
                let k3 = rate(middle, f + h / 2.0 * k2, gain);
                let k4 = rate(end, f + h * k3, gain);
                (c, now) = (end, until);
                f += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            }
            if now == next_pulse {
                gain = pulses.next().unwrap().1;
                c += 1.0;
            } else if now == sample * 1000 {
                break;
            }
        }
        samples.push(f);
    }
    samples
}

/// The same from the device's model, advanced in ticks of 1 ms.
fn fixed(subject: &Subject, pulses: &[Pulse], ms: u32) -> Vec<f64> {
    let muscle = subject.fixed();
    let mut state = CalciumForceState::at_rest(START);
    let mut pulses = pulses.iter().peekable();
    let mut samples = vec![];
    for sample in 0..=ms {
        while let Some((at, gain)) = pulses.next_if(|p| p.0 <= sample * 1000) {
            let gain = Gain::new(fixed::types::U1F31::from_num(*gain));
            muscle.pulse(&mut state, START.plus(*at), gain);
        }
        muscle.advance(&mut state, START.plus(sample * 1000));
        samples.push(muscle.force(&state).0.to_num());
    }
    samples
}

/// Worst difference over the peak of `truth`, %.
fn error_pct(truth: &[f64], model: &[f64]) -> f64 {
    assert_eq!(truth.len(), model.len());
    let peak = truth.iter().copied().fold(0.0, f64::max);
    let pairs = truth.iter().zip(model);
    pairs.map(|(t, m)| (t - m).abs()).fold(0.0, f64::max) / peak * 100.0
}

/// A train of 1 s at `hz`, full gain.
fn train(hz: u32) -> Vec<Pulse> {
    (0..hz)
        .map(|i| ((f64::from(i) * 1e6 / f64::from(hz)).round() as u32, 1.0))
        .collect()
}

/// A train of 1 s with every pulse up to 45 % of a period off its place and,
/// where `gains` is set, a gain of its own.
fn scattered(hz: u32, gains: bool) -> Vec<Pulse> {
    let mut seed = 0x9E37_79B9_u32.wrapping_mul(hz);
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1u32 << 24)
    };
    let period = 1e6 / f64::from(hz);
    let pulse = |i: u32| {
        let at = (f64::from(i) + 0.5 + 0.9 * (random() - 0.5)) * period;
        (at as u32, if gains { 0.1 + 0.9 * random() } else { 1.0 })
    };
    (0..hz).map(pulse).collect()
}

/// Scattered pulses, each followed by two more within 0.9 ms: up to three in
/// a tick.
fn bursts(hz: u32) -> Vec<Pulse> {
    let followed = |(at, gain): Pulse| [(at, gain), (at + 311, gain / 2.0), (at + 900, gain)];
    scattered(hz, true).into_iter().flat_map(followed).collect()
}

#[test]
fn golden_solution_is_met_by_reference_and_device() {
    let subjects = subjects();
    let mut lines = GOLDEN.lines();
    let cases: Vec<&str> = lines.next().unwrap().split(',').skip(1).collect();
    let columns: Vec<Vec<f64>> = lines
        .map(|row| row.split(',').skip(1).map(|v| v.parse().unwrap()).collect())
        .collect();
    assert_eq!((cases.len(), columns.len()), (10, 151));
    for (i, case) in cases.iter().enumerate() {
        let (name, hz) = case.split_once('_').unwrap();
        let subject = subjects.iter().find(|s| s.name == name).unwrap();
        let pulses = train(hz.parse().unwrap());
        let golden: Vec<f64> = columns.iter().map(|row| row[i]).collect();
        let thin = |samples: Vec<f64>| samples.into_iter().step_by(10).collect::<Vec<_>>();
        let of_reference = error_pct(&golden, &thin(reference(subject, &pulses, 1500)));
        let of_device = error_pct(&golden, &thin(fixed(subject, &pulses, 1500)));
        println!("{case}: device {of_device:.4} %, reference {of_reference:.1e} %");
        assert!(of_reference < 1e-6, "{case}: {of_reference:e} %");
        assert!(of_device <= 0.012, "{case}: {of_device:.4} %");
    }
}

#[test]
fn every_subject_rate_and_timing_is_within_its_bound() {
    const RATES: [u32; 7] = [10, 20, 30, 40, 50, 70, 100];
    let mut worst = 0f64;
    println!("worst error, % of peak (regular / scattered / with gains / bursts)");
    println!("      {}", RATES.map(|hz| format!("{hz:>28} Hz")).concat());
    for subject in subjects() {
        print!("{}  ", subject.name);
        for hz in RATES {
            let trains = [
                train(hz),
                scattered(hz, false),
                scattered(hz, true),
                bursts(hz),
            ];
            let errors = trains.map(|pulses| {
                error_pct(
                    &reference(&subject, &pulses, 1500),
                    &fixed(&subject, &pulses, 1500),
                )
            });
            print!("  {} |", errors.map(|e| format!("{e:.4}")).join(" "));
            worst = errors.iter().copied().fold(worst, f64::max);
        }
        println!();
    }
    println!("worst of all: {worst:.4} %");
    assert!(worst <= 0.012, "{worst} %");
    assert!(worst >= 0.006, "{worst} %: half of what is stated");
}

/// A measurement, not a check: what one active muscle costs on this computer.
#[test]
#[ignore = "prints a time; run it alone and by hand"]
fn cost_of_a_tick_on_this_computer() {
    const TICKS: u32 = 4_000_000;
    let muscle = subjects()[0].fixed();
    let per_tick = |pulse_every: u32| {
        let mut state = CalciumForceState::at_rest(START);
        let begin = std::time::Instant::now();
        for tick in 0..TICKS {
            let now = START.plus(tick.wrapping_mul(1000));
            if pulse_every > 0 && tick % pulse_every == 0 {
                muscle.pulse(&mut state, now.plus(437), Gain::FULL);
            }
            muscle.advance(&mut state, now.plus(1000));
            std::hint::black_box(muscle.force(&state));
        }
        begin.elapsed().as_nanos() as f64 / f64::from(TICKS)
    };
    println!("at rest            {:6.2} ns per tick", per_tick(0));
    println!("active, 50 Hz      {:6.2} ns per tick", per_tick(20));
    println!("a pulse every tick {:6.2} ns per tick", per_tick(1));
}
