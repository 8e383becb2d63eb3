//! The super-twisting law and its discretizations, on a sliding variable alone.
//!
//! Continuous: s' = −b·(u + d), u = k1·√|s|·sgn s + v, v' = k2·sgn s. Each
//! discretization answers, for the s of this period, what to add to v now and
//! by how much v grows.

use super::super::real::Real;
use super::{bounded, sign};

/// How the law is brought to discrete time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Discretization {
    /// Euler, signs and root of this period's s. Chatters: its limit cycle
    /// grows with the gains.
    Explicit,
    /// Root of this period's s, sign of the next (Xiong, Chen et al., "Discrete-
    /// time implementation of super-twisting control", IEEE TCAS-II 2022, and
    /// others): no chatter.
    SemiImplicit,
    /// Koch & Reichhartinger, "Discrete-time equivalents of the super-twisting
    /// algorithm", Automatica 107 (2019), implicit mapping: the
    /// state-dependent poles p·|s|^−½ go to 1/(1 − h·p·|s|^−½).
    KochReichhartinger,
    /// Both of the next period, predicted with u as if d were 0 (Brogliato,
    /// Polyakov, Efimov, "The implicit discretization of the supertwisting
    /// sliding-mode control algorithm", IEEE TAC 65 (2020)). What v holds
    /// against d is predicted away again: |s| keeps h·|d|.
    Resolvent,
    /// Both of the next period, predicted as if v cancelled d. Its dead-beat
    /// poles are e^(±iπ/3), on the unit circle: shown to show why
    /// [`Self::ProperImplicit`] counts the step of v twice.
    Proxy,
    /// Seeber & Andritsch, "Proper implicit discretization of the
    /// super-twisting controller", Automatica 173 (2025) 112027, derived here
    /// anew: as [`Self::Proxy`], but u takes v one growth further ahead, which
    /// puts both poles of the sliding phase at 0. Then s is h times the change
    /// of d's mean from period to period: at most L·h², which nobody beats.
    ProperImplicit,
}

impl Discretization {
    /// All of them, in the order of their descriptions.
    pub const ALL: [Self; 6] = [
        Self::Explicit,
        Self::SemiImplicit,
        Self::KochReichhartinger,
        Self::Resolvent,
        Self::Proxy,
        Self::ProperImplicit,
    ];

    /// A name for tables.
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

/// Gains for one period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Twist<R> {
    discretization: Discretization,
    k1: R,
    /// h·b.
    hb: R,
    /// h·b·k1.
    hbk1: R,
    /// h·k2.
    hk2: R,
    /// h²·b·k2.
    hhbk2: R,
    /// k3.
    linear: R,
}

/// The answer to one s: u = v + `push`, then v grows by `growth`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Push<R> {
    /// What to add to v now.
    pub push: R,
    /// By how much v grows until the next period.
    pub growth: R,
}

impl<R: Real> Twist<R> {
    /// k1 in effort·s^-½, k2 in effort/s, b the gain from effort to the rate of
    /// s, h the period in s; all above 0.
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

    /// With a term k3·s beside the root (linear correction: Moreno & Osorio, IEEE
    /// CDC 2008), in effort/s; the implicit forms take it of the next s too.
    pub fn with_linear(mut self, k3: R) -> Self {
        self.linear = k3;
        self
    }

    /// The answer to the sliding variable `s` while the integral is `v`.
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

    /// With the root and the sign of the next s, which solves
    /// (1 + h·b·k3)·z + h·b·k1·√|z|·sgn z + h²·b·k2·sgn z ∋ s.
    fn implicit(&self, s: R, ahead: R) -> Push<R> {
        let slope = R::ONE + self.hb * self.linear;
        let root = resolvent_root(s.abs(), slope, self.hbk1, self.hhbk2);
        // hhbk2 > 0; within it the next s is 0 and its sign a share.
        let side = bounded(s / self.hhbk2, R::ONE);
        self.combine_terms((self.k1 + self.linear * root) * root * side, side, ahead)
    }
}

/// √z for the z >= 0 that solves slope·z + a·√z + c = size, and 0 for
/// size <= c: the resolvent of the super-twisting law's set-valued right side.
pub(super) fn resolvent_root<R: Real>(size: R, slope: R, a: R, c: R) -> R {
    if size <= c {
        return R::ZERO;
    }
    let half = a / R::from_f64(2.0);
    // (√(half² + slope·rest) − half)/slope loses digits where rest is small.
    let rest = size - c;
    rest / ((half * half + slope * rest).sqrt() + half)
}
