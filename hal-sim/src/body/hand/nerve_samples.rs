//! Charge of nerves during a piece of the circuit's solution, at the times at which their thresholds
//! are checked.

use super::membrane::{Decay, Membrane, Nerve};
use super::network::{ACTIVES_MAX, Piece};
use super::spec::ELECTRODES;
use std::cell::OnceCell;

/// Longest time step between two threshold checks of a nerve, s; it bounds the error of spike
/// times.
const LOOK_S: f64 = 20e-6;
/// Factor by which each threshold check after the first ten comes later than the one before: the
/// drive decays, so that the charge then changes more slowly.
const GROWS: f64 = 1.25;

/// Maximum number of electrodes in a piece.
const SIZE: usize = ACTIVES_MAX + 1;
/// Maximum number of drives of a piece: one constant and the exponentials of its currents.
const DRIVES: usize = SIZE + 1;

/// Times within a piece at which nerves are checked, and the charge that each drive has caused by
/// then. They are the same for all nerves.
pub(super) struct NerveSamples<'p> {
    membrane: &'p Membrane,
    piece: &'p Piece,
    end: NerveSample,
    /// Samples from the first to the end of the piece; most pieces need only the end.
    all: OnceCell<Vec<NerveSample>>,
}

/// One of the times.
#[derive(Clone, Copy)]
pub(super) struct NerveSample {
    at_s: f64,
    /// Remaining share of an initial charge.
    kept: f64,
    /// Charge that each drive of amplitude 1 has caused.
    basis: [f64; DRIVES],
}

impl NerveSample {
    fn new(membrane: &Membrane, piece: &Piece, at_s: f64) -> Self {
        let mut basis = [0.0; DRIVES];
        for (place, (rate, _)) in basis.iter_mut().zip(drives(piece)) {
            let decay = Decay {
                amplitude: 1.0,
                rate,
            };
            *place = membrane.charge_after(0.0, [decay], at_s);
        }
        let kept = libm::exp(-at_s / membrane.leak_s);
        Self { at_s, kept, basis }
    }

    /// Returns the charge of a nerve; weights beyond the piece's drives are 0.
    pub fn charged(&self, before: f64, weights: &[f64; DRIVES]) -> f64 {
        let driven = self.basis.iter().zip(weights);
        before * self.kept + driven.map(|(b, w)| b * w).sum::<f64>()
    }
}

impl<'p> NerveSamples<'p> {
    pub fn new(membrane: &'p Membrane, piece: &'p Piece) -> Self {
        Self {
            membrane,
            piece,
            end: NerveSample::new(membrane, piece, piece.duration_s),
            all: OnceCell::new(),
        }
    }

    /// Returns all samples, in the order of time.
    pub fn all(&self) -> &[NerveSample] {
        self.all.get_or_init(|| {
            let mut all = Vec::new();
            let (mut t_s, mut step_s) = (0.0, LOOK_S);
            while t_s + step_s < self.piece.duration_s {
                t_s += step_s;
                all.push(NerveSample::new(self.membrane, self.piece, t_s));
                if t_s > 10.0 * LOOK_S {
                    step_s *= GROWS;
                }
            }
            all.push(self.end);
            all
        })
    }

    /// Returns the charge of a nerve at the end of the piece.
    pub fn last(&self, before: f64, weights: &[f64; DRIVES]) -> f64 {
        self.end.charged(before, weights)
    }

    /// Returns the time within the piece at which the nerve first reaches its threshold, or `None`
    /// if it never does.
    pub fn first_crossing(
        &self,
        nerve: Nerve,
        weights: &[f64; DRIVES],
        threshold: f64,
    ) -> Option<f64> {
        let (mut before_s, mut below) = (0.0, nerve.charged - threshold);
        for sample in self.all() {
            let at_s = sample.at_s;
            let needed = threshold * self.membrane.threshold_factor(nerve.since_s + at_s);
            let above = sample.charged(nerve.charged, weights) - needed;
            if above >= 0.0 {
                // Interpolates linearly between the two times.
                let part = if below < 0.0 {
                    below / (below - above)
                } else {
                    0.0
                };
                return Some(before_s + part * (at_s - before_s));
            }
            (before_s, below) = (at_s, above.max(-1e3 * threshold));
        }
        None
    }
}

/// Returns the decay rate (1/s) and the electrode currents (A) of each drive of `piece`: first
/// those of the constant part, whose rate is 0, then those of the exponentials.
fn drives(piece: &Piece) -> impl Iterator<Item = (f64, &[f64; SIZE])> {
    let terms = piece
        .terms()
        .iter()
        .map(|term| (term.rate_per_s, &term.current_a));
    std::iter::once((0.0, &piece.constant_a)).chain(terms)
}

/// Returns the amplitude of each drive of `piece` at one nerve; `transfers` is the drive of that
/// nerve per ampere through each electrode.
pub(super) fn weights(piece: &Piece, transfers: &[f64; ELECTRODES]) -> [f64; DRIVES] {
    let mut weights = [0.0; DRIVES];
    for (weight, (_, currents)) in weights.iter_mut().zip(drives(piece)) {
        let parts = transfers.iter().zip(currents);
        *weight = parts.map(|(transfer, current)| transfer * current).sum();
    }
    weights
}
