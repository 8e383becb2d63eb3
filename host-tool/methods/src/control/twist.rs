//! The super-twisting law and its discretizations, on a sliding variable alone.
//!
//! The continuous law is s' = −b·(u + d), u = k1·√|s|·sgn s + v, v' = k2·sgn s. For the s of this
//! period, each discretization returns the term to add to v now, and the growth of v.

use super::super::real::Real;
use super::{bounded, sign};

/// Discretization of the law.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Discretization {
    /// Explicit Euler, with sign and root of the present s. It chatters: its limit cycle grows with
    /// the gains.
    Explicit,
    /// Root of the present s, sign of the next (Xiong, Chen et al., "Discrete-time implementation
    /// of super-twisting control", IEEE TCAS-II 2022, and others), without chattering.
    SemiImplicit,
    /// Koch & Reichhartinger, "Discrete-time equivalents of the super-twisting algorithm",
    /// Automatica 107 (2019), implicit mapping: the state-dependent poles p·|s|^−½ map to 1/(1 −
    /// h·p·|s|^−½).
    KochReichhartinger,
    /// Root and sign of the next s, predicted with u as if d were 0 (Brogliato, Polyakov, Efimov,
    /// "The implicit discretization of the supertwisting sliding-mode control algorithm", IEEE TAC
    /// 65 (2020)). The prediction removes the part of v that counteracts d, so that |s| remains at
    /// h·|d|.
    Resolvent,
    /// Root and sign of the next s, predicted as if v cancelled d. Its dead-beat poles are
    /// e^(±iπ/3), on the unit circle. It is included to show why [`Self::ProperImplicit`] counts
    /// the step of v twice.
    Proxy,
    /// Seeber & Andritsch, "Proper implicit discretization of the super-twisting controller",
    /// Automatica 173 (2025) 112027, derived again here: as [`Self::Proxy`], but u uses v one
    /// growth further ahead, which puts both poles of the sliding phase at 0. Then s is h times the
    /// change of d's mean from period to period: at most L·h², which is optimal.
    ProperImplicit,
}

impl Discretization {
    /// Every discretization, in the order of the enum.
    pub const ALL: [Self; 6] = [
        Self::Explicit,
        Self::SemiImplicit,
        Self::KochReichhartinger,
        Self::Resolvent,
        Self::Proxy,
        Self::ProperImplicit,
    ];

    /// Returns the name for tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::SemiImplicit => "semi-implicit",
            Self::KochReichhartinger => "koch-reichhartinger",
            Self::Resolvent => "resolvent",
            Self::Proxy => "proxy",
            Self::ProperImplicit => "proper implicit",
        }
    }
}

/// A discretized super-twisting law with its gains, for one period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Twist<R> {
    discretization: Discretization,
    k1: R,
    /// Product h·b.
    hb: R,
    /// Product h·b·k1.
    hbk1: R,
    /// Product h·k2.
    hk2: R,
    /// Product h²·b·k2.
    hhbk2: R,
    /// Linear gain k3.
    linear: R,
}

/// Response to one s: u = v + `push`, then v grows by `growth`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Push<R> {
    /// Term to add to v now.
    pub push: R,
    /// Growth of v until the next period.
    pub growth: R,
}

impl<R: Real> Twist<R> {
    /// Creates the law with k1 in effort·s^-½, k2 in effort/s, b the gain from effort to the rate
    /// of s, and h the period in s; all above 0.
    pub fn new(discretization: Discretization, k1: R, k2: R, b: R, h: R) -> Self {
        let hb = h * b;
        Self {
            discretization,
            k1,
            hb,
            hbk1: hb * k1,
            hk2: h * k2,
            hhbk2: hb * (h * k2),
            linear: R::ZERO,
        }
    }

    /// Adds a term k3·s beside the root (linear correction: Moreno & Osorio, IEEE CDC 2008), in
    /// effort/s; the implicit forms use the next s for it too.
    pub fn with_linear(mut self, k3: R) -> Self {
        self.linear = k3;
        self
    }

    /// Returns the response to the sliding variable `s` while the integral is `v`.
    pub fn push(&self, s: R, v: R) -> Push<R> {
        match self.discretization {
            Discretization::Explicit => {
                let side = sign(s);
                let push = self.k1 * s.abs().sqrt() * side + self.linear * s;
                self.combine_terms(push, side, R::ZERO)
            }
            Discretization::SemiImplicit => {
                let root = s.abs().sqrt();
                let side = bounded(s / (self.hbk1 * root + self.hhbk2), R::ONE);
                self.combine_terms(self.k1 * root * side + self.linear * s, side, R::ONE)
            }
            Discretization::KochReichhartinger => {
                let root = s.abs().sqrt();
                let side = s / (s.abs() + self.hbk1 * root + self.hhbk2);
                self.combine_terms(
                    self.k1 * root * side + self.linear * s,
                    side,
                    R::from_f64(2.0),
                )
            }
            Discretization::Resolvent => self.implicit(s - self.hb * v, R::ONE),
            Discretization::Proxy => self.implicit(s, R::ONE),
            Discretization::ProperImplicit => self.implicit(s, R::from_f64(2.0)),
        }
    }

    fn combine_terms(&self, root_term: R, side: R, ahead: R) -> Push<R> {
        let growth = self.hk2 * side;
        Push {
            push: root_term + ahead * growth,
            growth,
        }
    }

    /// Computes the response with root and sign of the next s, which solves (1 + h·b·k3)·z +
    /// h·b·k1·√|z|·sgn z + h²·b·k2·sgn z ∋ s.
    fn implicit(&self, s: R, ahead: R) -> Push<R> {
        let slope = R::ONE + self.hb * self.linear;
        let root = resolvent_root(s.abs(), slope, self.hbk1, self.hhbk2);
        // hhbk2 > 0; for |s| up to hhbk2 the next s is 0, and its sign takes an intermediate value.
        let side = bounded(s / self.hhbk2, R::ONE);
        self.combine_terms((self.k1 + self.linear * root) * root * side, side, ahead)
    }
}

/// Returns √z for the z >= 0 that solves slope·z + a·√z + c = size, or 0 for size <= c: the
/// resolvent of the super-twisting law's set-valued right-hand side.
pub(super) fn resolvent_root<R: Real>(size: R, slope: R, a: R, c: R) -> R {
    if size <= c {
        return R::ZERO;
    }
    let half = a / R::from_f64(2.0);
    // The form (√(half² + slope·rest) − half)/slope loses digits if rest is small.
    let rest = size - c;
    rest / ((half * half + slope * rest).sqrt() + half)
}
