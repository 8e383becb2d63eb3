//! The rungs in f64, written from their formulas: s, N, and C in pulses.

/// A in N/s, K, τc, τ1, τ2 in s.
#[derive(Clone, Copy, Debug)]
pub struct Muscle {
    pub a: f64,
    pub k: f64,
    pub tau_c: f64,
    pub tau1: f64,
    pub tau2: f64,
}

/// A pulse: µs from the start, and gain.
pub type Pulse = (u64, f64);

/// What a pulse of a train with interval T does: level of activation, and s
/// for which it holds.
fn level_and_time(m: &Muscle, t: f64) -> (f64, f64) {
    let c_plus = 1.0 / -(-t / m.tau_c).exp_m1();
    let c_minus = c_plus - 1.0;
    let area = m.tau_c * ((m.k + c_plus) / (m.k + c_minus)).ln();
    let mean = area / t;
    let square = mean - m.tau_c / t * m.k * (1.0 / (m.k + c_minus) - 1.0 / (m.k + c_plus));
    let after = m.tau_c * ((m.k + c_plus) / m.k).ln();
    let time = after * mean / square;
    if time >= t {
        (mean, after / mean)
    } else {
        (area / time, time)
    }
}

/// Time constants of rise and fall at a level.
fn taus(m: &Muscle, level: f64) -> (f64, f64) {
    (m.tau1 + m.tau2 * level, m.tau1 + m.tau2 * level / 8.0)
}

/// Mean force of a steady train with interval T, full gain.
pub fn mean_force(m: &Muscle, t: f64) -> f64 {
    let (level, time) = level_and_time(m, t);
    let (rise, fall) = taus(m, level);
    let target = m.a * level * rise;
    if time >= t {
        return target;
    }
    let (p, q) = ((-time / rise).exp(), (-(t - time) / fall).exp());
    let swing = target * (1.0 - p) * (1.0 - q) / (1.0 - p * q);
    (time * target - (rise - fall) * swing) / t
}

/// Interval of each pulse from the one before, µs; 2 s after a pause.
fn intervals(pulses: &[Pulse]) -> Vec<u64> {
    let others = pulses.windows(2).map(|w| w[1].0 - w[0].0);
    let all = std::iter::once(2_000_000).chain(others);
    all.map(|us| us.min(2_000_000)).collect()
}

/// Force of the lag every millisecond: exact between its events.
pub fn lag(m: &Muscle, pulses: &[Pulse], ms: u64) -> Vec<f64> {
    let intervals = intervals(pulses);
    let (mut f, mut now, mut i) = (0.0, 0.0, 0);
    let (mut until, mut target, mut rise, mut fall) = (0.0, 0.0, 1.0, 1.0);
    let mut samples = vec![];
    for sample in 0..=ms {
        let end = sample as f64 * 1e-3;
        loop {
            let pulse = pulses.get(i).map_or(f64::INFINITY, |p| p.0 as f64 * 1e-6);
            let to = f64::min(end, pulse);
            let held = (f64::min(until, to) - now).max(0.0);
            f = target + (f - target) * f64::exp(-held / rise);
            f *= f64::exp(-(to - now - held) / fall);
            now = to;
            if pulse > end {
                break;
            }
            let (level, time) = level_and_time(m, intervals[i] as f64 * 1e-6);
            (rise, fall) = taus(m, level);
            target = pulses[i].1 * m.a * level * rise;
            until = now + time;
            i += 1;
        }
        samples.push(f);
    }
    samples
}

/// Force of the static rung every millisecond.
pub fn steady(m: &Muscle, pulses: &[Pulse], ms: u64) -> Vec<f64> {
    let intervals = intervals(pulses);
    let level = |us: u64| {
        let i = pulses.partition_point(|p| p.0 <= us).checked_sub(1)?;
        let is_over = us >= pulses[i].0 + 2 * intervals[i];
        (!is_over).then(|| pulses[i].1 * mean_force(m, intervals[i] as f64 * 1e-6))
    };
    (0..=ms).map(|t| level(t * 1000).unwrap_or(0.0)).collect()
}

