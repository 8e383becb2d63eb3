//! Map of the word length of C against the force that remains after the last pulse.
//!
//! ETD midpoint with only C in fixed point and everything else in f64, so that every error comes
//! from C's word. C ← round(C·e^(−h/τc)) once per step.

use super::{Axis, Cell, Class, Layout, Map, Panels};
use hal_sim::body::muscle::{Parameters, SUBJECTS};

/// Step of the simulation, s: the device's control tick.
const H: f64 = 1e-3;
/// Number of steps between two pulses, for a rate of 40 Hz.
const BETWEEN_PULSES: u32 = 25;
/// Number of steps with pulses, and number of steps after them: 1 s and 6 s.
const STEPS: [u32; 2] = [1000, 6000];
const BITS: [u32; 25] = [
    6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30,
];
/// Largest error allowed for the device's model, % of the peak force.
const TOLERANCE: f64 = 0.02;

/// How C is rounded after each step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// To the nearest value; halves are rounded up.
    Nearest,
    Down,
}

/// Effect of one word length of C on one muscle. Forces are in % of the peak force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Force that remains 6 s after the last pulse.
    pub residual: f64,
    /// Time from the last pulse until C reaches 0 for good, ms; `None` if it never does.
    pub zero_after_ms: Option<u32>,
    /// Largest difference between the force and that of the same method with C in f64.
    pub error: f64,
}

const CLASSES: [Class; 5] = [
    Class::new(',', TOLERANCE, "error up to 0.02 %", 0),
    Class::new('o', TOLERANCE, "remains forever, up to 0.02 %", 0),
    Class::new('1', 1.0, "up to 1 %", 2),
    Class::new('2', 10.0, "up to 10 %", 2),
    Class::new('X', f64::INFINITY, "more than 10 %", 2),
];

/// Computes the map by simulating every cell; the seed is not used.
pub fn draw(_seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let mut panels = Panels::new(PANELS.len(), progress);
    for (title, rounding, least, found, told) in PANELS {
        panels.add(title.to_owned(), &SUBJECTS, &BITS, |p, bits| {
            let found = found(run(p, *bits, rounding));
            let cell = Cell::with_prediction(&CLASSES, found, Some(told(p, *bits, rounding)));
            Cell {
                class: cell.class.max(least),
                ..cell
            }
        });
    }
    let (ms, left) = slowest_to_zero();
    Map {
        name: "word_length",
        title: "Word length of C: remaining force and error",
        across: Axis::new("fraction bits of C", "", &BITS, u32::to_string),
        down: Axis::new("subject and its K", "", &SUBJECTS, |p| {
            let n = SUBJECTS.iter().position(|q| q == p).unwrap_or(0);
            format!("K{:02} {:.3}", n + 1, p.k)
        }),
        quantity: "force, % of the train's peak",
        classes: &CLASSES,
        panels: panels.made,
        layout: Layout::Beside(2),
        theory: "C stops decaying where rounding undoes its decay, at n last bits, n being the \
                 largest integer with n (1 − e^(−h/τc)) < 1/2; rounded down it loses up to \
                 1/(1 − e^(−h/τc)) last bits. Both are multiplied by dF/dC of the steady force \
                 A x (τ1 + τ2 x).",
        notes: vec![format!(
            "ETD midpoint at 1 ms, 40 Hz for 1 s, then 6 s of rest; only C is in fixed point. \
             Rounded down, C reaches 0 for every subject and word length at most {ms} ms after the \
             last pulse, and then the force decays as that of a muscle: {left:.0e} % remains after \
             6 s."
        )],
    }
}

/// Definition of a panel: its title, the rounding of C, the smallest class index of its cells, a
/// function for the plotted number, and one for theory's prediction of it. The smallest class is 1
/// for a remaining force, which is not an error.
type PanelOf = (
    &'static str,
    Rounding,
    usize,
    fn(Outcome) -> f64,
    fn(&Parameters, u32, Rounding) -> f64,
);

