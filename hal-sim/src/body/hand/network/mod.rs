//! Electric circuit between the output stages of a stimulator and a forearm.
//!
//! Up to six active electrodes and one common return electrode lie on one arm (Hamana et al. 2022).
//! Under each is skin ([`Skin`]: resistances and a capacitor), between them tissue (resistances). A
//! terminal is driven, grounded or floating. While no terminal changes, currents are sums of
//! exponentials. The capacitor voltages at the end ([`Charge`]) are the residual charge with which
//! the next segment begins.

mod circuit;
mod exponentials;
mod freeze;
mod limiter;
mod modes;
mod piece;
mod skin;
mod symmetric;

use circuit::Circuit;
use freeze::FrozenSegment;
pub use limiter::Terminal;
use modes::Modes;
pub use piece::{Charge, Piece, Term};
pub use skin::Skin;
use symmetric::{Matrix, SIZE, identity, inverse};

/// Maximum number of active electrodes of a network.
pub const ACTIVES_MAX: usize = SIZE - 1;

/// Asymmetry of a tissue's resistances that still counts as rounding, relative to the largest
/// resistance.
const ASYMMETRY: f64 = 1e-9;

/// Constant part of the circuit: electrodes, skin, tissue and the current limit of the stages.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    circuit: Circuit,
    /// Modes with R_p = R_0, one entry for every set of terminals that have a given voltage: bit k
    /// of the entry's index is set if terminal k belongs to the set.
    modes: Vec<Modes>,
    skins: Vec<Skin>,
    limit_a: f64,
}

/// The reason why a network is invalid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidNetwork {
    /// The number of active electrodes is not 1 to [`ACTIVES_MAX`]; gives the number of skins.
    #[error("network: {0} electrodes; allowed: 2 to 7, with the common return")]
    Skins(usize),
    /// The matrix does not have a row and a column for every electrode.
    #[error("network: `resistance_ohm` must have {0} rows of {0} numbers")]
    Size(usize),
    /// A resistance is not finite; gives its row and column.
    #[error("network: `resistance_ohm[{0}][{1}]` is not finite")]
    NotFinite(usize, usize),
    /// A resistance differs from its mirror image; gives its row and column.
    #[error(
        "network: `resistance_ohm[{0}][{1}]` and `[{1}][{0}]` differ, but the matrix must be symmetric"
    )]
    Asymmetric(usize, usize),
    /// Some currents that sum to zero would dissipate no power.
    #[error("network: `resistance_ohm` is not positive definite for currents that sum to 0")]
    NotPositiveDefinite,
    /// A field of a [`Skin`] is invalid; gives the electrode, the field, and the field's range.
    #[error("network: electrode {0}: `{1}` is out of range; allowed: {2}")]
    Skin(usize, &'static str, &'static str),
    /// The current limit is not above 0 A; it may be infinite.
    #[error("network: `limit_a` is {0} A; it must be above 0 A")]
    Limit(f64),
}

/// The reason why a segment cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidSegment {
    /// The number of terminals differs from that of active electrodes; gives both.
    #[error("segment: {0} terminals for {1} active electrodes")]
    Terminals(usize, usize),
    /// The voltage of a stage is not finite; gives the active electrode.
    #[error("segment: the voltage of terminal {0} is not finite")]
    Volts(usize),
    /// The duration is negative or not finite.
    #[error("segment: `duration_s` is {0} s; it must be finite and at least 0 s")]
    Duration(f64),
    /// Rounding leaves no consistent set of limiting stages, or no R_p agrees with its current. Not
    /// known to happen with realistic values of skin and tissue.
    #[error("segment: the circuit has no consistent solution")]
    Unsettled,
}

impl Network {
    /// Creates the network. `resistance_ohm` is the mean potential under each electrode (row) per
    /// ampere into each (column), Ω, symmetric, the common return last. A constant added to all
    /// entries has no effect, since currents sum to zero; the matrix must be positive definite only
    /// for such currents. `skins` has one entry per electrode in the same order. `limit_a` is the
    /// current limit of a stage, A, above 0; infinite without a limiter.
    ///
    /// # Errors
    /// Returns [`InvalidNetwork`] with the invalid field or value.
    pub fn new(
        resistance_ohm: &[Vec<f64>],
        skins: Vec<Skin>,
        limit_a: f64,
    ) -> Result<Self, InvalidNetwork> {
        let electrodes = skins.len();
        if !(2..=SIZE).contains(&electrodes) {
            return Err(InvalidNetwork::Skins(electrodes));
        }
        let wrong = |(i, skin): (usize, &Skin)| {
            let wrong = skin.first_invalid_field();
            wrong.map(|(field, range)| InvalidNetwork::Skin(i, field, range))
        };
        if let Some(wrong) = skins.iter().enumerate().find_map(wrong) {
            return Err(wrong);
        }
        if limit_a.is_nan() || limit_a <= 0.0 {
            return Err(InvalidNetwork::Limit(limit_a));
        }
        let tissue = tissue(resistance_ohm, electrodes)?;
        let circuit = Circuit::new(&tissue, &skins);
        let mut parallel_ohm = [0.0; SIZE];
        for (ohm, skin) in parallel_ohm.iter_mut().zip(&skins) {
            *ohm = skin.parallel_ohm;
        }
        let modes = (0..1 << circuit.actives)
            .map(|set| Modes::new(&circuit, &parallel_ohm, set, identity()))
            .collect::<Option<_>>()
            .ok_or(InvalidNetwork::NotPositiveDefinite)?;
        Ok(Self {
            circuit,
            modes,
            skins,
            limit_a,
        })
    }

