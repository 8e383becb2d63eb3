//! Map of integrator × step for every subject: the largest step at which each method stays stable.

use super::map::class_of;
use super::{Axis, Cell, Class, Layout, Map, Panels};
use crate::subjects::forces;
use crate::subjects::spec;
use hal_sim::body::muscle::reference::{Sample, integrate};
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use methods::muscle::{Integrator, Method, Number, Setting};
use rayon::prelude::*;

/// Methods of the rows, each with its number format.
const METHODS: [(Method, Number); 8] = [
    (Method::Euler, Number::F64),
    (Method::Heun, Number::F64),
    (Method::RungeKutta4, Number::F64),
    (Method::Etd1, Number::F64),
    (Method::EtdMidpoint, Number::F64),
    (Method::GaussExponential, Number::F64),
    (Method::LogTable, Number::F64),
    (Method::Shipped, Number::Device),
];
/// Steps of the columns, µs. The shipped model always steps by 1 ms; in its row they are the times
/// between two calls.
const STEPS_US: [u32; 25] = [
    250, 500, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 9000, 10_000, 10_500, 11_000, 12_000,
    13_000, 14_000, 15_000, 16_000, 18_000, 20_000, 22_000, 24_000, 27_000, 30_000,
];
/// Pulse rates of the trains, Hz; each train lasts 1 s.
const RATES_HZ: [f64; 3] = [20.0, 40.0, 80.0];
/// Time of the first pulse, µs, chosen so that pulses do not coincide with the ends of steps.
const FIRST_PULSE_US: u32 = 137;
/// Length of a run, s: 1 s with pulses, then 3 s of rest in which an instability can grow.
const DURATION_S: f64 = 4.0;
/// Length of each of two windows at the end of a run, s. If |F| is larger in the second than in the
/// first, the method diverges.
const WINDOW_S: f64 = 0.5;
/// Size of a negative force that counts as a failure, as a fraction of the peak force.
const NEGATIVE: f64 = 1e-3;

/// Outcome of runs with one method and step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Largest error of the force, % of the train's peak force.
    pub error: f64,
    /// Whether the force fell below −0.1 % of the peak force.
    pub negative: bool,
    /// Whether the method diverged: a force was not finite, an error exceeded the peak force, or
    /// |F| still grew at the end of the rest.
    pub diverges: bool,
}

const CLASSES: [Class; 7] = [
    Class::new('.', 0.02, "up to 0.02 %", 0),
    Class::new('1', 0.1, "up to 0.1 %", 0),
    Class::new('2', 1.0, "up to 1 %", 0),
    Class::new('3', 10.0, "up to 10 %", 0),
    Class::new('4', f64::INFINITY, "more, but stable", 0),
    Class::new('n', f64::INFINITY, "force below zero", 1),
    Class::new('X', f64::INFINITY, "diverges", 2),
];

/// Computes the map by simulating every cell; the seed is not used.
pub fn draw(_seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let mut panels = Panels::new(SUBJECTS.len(), progress);
    for (subject, p) in (1..).zip(&SUBJECTS) {
        let [tau1, tau_c] = [p.tau1_s, p.tau_c_s].map(|s| s * 1e3);
        let title = format!("K{subject:02}: τ1 {tau1:.1} ms, τc {tau_c:.1} ms");
        let steps = STEPS_US.par_iter();
        let columns: Vec<_> = steps.map(|step_us| (*step_us, run(p, *step_us))).collect();
        let rows: Vec<usize> = (0..METHODS.len()).collect();
        panels.add(title, &rows, &columns, |row, (step_us, found)| Cell {
            class: class(&found[*row]),
            number: found[*row].error,
            predicted: Some(predicted(METHODS[*row].0, p, *step_us)),
            told: None,
        });
    }
    Map {
        name: "integrator",
        title: "Integrator and step: where each method fails, for ten subjects",
        across: Axis::new(
            "step; for the shipped model, time between calls",
            "ms",
            &STEPS_US,
            |us| format!("{}", f64::from(*us) / 1e3),
        ),
        down: Axis::new("method", "", &METHODS, |(m, _)| m.name().to_owned()),
        quantity: "worst error, % of peak, over 20, 40 and 80 Hz",
        classes: &CLASSES,
        panels: panels.made,
        layout: Layout::Beside(2),
        theory: "explicit methods diverge where the step is more than 2 (Euler, Heun) or 2.785 \
                 (RK4) times τ1 or τc, or an inner value of C passes the pole of x = C/(C + K) at \
                 -K: from Cmax (h/τc − 1) > K on for Euler and Heun, near h = 1.3 τc for RK4. \
                 Before that, Euler's force may turn negative from τ1 or τc on. Exponential \
                 methods never fail.",
        notes: vec![
            "Diverges: not a number, an error larger than the peak, or |F| still growing 3 s \
             after the last pulse. Force below zero: by more than 0.1 % of the peak. f64, steps \
             split at pulses; trains of 1 s; errors at the ends of steps, against the exact \
             solution."
                .to_owned(),
        ],
    }
}

fn class(found: &Outcome) -> usize {
    match found {
        Outcome { diverges: true, .. } => 6,
        Outcome { negative: true, .. } => 5,
        Outcome { error, .. } => class_of(&CLASSES, *error),
    }
}

