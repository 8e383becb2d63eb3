//! Circuit of a network, as seen from its terminals.

use super::skin::Skin;
use super::symmetric::{Matrix, SIZE, Vector, dot};

/// Quantity that a terminal imposes on its electrode during a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// Voltage relative to the common return, V.
    Voltage(f64),
    /// Current into the tissue, A; 0 for an open terminal.
    Current(f64),
}

/// Constant elements of the circuit: tissue, series resistances and capacitors.
#[derive(Clone, Debug, PartialEq)]
pub struct Circuit {
    /// Number of active electrodes; also the index of the common return.
    pub actives: usize,
    /// Voltage between an active terminal (row) and the terminal of the return, per ampere that
    /// enters an active terminal (column) and leaves through the return: tissue and series
    /// resistances.
    loop_ohm: Matrix,
    /// Capacitance of every electrode, F; 0 for none.
    pub farad: Vector,
}

impl Circuit {
    /// Creates the circuit. `tissue_ohm` contains the loop resistances of the tissue between all
    /// active electrodes. `skins` has one entry per electrode, that of the common return last.
    pub fn new(tissue_ohm: &Matrix, skins: &[Skin]) -> Self {
        let actives = skins.len() - 1;
        let mut series_ohm = [0.0; SIZE];
        let mut farad = [0.0; SIZE];
        for (electrode, skin) in skins.iter().enumerate() {
            series_ohm[electrode] = skin.series_ohm;
            farad[electrode] = skin.farad;
        }
        Self {
            actives,
            loop_ohm: in_series(tissue_ohm, &series_ohm, actives),
            farad,
        }
    }

    /// Returns the voltage of an active terminal relative to that of the return, V. `current_a`
    /// contains the currents of all electrodes into the tissue, `skin_v` the voltages over R_p and
    /// C of their skins.
    pub fn terminal_v(&self, electrode: usize, current_a: &Vector, skin_v: &Vector) -> f64 {
        let drop_v = dot(&self.loop_ohm[electrode], current_a);
        drop_v + skin_v[electrode] - skin_v[self.actives]
    }

    /// Returns the tissue and series resistance of an active electrode's loop, Ω: the one that a
    /// current meets before the capacitors charge.
    pub fn own_ohm(&self, electrode: usize) -> f64 {
        self.loop_ohm[electrode][electrode]
    }

    /// Returns whether the skin of this electrode has a capacitor.
    pub fn has_capacitor(&self, electrode: usize) -> bool {
        self.farad[electrode] > 0.0
    }

    /// Returns the loop resistances, with R_p in series for electrodes without a parallel
    /// capacitor.
    pub fn loops(&self, parallel_ohm: &Vector) -> Matrix {
        let mut through_ohm = *parallel_ohm;
        for (ohm, farad) in through_ohm.iter_mut().zip(self.farad) {
            *ohm = if farad > 0.0 { 0.0 } else { *ohm };
        }
        in_series(&self.loop_ohm, &through_ohm, self.actives)
    }

    /// Sets the current of the common return to minus the sum of the others.
    pub fn balance_return_current(&self, current_a: &mut Vector) {
        current_a[self.actives] = -current_a[..self.actives].iter().sum::<f64>();
    }
}

/// Adds a series resistance at every electrode to the loop resistances; that of the return is part
/// of all loops.
fn in_series(loop_ohm: &Matrix, more_ohm: &Vector, actives: usize) -> Matrix {
    let mut out = *loop_ohm;
    for (electrode, row) in out[..actives].iter_mut().enumerate() {
        let common = &mut row[..actives];
        common
            .iter_mut()
            .for_each(|common| *common += more_ohm[actives]);
        row[electrode] += more_ohm[electrode];
    }
    out
}
