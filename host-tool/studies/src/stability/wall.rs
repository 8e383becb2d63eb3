//! Maps of stiffness, delay and damping of the virtual wall: where an arm that leans on it comes to
//! rest and where it swings, with two predictions.
//!
//! Both predictions describe this loop, s being the Laplace variable:
//!
//! ```text
//! I s² + b s + k + K (1 + s Td / (1 + s/ωc)) e^(−s D) / (1 + τ s) = 0
//! ```
//!
//! K: torque per angle of the wall at the point of rest, N·m/rad (recruitment's slope there times
//! the wall's stiffness). τ: the muscle's lag. Force is linear in recruitment, dF/dt = r A x(t) − F
//! / (τ1 + τ2 x(t)), and x(t) does not depend on r at a constant pulse rate, so 1/τ is the mean of
//! 1/(τ1 + τ2 x) over a period. D: electromechanical delay, device, half a pulse period of hold. b:
//! the joint's friction, passive and of the working muscles.

use super::wall_loop::{LATENCY_MS, PERIOD_MS, WALL_MDEG, angles, leaning, wall};
use super::{Axis, Cell, Class, Layout, Map, Panels};
use hal_sim::body::ElbowSpec;
use hal_sim::body::muscle::Parameters;
use std::f64::consts::{PI, TAU};

/// Stiffness of the wall in the columns, µA/°.
const STIFFNESS: [u32; 17] = [
    1000, 1200, 1400, 1700, 2000, 2400, 2800, 3400, 4000, 4800, 5600, 6700, 8000, 9500, 11_000,
    13_000, 16_000,
];
/// Electromechanical delays in the rows, ms; that of the nominal elbow is 25.
const DELAY_MS: [u32; 10] = [5, 10, 15, 20, 25, 30, 40, 50, 70, 100];
/// Electromechanical delays in the rows of the map with the classical condition, ms. They are few,
/// because that condition does not depend on delay.
const FEW_DELAYS_MS: [u32; 3] = [5, 25, 50];
/// Damping of each panel: passive friction of the joint, N·m·s/rad, and the wall's Td, s.
const DAMPING: [(f64, f64); 6] = [
    (0.2, 0.0),
    (0.5, 0.0),
    (1.0, 0.0),
    (2.0, 0.0),
    (0.5, 0.05),
    (0.5, 0.1),
];
/// Length of a simulated trial, s.
const TRIAL_S: u64 = 40;
/// Length of the part at the end of a trial that is judged, s.
const JUDGED_S: u64 = 4;
/// Peak-to-peak angle above which an arm counts as swinging, °: ten times the ripple that the
/// pulses cause.
const SWING_DEG: f64 = 0.5;

const CLASSES: [Class; 3] = [
    Class::new('.', SWING_DEG, "rests: up to 0.5 deg", 0),
    Class::new('o', 5.0, "swings up to 5 deg", 1),
    Class::new('X', f64::INFINITY, "swings more than 5 deg", 1),
];

/// Linearised loop of arm and wall at the point of rest, in the symbols of the equation above.
#[derive(Clone, Copy, Debug)]
struct Linear {
    inertia: f64,
    damping: f64,
    stiffness: f64,
    /// K: change of the wall's torque per change of the angle, N·m/rad.
    gain: f64,
    /// τ: time constant with which the muscle's force follows recruitment, s.
    lag_s: f64,
    /// Td: damping of the wall divided by its stiffness, s.
    lead_s: f64,
    /// 1/ωc: time constant of the velocity filter, s.
    filter_s: f64,
    /// D: sum of all delays in the loop, s.
    delay_s: f64,
}

/// Computes the map with the prediction of the linear delay margin, which includes the muscle's
/// lag.
pub fn draw(_seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let theory = "D is the smallest (pi + arg L(iw))/w with |L(iw)| = 1, L = K (1 + s Td/(1 + \
                  s/wc)) / ((1 + tau s)(I s^2 + b s + k)), with the muscle's lag tau in the loop; \
                  beyond Routh's criterion for D = 0 the arm swings at any delay.";
    Map {
        name: "wall",
        title: "The virtual wall: stiffness, delay, damping",
        ..map(&DELAY_MS, theory, Linear::swings, progress)
    }
}

