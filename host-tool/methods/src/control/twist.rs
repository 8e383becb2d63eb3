//! The super-twisting law and its discretizations, on a sliding variable alone.
//!
//! The continuous law is s' = −b·(u + d), u = k1·√|s|·sgn s + v, v' = k2·sgn s. For the s of this
//! period, each discretization returns the term to add to v now, and the growth of v.

use super::super::real::Real;
use super::{bounded, sign};

/// How the continuous super-twisting law is discretized.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Discretization {
    /// Explicit Euler: sign and root of the present s. It chatters, with a limit cycle that grows
    /// with the gains.
    Explicit,
    /// Root of the present s and sign of the next s, without chattering (Xiong, Chen et al.,
    /// "Discrete-time implementation of super-twisting control", IEEE TCAS-II 2022, and others).
    SemiImplicit,
    /// Implicit mapping of Koch & Reichhartinger, "Discrete-time equivalents of the super-twisting
    /// algorithm", Automatica 107 (2019): each state-dependent pole p·|s|^−½ is mapped to 1/(1 −
    /// h·p·|s|^−½).
    KochReichhartinger,
    /// Root and sign of the next s, which is predicted as if the disturbance d were 0 (Brogliato,
    /// Polyakov, Efimov, "The implicit discretization of the supertwisting sliding-mode control
    /// algorithm", IEEE TAC 65 (2020)). This prediction counts the part of v that counteracts d as
    /// a change of s, so that |s| remains at h·|d|.
    Resolvent,
    /// Root and sign of the next s, which is predicted as if v cancelled d exactly. Its poles in
    /// the sliding phase are e^(±iπ/3), on the unit circle, so that it oscillates. It is included
    /// to show why [`Self::ProperImplicit`] counts the step of v twice.
    Proxy,
    /// Proper implicit form of Seeber & Andritsch, "Proper implicit discretization of the
    /// super-twisting controller", Automatica 173 (2025) 112027, derived again here. It is as
    /// [`Self::Proxy`], but u contains the growth of v twice. This puts both poles of the sliding
    /// phase at 0. Then s is h times the change of d's mean from one period to the next: at most
    /// L·h², which is optimal.
    ProperImplicit,
}

impl Discretization {
    /// Every discretization, in the order in which the variants are declared.
    pub const ALL: [Self; 6] = [
        Self::Explicit,
        Self::SemiImplicit,
        Self::KochReichhartinger,
        Self::Resolvent,
        Self::Proxy,
        Self::ProperImplicit,
    ];

    /// Returns the name of the discretization in tables of results.
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

/// A discretized super-twisting law with its gains, for a fixed control period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Twist<R> {
    discretization: Discretization,
    k1: R,
    /// Product h·b of the period and the gain from effort to the rate of s.
    hb: R,
    /// Product h·b·k1, by which the root term changes s in one period.
    hbk1: R,
    /// Product h·k2, by which v grows in one period at most.
    hk2: R,
    /// Product h²·b·k2, by which the growth of v changes s in one period.
    hhbk2: R,
    /// Gain k3 of the linear term; 0 without one.
    linear: R,
}

/// Output of the law for one period: the effort is u = v + `push`, and then v grows by `growth`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Push<R> {
    /// Effort in addition to v in this period.
    pub push: R,
    /// Change of v until the next period.
    pub growth: R,
}

impl<R: Real> Twist<R> {
    /// Creates the law for a control period of `h`, s. `k1` is in effort·s^-½ and `k2` in effort/s.
    /// `b` is the gain from effort to the rate of s. All of them must be above 0.
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

    /// Adds a linear term k3·s to the root term (linear correction: Moreno & Osorio, IEEE CDC
    /// 2008). `k3` is the gain, in effort per unit of s. The implicit forms use the next s in this
    /// term, too.
    pub fn with_linear(mut self, k3: R) -> Self {
        self.linear = k3;
        self
    }

    /// Returns the effort in addition to the integral `v`, and the growth of the integral, for the
    /// sliding variable `s`.
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

    /// Returns the law's output with root and sign of the next s. The next s is the z that solves
    /// (1 + h·b·k3)·z + h·b·k1·√|z|·sgn z + h²·b·k2·sgn z ∋ s. `ahead` says how many times the
    /// growth of v is contained in the effort.
    fn implicit(&self, s: R, ahead: R) -> Push<R> {
        let slope = R::ONE + self.hb * self.linear;
        let root = resolvent_root(s.abs(), slope, self.hbk1, self.hhbk2);
        // hhbk2 > 0; for |s| up to hhbk2 the next s is 0, and its sign takes an intermediate value.
        let side = bounded(s / self.hhbk2, R::ONE);
        self.combine_terms((self.k1 + self.linear * root) * root * side, side, ahead)
    }
}

/// Returns √z for the z ≥ 0 that solves slope·z + a·√z + c = size; 0 if size ≤ c. This is the
/// resolvent of the set-valued right-hand side of the super-twisting law.
pub(super) fn resolvent_root<R: Real>(size: R, slope: R, a: R, c: R) -> R {
    if size <= c {
        return R::ZERO;
    }
    let half = a / R::from_f64(2.0);
    // The form (√(half² + slope·rest) − half)/slope loses digits if rest is small.
    let rest = size - c;
    rest / ((half * half + slope * rest).sqrt() + half)
}