/// Panels of the map: the force that remains, and the largest error with each rounding. There is no
/// panel for the force that remains with rounding down, because none remains at any word length; a
/// note and a test confirm this.
#[rustfmt::skip]
const PANELS: [PanelOf; 3] = [
    ("force 6 s after the last pulse; C rounded to nearest", Rounding::Nearest, 1, |of| of.residual, |p, bits, _| predicted_residual(p, bits)),
    ("worst error; C rounded to nearest", Rounding::Nearest, 0, |of| of.error, predicted_error),
    ("worst error; C rounded down", Rounding::Down, 0, |of| of.error, predicted_error),
];

/// Returns, for C rounded down, the longest time that C takes to reach 0 after the last pulse, ms,
/// and the largest force that remains at the end, % of the peak force. Both are over all muscles
/// and word lengths.
fn slowest_to_zero() -> (u32, f64) {
    let all = SUBJECTS
        .iter()
        .flat_map(|p| BITS.map(|bits| run(p, bits, Rounding::Down)));
    all.fold((0, 0.0), |(ms, left), of| {
        // A C that never reaches 0 counts as the longest time.
        let took = of.zero_after_ms.unwrap_or(u32::MAX);
        (ms.max(took), left.max(of.residual))
    })
}

/// Simulates one muscle whose C has `bits` fraction bits.
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
    let (mut last_pulse, mut zero_after_ms) = (0, None);
    for step in 0..STEPS[0] + STEPS[1] {
        if step < STEPS[0] && step.is_multiple_of(BETWEEN_PULSES) {
            word += one;
            exact += 1.0;
            last_pulse = step;
        }
        force = after_step(p, force, word as f64 / one as f64);
        exact_force = after_step(p, exact_force, exact);
        word = (word * factor + half) >> 32;
        exact *= (-H / p.tau_c_s).exp();
        if word == 0 {
            zero_after_ms = zero_after_ms.or(Some(step + 1 - last_pulse));
        } else {
            zero_after_ms = None;
        }
        peak = peak.max(exact_force);
        error = error.max((force - exact_force).abs());
    }
    Outcome {
        residual: force / peak * 100.0,
        zero_after_ms,
        error: error / peak * 100.0,
    }
}

/// Returns the force after one step, given the force and the C at its start.
fn after_step(p: &Parameters, force: f64, c: f64) -> f64 {
    let middle = c * (-0.5 * H / p.tau_c_s).exp();
    let x = middle / (middle + p.k);
    let tau = p.tau1_s + p.tau2_s * x;
    force + (1.0 - (-H / tau).exp()) * (p.a_n_per_s * x * tau - force)
}

/// Returns the value of C at which rounding to nearest stops its decay, in units of its last bit.
fn frozen(p: &Parameters) -> f64 {
    (0.5 / (1.0 - (-H / p.tau_c_s).exp())).ceil() - 1.0
}

fn steady(p: &Parameters, c: f64) -> f64 {
    let x = c / (c + p.k);
    p.a_n_per_s * x * (p.tau1_s + p.tau2_s * x)
}

/// Returns the largest C of the train, and the steady force at its mean C.
fn level(p: &Parameters) -> (f64, f64) {
    let period = H * f64::from(BETWEEN_PULSES);
    let top = 1.0 / (1.0 - (-period / p.tau_c_s).exp());
    (top, steady(p, p.tau_c_s / period))
}

/// Returns the force that theory predicts to remain if C is rounded to nearest, % of the steady
/// force.
fn predicted_residual(p: &Parameters, bits: u32) -> f64 {
    let c = frozen(p) * (-f64::from(bits)).exp2();
    steady(p, c) / level(p).1 * 100.0
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
                let [down, nearest] =
                    [Rounding::Down, Rounding::Nearest].map(|rounding| run(p, bits, rounding));
                assert!(down.zero_after_ms.is_some() && nearest.zero_after_ms.is_none());
                assert!(nearest.residual > 1e9 * down.residual);
            }
        }
        let (ms, left) = slowest_to_zero();
        println!("rounded down: C is 0 after {ms} ms at the latest, {left:.0e} % left after 6 s");
        assert!(ms < 1000 && left < 1e-20);
    }

    /// K = 0.012; the error with 18 bits is about half of that with 17.
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
