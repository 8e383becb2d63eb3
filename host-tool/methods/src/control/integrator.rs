//! The disturbed integrator σ' = u + d with |d'| <= L under zero-order hold: the textbook plant on
//! which discretizations of super-twisting are compared.

use super::super::real::Real;
use super::twist::{Discretization, Twist};

/// A disturbance with bounded slope.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Disturbance {
    /// No disturbance.
    None,
    /// A triangle wave with slope ±L.
    Triangle {
        /// Number of periods between two changes of direction.
        periods: u32,
    },
    /// The slope is L with the sign of the present σ, upward at 0, and therefore always outward.
    Adversarial,
    /// The slope is ±L, with the sign of the last growth of σ (upward without growth): it excites a
    /// form that nearly oscillates.
    Resonant,
}

impl Disturbance {
    /// The disturbances for which the bound must hold: adversarial ones, fast and slow triangles.
    pub const ALL: [Self; 5] = [
        Self::Triangle { periods: 1 },
        Self::Triangle { periods: 7 },
        Self::Triangle { periods: 997 },
        Self::Adversarial,
        Self::Resonant,
    ];
}

/// Gains, period and disturbance of one closed loop.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Loop<R> {
    /// Gain k1 of the root term.
    pub k1: R,
    /// Gain k2 of the sign term.
    pub k2: R,
    /// Sample period h, s.
    pub h: R,
    /// L, largest slope of the disturbance, 1/s.
    pub slope: R,
}

/// Number of periods in which a loop settles from σ = 10·L·h², then number of periods that are
/// evaluated. Everything scales with L and h, so the same numbers suit every loop.
const SETTLING: u32 = 4000;
const JUDGED: u32 = 4000;

/// Fraction of L·h² below which a σ counts as rounding.
const ROUNDING: f64 = 1e-6;

impl<R: Real> Loop<R> {
    /// Returns whether the gains meet the conditions under which super-twisting rejects the
    /// disturbance: k2 > L and k1 > √(k2 + L) (Seeber & Horn, "Stability proof for a
    /// well-established super-twisting parameter setting", Automatica 84 (2017)). They hold for the
    /// proper implicit form too.
    pub fn fulfils_theorem(&self) -> bool {
        self.k2 > self.slope && self.k1 * self.k1 > self.k2 + self.slope
    }

    /// Returns the largest |σ| at the sampling instants once settled, in units of σ. The simulation
    /// stops at 10^9·L·h², from where no loop returns.
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

    /// Returns the same for any law from σ to u, for example one in fixed point.
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
            // u is held, and d rises linearly.
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

    /// Returns the largest |σ| over [`Disturbance::ALL`].
    pub fn worst_sigma_of_all(&self, discretization: Discretization) -> R {
        let each = Disturbance::ALL.map(|d| self.worst_sigma(discretization, d));
        each.into_iter()
            .fold(R::ZERO, |most, x| if x > most { x } else { most })
    }
}

/// Returns the sign of x, or 1 if x is only rounding: an adversary that follows the sign of
/// rounding changes direction every period, and its effect cancels.
fn outward<R: Real>(x: R, unit: R) -> R {
    if x < -(R::from_f64(ROUNDING) * unit) {
        -R::ONE
    } else {
        R::ONE
    }
}

/// Returns the exponent p of y ~ x^p by a least-squares line through ln y over ln x, or `None` for
/// fewer than two points or any value that is not positive.
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
