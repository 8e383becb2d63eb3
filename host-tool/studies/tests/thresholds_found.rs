//! Measures the default if each flexor point's threshold were found before the start: pairs whose
//! thresholds differ cause most of its error.

use firmware::control::{JointSpec, PointSpec};
use firmware::units::{Amplitude, Micros};
use hal_sim::body::wearer::Site;
use rayon::prelude::*;
use std::collections::BTreeMap;
use studies::tracking::default;
use studies::tracking::driver::{Device, Driver};
use studies::tracking::exercise::{Exercise, Outcome, RIPPLE_DEG, Wearers};
use studies::tracking::plant::Plant;
use studies::tracking::statistics::{mean, percentile};
use studies::tracking::target::Course;
use studies::tracking::trial::run;
use studies::tracking::wearer::{self, Points, Volts};

const WEARERS: u64 = 200;
/// Seed of the wearers; development used 1001, 1002, 1539 and 1540.
const SEED: u64 = 1;
/// Largest unreachable part of the time that counts as in reach, as in the chart.
const WHOLLY: f64 = 0.005;

/// Rise of each ramp per second, as a part of the wearer's maximum, and its start as a part of the
/// point's threshold in the file.
const RAMP_PER_S: f64 = 0.1;
const RAMP_FROM: f64 = 0.9;
/// Flexion that counts as movement, degrees.
const MOVED_DEG: f64 = 2.0;
/// Overshoot of a threshold because of delay, muscle, friction and filter, as a part of the file's
/// threshold.
const OVERSHOOT: f64 = 0.04;
/// Time before a ramp, and after it until the finger has returned, ms.
const QUIET_MS: u32 = 300;
const BACK_MS: u32 = 400;

/// Ramps each of two flexor points alone until the finger moves, then arms the device's joint with
/// both thresholds shifted by the results. It uses only what a host has: an amplitude for a
/// channel, and the angle.
struct SearchingDriver {
    spec: JointSpec,
    joint: Option<Device>,
    point: usize,
    ms: u32,
    is_back: bool,
    measured: Option<f64>,
    filtered: f64,
    before: f64,
    /// Found threshold divided by the file's, minus [`OVERSHOOT`].
    moved: [f64; 2],
}

impl SearchingDriver {
    fn new(spec: JointSpec) -> Self {
        Self {
            spec,
            joint: None,
            point: 0,
            ms: 0,
            is_back: false,
            measured: None,
            filtered: 0.0,
            before: 0.0,
            moved: [1.0; 2],
        }
    }

    /// Builds the joint with the found thresholds; no amplitude exceeds the file's maximum.
    fn arm(&self) -> Device {
        let mut spec = self.spec.clone();
        for (point, moved) in spec.flexors.iter_mut().zip(self.moved) {
            let PointSpec { threshold, max, .. } = *point;
            let threshold = f64::from(threshold.get()) * moved;
            point.threshold = Amplitude::new(threshold.min(0.97 * f64::from(max.get())) as u32);
        }
        Device::new(&spec).unwrap()
    }

    fn ramp(&mut self, measured: f64) -> Volts {
        let file = wearer::nominal();
        let site = [file.flexor_a, file.flexor_b][self.point];
        self.filtered += (measured - self.filtered) / 32.0;
        self.ms += 1;
        let Some(ms) = self.ms.checked_sub(QUIET_MS).filter(|_| !self.is_back) else {
            self.before = self.filtered;
            if self.is_back && self.ms > BACK_MS {
                (self.is_back, self.ms, self.point) = (false, QUIET_MS / 2, self.point + 1);
            }
            return [0.0; 3];
        };
        let rise = RAMP_PER_S * site.max_v * f64::from(ms) / 1000.0;
        let volts = (RAMP_FROM * site.threshold_v + rise).min(site.max_v);
        if self.filtered - self.before > MOVED_DEG || volts >= site.max_v {
            let moved = volts / site.threshold_v - OVERSHOOT;
            self.moved[self.point] = moved.clamp(0.93, 1.22);
            (self.is_back, self.ms) = (true, 0);
        }
        let mut all = [0.0; 3];
        all[self.point] = volts;
        all
    }
}

impl Driver for SearchingDriver {
    fn setpoint(&mut self, now: Micros, at: Micros, degrees: f64) {
        if let Some(joint) = &mut self.joint {
            joint.setpoint(now, at, degrees);
        }
    }

    fn measurement(&mut self, now: Micros, at: Micros, degrees: f64) {
        if self.measured.replace(degrees).is_none() {
            self.filtered = degrees;
        }
        if let Some(joint) = &mut self.joint {
            joint.measurement(now, at, degrees);
        }
    }

    fn tick(&mut self, now: Micros) -> Volts {
        match (&mut self.joint, self.measured) {
            (Some(joint), _) => joint.tick(now),
            (None, Some(measured)) if self.point < 2 => self.ramp(measured),
            (None, Some(_)) => {
                self.joint = Some(self.arm());
                [0.0; 3]
            }
            (None, None) => [0.0; 3],
        }
    }

    fn refused(&self) -> Option<&str> {
        self.joint.as_ref().and_then(Driver::refused)
    }
}

