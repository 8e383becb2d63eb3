//! Map of how far × how long the reference lies beyond a weak finger's reach, for controllers with
//! and without anti-windup: how late the finger moves back once the reference is within reach again.
//!
//! Theory: without anti-windup the integral grows all the time that the effort is at its limit, and
//! has to shrink again first.

use super::describing::Plant;
use super::finger::quiet_finger;
use super::{Axis, Cell, Class, Declaration, Layout, Map, Panel};
use crate::tracking::candidate::Candidate;
use crate::tracking::driver::{Device, Driver, Floating};
use crate::tracking::wearer::{self, KnownWearer, Points};
use firmware::control::{HoldPolicy, JointSpec, LawSpec, ResponseSpec};
use firmware::units::Micros;
use hal_sim::body::{Body, Drive, Finger, FingerSpec, Pulse};
use host_core::session::LawName;
use methods::control::twist::Discretization;
use methods::control::{AddOns, Form};

/// Excess of the reference over the finger's reach in the rows, °.
const EXCESS_DEG: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 40.0];
/// Time that the reference spends beyond the reach in the columns, ms.
const BEYOND_MS: [u32; 7] = [250, 500, 1000, 2000, 4000, 8000, 16_000];
/// Strength of the flexor, as a share of participant P's.
const STRENGTH: f64 = 0.6;
/// Angle before and after, °.
const LOW_DEG: f64 = 20.0;
/// Time at [`LOW_DEG`] before, and longest time observed after, ms.
const BEFORE_MS: u32 = 10_000;
const AFTER_MS: u32 = 20_000;
/// Movement that counts as the beginning of the return, °.
const MOVED_DEG: f64 = 2.0;

const CLASSES: [Class; 7] = [
    Class::new('.', 0.2, "up to 0.2 s", 0),
    Class::new('1', 0.3, "up to 0.3 s", 0),
    Class::new('2', 0.5, "up to 0.5 s", 0),
    Class::new('3', 1.0, "up to 1 s", 1),
    Class::new('5', 3.0, "up to 3 s", 1),
    Class::new('8', 20.0, "up to 20 s", 1),
    Class::new('!', f64::INFINITY, "not within 20 s", 1),
];

/// A controller of a panel.
#[derive(Clone)]
enum Contender {
    /// The default controller, by the code of the device, with a correct wearer file.
    Default,
    /// A control law in floating point, and whether it has anti-windup.
    Floating(Candidate, bool),
}

/// Declares the map; the seed is not used.
pub fn declare(_seed: u64) -> Declaration {
    let contenders = contenders();
    let panel = |(name, _): &(String, Contender)| Panel::blank(name.clone());
    let map = Map {
        name: "saturation",
        title: "Saturation with and without anti-windup: how late the finger returns",
        across: Axis::new("time beyond the reach", "s", &BEYOND_MS, |ms| {
            format!("{}", f64::from(*ms) * 1e-3)
        }),
        down: Axis::new("excess", "°", &EXCESS_DEG, f64::to_string),
        quantity: "time from the return of the reference until the finger has moved 2° back, s",
        classes: &CLASSES,
        panels: contenders.iter().map(panel).collect(),
        layout: Layout::Beside(2),
        theory: "lag of the finger, plus without anti-windup (v0 + G(e) T − P(d) − 1)/G(d), where \
                 v0 is the effort that holds 20°, G(e) the growth of the integral at an error e, \
                 P(e) the rest of the effort, e the excess, T the time beyond, and d the reach \
                 minus 20°.",
        notes: vec![format!(
            "Finger of participant P with {STRENGTH} of the flexor's torque, one point, sensor \
             without noise; it holds {LOW_DEG}° for 10 s, is asked for an angle that exceeds its \
             reach of {:.1}°, then for {LOW_DEG}° again. The device's default controller has a correct \
             wearer file; the other control laws are in floating point, with the device's default \
             gains. The paper's controller has no anti-windup. The lag of the finger is its \
             delay, half a pulse period and the muscle's lag, {:.2} s; assumed: the integral \
             begins to grow at once.",
            reach_deg(),
            lag_s()
        )],
    };
    Declaration {
        map,
        simulate: Box::new(move |at| {
            let (_, contender) = &contenders[at.panel];
            cell(contender, EXCESS_DEG[at.row], BEYOND_MS[at.column])
        }),
    }
}

fn contenders() -> Vec<(String, Contender)> {
    let mut all = vec![(LawName::Recommended.title().to_owned(), Contender::Default)];
    for (name, candidate) in laws() {
        for (has, words) in [(true, "with"), (false, "without")] {
            let title = format!("{name}, {words} anti-windup");
            all.push((title, Contender::Floating(candidate.clone(), has)));
        }
    }
    all
}

