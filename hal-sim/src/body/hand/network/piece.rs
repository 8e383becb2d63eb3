//! What flows during a piece, in closed form, and the charge between pieces.

use super::exponentials::Exponentials;
use super::symmetric::{SIZE, Vector};

/// Volts across every electrode's skin capacitor, the terminal's side positive: all
/// that an arm's electrodes remember. Discharged by default. An electrode without a
/// capacitor remembers nothing; its entry stays 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Charge {
    pub(super) volts: Vector,
}

impl Charge {
    /// Across the capacitor of this electrode, V; the common return is the last.
    pub fn volts(&self, electrode: usize) -> f64 {
        self.volts[electrode]
    }
}

/// What decays at one rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Term {
    /// 1/s, above 0.
    pub rate_per_s: f64,
    /// Its part of every electrode's current at the piece's start, A. Sums to 0.
    pub current_a: Vector,
    /// Its part of the voltage over every electrode's R_p and C at the piece's start, V.
    pub skin_v: Vector,
}

impl Term {
    fn remaining(&self, t_s: f64) -> f64 {
        (-self.rate_per_s * t_s).exp()
    }
}

/// A time during which no terminal changes and no stage begins or ceases to limit:
/// every current is a constant plus exponentials. Currents are positive out of the
/// terminal into the tissue and sum to 0. Entries beyond the last electrode are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// How long it lasts, s; above 0.
    pub duration_s: f64,
    /// Constant part of every electrode's current, A.
    pub constant_a: Vector,
    /// Constant part of the voltage over every electrode's R_p and C, V.
    pub constant_v: Vector,
    /// R_p of every electrode, Ω: constant over a segment.
    pub parallel_ohm: Vector,
    /// The electrodes whose stage holds its current at the limit.
    pub is_limited: [bool; SIZE],
    pub(super) terms: [Term; SIZE],
    /// How many of the terms have currents; they come first.
    pub(super) conducting: usize,
    /// How many terms there are. The rest are the capacitors that nothing reaches:
    /// a floating electrode's, or one whose current a stage holds.
    pub(super) count: usize,
}

impl Piece {
    /// The exponentials that the currents consist of, none where all are constant.
    pub fn terms(&self) -> &[Term] {
        &self.terms[..self.conducting]
    }

    pub(super) fn all_terms(&self) -> &[Term] {
        &self.terms[..self.count]
    }

    /// Current of this electrode, A, `t_s` after the piece's start.
    pub fn current_a(&self, electrode: usize, t_s: f64) -> f64 {
        let part = |term: &Term| term.current_a[electrode] * term.remaining(t_s);
        self.constant_a[electrode] + self.terms().iter().map(part).sum::<f64>()
    }

    /// Voltage over this electrode's R_p and C, V, `t_s` after the piece's start.
    pub fn skin_v(&self, electrode: usize, t_s: f64) -> f64 {
        let part = |term: &Term| term.skin_v[electrode] * term.remaining(t_s);
        self.constant_v[electrode] + self.all_terms().iter().map(part).sum::<f64>()
    }

    /// Currents of all electrodes and voltages over their R_p and C at once.
    pub(in crate::body::hand) fn at(&self, t_s: f64) -> (Vector, Vector) {
        let (mut current_a, mut skin_v) = (self.constant_a, self.constant_v);
        for term in self.all_terms() {
            let left = term.remaining(t_s);
            for electrode in 0..SIZE {
                current_a[electrode] += left * term.current_a[electrode];
                skin_v[electrode] += left * term.skin_v[electrode];
            }
        }
        (current_a, skin_v)
    }

    /// A bound of this electrode's |current| during the piece, A.
    pub(super) fn max_current_bound_a(&self, electrode: usize) -> f64 {
        let parts = self
            .terms()
            .iter()
            .map(|term| term.current_a[electrode].abs());
        self.constant_a[electrode].abs() + parts.sum::<f64>()
    }

    /// Charge that this electrode gives to the tissue over the whole piece, C.
    pub fn charge_c(&self, electrode: usize) -> f64 {
        let part = |term: &Term| {
            let passed = -(-term.rate_per_s * self.duration_s).exp_m1();
            term.current_a[electrode] * passed / term.rate_per_s
        };
        let parts = self.terms().iter().map(part);
        self.constant_a[electrode] * self.duration_s + parts.sum::<f64>()
    }

    /// This electrode's current as a sum whose zeros can be found.
    pub(super) fn current(&self, electrode: usize) -> Exponentials {
        let pair = |term: &Term| (term.rate_per_s, term.current_a[electrode]);
        Exponentials::new(self.constant_a[electrode], self.terms().iter().map(pair))
    }
}