/// Computes the map for a few delays, with the prediction of the classical condition for a sampled
/// wall.
pub fn draw_classical(_seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let theory = "b = K T/2 + K Td, T the 20 ms between pulses: a sampled wall without a muscle's \
                  lag and without a delay (Colgate and Schenkel 1997). Left of the line, theory \
                  predicts that the arm rests.";
    Map {
        name: "wall_classical",
        title: "The virtual wall beside the classical condition of a sampled wall",
        ..map(&FEW_DELAYS_MS, theory, Linear::swings_classically, progress)
    }
}

fn map(
    delays_ms: &[u32],
    theory: &'static str,
    swings: fn(&Linear) -> bool,
    progress: &mut dyn FnMut(f64),
) -> Map {
    let mut panels = Panels::new(DAMPING.len(), progress);
    for (friction, lead_s) in DAMPING {
        let title = format!("friction {friction} N m s/rad, Td {lead_s} s");
        panels.add(title, delays_ms, &STIFFNESS, |delay_ms, stiffness| {
            cell(friction, lead_s, *delay_ms, *stiffness, swings)
        });
    }
    Map {
        name: "",
        title: "",
        across: Axis::new("stiffness", "mA/deg", &STIFFNESS, |s| {
            format!("{}", f64::from(*s) / 1000.0)
        }),
        down: Axis::new("delay", "ms", delays_ms, u32::to_string),
        quantity: "peak to peak over the last 4 s of 40 s, leaning with a constant torque",
        classes: &CLASSES,
        panels: panels.made,
        layout: Layout::Beside(2),
        theory,
        notes: vec![notes()],
    }
}

fn notes() -> String {
    let typical = Linear::of(&arm(0.5, 25), 4000, 0.0);
    format!(
        "Harris' proportional wall on the triceps at 90 deg, 1 kHz, pulses at 50 Hz; the arm leans \
         on it with {:.1} N m. Friction is the passive friction of the joint, active muscles add \
         {:.2} N m s/rad; Td is the wall's damping divided by its stiffness. K = {:.1} N m/rad at \
         4 mA/deg, I = {} kg m^2, tau = {:.0} ms, D = the electromechanical delay of the row plus \
         {} ms for the device and the hold between pulses. \
         Harris' ramp of 80 mA over 9 deg is 8.9 mA/deg.",
        ElbowSpec::default().person.push_nm,
        typical.damping - 0.5,
        typical.gain,
        typical.inertia,
        typical.lag_s * 1e3,
        PERIOD_MS / 2 + LATENCY_MS,
    )
}

/// Simulates the arm of one cell; `swings` predicts whether it swings.
fn cell(
    friction: f64,
    lead_s: f64,
    delay_ms: u32,
    stiffness: u32,
    swings: fn(&Linear) -> bool,
) -> Cell {
    let arm = arm(friction, delay_ms);
    // Rounded down to the device's steps; both are well inside their ranges.
    let damping = (f64::from(stiffness) * lead_s) as u32;
    let number = swing_deg(&arm, stiffness, damping);
    let told = swings(&Linear::of(&arm, stiffness, lead_s));
    Cell::with_verdict(&CLASSES, number, Some(u8::from(told)))
}

fn arm(friction: f64, delay_ms: u32) -> ElbowSpec {
    leaning(ElbowSpec {
        damping_nm_s_per_rad: friction,
        electromechanical_delay_us: delay_ms * 1000,
        ..ElbowSpec::default()
    })
}

/// Returns how far the arm swings at the end of a trial, peak to peak, °.
fn swing_deg(arm: &ElbowSpec, stiffness: u32, damping: u32) -> f64 {
    let angles = angles(&wall(stiffness, damping), arm.clone(), TRIAL_S);
    let judged = angles.iter().rev().take(JUDGED_S as usize * 1000);
    let (low, high) = judged.fold((f64::MAX, f64::MIN), |(low, high), &a| {
        (low.min(a), high.max(a))
    });
    high - low
}

