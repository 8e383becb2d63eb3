//! Search for the R_p at which a segment is frozen: the values that agree with the segment's own
//! currents.
//!
//! The R_p of true skin changes with the current at every moment. A segment has a single R_p per
//! electrode: the one at the mean of |I| weighted by |v|, the voltage over R_p. Since 1/R_p is
//! linear in |I|, the frozen R_p then conducts the same charge as the changing one would along the
//! same course, as long as v keeps its sign. A plain mean would let a long rest dilute the
//! discharge with which it begins.

use super::circuit::Circuit;
use super::limiter::{Limiting, Stages, Terminal};
use super::modes::Modes;
use super::piece::{Charge, Piece};
use super::skin::Skin;
use super::symmetric::{Matrix, SIZE, Vector, dot, identity};

/// Relative difference below which an R_p counts as equal to the one that its current requires: a
/// hundredth of the error in current that freezing causes.
const AGREED: f64 = 1e-4;

/// Maximum number of iterations; five are usual.
const TRIES: usize = 100;
/// Number of iterations without convergence after which the estimated Jacobian is discarded and the
/// step length halved.
const AFRESH: usize = 20;

/// Nodes on [0, 1] and weights of the Gauss-Legendre rule of eight points.
#[rustfmt::skip]
const GAUSS: [(f64, f64); 8] = [
    (0.019_855_071_751_231_856, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_64, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_63),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_63),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_24),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13),
];

/// A segment whose frozen skin resistances R_p are to be found.
pub struct FrozenSegment<'a> {
    pub circuit: &'a Circuit,
    /// Modes with R_p = R_0, one entry for every set of terminals that have a given voltage: bit k
    /// of the entry's index is set if terminal k belongs to the set.
    pub modes: &'a [Modes],
    pub skins: &'a [Skin],
    pub terminals: &'a [Terminal],
    /// Current limit of each output stage, A; infinite if no stage limits.
    pub limit_a: f64,
    pub duration_s: f64,
}

impl FrozenSegment<'_> {
    /// Returns the pieces of the segment and the charge at its end, or `None` if the iteration does
    /// not converge.
    ///
    /// Broyden's method finds a fixed point of ln(R_0 / R_p).
    pub fn pieces(&self, charge: &Charge) -> Option<(Vec<Piece>, Charge)> {
        let mut limiting = [Limiting::default(); SIZE];
        let mut broyden = Broyden::new();
        for attempt in 0..TRIES {
            if attempt % AFRESH == AFRESH - 1 {
                broyden.restart(0.5f64.powi((attempt / AFRESH) as i32 + 1));
            }
            let (pieces, end) = self.solve_with_drops(charge, &mut limiting, &broyden.state)?;
            let wrong = self.drop_errors(&pieces, &broyden.state);
            if wrong.iter().all(|value| value.abs() <= AGREED) {
                return Some((pieces, end));
            }
            broyden.step(&wrong);
        }
        None
    }

    /// Solves the segment with R_p = R_0 / exp(`drop`).
    fn solve_with_drops(
        &self,
        charge: &Charge,
        limiting: &mut [Limiting; SIZE],
        drop: &Vector,
    ) -> Option<(Vec<Piece>, Charge)> {
        let mut parallel_ohm = [0.0; SIZE];
        for ((ohm, skin), drop) in parallel_ohm.iter_mut().zip(self.skins).zip(drop) {
            *ohm = skin.parallel_ohm / libm::exp(*drop);
        }
        let stages = Stages {
            circuit: self.circuit,
            modes: self.modes,
            parallel_ohm: (*drop != [0.0; SIZE]).then_some(&parallel_ohm),
            terminals: self.terminals,
            limit_a: self.limit_a,
        };
        stages.pieces(charge, limiting, self.duration_s)
    }

    /// Returns, for each electrode, how far `drop` exceeds the value that the mean current
    /// requires.
    fn drop_errors(&self, pieces: &[Piece], drop: &Vector) -> Vector {
        let mut wrong = [0.0; SIZE];
        if self.skins.iter().all(Skin::is_linear) {
            return wrong;
        }
        let means_a = means_a(pieces, self.skins.len());
        for (electrode, skin) in self.skins.iter().enumerate() {
            let asked = skin.parallel_ohm / skin.parallel_ohm_at(means_a[electrode]);
            wrong[electrode] = drop[electrode] - libm::log(asked);
        }
        wrong
    }
}

