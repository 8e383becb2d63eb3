//! Decay of the capacitor voltages while certain terminals hold a voltage.
//!
//! Let i be the currents of those terminals, M their loop resistance (tissue and everything in
//! series, through the common return), u their voltages and E the incidence of currents on
//! electrodes. Then M i = u − Eᵀv, and every capacitor follows C v̇ = E i − v / R_p. In w = C^½ v
//! the matrix of that equation, C^−½ (1/R_p + E M⁻¹ Eᵀ) C^−½, is symmetric and positive definite:
//! its eigenvalues are the rates, real and above 0. Terminals that hold a current only add a
//! constant.

use super::circuit::{Circuit, Source};
use super::piece::{Charge, Piece, Term};
use super::symmetric::{Matrix, SIZE, Vector, dot, eigen, inverse};

/// Modes of a circuit with given R_p and a given set of terminals at a voltage.
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    parallel_ohm: Vector,
    /// Terminals that have a given voltage; the others carry a given current.
    at_voltage: ElectrodeSubset,
    /// Loop resistances, with R_p in series for electrodes without a capacitor.
    loop_ohm: Matrix,
    /// Inverse of the loop resistances between the terminals at a voltage, in their order.
    inverse: Matrix,
    /// Voltages and currents of each mode, scaled so that Σ C v² is 1; voltages of capacitors only.
    shapes: [Term; SIZE],
    rows: usize,
    /// Eigenvectors, which are also a good initial guess of the eigenvectors with other R_p.
    pub basis: Matrix,
}

/// Up to [`SIZE`] electrode indices, without allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ElectrodeSubset {
    list: [usize; SIZE],
    count: usize,
}

impl ElectrodeSubset {
    fn from_electrodes(electrodes: impl Iterator<Item = usize>) -> Self {
        let mut few = Self::default();
        for (place, electrode) in few.list.iter_mut().zip(electrodes) {
            *place = electrode;
            few.count += 1;
        }
        few
    }

    fn as_slice(&self) -> &[usize] {
        &self.list[..self.count]
    }

    /// Returns the part of `matrix` with the rows and columns of these electrodes.
    fn submatrix(&self, matrix: &Matrix) -> Matrix {
        let mut out = [[0.0; SIZE]; SIZE];
        for (row, i) in out.iter_mut().zip(self.as_slice()) {
            for (value, j) in row.iter_mut().zip(self.as_slice()) {
                *value = matrix[*i][*j];
            }
        }
        out
    }
}

impl Modes {
    /// Computes the modes. Bit k of `set` says whether terminal k is at a voltage; `basis` is a
    /// guess of the eigenvectors. Returns `None` if rounding leaves no positive definite matrix.
    pub fn new(
        circuit: &Circuit,
        parallel_ohm: &Vector,
        set: usize,
        basis: Matrix,
    ) -> Option<Self> {
        let actives = 0..circuit.actives;
        let at_voltage =
            ElectrodeSubset::from_electrodes(actives.filter(|electrode| set >> electrode & 1 == 1));
        let loop_ohm = circuit.loops(parallel_ohm);
        let inverse = inverse(at_voltage.submatrix(&loop_ohm), at_voltage.count)?;
        let mut modes = Self {
            parallel_ohm: *parallel_ohm,
            at_voltage,
            loop_ohm,
            inverse,
            shapes: [Term::default(); SIZE],
            rows: 0,
            basis,
        };
        modes.find_modes(circuit)?;
        Some(modes)
    }

    /// Computes the rates and shapes of all modes.
    fn find_modes(&mut self, circuit: &Circuit) -> Option<()> {
        let siemens = self.conductance(circuit);
        let coupled = self
            .at_voltage
            .as_slice()
            .iter()
            .copied()
            .chain([circuit.actives]);
        let coupled = ElectrodeSubset::from_electrodes(
            coupled.filter(|electrode| circuit.has_capacitor(*electrode)),
        );
        let mut scale = [0.0; SIZE];
        for (value, electrode) in scale.iter_mut().zip(coupled.as_slice()) {
            *value = circuit.farad[*electrode].sqrt().recip();
        }
        let mut system = coupled.submatrix(&siemens);
        for (i, electrode) in coupled.as_slice().iter().enumerate() {
            system[i][i] += self.parallel_ohm[*electrode].recip();
            let scaled = system[i].iter_mut().zip(scale);
            scaled.for_each(|(value, other)| *value *= scale[i] * other);
        }
        self.rows = coupled.count;
        let rates = eigen(&system, &mut self.basis, self.rows)?;
        for (mode, shape) in self.shapes[..self.rows].iter_mut().enumerate() {
            shape.rate_per_s = rates[mode];
            for (i, electrode) in coupled.as_slice().iter().enumerate() {
                shape.skin_v[*electrode] = self.basis[mode][i] * scale[i];
            }
            for electrode in self.at_voltage.as_slice() {
                shape.current_a[*electrode] = -dot(&siemens[*electrode], &shape.skin_v);
            }
            circuit.balance_return_current(&mut shape.current_a);
        }
        rates[..self.rows]
            .iter()
            .all(|rate| *rate > 0.0)
            .then_some(())
    }