    /// Returns the number of active electrodes, which is also the index of the common return.
    pub fn actives(&self) -> usize {
        self.circuit.actives
    }

    /// Returns the skins in the order of the electrodes, that of the common return last.
    pub fn skins(&self) -> &[Skin] {
        &self.skins
    }

    /// Returns the voltage of an active electrode's terminal relative to the common return, V, at
    /// `t_s` after the start of the piece: the voltage of a stage, or of a floating lead.
    pub fn terminal_v(&self, piece: &Piece, electrode: usize, t_s: f64) -> f64 {
        let (current_a, skin_v) = piece.at(t_s);
        self.circuit.terminal_v(electrode, &current_a, &skin_v)
    }

    /// Computes the currents of a segment with these terminals of the active electrodes: pieces
    /// whose durations sum to `duration_s`, none if that is 0. `charge` must belong to this network
    /// and advances to the end of the segment.
    ///
    /// # Errors
    /// Returns [`InvalidSegment`] with the reason; `charge` is then unchanged.
    pub fn segment(
        &self,
        charge: &mut Charge,
        terminals: &[Terminal],
        duration_s: f64,
    ) -> Result<Vec<Piece>, InvalidSegment> {
        let actives = self.actives();
        if terminals.len() != actives {
            return Err(InvalidSegment::Terminals(terminals.len(), actives));
        }
        let is_wrong =
            |terminal: &Terminal| matches!(terminal, Terminal::Driven(v) if !v.is_finite());
        if let Some(wrong) = terminals.iter().position(is_wrong) {
            return Err(InvalidSegment::Volts(wrong));
        }
        if !(duration_s.is_finite() && duration_s >= 0.0) {
            return Err(InvalidSegment::Duration(duration_s));
        }
        if duration_s == 0.0 {
            return Ok(Vec::new());
        }
        let freezing = FrozenSegment {
            circuit: &self.circuit,
            modes: &self.modes,
            skins: &self.skins,
            terminals,
            limit_a: self.limit_a,
            duration_s,
        };
        let (pieces, end) = freezing.pieces(charge).ok_or(InvalidSegment::Unsettled)?;
        *charge = end;
        Ok(pieces)
    }
}

/// Checks the tissue's resistances and returns them as resistances of loops through the common
/// return, made exactly symmetric.
fn tissue(resistance_ohm: &[Vec<f64>], electrodes: usize) -> Result<Matrix, InvalidNetwork> {
    let is_whole = |row: &Vec<f64>| row.len() == electrodes;
    if resistance_ohm.len() != electrodes || !resistance_ohm.iter().all(is_whole) {
        return Err(InvalidNetwork::Size(electrodes));
    }
    let at = |i: usize, j: usize| resistance_ohm[i][j];
    let pairs = || (0..electrodes).flat_map(|i| (0..electrodes).map(move |j| (i, j)));
    if let Some((i, j)) = pairs().find(|(i, j)| !at(*i, *j).is_finite()) {
        return Err(InvalidNetwork::NotFinite(i, j));
    }
    let largest = pairs().fold(0.0, |largest_so_far: f64, (i, j)| {
        largest_so_far.max(at(i, j).abs())
    });
    let differ = |(i, j): &(usize, usize)| (at(*i, *j) - at(*j, *i)).abs() > ASYMMETRY * largest;
    if let Some((i, j)) = pairs().find(differ) {
        return Err(InvalidNetwork::Asymmetric(i, j));
    }
    let mut tissue = [[0.0; SIZE]; SIZE];
    for (i, j) in pairs() {
        tissue[i][j] = 0.5 * (at(i, j) + at(j, i));
    }
    // A loop enters at one electrode and leaves at the common return.
    let common = electrodes - 1;
    let mut loops = [[0.0; SIZE]; SIZE];
    for i in 0..common {
        for j in 0..common {
            let across = tissue[i][common] + tissue[common][j];
            loops[i][j] = tissue[i][j] + tissue[common][common] - across;
        }
    }
    inverse(loops, common).ok_or(InvalidNetwork::NotPositiveDefinite)?;
    Ok(loops)
}
