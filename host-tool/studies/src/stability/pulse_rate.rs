//! Map of pulse rate × time between calls × time constants: the error of the shipped muscle model,
//! with pulses at their own times, or snapped to the calls.

use super::chance::uniform;
use super::{Axis, Cell, Class, Layout, Map, Panels};
use crate::subjects::{forces, spec};
use hal_sim::body::muscle::reference::integrate;
use hal_sim::body::muscle::{Muscle, Parameters, Step};
use methods::muscle::{Integrator, Setting};

const RATES_HZ: [f64; 12] = [
    5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0, 100.0, 150.0, 200.0,
];
/// Times between two calls of the model in the columns, µs.
const CALLS_US: [u32; 18] = [
    250, 500, 750, 1000, 1500, 2000, 3000, 4000, 5000, 6000, 8000, 10_000, 12_000, 15_000, 18_000,
    20_000, 25_000, 30_000,
];
/// Factors by which all three time constants of the mean subject are multiplied, one for each
/// panel.
const SCALES: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
/// Time span of the pulses of a train, s.
const TRAIN_S: f64 = 1.0;
/// Largest deviation of a pulse from its regular time, as a fraction of the period. It makes pulses
/// fall anywhere between two calls.
const JITTER: f64 = 0.2;
/// Length of a run, s: a train, then a rest.
const DURATION_S: f64 = 1.8;
/// Error that the shipped model must not exceed for any muscle, % of the peak force.
const LIMIT: f64 = 0.02;

const CLASSES: [Class; 5] = [
    Class::new('.', 0.005, "up to 0.005 %", 0),
    Class::new('1', LIMIT, "up to 0.02 %", 0),
    Class::new('2', 1.0, "up to 1 %", 1),
    Class::new('3', 10.0, "up to 10 %", 1),
    Class::new('X', f64::INFINITY, "more than 10 %", 2),
];

/// When the model receives a pulse.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Pulses {
    /// With the pulse's own time, as on the device.
    Timed,
    /// As if it came at the call before it.
    Snapped,
}

