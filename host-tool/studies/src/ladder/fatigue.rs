//! What a rung lacks of a muscle at work: the calcium–force equations with
//! parameters that tire, in f64, against the firmware's.

use super::protocol::Protocol;
use super::signal::{Difference, START, spec};
use super::{MeasureError, each};
use firmware::muscle::{FatigueSpec, Gain, Ladder, Model, Rung};
use firmware::units::us;
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use host_core::choice::grid::{RATES_MHZ, SESSIONS_S};

/// A muscle that tires: Lee 2020, (2) and (3), with Ding 2003's equations for
/// A, K and τ1. Classical Runge–Kutta for F, exact C, in steps of at most
/// 1 ms split at pulses; fatigue, with time constants of minutes, by the
/// rectangle rule over the same steps.
#[derive(Clone, Copy, Debug)]
pub struct Tiring {
    fresh: Parameters,
    now: Parameters,
    /// |αA| in 1/s², αK in 1/(N·s), ατ1 in 1/N, τfat in s.
    alpha_a: f64,
    alpha_k: f64,
    alpha_tau1: f64,
    tau_fat_s: f64,
    gain: f64,
    c: f64,
    force: f64,
}

/// τ1 and K end where the firmware's ranges do.
const TAU1_MAX_S: f64 = 0.2;
const K_MAX: f64 = 5.0;
/// Longest step, s.
const STEP_S: f64 = 1e-3;

impl Tiring {
    /// A fresh muscle.
    pub fn new(fresh: Parameters, fatigue: &FatigueSpec) -> Self {
        Self {
            fresh,
            now: fresh,
            alpha_a: f64::from(fatigue.alpha_a_milli_per_s2) * 1e-3,
            alpha_k: f64::from(fatigue.alpha_k_nano_per_n_s) * 1e-9,
            alpha_tau1: f64::from(fatigue.alpha_tau1_nano_per_n) * 1e-9,
            tau_fat_s: f64::from(fatigue.tau_fat_ms) * 1e-3,
            gain: 0.0,
            c: 0.0,
            force: 0.0,
        }
    }

    /// A pulse now.
    pub const fn pulse(&mut self, gain: f64) {
        self.gain = gain;
        self.c += 1.0;
    }

    /// Force, N.
    pub const fn force(&self) -> f64 {
        self.force
    }

    /// Lets `us` microseconds pass.
    pub fn pass(&mut self, us: u32) {
        let span = f64::from(us) * 1e-6;
        let steps = (span / STEP_S).ceil();
        for _ in 0..steps as u32 {
            self.step(span / steps);
        }
    }

    fn step(&mut self, h: f64) {
        let Self { now: p, gain, .. } = *self;
        let rate = |c: f64, f: f64| {
            let x = c / (p.k + c);
            gain * p.a_n_per_s * x - f / (p.tau1_s + p.tau2_s * x)
        };
        let half = (-0.5 * h / p.tau_c_s).exp();
        let (c0, c1, c2, f) = (self.c, self.c * half, self.c * half * half, self.force);
        let k1 = rate(c0, f);
        let k2 = rate(c1, f + 0.5 * h * k1);
        let k3 = rate(c1, f + 0.5 * h * k2);
        let k4 = rate(c2, f + h * k3);
        self.force += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        self.c = c2;
        let back = h / self.tau_fat_s;
        let (p, fresh, work) = (&mut self.now, &self.fresh, h * f);
        p.a_n_per_s += back * (fresh.a_n_per_s - p.a_n_per_s) - self.alpha_a * work;
        p.k += back * (fresh.k - p.k) + self.alpha_k * work;
        p.k = p.k.min(K_MAX);
        p.tau1_s += back * (fresh.tau1_s - p.tau1_s) + self.alpha_tau1 * work;
        p.tau1_s = p.tau1_s.min(TAU1_MAX_S);
    }
}

/// What this muscle does, N, at every millisecond.
pub fn reference(parameters: &Parameters, fatigue: &FatigueSpec, protocol: &Protocol) -> Vec<f64> {
    let mut muscle = Tiring::new(*parameters, fatigue);
    let mut now_us = 0;
    protocol.play(|us, pulse| {
        muscle.pass(us - now_us);
        now_us = us;
        if let Some(gain) = pulse {
            muscle.pulse(gain);
        }
        muscle.force()
    })
}

/// Errors of calcium-force and calcium-force-fatigue after each session of the
/// grid, at one rate; 0 before any work.
pub type Course = [[Difference; 2]; SESSIONS_S.len()];

