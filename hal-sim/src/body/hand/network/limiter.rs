//! Voltage stages that limit their current: which of them do, and until when.
//!
//! A stage either holds its voltage while its current is within the limit, or holds
//! the limit while that needs less than its voltage. With a positive definite tissue
//! this is the minimum of a strictly convex function over the box of allowed currents:
//! at every instant exactly one set of stages limits. It is found by Murty's rule
//! (turn the first stage that contradicts its state, again and again), and left when
//! the first stage comes to the end of its state.

use super::circuit::{Circuit, Source};
use super::exponentials::Exponentials;
use super::modes::Modes;
use super::piece::{Charge, Piece};
use super::symmetric::{SIZE, Vector};

/// What is connected to an active electrode during a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Terminal {
    /// A voltage stage that sets these volts against the common return, of either
    /// sign, and limits its current.
    Driven(f64),
    /// A switch to the common return, which limits nothing.
    Grounded,
    /// Nothing: no current.
    Floating,
}

/// Turns of stages within a segment. Each stage turns once or twice; if rounding makes
/// this many of it, nothing is right.
const MOST_TURNS: usize = 1000;

/// Which way a stage limits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Limiting {
    /// It sets its voltage.
    #[default]
    No,
    /// It holds the limit into the tissue.
    Positive,
    /// It holds the limit out of the tissue.
    Negative,
}

/// All stages of a segment, with the R_p it is frozen at.
pub struct Stages<'a> {
    pub circuit: &'a Circuit,
    /// With R_0, of every set of terminals at a voltage; bit k is terminal k.
    pub modes: &'a [Modes],
    /// `None`: R_0.
    pub parallel_ohm: Option<&'a Vector>,
    pub terminals: &'a [Terminal],
    /// A; infinite: no stage limits.
    pub limit_a: f64,
}

impl Stages<'_> {
    /// The pieces of a segment of `duration_s` from `charge` on, and the charge at its
    /// end. `limiting` is a guess of how it begins and becomes how it does. `None` if
    /// rounding leaves no consistent set.
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

    /// What the capacitors hold after a piece.
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

    /// The first stage whose state ends within the piece, and when.
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

    /// When, within `end_s`, the current of a stage at its voltage leaves the limits.
    fn limit_start_s(&self, piece: &Piece, electrode: usize, end_s: f64) -> Option<f64> {
        if piece.max_current_bound_a(electrode) <= self.limit_a {
            return None;
        }
        let current = piece.current(electrode);
        let within = |sign: f64| current.scaled(sign).plus(self.limit_a);
        let ends_s = [-1.0, 1.0].map(|sign| within(sign).first_falling_zero(end_s, self.limit_a));
        ends_s.into_iter().flatten().reduce(f64::min)
    }

    /// When, within `end_s`, the limit needs the stage's voltage: until then the
    /// terminal is below it (`side` −1: the current is positive) or above (1).
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

/// What a stage does after its state has ended at the end of this piece.
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
