//! The disturbed integrator σ' = u + d with |d'| <= L under zero-order hold: the textbook plant on
//! which discretizations of super-twisting are compared.

use super::super::real::Real;
use super::twist::{Discretization, Twist};

/// Disturbance d with a bounded slope, |d'| ≤ L.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Disturbance {
    /// The disturbance is always 0.
    None,
    /// Triangle wave whose slope is L or −L.
    Triangle {
        /// Number of control periods between two changes of direction.
        periods: u32,
    },
    /// The slope has the sign of the present σ (positive at 0), so that the disturbance always
    /// drives σ away from 0.
    Adversarial,
    /// The slope has the sign of the latest change of σ (positive without a change). This excites a
    /// discretization that is close to oscillating.
    Resonant,
}

impl Disturbance {
    /// The disturbances over which the bound of σ is tested: the two adversarial ones, and fast and
    /// slow triangle waves.
    pub const ALL: [Self; 5] = [
        Self::Triangle { periods: 1 },
        Self::Triangle { periods: 7 },
        Self::Triangle { periods: 997 },
        Self::Adversarial,
        Self::Resonant,
    ];
}

/// Closed loop of a control law and the disturbed integrator: its gains, period and bound of the
/// disturbance.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Loop<R> {
    /// Gain k1 of the square root term.
    pub k1: R,
    /// Gain k2 of the sign term.
    pub k2: R,
    /// Sample period h, s.
    pub h: R,
    /// Largest slope L of the disturbance, 1/s.
    pub slope: R,
}

/// Number of periods after which the loop counts as settled. It starts at σ = 10·L·h². All loops
/// scale with L and h, so the same number suits every loop.
const SETTLING: u32 = 4000;
/// Number of periods after settling in which the largest |σ| is determined.
const JUDGED: u32 = 4000;

/// Fraction of L·h² below which a value of σ counts as a rounding error.
const ROUNDING: f64 = 1e-6;

impl<R: Real> Loop<R> {
    /// Returns whether the gains satisfy the conditions under which super-twisting rejects the
    /// disturbance: k2 > L and k1 > √(k2 + L) (Seeber & Horn, "Stability proof for a
    /// well-established super-twisting parameter setting", Automatica 84 (2017)). The same
    /// conditions hold for the proper implicit form.
    pub fn fulfils_theorem(&self) -> bool {
        self.k2 > self.slope && self.k1 * self.k1 > self.k2 + self.slope
    }

    /// Simulates the loop with a discretized super-twisting law. Returns the largest |σ| at the
    /// sampling instants after settling, in the unit of σ. Stops and returns |σ| as soon as it
    /// exceeds 10^9·L·h², because the loop has then diverged.
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

    /// Simulates the loop with any control law, for example one in fixed point. `law` returns u for
    /// a given σ. Returns the largest |σ| as [`Self::worst_sigma`] does.
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

    /// Returns the largest |σ| over all disturbances in [`Disturbance::ALL`].
    pub fn worst_sigma_of_all(&self, discretization: Discretization) -> R {
        let sigmas = Disturbance::ALL.map(|d| self.worst_sigma(discretization, d));
        sigmas
            .into_iter()
            .fold(R::ZERO, |most, x| if x > most { x } else { most })
    }
}

/// Returns the sign of `x`, or 1 if `x` is as small as a rounding error. If the adversarial
/// disturbance followed the sign of rounding errors, it would change direction in every period and
/// have no effect.
fn outward<R: Real>(x: R, unit: R) -> R {
    if x < -(R::from_f64(ROUNDING) * unit) {
        -R::ONE
    } else {
        R::ONE
    }
}

/// Returns the exponent p of the power law y ~ x^p, fitted by a least-squares line to ln y over ln
/// x. `None` for fewer than two points, or if a value is not positive.
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