/// Returns the control laws in floating point with the default gains of the device.
fn laws() -> [(&'static str, Candidate); 3] {
    let candidate = |form, law: LawSpec, values: &[(&str, f64)]| {
        let cutoff = ("cutoff_hz", f64::from(law.default_cutoff_mhz()) * 1e-3);
        let values = values.iter().copied().chain([cutoff]);
        Candidate {
            form,
            add_ons: AddOns::NONE,
            period_ms: law.default_period_ms().into(),
            extrapolation_ms: 0,
            values: values
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
        }
    };
    [
        (
            "super-twisting alone",
            candidate(
                Form::Twisting(Discretization::ProperImplicit),
                LawSpec::ALONE,
                &[
                    ("lambda_per_s", 10.0),
                    ("k1", 0.08),
                    ("k2_per_rad", 1.08),
                    ("b_rad_per_s2", 150.0),
                ],
            ),
        ),
        (
            LawName::Paper.title(),
            candidate(
                Form::Paper,
                LawSpec::PAPER,
                &[("lambda_per_s", 10.0), ("w_v_per_s", 1.0)],
            ),
        ),
        (
            LawName::Pid.title(),
            candidate(
                Form::Pid,
                LawSpec::PID,
                &[
                    ("kp_per_rad", 1.06),
                    ("ki_per_rad_s", 17.0),
                    ("kd_s_per_rad", 0.117),
                ],
            ),
        ),
    ]
}

fn finger() -> FingerSpec {
    let nominal = quiet_finger();
    FingerSpec {
        flexor_torque_nm: STRENGTH * nominal.flexor_torque_nm,
        ..nominal
    }
}

/// Returns the angle that full flexion holds, °.
fn reach_deg() -> f64 {
    let spec = finger();
    let [low, high] = spec.stops_deg;
    let spring = spec.stiffness_nm_per_rad.to_radians();
    let loss = spec.flexor_torque_nm * spec.torque_loss / (high - low);
    (spring * spec.rest_deg + spec.flexor_torque_nm + loss * low) / (spring + loss)
}

/// Returns the lag of the finger from effort to angle, s.
fn lag_s() -> f64 {
    let plant = Plant::new(&finger(), LOW_DEG);
    let delay_s = f64::from(finger().electromechanical_delay_us) * 1e-6;
    delay_s + 0.5 * super::finger::PULSE_PERIOD_US as f64 * 1e-6 + plant.lag_s()
}

fn driver(contender: &Contender) -> Box<dyn Driver> {
    match contender {
        Contender::Default => {
            let mut model = wearer::model(Points::One, LawSpec::RECOMMENDED.default_lead_ms());
            model.flexion_unm = (f64::from(model.flexion_unm) * STRENGTH) as u32;
            let law = LawSpec::RECOMMENDED.for_wearer(&model);
            let joint = JointSpec {
                wearer: Some(model),
                response: Some(ResponseSpec::RECOMMENDED.for_wearer(&model)),
                ..wearer::joint(law, Points::One, HoldPolicy::Hold)
            };
            Box::new(Device::new(&joint).expect("a valid joint"))
        }
        Contender::Floating(candidate, has_anti_windup) => {
            let known = KnownWearer::nominal(Points::One);
            let floating: Floating<f64> = candidate.driver_of(&known).expect("a valid law");
            Box::new(floating.with_anti_windup(*has_anti_windup))
        }
    }
}

fn cell(contender: &Contender, excess_deg: f64, beyond_ms: u32) -> Cell {
    let number = late_s(driver(contender), excess_deg, beyond_ms);
    let wound = match contender {
        Contender::Floating(candidate, false) => wound_s(candidate, excess_deg, beyond_ms),
        _ => 0.0,
    };
    Cell::with_prediction(&CLASSES, number, Some(lag_s() + wound))
}

/// Returns the time that theory predicts for the integral to shrink, s.
fn wound_s(candidate: &Candidate, excess_deg: f64, beyond_ms: u32) -> f64 {
    let at = |error_deg: f64| {
        let answer = candidate.feedback_at(error_deg.to_radians());
        answer.expect("a valid law")
    };
    let held = Plant::new(&finger(), LOW_DEG).effort();
    let back = at(reach_deg() - LOW_DEG);
    let wound = held + at(excess_deg).1 * f64::from(beyond_ms) * 1e-3 - back.0 - 1.0;
    (wound / back.1).max(0.0)
}

/// Simulates a trial, and returns the time from the return of the reference until the finger moves
/// back, s; infinite if it does not.
fn late_s(mut driver: Box<dyn Driver>, excess_deg: f64, beyond_ms: u32) -> f64 {
    let spec = finger();
    let sites = spec.sites();
    let mut finger = Finger::new(spec, 0).expect("a valid finger");
    let back_ms = BEFORE_MS + beyond_ms;
    let mut from_deg = f64::NAN;
    for ms in 0..back_ms + AFTER_MS {
        let t_us = u64::from(ms) * 1000;
        let now = Micros::new(ms * 1000);
        let reference = match (BEFORE_MS..back_ms).contains(&ms) {
            true => reach_deg() + excess_deg,
            false => LOW_DEG,
        };
        if ms.is_multiple_of(10) {
            driver.setpoint(now, now, reference);
        }
        driver.measurement(now, now, finger.sensed_deg());
        let volts = driver.tick(now);
        if t_us.is_multiple_of(super::finger::PULSE_PERIOD_US) {
            for (site, volts) in sites.iter().zip(volts).filter(|(_, volts)| *volts > 0.0) {
                finger.pulse(&Pulse {
                    t_us,
                    channel: site.channel,
                    drive: Drive::Volts(volts),
                    width_us: 200,
                    conducted: false,
                });
            }
        }
        finger.advance(t_us + 1000);
        let angle = finger.angle_deg();
        if ms + 1 == back_ms {
            from_deg = angle;
        }
        if ms >= back_ms && angle < from_deg - MOVED_DEG {
            return f64::from(ms + 1 - back_ms) * 1e-3;
        }
    }
    f64::INFINITY
}
