//! Currents and voltages during a piece, in closed form, and the charge between pieces.

use super::exponentials::Exponentials;
use super::symmetric::{SIZE, Vector};

/// Voltages across the skin capacitors of all electrodes, V, positive at the terminal. They are the
/// whole state that electrodes keep between pieces. The default is discharged; the entry of an
/// electrode without a capacitor stays 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Charge {
    pub(super) volts: Vector,
}

impl Charge {
    /// Returns the voltage across the capacitor of this electrode, V; the common return is the
    /// last.
    pub fn volts(&self, electrode: usize) -> f64 {
        self.volts[electrode]
    }
}

/// Part of currents and voltages that decays at one rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Term {
    /// Rate of decay, 1/s, above 0.
    pub rate_per_s: f64,
    /// Contribution to the current of every electrode at the start of the piece, A. The entries sum
    /// to 0.
    pub current_a: Vector,
    /// Contribution to the voltage over R_p and C of every electrode at the start of the piece, V.
    pub skin_v: Vector,
}

impl Term {
    fn remaining(&self, t_s: f64) -> f64 {
        libm::exp(-self.rate_per_s * t_s)
    }
}

/// An interval during which no terminal changes and no stage starts or stops limiting: every
/// current is a constant plus exponentials. Currents are positive out of the terminal into the
/// tissue and sum to 0. Entries beyond the last electrode are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Duration of the piece, s; above 0.
    pub duration_s: f64,
    /// Constant part of the current of every electrode, A.
    pub constant_a: Vector,
    /// Constant part of the voltage over R_p and C of every electrode, V.
    pub constant_v: Vector,
    /// R_p of every electrode, Ω; constant over a segment.
    pub parallel_ohm: Vector,
    /// Whether the stage of each electrode holds its current at the limit.
    pub is_limited: [bool; SIZE],
    pub(super) terms: [Term; SIZE],
    /// Number of terms that carry currents; they come first.
    pub(super) conducting: usize,
    /// Number of all terms. The others are isolated capacitors: that of a floating electrode, or of
    /// an electrode whose current a stage holds.
    pub(super) count: usize,
}

impl Piece {
    /// Returns the exponentials of the currents; empty if all currents are constant.
    pub fn terms(&self) -> &[Term] {
        &self.terms[..self.conducting]
    }

    pub(super) fn all_terms(&self) -> &[Term] {
        &self.terms[..self.count]
    }

    /// Returns the current of this electrode, A, at `t_s` after the start of the piece.
    pub fn current_a(&self, electrode: usize, t_s: f64) -> f64 {
        let part = |term: &Term| term.current_a[electrode] * term.remaining(t_s);
        self.constant_a[electrode] + self.terms().iter().map(part).sum::<f64>()
    }

    /// Returns the voltage over R_p and C of this electrode, V, at `t_s` after the start of the
    /// piece.
    pub fn skin_v(&self, electrode: usize, t_s: f64) -> f64 {
        let part = |term: &Term| term.skin_v[electrode] * term.remaining(t_s);
        self.constant_v[electrode] + self.all_terms().iter().map(part).sum::<f64>()
    }

    /// Returns the currents of all electrodes, A, and the voltages over their R_p and C, V.
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

    /// Returns an upper bound of the magnitude of this electrode's current during the piece, A.
    pub(super) fn max_current_bound_a(&self, electrode: usize) -> f64 {
        let parts = self
            .terms()
            .iter()
            .map(|term| term.current_a[electrode].abs());
        self.constant_a[electrode].abs() + parts.sum::<f64>()
    }

    /// Returns the charge that this electrode delivers to the tissue over the whole piece, C.
    pub fn charge_c(&self, electrode: usize) -> f64 {
        let part = |term: &Term| {
            let passed = -libm::expm1(-term.rate_per_s * self.duration_s);
            term.current_a[electrode] * passed / term.rate_per_s
        };
        let parts = self.terms().iter().map(part);
        self.constant_a[electrode] * self.duration_s + parts.sum::<f64>()
    }

    /// Returns the current of this electrode as a sum whose zeros can be found.
    pub(super) fn current(&self, electrode: usize) -> Exponentials {
        let pair = |term: &Term| (term.rate_per_s, term.current_a[electrode]);
        Exponentials::new(self.constant_a[electrode], self.terms().iter().map(pair))
    }
}
