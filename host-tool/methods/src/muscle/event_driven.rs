//! Event-driven integration: the exact solution between pulses, whose one integral is computed by
//! Gauss–Legendre quadrature.
//!
//! With α = τ1 + τ2, κ = τ1·K/α, the factor e^(−R) of F remains from s to the end h of an interval,
//! R = (h − s)/τ1 − (τc·τ2/(τ1·α))·ln((C(s) + κ)/(C(h) + κ)), by partial fractions of 1/τ in eq.
//! (3) of Lee 2020.

use super::scheme::Muscle;
use super::{Arithmetic, Integrator};
use firmware::muscle::CalciumForceSpec;
use firmware::units::{Micros, us};

/// Returns nodes and weights of the Gauss–Legendre rule with `N` nodes on the interval 0…1, for `N`
/// = 2, 3, 4 or 10 (Abramowitz & Stegun, table 25.4, as (1 + x)/2 and w/2).
const fn rule<const N: usize>() -> [(f64, f64); N] {
    const { assert!(matches!(N, 2 | 3 | 4 | 10)) };
    let half: &[(f64, f64)] = match N {
        2 => &[(0.577_350_269_189_625_8, 1.0)],
        3 => &[(0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)],
        4 => &[
            (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
            (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
        ],
        _ => &[
            (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
            (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
            (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
            (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
            (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
        ],
    };
    let mut nodes = [(0.5, 0.0); N];
    let (mut i, odd) = (0, N % 2);
    while i < half.len() {
        let (x, w) = half[i];
        if odd == 1 && i == 0 {
            nodes[0] = (0.5, w / 2.0);
        } else {
            let place = 2 * i - odd;
            nodes[place] = ((1.0 - x) / 2.0, w / 2.0);
            nodes[place + 1] = ((1.0 + x) / 2.0, w / 2.0);
        }
        i += 1;
    }
    nodes
}

/// Constants of the exact solution between two pulses, for one muscle.
#[derive(Clone, Copy, Debug)]
pub struct Interval<R> {
    muscle: Muscle<R>,
    kappa: R,
    /// Decay rate 1/τ1 that F has without calcium.
    rate: R,
    /// Exponent p = τc·τ2/(τ1·α) of the calcium term in the decay of F.
    power: R,
}

impl<R: Arithmetic> Interval<R> {
    /// Computes the constants from the parameters of a muscle.
    pub fn new(muscle: &Muscle<R>) -> Self {
        let alpha = muscle.tau1 + muscle.tau2;
        Self {
            muscle: *muscle,
            kappa: muscle.tau1 / alpha * muscle.k,
            rate: R::ONE / muscle.tau1,
            power: muscle.tau2 / alpha / (muscle.rate_c * muscle.tau1),
        }
    }

    /// Returns G = p·log2(1 + c/κ), octaves, with p = τc·τ2/(τ1·α), and the slope of G over ln c.
    /// While G falls from G0, the share of F that remains is larger by the factor 2^(G0 − G) than
    /// with τ1 alone.
    pub fn power_at(&self, c: R) -> (R, R) {
        let octaves = R::from_f64(core::f64::consts::LOG2_E);
        let value = (R::ONE + c / self.kappa).ln();
        let slope = c / (c + self.kappa);
        (self.power * octaves * value, self.power * octaves * slope)
    }

    /// Returns the factor by which F decays during `time`, while C falls from `c`, and the force
    /// that is added meanwhile, N. The integral of the added force is evaluated at `N` nodes.
    pub fn decay_and_gain<const N: usize>(&self, time: R, c: R) -> (R, R) {
        let m = &self.muscle;
        let end = c * m.calcium_decay(time) + self.kappa;
        let kept = |rest: R, c: R| {
            let bound = ((c + self.kappa) / end).ln();
            (self.power * bound - rest * self.rate).exp()
        };
        let mut source = R::ZERO;
        for (node, weight) in const { rule::<N>() } {
            let c = c * m.calcium_decay(time * R::from_f64(node));
            let rest = time * R::from_f64(1.0 - node);
            source = source + R::from_f64(weight) * (m.bound_fraction(c) * kept(rest, c));
        }
        (kept(time, c), m.a * (time * source))
    }
}

/// A muscle whose stored state is updated at pulses, and after a maximum time without pulses. A
/// reading in between is computed from the stored state and does not change it.
#[derive(Clone, Copy, Debug)]
pub struct EventDriven<R, const NODES: usize> {
    interval: Interval<R>,
    longest_us: u32,
    /// Calcium state C at the time `from`.
    c: R,
    /// Force F at the time `from`, N.
    f: R,
    from: Micros,
    now: Micros,
}

impl<R: Arithmetic, const NODES: usize> EventDriven<R, NODES> {
    /// Creates a muscle without calcium and force at time 0. `longest_us` is the longest time that
    /// one integral covers, µs, at least 1.
    pub fn new(spec: &CalciumForceSpec, longest_us: u32) -> Self {
        Self {
            interval: Interval::new(&Muscle::new(spec)),
            longest_us,
            c: R::ZERO,
            f: R::ZERO,
            from: Micros::new(0),
            now: Micros::new(0),
        }
    }

    fn time(&self) -> R {
        R::from_micros(self.now.elapsed_since(self.from))
    }

    fn force(&self) -> R {
        if self.now == self.from || (self.c == R::ZERO && self.f == R::ZERO) {
            return self.f;
        }
        let time = self.time();
        let (kept, added) = self.interval.decay_and_gain::<NODES>(time, self.c);
        self.f * kept + added
    }

    fn calcium_number(&self) -> R {
        self.c * self.interval.muscle.calcium_decay(self.time())
    }

    /// Stores the present C and F as the state from which later ones are computed.
    fn store_state(&mut self) {
        (self.f, self.c) = (self.force(), self.calcium_number());
        self.from = self.now;
    }
}

impl<R: Arithmetic, const NODES: usize> Integrator for EventDriven<R, NODES> {
    fn pulse(&mut self, at: Micros) {
        self.advance(at);
        self.store_state();
        self.c = self.c + R::ONE;
    }
    fn advance(&mut self, to: Micros) {
        while to.elapsed_since(self.from) > self.longest_us {
            self.now = self.from + us(self.longest_us);
            self.store_state();
        }
        self.now = to;
    }
    fn calcium(&self) -> f64 {
        self.calcium_number().to_f64()
    }
    fn force_n(&self) -> f64 {
        self.force().to_f64()
    }
    fn force_bits(&self) -> u32 {
        self.force().fold_bits()
    }
}
