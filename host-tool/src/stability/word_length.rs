//! Word length of C against what is left of the force after the last pulse.
//!
//! ETD midpoint with C alone in fixed point and everything else in f64, so that
//! nothing but C's word can be to blame. C ← round(C·e^(−h/τc)) once per step.

use super::{Axis, Cell, Class, Map, Panel};
use hal_sim::body::muscle::{Parameters, SUBJECTS};

/// The step, s: the device's tick.
const H: f64 = 1e-3;
/// A pulse every this many steps, 40 Hz.
const BETWEEN_PULSES: u32 = 25;
/// Steps with pulses, then steps without: 1 s and 6 s.
const STEPS: [u32; 2] = [1000, 6000];
const BITS: [u32; 25] = [
    6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30,
];
/// What the shipped model may be wrong by, % of peak.
const TOLERANCE: f64 = 0.02;

/// How C is rounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// To the nearest, halves up.
    Nearest,
    /// Down.
    Down,
}

/// What one word length did to one muscle, in % of its peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Force that is left 6 s after the last pulse.
    pub residual: f64,
    /// Worst difference to the same method with C in f64.
    pub error: f64,
}

const CLASSES: [Class; 6] = [
    Class::new('.', "exactly 0", 0),
    Class::new(',', "error up to 0.02 %", 0),
    Class::new('o', "left for ever, up to 0.02 %", 1),
    Class::new('1', "up to 1 %", 2),
    Class::new('2', "up to 10 %", 2),
    Class::new('X', "more than 10 %", 2),
];

/// The map.
pub fn draw(_seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let mut panels = Vec::new();
    for rounding in [Rounding::Nearest, Rounding::Down] {
        panels.extend(panels_of(rounding));
        progress(panels.len() as f64 / 4.0);
    }
    Map {
        name: "word_length",
        title: "Word length of C, against the force that is left and the error it makes",
        across: Axis::new("fraction bits of C", "", &BITS, u32::to_string),
        down: Axis::new("subject and its K", "", &SUBJECTS, |p| {
            let n = SUBJECTS.iter().position(|q| q == p).unwrap_or(0);
            format!("K{:02} {:.3}", n + 1, p.k)
        }),
        quantity: "force, % of the train's peak",
        classes: CLASSES.to_vec(),
        panels,
        theory: "C freezes where rounding takes back its decay, at the largest whole n with \
                 n (1 − e^(−h/τc)) < 1/2 of the last bit; rounded down it loses up to \
                 1/(1 − e^(−h/τc)) of them. Both times dF/dC of the steady force \
                 A x (τ1 + τ2 x).",
        notes: vec![
            "ETD midpoint at 1 ms, 40 Hz for 1 s, then 6 s of rest; C alone in fixed point."
                .to_owned(),
        ],
    }
}

/// What is left, and the worst error.
fn panels_of(rounding: Rounding) -> [Panel; 2] {
    let how = match rounding {
        Rounding::Nearest => "C rounded to nearest",
        Rounding::Down => "C rounded down",
    };
    let left = format!("left 6 s after the last pulse; {how}");
    let error = format!("worst error; {how}");
    [
        Panel::new(left, &SUBJECTS, &BITS, |p, bits| {
            let predicted = predicted_residual(p, *bits, rounding);
            cell(Small::Stays, run(p, *bits, rounding).residual, predicted)
        }),
        Panel::new(error, &SUBJECTS, &BITS, |p, bits| {
            let predicted = predicted_error(p, *bits, rounding);
            cell(Small::Error, run(p, *bits, rounding).error, predicted)
        }),
    ]
}

/// What a number within the tolerance is.
#[derive(Clone, Copy)]
enum Small {
    /// An error like any other.
    Error,
    /// A force that never goes away.
    Stays,
}

/// The class of a number beside the number that theory gives.
fn cell(small: Small, number: f64, predicted: f64) -> Cell {
    let class = |x: f64| match (x, small) {
        (0.0, _) => 0,
        (x, Small::Error) if x <= TOLERANCE => 1,
        (x, Small::Stays) if x <= TOLERANCE => 2,
        (x, _) if x <= 1.0 => 3,
        (x, _) if x <= 10.0 => 4,
        _ => 5,
    };
    Cell {
        class: class(number),
        number,
        predicted: Some([0, 0, 1, 2, 2, 2][class(predicted)]),
    }
}