impl Linear {
    /// Linearises the loop at the point of rest. There the triceps balances push and passive
    /// torque; this determines recruitment, amplitude and penetration.
    fn of(arm: &ElbowSpec, stiffness_ua_per_deg: u32, lead_s: f64) -> Self {
        let curvature = arm.recruitment_curvature;
        let triceps = &arm.triceps;
        let range_ma = triceps.max_ma - triceps.threshold_ma;
        let ma_per_deg = f64::from(stiffness_ua_per_deg) * 1e-3;
        let (mut share, mut angle_deg) = (0.0, f64::from(WALL_MDEG) * 1e-3);
        // The passive torque is weak: each round corrects by a few percent.
        for _ in 0..50 {
            let passive = arm.stiffness_nm_per_rad * (angle_deg - arm.rest_deg).to_radians();
            share = (arm.person.push_nm - passive).max(0.0) / triceps.torque_nm;
            let along = libm::log1p(share * libm::expm1(curvature)) / curvature;
            let amplitude_ma = triceps.threshold_ma + range_ma * along;
            angle_deg = f64::from(WALL_MDEG) * 1e-3 + amplitude_ma / ma_per_deg;
        }
        // d/dx of expm1(c x)/expm1(c), expressed in the share itself.
        let slope_per_ma = curvature * (share + 1.0 / libm::expm1(curvature)) / range_ma;
        let working = share * triceps.torque_nm + arm.person.push_nm;
        let delay_us = f64::from(arm.electromechanical_delay_us);
        let held_ms = (PERIOD_MS / 2 + LATENCY_MS) as f64;
        Self {
            inertia: arm.inertia_kg_m2,
            damping: arm.damping_nm_s_per_rad + arm.active_damping_s_per_rad * working,
            stiffness: arm.stiffness_nm_per_rad,
            gain: triceps.torque_nm * slope_per_ma * ma_per_deg * 180.0 / PI,
            lag_s: lag_s(&triceps.dynamics),
            lead_s,
            filter_s: 1.0 / (TAU * 10.0),
            delay_s: delay_us * 1e-6 + held_ms * 1e-3,
        }
    }

    fn swings_classically(&self) -> bool {
        let held_s = PERIOD_MS as f64 * 1e-3;
        self.damping <= self.gain * (0.5 * held_s + self.lead_s)
    }

    fn swings(&self) -> bool {
        !self.rests_without_delay() || self.delay_s > self.delay_margin_s()
    }

    /// Returns whether the arm rests if the loop has no delay, by Routh's criterion. Its polynomial
    /// is `(1 + f s)(1 + τ s)(I s² + b s + k) + K (1 + (f + Td) s)`, where f = 1/ωc.
    fn rests_without_delay(&self) -> bool {
        let (f, t) = (self.filter_s, self.lag_s);
        let (i, b, k, g) = (self.inertia, self.damping, self.stiffness, self.gain);
        let (p1, p2) = (f + t, f * t);
        let a = [
            p2 * i,
            p1 * i + p2 * b,
            i + p1 * b + p2 * k,
            b + p1 * k + g * (f + self.lead_s),
            k + g,
        ];
        let first = (a[1] * a[2] - a[0] * a[3]) / a[1];
        let second = (first * a[3] - a[1] * a[4]) / first;
        a.iter().all(|a| *a > 0.0) && first > 0.0 && second > 0.0
    }