/// Runs each of the map's methods with this step on one muscle, and returns the worst outcome over
/// all pulse rates for each method.
pub fn run(p: &Parameters, step_us: u32) -> Vec<Outcome> {
    let mut worst: Vec<Option<Outcome>> = vec![None; METHODS.len()];
    for rate in RATES_HZ {
        let pulses: Vec<u32> = (0..rate as u32)
            .map(|n| FIRST_PULSE_US + (f64::from(n) * 1e6 / rate).round() as u32)
            .collect();
        let seconds: Vec<f64> = pulses.iter().map(|us| f64::from(*us) * 1e-6).collect();
        let truth = integrate(p, &seconds, DURATION_S, f64::from(step_us) * 1e-6);
        for ((method, number), worst) in METHODS.iter().zip(&mut worst) {
            let setting = Setting::new(*method, *number, step_us);
            let judged = setting.with_integrator(&spec(p), |m| judge(m, &pulses, &truth, step_us));
            let judged = judged.expect("table 4 is within the device's ranges");
            *worst = Some(worst.map_or(judged, |w| w.or_worse(judged)));
        }
    }
    worst.into_iter().flatten().collect()
}

impl Outcome {
    fn or_worse(self, other: Self) -> Self {
        Self {
            error: self.error.max(other.error),
            negative: self.negative || other.negative,
            diverges: self.diverges || other.diverges,
        }
    }
}

/// Runs a muscle through a train and compares its force with the true force at the end of every
/// step.
fn judge(muscle: &mut dyn Integrator, pulses: &[u32], truth: &[Sample], step_us: u32) -> Outcome {
    let peak = truth.iter().fold(0.0, |most: f64, s| most.max(s.force_n));
    let (mut error, mut lowest) = (0.0f64, 0.0f64);
    let mut ends = [0.0f64; 2];
    let mut finite = true;
    let times = || (0..truth.len() as u32).map(|n| n * step_us);
    for ((force, now), sample) in forces(muscle, pulses, times()).zip(times()).zip(truth) {
        finite &= force.is_finite();
        error = error.max((force - sample.force_n).abs());
        lowest = lowest.min(force);
        let left = DURATION_S - f64::from(now) * 1e-6;
        if left < 2.0 * WINDOW_S {
            let end = &mut ends[usize::from(left < WINDOW_S)];
            *end = end.max(force.abs());
        }
    }
    Outcome {
        error: error / peak * 100.0,
        negative: lowest < -NEGATIVE * peak,
        diverges: !finite || error > peak || ends[1] > ends[0],
    }
}

/// Predicts the verdict, as in [`Class::verdict`]. Without pulses, x falls to 0 and τ to its
/// shortest value τ1. The equations then describe two decays, and a method is stable if its growth
/// factor at z = h/τ is (Hairer & Wanner, Solving ODEs II, IV.2). With pulses, no intermediate
/// value of C within a step may pass the pole of x at −K.
fn predicted(method: Method, p: &Parameters, step_us: u32) -> u8 {
    let h = f64::from(step_us) * 1e-6;
    let z = h / p.tau_c_s;
    // Largest stable z, and the smallest inner value of C relative to C before the step.
    let (limit, lowest) = match method {
        Method::Euler | Method::Heun => (2.0, 1.0 - z),
        Method::RungeKutta4 => (
            2.785,
            (1.0 - z / 2.0).min(1.0 - z + z * z / 2.0 - z.powi(3) / 4.0),
        ),
        _ => return 0,
    };
    let fastest = RATES_HZ.into_iter().fold(0.0, f64::max);
    let most_calcium = 1.0 / (1.0 - libm::exp(-1.0 / (fastest * p.tau_c_s)));
    let stiffest = z.max(h / p.tau1_s);
    if stiffest > limit || -lowest * most_calcium > p.k {
        2
    } else {
        u8::from(method == Method::Euler && stiffest > 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(method: Method) -> usize {
        METHODS
            .iter()
            .position(|(m, _)| *m == method)
            .expect("a row")
    }

    #[test]
    fn explicit_methods_diverge_on_k05_where_theory_says_and_not_before() {
        // 2·τ1 and 2.785·τ1 with τ1 = 5 ms, 5 % on either side.
        for (method, limit_us) in [
            (Method::Euler, 10_000.0),
            (Method::Heun, 10_000.0),
            (Method::RungeKutta4, 13_925.0),
        ] {
            let diverges = |part: f64| {
                let step = (limit_us * part) as u32;
                run(&SUBJECTS[4], step)[row(method)].diverges
            };
            assert!(!diverges(0.95) && diverges(1.05), "{method:?}");
        }
    }

    #[test]
    fn exponential_methods_and_the_shipped_one_survive_thirty_milliseconds() {
        let map = draw(1, &mut |_| {});
        let mut worst = 0.0f64;
        for (row, (method, _)) in METHODS.iter().enumerate().skip(row(Method::Etd1)) {
            for cell in map.panels.iter().flat_map(|panel| &panel.rows[row]) {
                assert_eq!(map.verdict(cell), 0, "{method:?}");
                if *method == Method::Shipped {
                    worst = worst.max(cell.number);
                }
            }
        }
        println!("shipped, up to 30 ms between calls: {worst:.4} % of peak");
        assert!(worst <= 0.02, "{worst}");
    }
}
