//! The electric circuit between the stages of a stimulator and a forearm.
//!
//! Up to six active electrodes and one common return electrode on one arm (Hamana et
//! al. 2022). Under each is skin ([`Skin`]: resistances and a capacitor), between them
//! tissue (resistances). A terminal is driven, grounded or floating; while none
//! changes, currents are sums of exponentials, and what the capacitors hold at the end
//! ([`Charge`]) is the residual charge that the next segment begins with.

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

/// Most active electrodes of a network.
pub const ACTIVES_MAX: usize = SIZE - 1;

/// Asymmetry of a tissue's resistances that still counts as rounding, of the largest.
const ASYMMETRY: f64 = 1e-9;

/// Electrodes, skin, tissue and the stages' current limit: what does not change.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    circuit: Circuit,
    /// With R_0, of every set of terminals at a voltage; bit k is terminal k.
    modes: Vec<Modes>,
    skins: Vec<Skin>,
    limit_a: f64,
}

/// What no network can have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidNetwork {
    /// Active electrodes are 1 to [`ACTIVES_MAX`].
    #[error("network: {0} skins, must be 2 to 7: active electrodes and the common return")]
    Skins(usize),
    /// The matrix has a row and a column for every electrode.
    #[error("network: `resistance_ohm` has not {0} rows of {0} numbers")]
    Size(usize),
    /// Row and column of a resistance that is not finite.
    #[error("network: `resistance_ohm[{0}][{1}]` is not finite")]
    NotFinite(usize, usize),
    /// Row and column of a resistance that differs from its mirror image.
    #[error("network: `resistance_ohm[{0}][{1}]` and `[{1}][{0}]` differ: not symmetric")]
    Asymmetric(usize, usize),
    /// Some currents that sum to zero would take no power.
    #[error("network: `resistance_ohm` is not positive definite for currents that sum to 0")]
    NotPositiveDefinite,
    /// Electrode, field of its [`Skin`], and the field's range.
    #[error("network: skin {0}, `{1}` is out of range: {2}")]
    Skin(usize, &'static str, &'static str),
    /// The limit is above 0 A and may be infinite.
    #[error("network: `limit_a` is {0} A, must be above 0")]
    Limit(f64),
}

/// Why there is no segment.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidSegment {
    /// How many terminals were given, and how many active electrodes there are.
    #[error("segment: {0} terminals for {1} active electrodes")]
    Terminals(usize, usize),
    /// Active electrode whose stage sets no finite voltage.
    #[error("segment: volts of terminal {0} are not finite")]
    Volts(usize),
    /// A duration is finite and not negative.
    #[error("segment: `duration_s` is {0} s, must be finite, 0 or above")]
    Duration(f64),
    /// Rounding leaves no consistent set of limiting stages, or no R_p that agrees with
    /// its current. Not known to happen with numbers of skin and tissue.
    #[error("segment: no consistent currents found")]
    Unsettled,
}

impl Network {
    /// `resistance_ohm`: mean potential under each electrode (row) per ampere into
    /// each (column), Ω, symmetric, the common return last. Any number may be added to
    /// all of it, since currents sum to zero: the reference does not matter, and
    /// positive definite it must be only for such currents. `skins`: one per electrode
    /// in the same order. `limit_a`: what a stage limits its current to, A, above 0;
    /// infinite without a limiter.
    ///
    /// # Errors
    /// [`InvalidNetwork`] names what no network can have.
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

    /// Active electrodes; the common return has this index.
    pub fn actives(&self) -> usize {
        self.circuit.actives
    }

    /// The skins, the common return's last.
    pub fn skins(&self) -> &[Skin] {
        &self.skins
    }

    /// Voltage of an active electrode's terminal against the common return's, V,
    /// `t_s` after the piece's start: what a stage sets or a floating lead shows.
    pub fn terminal_v(&self, piece: &Piece, electrode: usize, t_s: f64) -> f64 {
        let (current_a, skin_v) = piece.at(t_s);
        self.circuit.terminal_v(electrode, &current_a, &skin_v)
    }

    /// What flows while the terminals of the active electrodes are these: pieces whose
    /// durations sum to `duration_s`, none if that is 0. `charge` is this network's
    /// and is taken to the end.
    ///
    /// # Errors
    /// [`InvalidSegment`] says why there is none; `charge` is then as before.
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

/// The tissue's resistances, checked, its two halves made equal.
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
    // A loop goes in at one electrode and out at the common return.
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