    /// Returns the largest delay at which the arm still rests, s, if it rests without delay;
    /// infinite if the loop's gain never reaches 1.
    fn delay_margin_s(&self) -> f64 {
        // In steps of a hundredth of an octave; bisection then refines each crossing.
        let rates = (0..1400).map(|n| 0.1 * libm::pow(2f64, f64::from(n) * 0.01));
        let above = |w: f64| self.response(w).0 > 1.0;
        let mut margin = f64::INFINITY;
        let mut before = 1e-3;
        for w in rates {
            if above(w) != above(before) {
                let (mut low, mut high) = (before, w);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if above(middle) == above(before) {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                let phase = (PI + self.response(low).1).rem_euclid(TAU);
                margin = margin.min(phase / low);
            }
            before = w;
        }
        margin
    }

    /// Returns gain and phase of the open loop without delay, at the angular frequency `w` in
    /// rad/s.
    fn response(&self, w: f64) -> (f64, f64) {
        let arm = (self.stiffness - self.inertia * w * w, self.damping * w);
        let parts = [
            (1.0, w * (self.filter_s + self.lead_s)),
            (1.0, w * self.filter_s),
            (1.0, w * self.lag_s),
            arm,
        ];
        let [size, angle]: [[f64; 4]; 2] = [
            parts.map(|(re, im)| f64::hypot(re, im)),
            parts.map(|(re, im)| f64::atan2(im, re)),
        ];
        let gain = self.gain * size[0] / (size[1] * size[2] * size[3]);
        (gain, angle[0] - angle[1] - angle[2] - angle[3])
    }
}

/// Returns the time constant τ with which the force of a muscle, pulsed every [`PERIOD_MS`],
/// follows recruitment, s.
fn lag_s(p: &Parameters) -> f64 {
    let period_s = PERIOD_MS as f64 * 1e-3;
    let top = 1.0 / -libm::expm1(-period_s / p.tau_c_s);
    let points = 1000;
    let rate = |n: u32| {
        let c = top * libm::exp(-period_s * (f64::from(n) + 0.5) / f64::from(points) / p.tau_c_s);
        1.0 / (p.tau1_s + p.tau2_s * c / (c + p.k))
    };
    f64::from(points) / (0..points).map(rate).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares result and prediction in one row of stiffnesses: counts the cells that are worse
    /// and those that are better than predicted.
    fn row(friction: f64, lead_s: f64, delay_ms: u32, swings: fn(&Linear) -> bool) -> [usize; 2] {
        let cells = STIFFNESS.map(|s| cell(friction, lead_s, delay_ms, s, swings));
        let count = |is: fn(bool, bool) -> bool| {
            let hit = |c: &&Cell| is(c.class > 0, c.predicted == Some(1));
            cells.iter().filter(hit).count()
        };
        [
            count(|found, predicted| found && !predicted),
            count(|found, predicted| !found && predicted),
        ]
    }

    #[test]
    fn the_delay_margin_with_the_muscles_lag_meets_the_wall_to_one_cell() {
        for (friction, lead_s, delay_ms) in [(0.5, 0.0, 25), (1.0, 0.0, 70), (0.5, 0.1, 15)] {
            let [worse, better] = row(friction, lead_s, delay_ms, Linear::swings);
            assert!(worse + better <= 1, "{friction} {lead_s} {delay_ms}");
        }
    }

    #[test]
    fn the_classical_condition_calls_swinging_walls_safe() {
        let [worse, better] = row(0.5, 0.0, 25, Linear::swings_classically);
        assert!(worse >= 5 && better == 0, "{worse} {better}");
    }

    #[test]
    fn damping_in_the_wall_lets_it_be_stiffer() {
        let stiffest = |lead_s| {
            let rests = |s: &&u32| cell(0.5, lead_s, 25, **s, Linear::swings).class == 0;
            STIFFNESS.iter().take_while(rests).count()
        };
        assert!(stiffest(0.05) > stiffest(0.0));
    }

    /// A closed form exists: a pure spring with only the lag, I s² + b s + K/(1 + τ s), rests
    /// without delay if b (I + b τ) > I τ K.
    #[test]
    fn routh_agrees_with_the_closed_form() {
        for n in 1..100 {
            let gain = f64::from(n);
            let linear = Linear {
                inertia: 0.06,
                damping: 0.8,
                stiffness: 0.0,
                gain,
                lag_s: 0.14,
                lead_s: 0.0,
                filter_s: 1e-9,
                delay_s: 0.0,
            };
            let rests = 0.8 * (0.06 + 0.8 * 0.14) > 0.06 * 0.14 * gain;
            assert_eq!(linear.rests_without_delay(), rests, "{gain}");
            if rests {
                // The margin must be positive if the loop rests without delay.
                assert!(linear.delay_margin_s() > 0.0);
            }
        }
    }
}
