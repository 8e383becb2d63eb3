//! What a network consists of, as seen from its terminals.

use super::skin::Skin;
use super::symmetric::{Matrix, SIZE, Vector, dot};

/// What a terminal imposes on its electrode during a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// Volts against the common return.
    Voltage(f64),
    /// Amperes into the tissue; 0 of an open one.
    Current(f64),
}

/// Tissue, series resistances and capacitors: what does not change.
#[derive(Clone, Debug, PartialEq)]
pub struct Circuit {
    /// Active electrodes; the common return has this index.
    pub actives: usize,
    /// Volts between an active terminal and the return's per ampere into another and
    /// out of the return: tissue and series resistances.
    loop_ohm: Matrix,
    /// Capacitance of every electrode, F; 0: none.
    pub farad: Vector,
}

impl Circuit {
    /// `tissue_ohm`: the tissue's part of the loops, for all skins but the last.
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

    /// Volts between an active terminal and the return's, from all currents into the
    /// tissue and voltages over the skins' R_p and C.
    pub fn terminal_v(&self, electrode: usize, current_a: &Vector, skin_v: &Vector) -> f64 {
        let drop_v = dot(&self.loop_ohm[electrode], current_a);
        drop_v + skin_v[electrode] - skin_v[self.actives]
    }

    /// Resistance of an active electrode's loop at the first instant, Ω.
    pub fn own_ohm(&self, electrode: usize) -> f64 {
        self.loop_ohm[electrode][electrode]
    }

    /// Whether this electrode's skin has a capacitor.
    pub fn has_capacitor(&self, electrode: usize) -> bool {
        self.farad[electrode] > 0.0
    }

    /// The loops, with R_p in series where there is no capacitor beside it.
    pub fn loops(&self, parallel_ohm: &Vector) -> Matrix {
        let mut through_ohm = *parallel_ohm;
        for (ohm, farad) in through_ohm.iter_mut().zip(self.farad) {
            *ohm = if farad > 0.0 { 0.0 } else { *ohm };
        }
        in_series(&self.loop_ohm, &through_ohm, self.actives)
    }

    /// The common return takes what the others give.
    pub fn balance_return_current(&self, current_a: &mut Vector) {
        current_a[self.actives] = -current_a[..self.actives].iter().sum::<f64>();
    }
}

/// Loops with more resistance at every electrode: the return's is in all of them.
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