    /// Returns E M⁻¹ Eᵀ, S: the conductance between all electrodes with which the capacitor
    /// voltages drive currents through the terminals at a voltage.
    fn conductance(&self, circuit: &Circuit) -> Matrix {
        let mut out = [[0.0; SIZE]; SIZE];
        let common = circuit.actives;
        for (row, i) in self.inverse.iter().zip(self.at_voltage.as_slice()) {
            for (siemens, j) in row.iter().zip(self.at_voltage.as_slice()) {
                out[*i][*j] = *siemens;
                out[*i][common] -= siemens;
                out[common][*j] -= siemens;
                out[common][common] += siemens;
            }
        }
        out
    }

    /// Returns the currents of all electrodes with these voltages over the capacitors, A.
    fn currents_a(
        &self,
        circuit: &Circuit,
        imposed: &[Source; SIZE],
        capacitor_v: &Vector,
    ) -> Vector {
        let mut current_a = imposed.map(|imposed| match imposed {
            Source::Current(held) => held,
            Source::Voltage(_) => 0.0,
        });
        let mut left_v = [0.0; SIZE];
        for (left, electrode) in left_v.iter_mut().zip(self.at_voltage.as_slice()) {
            if let Source::Voltage(volts) = imposed[*electrode] {
                let held_v = dot(&self.loop_ohm[*electrode], &current_a);
                let stored_v = capacitor_v[*electrode] - capacitor_v[circuit.actives];
                *left = volts - held_v - stored_v;
            }
        }
        for (row, electrode) in self.inverse.iter().zip(self.at_voltage.as_slice()) {
            current_a[*electrode] = dot(row, &left_v);
        }
        circuit.balance_return_current(&mut current_a);
        current_a
    }

    /// Returns the piece that starts with `charge` and lasts `duration_s` without a change.
    /// `imposed` applies to the active electrodes; the others carry no current.
    pub fn piece(
        &self,
        circuit: &Circuit,
        imposed: &[Source; SIZE],
        charge: &Charge,
        duration_s: f64,
    ) -> Piece {
        let mut piece = Piece {
            duration_s,
            constant_a: [0.0; SIZE],
            constant_v: [0.0; SIZE],
            parallel_ohm: self.parallel_ohm,
            is_limited: [false; SIZE],
            terms: self.shapes,
            conducting: self.rows,
            count: self.rows,
        };
        let discharged_a = self.currents_a(circuit, imposed, &[0.0; SIZE]);
        for term in &mut piece.terms[..self.rows] {
            let (mut driven, mut stored) = (0.0, 0.0);
            let held = circuit.farad.iter().zip(charge.volts);
            for ((skin_v, flows), (farad, volts)) in term.skin_v.iter().zip(discharged_a).zip(held)
            {
                driven += skin_v * flows;
                stored += skin_v * farad * volts;
            }
            let settled = driven / term.rate_per_s;
            let away = stored - settled;
            let sums = piece.constant_v.iter_mut().zip(term.skin_v);
            sums.for_each(|(sum, v)| *sum += settled * v);
            term.skin_v.iter_mut().for_each(|v| *v *= away);
            term.current_a.iter_mut().for_each(|a| *a *= away);
        }
        piece.constant_a = self.currents_a(circuit, imposed, &piece.constant_v);
        self.add_uncoupled(circuit, imposed, charge, &mut piece);
        piece
    }

    /// Adds the voltages over the skins that no mode contains: that of an R_p without a capacitor,
    /// and that of a capacitor that sees only its own R_p and a constant current.
    fn add_uncoupled(
        &self,
        circuit: &Circuit,
        imposed: &[Source; SIZE],
        charge: &Charge,
        piece: &mut Piece,
    ) {
        for (electrode, imposed) in imposed.iter().enumerate().take(circuit.actives + 1) {
            let ohm = self.parallel_ohm[electrode];
            let settled_v = ohm * piece.constant_a[electrode];
            let is_return = electrode == circuit.actives;
            if !circuit.has_capacitor(electrode) {
                piece.constant_v[electrode] = settled_v;
                for term in &mut piece.terms[..self.rows] {
                    term.skin_v[electrode] = ohm * term.current_a[electrode];
                }
            } else if !is_return && matches!(imposed, Source::Current(_)) {
                piece.constant_v[electrode] = settled_v;
                let term = &mut piece.terms[piece.count];
                term.rate_per_s = (ohm * circuit.farad[electrode]).recip();
                term.skin_v[electrode] = charge.volts[electrode] - settled_v;
                piece.count += 1;
            }
        }
    }
}