/// αA in 1/s² (a loss above 0), αK in 1/(N s), ατ1 in 1/N, τfat in s.
#[derive(Clone, Copy, Debug)]
pub struct Fatigue {
    pub alpha_a: f64,
    pub alpha_k: f64,
    pub alpha_tau1: f64,
    pub tau_fat: f64,
}

/// How the calcium–force model tires.
#[derive(Clone, Copy, Debug)]
pub enum Tiring {
    /// Not at all.
    Never,
    /// By Ding's equations.
    Always(Fatigue),
    /// By their solution for the mean force of each second, at its end.
    EverySecond(Fatigue),
}

/// A, K, τ1 and F.
type State = [f64; 4];

/// A, K and τ1 after a second with a mean force.
fn after_a_second(m: &Muscle, tire: &Fatigue, y: State, force: f64) -> State {
    let kept = (-1.0 / tire.tau_fat).exp();
    let towards = |now: f64, end: f64| end + (now - end) * kept;
    let loss = tire.alpha_a * force / y[0];
    let end = m.a / (1.0 + loss * tire.tau_fat);
    [
        end + (y[0] - end) * (-1.0 / tire.tau_fat - loss).exp(),
        towards(y[1], m.k + tire.alpha_k * force * tire.tau_fat),
        towards(y[2], m.tau1 + tire.alpha_tau1 * force * tire.tau_fat),
        y[3],
    ]
}

/// Force every millisecond of the calcium–force model: exact C, and classical
/// Runge–Kutta at 50 µs or less, split at pulses. And A/A₀ at the end.
pub fn tiring(m: &Muscle, tiring: Tiring, pulses: &[Pulse], ms: u64) -> (Vec<f64>, f64) {
    let rate = |c: f64, gain: f64, [a, k, tau1, f]: State| {
        let x = c / (k + c);
        let force = a * gain * x - f / (tau1 + m.tau2 * x);
        let Tiring::Always(tire) = tiring else {
            return [0.0, 0.0, 0.0, force];
        };
        [
            (m.a - a) / tire.tau_fat - tire.alpha_a * f,
            (m.k - k) / tire.tau_fat + tire.alpha_k * f,
            (m.tau1 - tau1) / tire.tau_fat + tire.alpha_tau1 * f,
            force,
        ]
    };
    let ahead = |y: State, h: f64, d: State| std::array::from_fn(|i| y[i] + h * d[i]);
    let (mut c, mut gain, mut now, mut i) = (0.0, 0.0, 0u64, 0);
    let mut y = [m.a, m.k, m.tau1, 0.0];
    let mut samples = vec![];
    for sample in 0..=ms {
        loop {
            let pulse = pulses.get(i).map_or(u64::MAX, |p| p.0);
            let until = pulse.min(sample * 1000).min(now + 50);
            if until > now {
                let h = (until - now) as f64 * 1e-6;
                let (mid, end) = (c * (-h / 2.0 / m.tau_c).exp(), c * (-h / m.tau_c).exp());
                let k1 = rate(c, gain, y);
                let k2 = rate(mid, gain, ahead(y, h / 2.0, k1));
                let k3 = rate(mid, gain, ahead(y, h / 2.0, k2));
                let k4 = rate(end, gain, ahead(y, h, k3));
                y = std::array::from_fn(|i| {
                    y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
                });
                (c, now) = (end, until);
            }
            if now == pulse {
                gain = pulses[i].1;
                c += 1.0;
                i += 1;
            } else if now == sample * 1000 {
                break;
            }
        }
        samples.push(y[3]);
        if let Tiring::EverySecond(tire) = tiring
            && sample > 0
            && sample.is_multiple_of(1000)
        {
            let second = &samples[samples.len() - 1000..];
            y = after_a_second(m, &tire, y, second.iter().sum::<f64>() / 1000.0);
        }
    }
    (samples, y[0] / m.a)
}
