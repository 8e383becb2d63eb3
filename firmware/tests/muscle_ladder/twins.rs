//! The models in f64, written from their equations; units are s and N, and C in pulses.

/// Muscle parameters: A in N/s, K, τc, τ1, τ2 in s.
#[derive(Clone, Copy, Debug)]
pub struct Muscle {
    pub a: f64,
    pub k: f64,
    pub tau_c: f64,
    pub tau1: f64,
    pub tau2: f64,
}

/// Pulse: µs from the start, and gain.
pub type Pulse = (u64, f64);

/// Fatigue parameters: αA in 1/s² (positive for a loss), αK in 1/(N s), ατ1 in 1/N, τfat in s.
#[derive(Clone, Copy, Debug)]
pub struct Fatigue {
    pub alpha_a: f64,
    pub alpha_k: f64,
    pub alpha_tau1: f64,
    pub tau_fat: f64,
}

/// Fatigue of the calcium–force model.
#[derive(Clone, Copy, Debug)]
pub enum FatigueMode {
    /// No fatigue.
    Never,
    /// Fatigue by Ding's equations.
    Always(Fatigue),
    /// Fatigue by the equations' solution for the mean force of each second, at its end.
    EverySecond(Fatigue),
}

/// State variables A, K, τ1 and F.
type State = [f64; 4];

/// Returns A, K and τ1 after a second with a mean force.
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

/// Returns the calcium–force model's force every millisecond, and A/A₀ at the end. Uses exact C,
/// and classical Runge–Kutta at 50 µs or less, split at pulses.
pub fn tiring(m: &Muscle, tiring: FatigueMode, pulses: &[Pulse], ms: u64) -> (Vec<f64>, f64) {
    let rate = |c: f64, gain: f64, [a, k, tau1, f]: State| {
        let x = c / (k + c);
        let force = a * gain * x - f / (tau1 + m.tau2 * x);
        let FatigueMode::Always(tire) = tiring else {
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
        if let FatigueMode::EverySecond(tire) = tiring
            && sample > 0
            && sample.is_multiple_of(1000)
        {
            let second = &samples[samples.len() - 1000..];
            y = after_a_second(m, &tire, y, second.iter().sum::<f64>() / 1000.0);
        }
    }
    (samples, y[0] / m.a)
}