/// The default's parameters searched again for two points alone: 300 steps of hill climbing from
/// the shipped ones, on the first 32 earlier wearers of seed 1539, without found thresholds.
const TWO_POINT: [(&str, f64); 13] = [
    ("lambda_per_s", 7.760),
    ("kd_s_per_rad", 0.134),
    ("ki_per_rad_s", 5.101),
    ("k1", 0.068),
    ("k2_per_rad", 0.026),
    ("cutoff_hz", 4.564),
    ("feed_forward_lead_s", 0.239),
    ("smith_gain_rad", 0.479),
    ("smith_muscle_s", 0.067),
    ("smith_joint_s", 0.121),
    ("smith_delay_s", 0.061),
    ("adapt_scale_per_rad_s", 30.526),
    ("adapt_damping_per_rad2", 0.133),
];

/// A driver and its wearers.
#[derive(Clone, Copy)]
struct Row<'a> {
    name: &'static str,
    numbers: &'a BTreeMap<String, f64>,
    is_searching: bool,
    alter: fn(&mut Plant),
}

struct SearchCounts {
    reaching: Vec<f64>,
    all: Vec<f64>,
    failed: usize,
    refused: usize,
    restless: usize,
}

fn attempt(row: &Row<'_>, wearers: Wearers, index: u64) -> (f64, Outcome) {
    let course = wearers.course(Course::Sine, SEED, index);
    let mut plant = wearers.plant(SEED, index);
    (row.alter)(&mut plant);
    let exercise = Exercise::new(plant, Points::Two, course).unwrap();
    let spec = default::joint(row.numbers, Points::Two);
    let mut driver: Box<dyn Driver> = if row.is_searching {
        Box::new(SearchingDriver::new(spec))
    } else {
        Box::new(Device::new(&spec).unwrap())
    };
    let attempt = run(&exercise.plant, &mut *driver, &exercise.wanted).unwrap();
    (exercise.reachable.unreachable, exercise.judge(attempt))
}

fn told(row: &Row<'_>, wearers: Wearers) -> SearchCounts {
    let outcomes = (0..WEARERS).into_par_iter();
    let outcomes: Vec<_> = outcomes.map(|n| attempt(row, wearers, n)).collect();
    let tracked = || outcomes.iter().filter(|(_, o)| o.refused.is_none());
    let restless = |o: &Outcome| o.ripple.is_some_and(|r| r.rms_deg > RIPPLE_DEG);
    let reaching = tracked().filter(|(unreachable, _)| *unreachable < WHOLLY);
    SearchCounts {
        reaching: reaching.map(|(_, o)| o.rmse).collect(),
        all: tracked().map(|(_, o)| o.rmse).collect(),
        failed: outcomes.iter().filter(|(_, o)| o.has_failed()).count(),
        refused: outcomes.len() - tracked().count(),
        restless: tracked().filter(|(_, o)| restless(o)).count(),
    }
}

/// Prints a row; returns the mean RMSE in reach of the earlier wearers and of the widened ones.
fn print(row: &Row<'_>) -> (f64, f64) {
    let [earlier, widened] = [Wearers::Earlier, Wearers::Widened].map(|w| told(row, w));
    println!(
        "{:38}{:5.2}°{:5.2}° in reach{:6.2}°{:6.2}° widened, {} fail, {} refused, {} restless",
        row.name,
        mean(&earlier.reaching),
        percentile(&earlier.reaching, 0.95),
        mean(&widened.all),
        percentile(&widened.all, 0.95),
        widened.failed,
        widened.refused,
        widened.restless
    );
    (mean(&earlier.reaching), mean(&widened.all))
}

/// Shifts B from the file by the same factor as A.
fn move_alike(plant: &mut Plant) {
    let (file, finger) = (wearer::nominal(), &mut plant.finger.finger);
    let moved = finger.flexor_a.max_v / file.flexor_a.max_v;
    let b = Site {
        max_v: file.flexor_b.max_v * moved,
        threshold_v: file.flexor_b.threshold_v * moved,
        ..finger.flexor_b
    };
    finger.place_flexors([finger.flexor_a, b]);
}

fn delay_as_nominal(plant: &mut Plant) {
    plant.finger.finger.electromechanical_delay_us = wearer::nominal().electromechanical_delay_us;
}

/// Two-point; prints a table of its results.
#[test]
fn thresholds_found_first_help_two_points() {
    let shipped = default::shipped().into_iter();
    let shipped = shipped.map(|(name, x)| (name.to_owned(), x)).collect();
    let two = TWO_POINT.map(|(name, x)| (name.to_owned(), x)).into();
    let row = |name, numbers, is_searching, alter| Row {
        name,
        numbers,
        is_searching,
        alter,
    };
    let as_drawn: fn(&mut Plant) = |_| {};
    let both: fn(&mut Plant) = |plant| {
        move_alike(plant);
        delay_as_nominal(plant);
    };
    let rows = [
        row("default", &shipped, false, as_drawn),
        row("default, found", &shipped, true, as_drawn),
        row("two-point numbers", &two, false, as_drawn),
        row("two-point numbers, found", &two, true, as_drawn),
        row("  A and B moved alike", &two, false, move_alike),
        row("  delay as nominal", &two, false, delay_as_nominal),
        row("  both", &two, false, both),
    ];
    let [default, found, two, two_found, ..] = rows.map(|row| print(&row));
    assert!(found.0 < default.0 && found.1 < default.1);
    assert!(two_found.0 < two.0 && two_found.1 < two.1);
}