/// Work without a pause at each rate of the grid, the worst over subjects, who
/// tire as Ding's quadriceps scaled to their strength.
///
/// # Errors
/// A subject the firmware does not take.
pub fn campaign(step: impl Fn(f64) + Sync) -> Result<Vec<Course>, MeasureError> {
    let jobs: Vec<(u32, &Parameters)> = RATES_MHZ
        .into_iter()
        .flat_map(|rate| SUBJECTS.iter().map(move |subject| (rate, subject)))
        .collect();
    let last = SESSIONS_S[SESSIONS_S.len() - 1];
    let courses = each(&jobs, step, |&(rate, subject)| work(rate, subject, last))?;
    Ok(courses
        .chunks(SUBJECTS.len())
        .map(|subjects| {
            let mut worst = Course::default();
            for course in subjects {
                for (worst, now) in worst.iter_mut().flatten().zip(course.iter().flatten()) {
                    *worst = worst.max(*now);
                }
            }
            worst
        })
        .collect())
}

/// One subject at one rate for `seconds`.
///
/// # Errors
/// A subject the firmware does not take.
pub fn work(rate_mhz: u32, subject: &Parameters, seconds: u32) -> Result<Course, MeasureError> {
    let force = spec(subject);
    let fatigue = FatigueSpec::scaled_to(force.a_mn_per_s);
    let rungs = [Rung::CalciumForce, Rung::CalciumForceFatigue];
    let [plain, tiring] = rungs.map(|rung| Ladder::new(force, Some(fatigue), rung));
    let models = [plain?, tiring?];
    let mut states = [models[0].at_rest(START), models[1].at_rest(START)];
    let mut truth = Tiring::new(*subject, &fatigue);
    let mut course = Course::default();
    let (mut peak, mut worst, mut squares) = (f64::MIN_POSITIVE, [0f64; 2], [0f64; 2]);
    let (mut due, mut now_us) = (0u32, 0u32);
    for ms in 1..=seconds * 1000 {
        let end_us = ms * 1000;
        // i/f to the microsecond; below 600 s · 200 Hz pulses.
        let at = |i: u32| (u64::from(i) * 1_000_000_000 / u64::from(rate_mhz)) as u32;
        while at(due) < end_us {
            let at_us = at(due);
            due += 1;
            truth.pass(at_us - now_us);
            now_us = at_us;
            truth.pulse(1.0);
            for (model, state) in models.iter().zip(&mut states) {
                model.pulse(state, START + us(at_us), Gain::FULL);
            }
        }
        truth.pass(end_us - now_us);
        now_us = end_us;
        peak = peak.max(truth.force());
        for (i, (model, state)) in models.iter().zip(&mut states).enumerate() {
            model.advance(state, START + us(end_us));
            let off = (model.force(state).get().to_num::<f64>() - truth.force()).abs();
            worst[i] = worst[i].max(off);
            squares[i] += off * off;
        }
        if let Some(row) = SESSIONS_S.iter().position(|&s| s * 1000 == ms) {
            course[row] = std::array::from_fn(|i| Difference {
                worst: worst[i] / peak,
                rms: (squares[i] / f64::from(ms)).sqrt() / peak,
            });
        }
    }
    Ok(course)
}

#[cfg(test)]
mod tests {
    use super::super::signal;
    use super::*;
    use host_core::choice::Scene;

    #[test]
    fn without_fatigue_it_is_the_simulated_wearers_muscle() {
        let never = FatigueSpec {
            alpha_a_milli_per_s2: 0,
            alpha_k_nano_per_n_s: 0,
            alpha_tau1_nano_per_n: 0,
            tau_fat_ms: 100_000,
        };
        let scene = Scene {
            burst_ms: 300,
            slowest_mhz: 20_000,
            fastest_mhz: 80_000,
            ramp_ms: 100,
            session_s: 1,
        };
        let protocol = Protocol::draw(&scene, 5);
        for subject in &SUBJECTS {
            let off = Difference::of(
                &signal::reference(subject, &protocol),
                &reference(subject, &never, &protocol),
            );
            assert!(off.worst < 1e-5, "{off:?}");
        }
    }

    #[test]
    fn a_minute_at_40_hz_tires_and_the_top_rung_follows() {
        let course = work(40_000, &SUBJECTS[0], 100).unwrap();
        let after_100_s = course[5];
        println!(
            "{:.3} %, {:.3} %",
            after_100_s[0].worst * 100.0,
            after_100_s[1].worst * 100.0
        );
        assert!(after_100_s[0].worst > 0.1);
        assert!(after_100_s[1].worst < after_100_s[0].worst / 10.0);
    }
}
