//! Map of pulse rate × step × time constants: the error of ETD midpoint, with steps split at pulses
//! or pulses snapped to steps.

use super::chance::uniform;
use super::{Axis, Cell, Class, Layout, Map, Panels};
use crate::subjects::forces;
use crate::subjects::spec;
use hal_sim::body::muscle::reference::integrate;
use hal_sim::body::muscle::{Muscle, Parameters, Step};
use methods::muscle::exponential::EtdMidpoint;
use methods::muscle::stepped::{Pulses, SteppedMuscle};

const RATES_HZ: [f64; 12] = [
    5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0, 100.0, 150.0, 200.0,
];
const STEPS_US: [u32; 18] = [
    250, 500, 750, 1000, 1500, 2000, 3000, 4000, 5000, 6000, 8000, 10_000, 12_000, 15_000, 18_000,
    20_000, 25_000, 30_000,
];
/// Factors by which all three time constants of the mean subject are multiplied, one for each
/// panel.
const SCALES: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
/// Time span of the pulses of a train, s.
const TRAIN_S: f64 = 1.0;
/// Largest deviation of a pulse from its regular time, as a fraction of the period. It makes pulses
/// fall anywhere within a step.
const JITTER: f64 = 0.2;
/// Length of a run, s: a train, then a rest.
const DURATION_S: f64 = 1.8;
/// Error that the device's model stays far below, % of the peak force.
const GOOD: f64 = 0.1;
/// Error that people notice, % of the peak force.
const NOTICEABLE: f64 = 10.0;

const CLASSES: [Class; 5] = [
    Class::new('.', 0.02, "up to 0.02 %", 0),
    Class::new('1', GOOD, "up to 0.1 %", 0),
    Class::new('2', 1.0, "up to 1 %", 1),
    Class::new('3', NOTICEABLE, "up to 10 %", 1),
    Class::new('X', f64::INFINITY, "more than 10 %", 2),
];

/// Computes the map by simulating every cell; `seed` determines the deviations of the pulses.
pub fn draw(seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let mut panels = Panels::new(2 * SCALES.len(), progress);
    for (pulses, name) in [
        (Pulses::Split, "split at pulses"),
        (Pulses::Snapped, "pulses snapped"),
    ] {
        for scale in SCALES {
            let p = muscle(scale);
            let [c, first, second] = [p.tau_c_s, p.tau1_s, p.tau2_s].map(|s| s * 1e3);
            let title = format!("{name}; τc {c:.1}, τ1 {first:.1}, τ2 {second:.0} ms");
            let trains = RATES_HZ.map(|rate| Train::new(&p, rate, seed));
            panels.add(title, &trains, &STEPS_US, |train, step| {
                let told = train.predicted(*step, pulses);
                Cell::with_prediction(&CLASSES, error(&p, train, *step, pulses), Some(told))
            });
        }
    }
    Map {
        name: "pulse_rate",
        title: "Pulse rate and step: the error of ETD midpoint, split at pulses or not",
        across: Axis::new("step", "ms", &STEPS_US, |us| {
            format!("{}", f64::from(*us) / 1e3)
        }),
        down: Axis::new("pulses per second", "Hz", &RATES_HZ, f64::to_string),
        quantity: "worst error, % of the train's peak",
        classes: &CLASSES,
        panels: panels.made,
        layout: Layout::Down(2),
        theory: "split: E' = −E/τ + h² [(a'' − r''F)/24 + (r a' − r'a)/12] along the exact \
                 solution, with a = A x, r = 1/τ, and h the step, or the time between pulses if \
                 that is shorter. Snapped: the same with the full step, plus max|F'| h/2, because \
                 a pulse is half a step early on average.",
        notes: vec![
            "Mean subject of Lee's table 4, all time constants multiplied; f64; a train of 1 s, \
             every pulse shifted by up to a fifth of a period, then 0.8 s of rest; errors at the \
             ends of steps."
                .to_owned(),
        ],
    }
}

fn muscle(scale: f64) -> Parameters {
    let mean = Parameters::mean_subject();
    Parameters {
        tau_c_s: mean.tau_c_s * scale,
        tau1_s: mean.tau1_s * scale,
        tau2_s: mean.tau2_s * scale,
        ..mean
    }
}

/// A train, with the properties of its exact solution from which theory predicts the error.
struct Train {
    rate_hz: f64,
    pulses_us: Vec<u32>,
    /// Largest error that theory predicts over the whole run for a step of 1 s, % of the peak
    /// force. It grows with the square of the step.
    error_per_h2: f64,
    /// Largest error that theory predicts in the rest after the last pulse, for a step of 1 s, % of
    /// the peak force.
    error_at_rest_per_h2: f64,
    /// Largest slope |F'| of the force, % of the peak force per s.
    slope: f64,
}

impl Train {
    fn new(p: &Parameters, rate_hz: f64, seed: u64) -> Self {
        let at = |n: u32| {
            let place = f64::from(n) + JITTER * (1.0 + 2.0 * uniform(seed, n.into()));
            (place * 1e6 / rate_hz) as u32
        };
        let pulses_us = (0..(TRAIN_S * rate_hz) as u32).map(at).collect();
        let mut train = Self {
            rate_hz,
            pulses_us,
            error_per_h2: 0.0,
            error_at_rest_per_h2: 0.0,
            slope: 0.0,
        };
        train.solve(p);
        train
    }