/// Runs one muscle with `bits` fraction bits for C.
#[must_use]
pub fn run(p: &Parameters, bits: u32, rounding: Rounding) -> Outcome {
    let one = 1u128 << bits;
    let factor = ((-H / p.tau_c_s).exp() * (1u64 << 32) as f64) as u128;
    let half = match rounding {
        Rounding::Nearest => 1 << 31,
        Rounding::Down => 0,
    };
    let (mut word, mut exact) = (0u128, 0.0);
    let (mut force, mut exact_force) = (0.0, 0.0);
    let (mut peak, mut error) = (0.0f64, 0.0f64);
    for step in 0..STEPS[0] + STEPS[1] {
        if step < STEPS[0] && step.is_multiple_of(BETWEEN_PULSES) {
            word += one;
            exact += 1.0;
        }
        force = after_step(p, force, word as f64 / one as f64);
        exact_force = after_step(p, exact_force, exact);
        word = (word * factor + half) >> 32;
        exact *= (-H / p.tau_c_s).exp();
        peak = peak.max(exact_force);
        error = error.max((force - exact_force).abs());
    }
    // What is still on its way down is no residual.
    let settled = if word == 0 { 0.0 } else { force };
    Outcome {
        residual: settled / peak * 100.0,
        error: error / peak * 100.0,
    }
}

/// F one step on, C at the step's start being `c`.
fn after_step(p: &Parameters, force: f64, c: f64) -> f64 {
    let middle = c * (-0.5 * H / p.tau_c_s).exp();
    let x = middle / (middle + p.k);
    let tau = p.tau1_s + p.tau2_s * x;
    force + (1.0 - (-H / tau).exp()) * (p.a_n_per_s * x * tau - force)
}

/// The C at which rounding to nearest stops its decay, in units of the last bit.
fn frozen(p: &Parameters) -> f64 {
    (0.5 / (1.0 - (-H / p.tau_c_s).exp())).ceil() - 1.0
}

fn steady(p: &Parameters, c: f64) -> f64 {
    let x = c / (c + p.k);
    p.a_n_per_s * x * (p.tau1_s + p.tau2_s * x)
}

/// The highest C of the train, and the steady force at its mean.
fn level(p: &Parameters) -> (f64, f64) {
    let period = H * f64::from(BETWEEN_PULSES);
    let top = 1.0 / (1.0 - (-period / p.tau_c_s).exp());
    (top, steady(p, p.tau_c_s / period))
}

fn predicted_residual(p: &Parameters, bits: u32, rounding: Rounding) -> f64 {
    match rounding {
        Rounding::Nearest => {
            let c = frozen(p) * (-f64::from(bits)).exp2();
            steady(p, c) / level(p).1 * 100.0
        }
        Rounding::Down => 0.0,
    }
}

fn predicted_error(p: &Parameters, bits: u32, rounding: Rounding) -> f64 {
    let last_bit = (-f64::from(bits)).exp2();
    let off = last_bit
        * match rounding {
            Rounding::Nearest => frozen(p),
            Rounding::Down => 1.0 / (1.0 - (-H / p.tau_c_s).exp()),
        };
    let (top, force) = level(p);
    let at = |n: u32| {
        let c = top * f64::from(n) / 400.0;
        (steady(p, c + off) - steady(p, c)).abs()
    };
    (0..=400).map(at).fold(0.0, f64::max) / force * 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_to_nearest_freezes_and_rounding_down_reaches_zero() {
        for p in &SUBJECTS {
            for bits in BITS {
                assert_eq!(run(p, bits, Rounding::Down).residual, 0.0);
                assert!(run(p, bits, Rounding::Nearest).residual > 0.0);
            }
        }
    }

    /// K = 0.012; at 18 bits the error is about half of that at 17.
    #[test]
    fn k05_has_the_smallest_k_and_needs_the_longest_word() {
        let bits = |p, rounding, most| {
            let enough = |bits: &u32| run(p, *bits, rounding).error <= most;
            BITS.into_iter().find(enough).expect("30 bits suffice")
        };
        let k05 = &SUBJECTS[4];
        let [down, near] = [Rounding::Down, Rounding::Nearest];
        for (rounding, most) in [
            (down, 1.0),
            (near, 1.0),
            (down, TOLERANCE),
            (near, TOLERANCE),
        ] {
            println!(
                "K05, {rounding:?}: {} bits for {most} %",
                bits(k05, rounding, most)
            );
        }
        assert_eq!(bits(k05, down, TOLERANCE), 23);
        assert_eq!(bits(k05, near, TOLERANCE), 20);
        for p in &SUBJECTS {
            assert!(bits(p, down, TOLERANCE) <= 23 && bits(p, near, TOLERANCE) <= 20);
        }
    }
}
