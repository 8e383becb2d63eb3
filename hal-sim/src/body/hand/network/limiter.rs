//! Voltage stages with a current limit: which of them limit, and until when.
//!
//! A stage either holds its voltage while its current is within the limit, or holds the limit while
//! that needs less than its voltage. With a positive definite tissue this is the minimum of a
//! strictly convex function over the box of allowed currents: at every instant exactly one set of
//! stages limits. Murty's rule finds the set (it repeatedly switches the first stage that
//! contradicts its state); the set ends when the first stage reaches the end of its state.

use super::circuit::{Circuit, Source};
use super::exponentials::Exponentials;
use super::modes::Modes;
use super::piece::{Charge, Piece};
use super::symmetric::{SIZE, Vector};

/// Connection of an active electrode during a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Terminal {
    /// A voltage stage that sets this voltage relative to the common return, of either sign, V, and
    /// limits its current.
    Driven(f64),
    /// A switch to the common return, without a current limit.
    Grounded,
    /// No connection and therefore no current.
    Floating,
}

/// Maximum number of stage transitions within a segment. Each stage changes once or twice; this
/// many occur only if rounding prevents a solution.
const MOST_TURNS: usize = 1000;

/// Direction in which a stage limits its current.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Limiting {
    /// The stage holds its voltage.
    #[default]
    No,
    /// The stage holds the limit, with current into the tissue.
    Positive,
    /// The stage holds the limit, with current out of the tissue.
    Negative,
}

/// All stages of a segment, with the R_p at which the segment is frozen.
pub struct Stages<'a> {
    pub circuit: &'a Circuit,
    /// Modes with R_p = R_0, one entry for every set of terminals that have a given voltage: bit k
    /// of the entry's index is set if terminal k belongs to the set.
    pub modes: &'a [Modes],
    /// R_p of every electrode, Ω; `None` for R_0.
    pub parallel_ohm: Option<&'a Vector>,
    pub terminals: &'a [Terminal],
    /// Current limit of each stage, A; infinite if no stage limits.
    pub limit_a: f64,
}

