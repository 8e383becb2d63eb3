//! Reference solution of the calcium-force equations to about machine precision, against which
//! other solutions are compared. It is slow.
//!
//! Between pulses C decays exactly and the integrating factor of F has a closed form, R(s) = s/τ1 -
//! (τc τ2 / τ1(τ1+τ2)) ln((αC0+β)/(αC(s)+β)) with α = τ1+τ2 and β = τ1 K (partial fractions of
//! equation (3)). The remaining integral of a smooth function is computed with Gauss-Legendre
//! panels.

use super::Parameters;

/// State of the muscle at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time since the start, s.
    pub t_s: f64,
    /// C, in units of one pulse; at a pulse the value just after it.
    pub c: f64,
    /// Muscle force F, N.
    pub force_n: f64,
}

/// Number of nodes per panel. A panel is no longer than τc or τ1, so that the nearest singularity
/// is 2π panel half-widths away and the error is below 1e-16.
const ORDER: usize = 10;

/// Delay of a pulse after a sample within which both count as simultaneous, s, so that the rounding
/// of i/f and k·dt does not decide which side of the jump is recorded.
const SAME_INSTANT_S: f64 = 1e-12;

/// Solves the equations from rest and returns samples at 0, `dt_s`, 2 `dt_s`, … up to `duration_s`.
///
/// `pulses_s` are pulse times in seconds, ascending, not below zero; pulses after `duration_s` are
/// ignored. `dt_s` and all parameters are above zero.
pub fn integrate(
    parameters: &Parameters,
    pulses_s: &[f64],
    duration_s: f64,
    dt_s: f64,
) -> Vec<Sample> {
    let rule = gauss_legendre();
    let mut state = State::default();
    let mut pulses = pulses_s.iter().copied().peekable();
    let count = (duration_s / dt_s + 1e-9) as u64;
    (0..=count)
        .map(|i| {
            let t_s = i as f64 * dt_s;
            while let Some(pulse_s) = pulses.next_if(|p| *p <= t_s + SAME_INSTANT_S) {
                state.pass(parameters, &rule, pulse_s.min(t_s));
                state.c += 1.0;
            }
            state.pass(parameters, &rule, t_s);
            Sample {
                t_s,
                c: state.c,
                force_n: state.force,
            }
        })
        .collect()
}

/// Returns the times of `count` pulses at `frequency_hz`, the first at zero, s.
pub fn train(frequency_hz: f64, count: u32) -> Vec<f64> {
    (0..count).map(|i| f64::from(i) / frequency_hz).collect()
}

#[derive(Default)]
struct State {
    t_s: f64,
    c: f64,
    force: f64,
}

impl State {
    /// Advances to `to_s` without a pulse.
    fn pass(&mut self, p: &Parameters, rule: &[(f64, f64); ORDER], to_s: f64) {
        let span = to_s - self.t_s;
        if span > 0.0 {
            let panels = (span / p.tau_c_s.min(p.tau1_s)).ceil().max(1.0);
            for _ in 0..panels as u64 {
                self.panel(p, rule, span / panels);
            }
        }
        self.t_s = to_s;
    }

    fn panel(&mut self, p: &Parameters, rule: &[(f64, f64); ORDER], h: f64) {
        let alpha = p.tau1_s + p.tau2_s;
        let beta = p.tau1_s * p.k;
        let c_at = |s: f64| self.c * libm::exp(-s / p.tau_c_s);
        let end = c_at(h);
        // R(h) - R(s), the decay of F from s to the end of the panel.
        let remaining = |s: f64, c: f64| {
            let bound = libm::log((alpha * c + beta) / (alpha * end + beta));
            (h - s) / p.tau1_s - p.tau_c_s * p.tau2_s / (p.tau1_s * alpha) * bound
        };
        let source: f64 = rule
            .iter()
            .map(|(node, weight)| {
                let s = h * node;
                let c = c_at(s);
                weight * c / (c + p.k) * libm::exp(-remaining(s, c))
            })
            .sum();
        let kept = libm::exp(-remaining(0.0, self.c));
        self.force = self.force * kept + p.a_n_per_s * h * source;
        self.c = end;
    }
}

/// Returns nodes and weights of the Gauss-Legendre rule on [0, 1]: roots of the Legendre polynomial
/// by Newton's method from the usual cosine guess.
fn gauss_legendre() -> [(f64, f64); ORDER] {
    std::array::from_fn(|i| {
        let n = ORDER as f64;
        let mut x = libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5));
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut below, mut value) = (1.0, x);
            for j in 2..=ORDER {
                let j = j as f64;
                (below, value) = (value, ((2.0 * j - 1.0) * x * value - (j - 1.0) * below) / j);
            }
            slope = n * (x * value - below) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
    })
}
