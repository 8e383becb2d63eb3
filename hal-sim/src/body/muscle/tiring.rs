//! A muscle with fatigue, in f64: equations (2)–(4) with those of Ding 2003 for A, K and τ1. It is
//! the reference for every prediction of fatigue.

use super::Parameters;

/// Parameters of fatigue (Ding 2003): the rates at which force reduces A and increases K and τ1,
/// and the time constant of their recovery. SI units, none negative, `tau_fat_s` above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fatigue {
    /// Rate at which force reduces A, |αA|, s⁻².
    pub alpha_a_per_s2: f64,
    /// Rate at which force increases K, αK, N⁻¹s⁻¹.
    pub alpha_k_per_n_s: f64,
    /// Rate at which force increases τ1, ατ1, N⁻¹.
    pub alpha_tau1_per_n: f64,
    /// Time constant of recovery, τfat, s.
    pub tau_fat_s: f64,
    /// Upper limit of K; the model is not meant for larger values.
    pub k_max: f64,
    /// Upper limit of τ1, s.
    pub tau1_max_s: f64,
}

impl Fatigue {
    /// A muscle without fatigue.
    pub const NEVER: Self = Self {
        alpha_a_per_s2: 0.0,
        alpha_k_per_n_s: 0.0,
        alpha_tau1_per_n: 0.0,
        tau_fat_s: 1.0,
        k_max: f64::INFINITY,
        tau1_max_s: f64::INFINITY,
    };
}

/// Longest time step, s.
const STEP_S: f64 = 1e-3;

/// A muscle with fatigue, over time. F is integrated by the classical Runge–Kutta method with exact
/// C, in steps of at most 1 ms that are split at pulses; fatigue, with time constants of minutes,
/// by the rectangle rule over the same steps. If a time constant is below 5 ms, the longest step is
/// a fifth of the shortest one.
#[derive(Clone, Copy, Debug)]
pub struct FatiguingMuscle {
    fresh: Parameters,
    now: Parameters,
    fatigue: Fatigue,
    longest_s: f64,
    /// Length of the last step, s, and the remaining share of C at its middle.
    half: (f64, f64),
    gain: f64,
    c: f64,
    force: f64,
}

impl FatiguingMuscle {
    /// Creates a muscle without fatigue yet.
    pub fn new(fresh: Parameters, fatigue: Fatigue) -> Self {
        let longest_s = STEP_S.min(0.2 * fresh.tau1_s.min(fresh.tau_c_s));
        Self {
            fresh,
            now: fresh,
            fatigue,
            longest_s,
            half: (longest_s, libm::exp(-0.5 * longest_s / fresh.tau_c_s)),
            gain: 0.0,
            c: 0.0,
            force: 0.0,
        }
    }

    /// Sets the longest step to `longest_s`, above 0, but at most a fifth of the shortest time
    /// constant. At 5 ms the error of the Runge-Kutta method is about 0.01 %.
    #[must_use]
    pub fn in_steps_of(mut self, longest_s: f64) -> Self {
        self.longest_s = longest_s.min(0.2 * self.fresh.tau1_s.min(self.fresh.tau_c_s));
        self
    }

    /// Reduces A by the share `part`, 0 to 1: fatigue that does not come from force.
    pub fn tire(&mut self, part: f64) {
        self.now.a_n_per_s *= 1.0 - part;
    }

    /// Returns whether the remaining force and calcium, relative to those of one pulse, are
    /// negligible.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.c < 1e-9 && self.force < 1e-9 * self.fresh.a_n_per_s
    }

    /// Applies a pulse now. `gain`, 0 to 1, scales A until the next pulse.
    pub const fn pulse(&mut self, gain: f64) {
        self.gain = gain;
        self.c += 1.0;
    }

    /// Sets the gain of the latest pulse to `gain` from now on, without additional calcium.
    pub const fn regain(&mut self, gain: f64) {
        self.gain = gain;
    }

    /// Advances a muscle with negligible force and without pulses by `us` microseconds: its force
    /// becomes 0, and fatigue recovers exactly.
    pub fn relax(&mut self, us: u64) {
        let span = us as f64 * 1e-6;
        let left = libm::exp(-span / self.fatigue.tau_fat_s);
        let (now, fresh) = (&mut self.now, &self.fresh);
        now.a_n_per_s = fresh.a_n_per_s + left * (now.a_n_per_s - fresh.a_n_per_s);
        now.k = fresh.k + left * (now.k - fresh.k);
        now.tau1_s = fresh.tau1_s + left * (now.tau1_s - fresh.tau1_s);
        self.c *= libm::exp(-span / fresh.tau_c_s);
        self.force = 0.0;
    }

    /// Returns the force F, N.
    pub const fn force(&self) -> f64 {
        self.force
    }

    /// Returns the parameters in the present state of fatigue.
    pub const fn parameters(&self) -> Parameters {
        self.now
    }

    /// Advances by `us` microseconds.
    pub fn pass(&mut self, us: u32) {
        let span = f64::from(us) * 1e-6;
        let steps = (span / self.longest_s - 1e-9).ceil().max(0.0);
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
        if self.half.0 != h {
            self.half = (h, libm::exp(-0.5 * h / p.tau_c_s));
        }
        let half = self.half.1;
        let (c0, c1, c2, f) = (self.c, self.c * half, self.c * half * half, self.force);
        let k1 = rate(c0, f);
        let k2 = rate(c1, f + 0.5 * h * k1);
        let k3 = rate(c1, f + 0.5 * h * k2);
        let k4 = rate(c2, f + h * k3);
        self.force += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        self.c = c2;
        let how = self.fatigue;
        let back = h / how.tau_fat_s;
        let (p, fresh, work) = (&mut self.now, &self.fresh, h * f);
        p.a_n_per_s += back * (fresh.a_n_per_s - p.a_n_per_s) - how.alpha_a_per_s2 * work;
        p.k += back * (fresh.k - p.k) + how.alpha_k_per_n_s * work;
        p.k = p.k.min(how.k_max);
        p.tau1_s += back * (fresh.tau1_s - p.tau1_s) + how.alpha_tau1_per_n * work;
        p.tau1_s = p.tau1_s.min(how.tau1_max_s);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{SUBJECTS, reference};
    use super::*;

    /// Compares with the reference, whose pulses have full gain: the error is below 2e-5 of the
    /// peak.
    #[test]
    fn without_fatigue_it_is_the_reference() {
        let pulses: Vec<f64> = reference::train(30.0, 20);
        for subject in &SUBJECTS {
            let truth = reference::integrate(subject, &pulses, 1.0, 1e-3);
            let peak = truth.iter().map(|s| s.force_n).fold(0.0, f64::max);
            let mut muscle = FatiguingMuscle::new(*subject, Fatigue::NEVER);
            let mut due = pulses.iter().map(|s| (s * 1e6).round() as u32).peekable();
            let mut now_us = 0;
            for (ms, sample) in (0u32..).zip(&truth) {
                while let Some(at_us) = due.next_if(|at| *at <= ms * 1000) {
                    muscle.pass(at_us - now_us);
                    now_us = at_us;
                    muscle.pulse(1.0);
                }
                muscle.pass(ms * 1000 - now_us);
                now_us = ms * 1000;
                let off = (muscle.force() - sample.force_n).abs() / peak;
                assert!(off < 2e-5, "{subject:?} at {ms} ms: {off}");
            }
        }
    }
}