    /// Computes the exact solution on a fine grid, and from it the fields for theory.
    fn solve(&mut self, p: &Parameters) {
        const FINE_US: u32 = 100;
        let fine = f64::from(FINE_US) * 1e-6;
        let step = Step::new(p, fine);
        let mut muscle = Muscle::new(*p);
        let ([mut error, mut at_rest], mut worst) = ([0.0; 2], [0.0f64; 2]);
        let (mut slope, mut peak) = (0.0f64, 0.0f64);
        let mut pulses = self.pulses_us.iter().peekable();
        for n in 0..(DURATION_S / fine) as u32 {
            while pulses.next_if(|at| **at <= n * FINE_US).is_some() {
                muscle.pulse(1.0);
            }
            let (rate, source) = local_error(p, muscle.c(), muscle.force());
            let before = muscle.force();
            muscle.step(&step);
            let kept = (-rate * fine).exp();
            let added = source * (1.0 - kept) / rate;
            error = error * kept + added;
            worst[0] = worst[0].max(f64::abs(error));
            if pulses.peek().is_none() {
                at_rest = at_rest * kept + added;
                worst[1] = worst[1].max(f64::abs(at_rest));
            }
            slope = slope.max((muscle.force() - before).abs() / fine);
            peak = peak.max(muscle.force());
        }
        self.error_per_h2 = worst[0] / peak * 100.0;
        self.error_at_rest_per_h2 = worst[1] / peak * 100.0;
        self.slope = slope / peak * 100.0;
    }

    /// Returns the error that theory predicts for this step, % of the peak force.
    fn predicted(&self, step_us: u32, pulses: Pulses) -> f64 {
        let h = f64::from(step_us) * 1e-6;
        match pulses {
            Pulses::Split => {
                let among_pulses = self.error_per_h2 * h.min(1.0 / self.rate_hz).powi(2);
                among_pulses.max(self.error_at_rest_per_h2 * h * h)
            }
            Pulses::Snapped => self.error_per_h2 * h * h + self.slope * h / 2.0,
        }
    }
}

/// Returns 1/τ, and the rate at which the midpoint method adds to the error, for a step of 1 s; it
/// grows with the square of the step. It is the difference between the exact flow and that of the
/// method, from the Magnus series of F' = a − r·F up to h³ (Iserles et al., "Lie-group methods",
/// Acta Numerica 2000, §4).
fn local_error(p: &Parameters, c: f64, force: f64) -> (f64, f64) {
    let x = c / (c + p.k);
    let x1 = -x * (1.0 - x) / p.tau_c_s;
    let x2 = x * (1.0 - x) * (1.0 - 2.0 * x) / p.tau_c_s.powi(2);
    let tau = p.tau1_s + p.tau2_s * x;
    let (tau1, tau2) = (p.tau2_s * x1, p.tau2_s * x2);
    let (r, r1) = (1.0 / tau, -tau1 / tau.powi(2));
    let r2 = -tau2 / tau.powi(2) + 2.0 * tau1.powi(2) / tau.powi(3);
    let [a, a1, a2] = [x, x1, x2].map(|x| p.a_n_per_s * x);
    (r, (a2 - r2 * force) / 24.0 + (r * a1 - r1 * a) / 12.0)
}

/// Returns the largest error of the midpoint method on a train, % of the peak force.
fn error(p: &Parameters, train: &Train, step_us: u32, pulses: Pulses) -> f64 {
    let seconds: Vec<f64> = train
        .pulses_us
        .iter()
        .map(|us| f64::from(*us) * 1e-6)
        .collect();
    let truth = integrate(p, &seconds, DURATION_S, f64::from(step_us) * 1e-6);
    let mut muscle = SteppedMuscle::<EtdMidpoint<f64>>::new(&spec(p), step_us, pulses);
    let times = (0..truth.len() as u32).map(|n| n * step_us);
    let (mut error, mut peak) = (0.0f64, 0.0f64);
    for (force, sample) in forces(&mut muscle, &train.pulses_us, times).zip(&truth) {
        error = error.max((force - sample.force_n).abs());
        peak = peak.max(sample.force_n);
    }
    error / peak * 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_steps_keep_a_tenth_of_a_percent_at_one_millisecond_and_snapped_ones_do_not() {
        let p = muscle(1.0);
        for rate in [10.0, 40.0, 100.0] {
            let train = Train::new(&p, rate, 1);
            let [split, snapped] =
                [Pulses::Split, Pulses::Snapped].map(|how| error(&p, &train, 1000, how));
            println!("{rate} Hz at 1 ms: split {split:.5} %, snapped {snapped:.3} %");
            assert!(split < 0.02 && snapped > GOOD);
        }
    }

    #[test]
    fn the_error_constant_tells_the_error_of_split_steps() {
        for scale in [0.5, 1.0, 2.0] {
            let p = muscle(scale);
            for rate in [10.0, 40.0] {
                let train = Train::new(&p, rate, 1);
                for step in [500, 1000, 2000] {
                    let found = error(&p, &train, step, Pulses::Split);
                    let told = train.predicted(step, Pulses::Split);
                    println!("x{scale} {rate} Hz {step} us: {found:.5} %, told {told:.5} %");
                    assert!((0.95..1.05).contains(&(told / found)));
                }
            }
        }
    }
}