/// Returns the mean |I| of every electrode, weighted by |v|, A; 0 if v is 0 throughout.
fn means_a(pieces: &[Piece], electrodes: usize) -> Vector {
    let (mut sums, mut weights) = ([0.0; SIZE], [0.0; SIZE]);
    for piece in pieces {
        // Nodes are concentrated towards the start, according to the fastest exponential.
        let rates = piece.terms().iter().map(|term| term.rate_per_s);
        let fastest = rates.fold(0.0, f64::max);
        let crowding = libm::log1p(fastest * piece.duration_s).max(1e-3);
        let span_s = piece.duration_s / libm::expm1(crowding);
        for (node, weight) in GAUSS {
            let grown = libm::exp(crowding * node);
            let (current_a, skin_v) = piece.at(span_s * (grown - 1.0));
            let weight = weight * span_s * crowding * grown;
            for electrode in 0..electrodes {
                let weight = weight * skin_v[electrode].abs();
                weights[electrode] += weight;
                sums[electrode] += weight * current_a[electrode].abs();
            }
        }
    }
    let mean = |electrode| {
        let weight: f64 = weights[electrode];
        if weight > 0.0 {
            sums[electrode] / weight
        } else {
            0.0
        }
    };
    std::array::from_fn(mean)
}

/// Broyden's method: plain fixed-point iteration first, then steps with an inverse Jacobian that
/// every step corrects, so that it captures how the electrodes' R_p depend on each other.
struct Broyden {
    inverse: Matrix,
    state: Vector,
    /// The last step, and the errors before it.
    last: Option<(Vector, Vector)>,
}

/// Smallest projection of the expected change on the step, relative to the step, at which the
/// Jacobian is updated.
const TAUGHT: f64 = 0.1;

impl Broyden {
    fn new() -> Self {
        Self {
            inverse: identity(),
            state: [0.0; SIZE],
            last: None,
        }
    }

    /// Discards the estimated Jacobian; plain steps are `part` times as long from here on.
    fn restart(&mut self, part: f64) {
        self.last = None;
        self.inverse = identity().map(|row| row.map(|row| row * part));
    }

    /// Moves the state, given its `drop_errors`; no component falls below 0.
    fn step(&mut self, wrong: &Vector) {
        if let Some((step, before)) = self.last {
            let change: Vector = std::array::from_fn(|k| wrong[k] - before[k]);
            let expected = self.inverse.map(|row| dot(&row, &change));
            let scale = dot(&step, &expected);
            if scale > TAUGHT * dot(&step, &step) {
                self.learn(&step, &expected, scale);
            }
        }
        let next = |k: usize| (self.state[k] - dot(&self.inverse[k], wrong)).max(0.0);
        let next: Vector = std::array::from_fn(next);
        self.last = Some((std::array::from_fn(|k| next[k] - self.state[k]), *wrong));
        self.state = next;
    }

    fn learn(&mut self, step: &Vector, expected: &Vector, scale: f64) {
        let mut along = [0.0; SIZE];
        for (row, step) in self.inverse.iter().zip(step) {
            let sums = along.iter_mut().zip(row);
            sums.for_each(|(sum, value)| *sum += step * value);
        }
        for (k, row) in self.inverse.iter_mut().enumerate() {
            let missed = (step[k] - expected[k]) / scale;
            let entries = row.iter_mut().zip(along);
            entries.for_each(|(value, along)| *value += missed * along);
        }
    }
}