/// Computes the map by simulating every cell; `seed` determines the deviations of the pulses.
pub fn draw(seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let mut panels = Panels::new(2 * SCALES.len(), progress);
    for (pulses, name) in [
        (Pulses::Timed, "pulses at their times"),
        (Pulses::Snapped, "pulses snapped to calls"),
    ] {
        for scale in SCALES {
            let p = muscle(scale);
            let [c, first, second] = [p.tau_c_s, p.tau1_s, p.tau2_s].map(|s| s * 1e3);
            let title = format!("{name}; τc {c:.1}, τ1 {first:.1}, τ2 {second:.0} ms");
            let trains = RATES_HZ.map(|rate| Train::new(&p, rate, seed));
            panels.add(title, &trains, &CALLS_US, |train, call_us| {
                let told = train.predicted(*call_us, pulses);
                Cell::with_prediction(&CLASSES, error(&p, train, *call_us, pulses), Some(told))
            });
        }
    }
    Map {
        name: "pulse_rate",
        title: "Pulse rate and calls: the error of the shipped muscle model",
        across: Axis::new("time between calls", "ms", &CALLS_US, |us| {
            format!("{}", f64::from(*us) / 1e3)
        }),
        down: Axis::new("pulses per second", "Hz", &RATES_HZ, f64::to_string),
        quantity: "worst error, % of the train's peak",
        classes: &CLASSES,
        panels: panels.made,
        layout: Layout::Down(2),
        theory: "pulses at their times: at most 0.02 % however rarely the model is called, for \
                 which its segments are chosen. Snapped: that plus max|F'| h/2, because a pulse is \
                 half a time h between calls early on average.",
        notes: vec![
            "Mean subject of Lee's table 4, all time constants multiplied; a train of 1 s, every \
             pulse shifted by up to a fifth of a period, then 0.8 s of rest; errors at the calls, \
             against the exact solution."
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

/// A train and the largest slope of the force under it.
struct Train {
    pulses_us: Vec<u32>,
    /// Largest slope |F'| of the force, % of the peak force per s.
    slope: f64,
}

impl Train {
    fn new(p: &Parameters, rate_hz: f64, seed: u64) -> Self {
        let pulses_us = shifted_pulses_us(rate_hz, JITTER, seed);
        let slope = slope(p, &pulses_us);
        Self { pulses_us, slope }
    }

    /// Returns the error that theory predicts, % of the peak force.
    fn predicted(&self, call_us: u32, pulses: Pulses) -> f64 {
        match pulses {
            Pulses::Timed => LIMIT,
            Pulses::Snapped => LIMIT + self.slope * f64::from(call_us) * 1e-6 / 2.0,
        }
    }
}

/// Returns the largest slope |F'| of the force, % of the peak force per s.
fn slope(p: &Parameters, pulses_us: &[u32]) -> f64 {
    const FINE_US: u32 = 100;
    let fine_s = f64::from(FINE_US) * 1e-6;
    let step = Step::new(p, fine_s);
    let mut muscle = Muscle::new(*p);
    let mut pulses = pulses_us.iter().peekable();
    let (mut slope, mut peak) = (0.0f64, 0.0f64);
    for n in 0..(DURATION_S / fine_s) as u32 {
        while pulses.next_if(|at| **at <= n * FINE_US).is_some() {
            muscle.pulse(1.0);
        }
        let before = muscle.force();
        muscle.step(&step);
        slope = slope.max((muscle.force() - before).abs() / fine_s);
        peak = peak.max(muscle.force());
    }
    slope / peak * 100.0
}

/// Returns the largest error of the shipped model on a train, % of the peak force.
fn error(p: &Parameters, train: &Train, call_us: u32, pulses: Pulses) -> f64 {
    let received = |us: &u32| match pulses {
        Pulses::Timed => *us,
        Pulses::Snapped => us / call_us * call_us,
    };
    let received: Vec<u32> = train.pulses_us.iter().map(received).collect();
    let error = shipped_error(p, (&train.pulses_us, &received), call_us, DURATION_S);
    error.expect("within the device's ranges")
}

/// Returns the times of regular pulses at `rate_hz` for 1 s, µs, each shifted by up to the part
/// `jitter` of a period.
pub(super) fn shifted_pulses_us(rate_hz: f64, jitter: f64, seed: u64) -> Vec<u32> {
    let at = |n: u32| {
        let place = f64::from(n) + jitter * (1.0 + 2.0 * uniform(seed, n.into()));
        (place * 1e6 / rate_hz) as u32
    };
    (0..(TRAIN_S * rate_hz) as u32).map(at).collect()
}

/// Returns the largest error of the shipped model at the calls of a run, % of the peak force: with
/// pulses at the second times instead of the first. `None` if the device refuses the muscle.
pub(super) fn shipped_error(
    p: &Parameters,
    (true_us, received_us): (&[u32], &[u32]),
    call_us: u32,
    duration_s: f64,
) -> Option<f64> {
    let seconds: Vec<f64> = true_us.iter().map(|us| f64::from(*us) * 1e-6).collect();
    let truth = integrate(p, &seconds, duration_s, f64::from(call_us) * 1e-6);
    let error = |muscle: &mut dyn Integrator| {
        let times = (0..truth.len() as u32).map(|n| n * call_us);
        let (mut error, mut peak) = (0.0f64, 0.0f64);
        for (force, sample) in forces(muscle, received_us, times).zip(&truth) {
            error = error.max((force - sample.force_n).abs());
            peak = peak.max(sample.force_n);
        }
        error / peak * 100.0
    };
    Setting::SHIPPED.with_integrator(&spec(p), error).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_at_their_times_stay_within_the_limit_and_snapped_ones_do_not() {
        for scale in SCALES {
            let p = muscle(scale);
            for rate in [10.0, 40.0, 100.0] {
                let train = Train::new(&p, rate, 1);
                for call_us in [1000, 20_000] {
                    let [timed, snapped] = [Pulses::Timed, Pulses::Snapped]
                        .map(|pulses| error(&p, &train, call_us, pulses));
                    println!(
                        "x{scale}, {rate} Hz, {call_us} µs: {timed:.5} %, snapped {snapped:.3} %"
                    );
                    assert!(timed <= LIMIT && snapped > LIMIT);
                }
            }
        }
    }
}
