//! The disturbed integrator σ' = u + d with |d'| <= L under zero-order hold: the
//! textbook plant on which discretizations of super-twisting are compared.

use super::super::real::Real;
use super::twist::{Discretization, Twist};

/// A disturbance of bounded slope.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Disturbance {
    /// At rest at 0.
    None,
    /// Up and down with slope ±L, turning every this many periods.
    Triangle {
        /// Periods from turn to turn.
        periods: u32,
    },
    /// Its slope is L with the sign of the present σ, upward at 0: always outward.
    Adversarial,
    /// Its slope is ±L, changed after each period with the sign of the last
    /// growth of σ (upward where there was none): what a form that nearly
    /// oscillates is driven by.
    Resonant,
}

impl Disturbance {
    /// Those that the bound is held to: adversarial ones, fast and slow
    /// triangles.
    pub const ALL: [Self; 5] = [
        Self::Triangle { periods: 1 },
        Self::Triangle { periods: 7 },
        Self::Triangle { periods: 997 },
        Self::Adversarial,
        Self::Resonant,
    ];
}

/// One closed loop.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Loop<R> {
    /// Gain of the root.
    pub k1: R,
    /// Gain of the sign.
    pub k2: R,
    /// Period, s.
    pub h: R,
    /// L, highest slope of the disturbance, 1/s.
    pub slope: R,
}

/// Periods that a loop gets to settle from σ = 10·L·h², and then to be judged.
/// Everything scales with L and h, so a number of periods suits all.
const SETTLING: u32 = 4000;
const JUDGED: u32 = 4000;

/// Below this part of L·h² a σ is rounding.
const ROUNDING: f64 = 1e-6;

impl<R: Real> Loop<R> {
    /// Whether gains fulfil the conditions under which super-twisting rejects
    /// the disturbance: k2 > L and k1 > √(k2 + L) (Seeber & Horn, "Stability
    /// proof for a well-established super-twisting parameter setting",
    /// Automatica 84 (2017)), to which the proper implicit form keeps.
    pub fn fulfils_theorem(&self) -> bool {
        self.k2 > self.slope && self.k1 * self.k1 > self.k2 + self.slope
    }

    /// Largest |σ| at the sampling instants once settled, in units of σ; stops
    /// at 10^9·L·h², where nothing returns.
    pub fn worst_sigma(&self, discretization: Discretization, disturbance: Disturbance) -> R {
        let twist = Twist::new(discretization, self.k1, self.k2, R::ONE, self.h);
        let mut integral = R::ZERO;
        self.worst_sigma_under(disturbance, |sigma| {
            let answer = twist.push(sigma, integral);
            let u = -(integral + answer.push);
            integral = integral + answer.growth;
            u
        })
    }

    /// The same for any law from σ to u: for fixed point.
    pub fn worst_sigma_under(&self, disturbance: Disturbance, mut law: impl FnMut(R) -> R) -> R {
        let h = self.h;
        let unit = self.slope * h * h;
        let (mut sigma, mut before) = (R::from_f64(10.0) * unit, R::ZERO);
        let (mut d, mut side) = (R::ZERO, R::ONE);
        let mut worst = R::ZERO;
        for period in 0..SETTLING + JUDGED {
            side = match disturbance {
                Disturbance::None => R::ZERO,
                Disturbance::Triangle { periods } if period % periods == 0 => -side,
                Disturbance::Triangle { .. } => side,
                Disturbance::Adversarial => outward(sigma, unit),
                Disturbance::Resonant => outward(sigma - before, unit),
            };
            before = sigma;
            let grown = side * self.slope * h;
            // u is held, d rises evenly.
            sigma = sigma + h * (law(sigma) + d + grown / R::from_f64(2.0));
            d = d + grown;
            if sigma.abs() > R::from_f64(1e9) * unit {
                return sigma.abs();
            }
            if period >= SETTLING && sigma.abs() > worst {
                worst = sigma.abs();
            }
        }
        worst
    }

    /// Largest |σ| over [`Disturbance::ALL`].
    pub fn worst_sigma_of_all(&self, discretization: Discretization) -> R {
        let each = Disturbance::ALL.map(|d| self.worst_sigma(discretization, d));
        each.into_iter()
            .fold(R::ZERO, |most, x| if x > most { x } else { most })
    }
}

/// The side of x, up where x is nothing but rounding: an adversary that follows
/// the sign of rounding turns every period, and that cancels.
fn outward<R: Real>(x: R, unit: R) -> R {
    if x < -(R::from_f64(ROUNDING) * unit) {
        -R::ONE
    } else {
        R::ONE
    }
}

/// The p of the straight line through ln y over ln x for y ~ x^p, by least
/// squares; `None` for fewer than two points or any that is not positive.
pub fn fitted_order(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 2 || points.iter().any(|(x, y)| !(*x > 0.0 && *y > 0.0)) {
        return None;
    }
    let n = points.len() as f64;
    let logs = || points.iter().map(|(x, y)| (libm::log(*x), libm::log(*y)));
    let (sum_x, sum_y) = logs().fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (mean_x, mean_y) = (sum_x / n, sum_y / n);
    let (xy, xx) = logs().fold((0.0, 0.0), |(xy, xx), (x, y)| {
        let dx = x - mean_x;
        (xy + dx * (y - mean_y), xx + dx * dx)
    });
    (xx > 0.0).then(|| xy / xx)
}