impl Stages<'_> {
    /// Returns the pieces of a segment of `duration_s` that starts with `charge`, and the charge at
    /// its end. `limiting` is a guess of the initial state and is set to the true one. Returns
    /// `None` if rounding leaves no consistent set.
    pub fn pieces(
        &self,
        charge: &Charge,
        limiting: &mut [Limiting; SIZE],
        duration_s: f64,
    ) -> Option<(Vec<Piece>, Charge)> {
        let mut pieces = Vec::with_capacity(2);
        let (mut charge, mut now, mut left_s) = (*charge, *limiting, duration_s);
        for _ in 0..MOST_TURNS {
            let mut piece = self.piece(&charge, &now, left_s)?;
            let turn = self.first_transition(&piece, &now);
            piece.duration_s = turn.map_or(left_s, |(_, at_s)| at_s);
            if let Some((electrode, _)) = turn {
                now[electrode] = next_limiting(&piece, electrode, now[electrode]);
            }
            if piece.duration_s > 0.0 {
                charge = self.charge_after(&piece);
                left_s -= piece.duration_s;
                pieces.push(piece);
            } else if pieces.is_empty() {
                *limiting = now;
            }
            if turn.is_none() || left_s <= 0.0 {
                return Some((pieces, charge));
            }
        }
        None
    }

    /// Returns the voltages of the capacitors after a piece.
    fn charge_after(&self, piece: &Piece) -> Charge {
        let (_, mut volts) = piece.at(piece.duration_s);
        for (volts, farad) in volts.iter_mut().zip(self.circuit.farad) {
            *volts = if farad > 0.0 { *volts } else { 0.0 };
        }
        Charge { volts }
    }

    fn piece(
        &self,
        charge: &Charge,
        limiting: &[Limiting; SIZE],
        duration_s: f64,
    ) -> Option<Piece> {
        let mut imposed = [Source::Current(0.0); SIZE];
        let mut set = 0;
        for (electrode, terminal) in self.terminals.iter().enumerate() {
            imposed[electrode] = match (terminal, limiting[electrode]) {
                (Terminal::Floating, _) => Source::Current(0.0),
                (Terminal::Grounded, _) => Source::Voltage(0.0),
                (Terminal::Driven(volts), Limiting::No) => Source::Voltage(*volts),
                (Terminal::Driven(_), Limiting::Positive) => Source::Current(self.limit_a),
                (Terminal::Driven(_), Limiting::Negative) => Source::Current(-self.limit_a),
            };
            let is_at_voltage = matches!(imposed[electrode], Source::Voltage(_));
            set |= usize::from(is_at_voltage) << electrode;
        }
        let at_r_0 = &self.modes[set];
        let mut piece = match self.parallel_ohm {
            None => at_r_0.piece(self.circuit, &imposed, charge, duration_s),
            Some(ohm) => {
                let modes = Modes::new(self.circuit, ohm, set, at_r_0.basis)?;
                modes.piece(self.circuit, &imposed, charge, duration_s)
            }
        };
        piece.is_limited = limiting.map(|limiting| limiting != Limiting::No);
        Some(piece)
    }

    /// Returns the first stage whose state ends within the piece, and the time of the transition.
    fn first_transition(&self, piece: &Piece, limiting: &[Limiting; SIZE]) -> Option<(usize, f64)> {
        let mut first: Option<(usize, f64)> = None;
        for (electrode, terminal) in self.terminals.iter().enumerate() {
            let Terminal::Driven(volts) = *terminal else {
                continue;
            };
            let end_s = first.map_or(piece.duration_s, |(_, at_s)| at_s);
            let ends_s = match limiting[electrode] {
                Limiting::No => self.limit_start_s(piece, electrode, end_s),
                Limiting::Positive => self.limit_end_s(piece, electrode, volts, -1.0, end_s),
                Limiting::Negative => self.limit_end_s(piece, electrode, volts, 1.0, end_s),
            };
            let is_first = |at_s: &f64| first.is_none_or(|(_, other)| *at_s < other);
            if let Some(at_s) = ends_s.filter(is_first) {
                first = Some((electrode, at_s));
            }
        }
        first
    }

    /// Returns the time within `end_s` at which the current of a stage that holds its voltage
    /// exceeds the limit.
    fn limit_start_s(&self, piece: &Piece, electrode: usize, end_s: f64) -> Option<f64> {
        if piece.max_current_bound_a(electrode) <= self.limit_a {
            return None;
        }
        let current = piece.current(electrode);
        let within = |sign: f64| current.scaled(sign).plus(self.limit_a);
        let ends_s = [-1.0, 1.0].map(|sign| within(sign).first_falling_zero(end_s, self.limit_a));
        ends_s.into_iter().flatten().reduce(f64::min)
    }

    /// Returns the time within `end_s` at which the limit needs the full voltage of the stage.
    /// Until then the terminal is below that voltage (`side` −1: the current is positive) or above
    /// it (1).
    fn limit_end_s(
        &self,
        piece: &Piece,
        electrode: usize,
        volts: f64,
        side: f64,
        end_s: f64,
    ) -> Option<f64> {
        let v = |current_a, skin_v| self.circuit.terminal_v(electrode, current_a, skin_v);
        let terms = piece.all_terms().iter();
        let pairs = terms.map(|term| (term.rate_per_s, v(&term.current_a, &term.skin_v)));
        let needed = Exponentials::new(v(&piece.constant_a, &piece.constant_v), pairs);
        let scale = volts.abs() + self.limit_a * self.circuit.own_ohm(electrode);
        let beyond = needed.plus(-volts).scaled(side);
        beyond.first_falling_zero(end_s, scale)
    }
}

/// Returns the next state of a stage whose state ends at the end of this piece.
fn next_limiting(piece: &Piece, electrode: usize, limiting: Limiting) -> Limiting {
    if limiting != Limiting::No {
        return Limiting::No;
    }
    let is_into_tissue = piece.current_a(electrode, piece.duration_s) > 0.0;
    if is_into_tissue {
        Limiting::Positive
    } else {
        Limiting::Negative
    }
}
