//! Map of rise × delay for the finger under the whole device: where tracking fails because the
//! wearer's `rise_ms` limits how fast an amplitude may grow.
//!
//! Theory treats a rise as added delay: half of the time that it takes from threshold to maximum.

use super::{Axis, Cell, Class, Layout, Map, Panels};
use firmware::control::PointSpec;
use firmware::units::Amplitude;
use host_core::analysis::metrics_without_lag;
use host_core::run::{DeviceName, SessionFile, run};
use host_core::session::{BodySpec, LawName, Session};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Values of the wearer's `rise_ms` in the rows of the map.
const RISES_MS: [u16; 9] = [10, 20, 50, 100, 200, 500, 1_000, 2_000, 5_000];
/// Delays that are added to the finger's electromechanical delay, ms.
const DELAYS_MS: [u32; 5] = [0, 15, 30, 50, 80];
/// Length of a simulated trial, µs.
const TRIAL_US: u64 = 20_000_000;
/// Start and end of the judged part of a trial, µs: two periods of the sine.
const JUDGED_US: (u64, u64) = (10_000_000, 20_000_000);

const CLASSES: [Class; 7] = [
    Class::new('.', 0.1, "up to 0.1°", 0),
    Class::new('1', 0.5, "up to 0.5°", 0),
    Class::new('2', 1.0, "up to 1°", 0),
    Class::new('5', 5.0, "up to 5°", 1),
    Class::new('8', 20.0, "up to 20°", 1),
    Class::new('X', 90.0, "more than 20°", 1),
    Class::new('!', f64::INFINITY, "the device ended the session", 1),
];

/// Computes the map by simulating every cell; the seed is not used.
pub fn draw(_seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let sessions = sessions();
    let mut panels = Panels::new(sessions.len(), progress);
    let mut floors = Vec::new();
    for (law, session) in sessions {
        let part = range(&session);
        let late_ms = |rise_ms: u16| (0.5 * part * f64::from(rise_ms)).round() as u32;
        let at_once = rmse_without_rise(&session, RISES_MS.map(late_ms));
        let floor = |delay_ms: u32| at_once.get(&delay_ms).copied().unwrap_or(f64::NAN);
        let list = DELAYS_MS.map(|delay_ms| format!("{:.2}", floor(delay_ms)));
        floors.push(format!("{law} {}°", list.join(", ")));
        panels.add(
            law.to_owned(),
            &RISES_MS,
            &DELAYS_MS,
            |rise_ms, delay_ms| {
                let floor_deg = floor(*delay_ms);
                let number = rmse_deg(&session, Some(*rise_ms), *delay_ms) - floor_deg;
                let told = floor(delay_ms + late_ms(*rise_ms)) - floor_deg;
                Cell::with_prediction(&CLASSES, number.max(0.0), Some(told.max(0.0)))
            },
        );
    }
    Map {
        name: "rise",
        title: "Rise and delay: where tracking fails because amplitudes may not jump",
        across: Axis::new("added delay", "ms", &DELAYS_MS, u32::to_string),
        down: Axis::new("rise_ms", "ms", &RISES_MS, u16::to_string),
        quantity: "RMSE of the true angle minus that without a rise at the same delay",
        classes: &CLASSES,
        panels: panels.made,
        layout: Layout::Beside(2),
        theory: "from threshold to maximum, a rise takes rise_ms (max - threshold) / limit (the \
                 largest of the joint's points) and delays by half of that. Its error is that of \
                 a finger without a rise whose delay is longer by this time.",
        notes: vec![format!(
            "The whole device on the native backend: two points of participant P, whose finger \
             itself delays by 25 ms, follow 45 ± 40° at 0.2 Hz for 20 s, of which the last 10 are \
             scored. Sensor without noise. Limits are the largest voltages, 28, 36 and 26 V; \
             thresholds 20, 25 and 14 V. RMSE without a rise (`start` at the limit): {}.",
            floors.join("; ")
        )],
    }
}

/// Returns the sessions of the panels with their names: the default controller for a known wearer,
/// and the paper's controller.
fn sessions() -> [(&'static str, Session); 2] {
    let known = include_str!("../../../sessions/hamana_exp4_two_point_wearer.toml");
    let paper = include_str!("../../../sessions/hamana_exp4_two_point_finger.toml")
        .replace("law = \"recommended\"", "law = \"paper\"");
    [
        (LawName::Recommended.title(), known.to_owned()),
        (LawName::Paper.title(), paper),
    ]
    .map(|(law, text)| {
        let file = SessionFile::parse(law, &text).expect("a shipped session");
        (law, file.session)
    })
}

/// Returns the range from threshold to maximum as a fraction of the channel's limit, the largest
/// among the points of the joint.
fn range(session: &Session) -> f64 {
    let joint = session.joint.as_ref().expect("a joint");
    let points = joint.flexors.iter().chain([&joint.extensor]);
    let part = |point: &PointSpec| {
        let channels = session.channels.iter();
        let own = channels.filter(|channel| channel.index() == point.channel);
        let limit = own.map(|channel| channel.spec.limit.get()).next();
        let range = point.max.get() - point.threshold.get();
        f64::from(range) / limit.map_or(f64::NAN, f64::from)
    };
    points.map(part).fold(0.0, f64::max)
}

/// Returns the RMSE without a rise, °, by delay, ms. It covers the delays of the map, alone and
/// with each of `late_ms`, the delays by which theory replaces a rise.
fn rmse_without_rise(session: &Session, late_ms: [u32; RISES_MS.len()]) -> BTreeMap<u32, f64> {
    let mut delays: Vec<u32> = (late_ms.into_iter().chain([0]))
        .flat_map(|late_ms| DELAYS_MS.map(|delay_ms| delay_ms + late_ms))
        .collect();
    delays.sort_unstable();
    delays.dedup();
    let rmse = |delay_ms: u32| (delay_ms, rmse_deg(session, None, delay_ms));
    delays.into_par_iter().map(rmse).collect()
}

/// Returns the RMSE of the true angle, °, with amplitudes that rise from zero within `rise_ms`, or
/// without a rise; infinite if the device ended the session.
fn rmse_deg(session: &Session, rise_ms: Option<u16>, delay_ms: u32) -> f64 {
    let mut session = session.clone();
    session.duration_us = TRIAL_US;
    session.measure = Some(JUDGED_US);
    for channel in &mut session.channels {
        channel.spec.start = match rise_ms {
            Some(_) => Amplitude::ZERO,
            None => channel.spec.limit,
        };
    }
    session.wearer.rise_ms = rise_ms.unwrap_or(session.wearer.rise_ms);
    if let Some(BodySpec::Finger(finger)) = &mut session.body {
        finger.sensor_noise_deg = 0.0;
        finger.electromechanical_delay_us += 1_000 * delay_ms;
    }
    let file = SessionFile {
        name: "rise".to_owned(),
        text: String::new(),
        session,
    };
    let port = DeviceName::Native.open(&file.session, 1);
    let port = port.expect("the native simulator");
    let (outcome, _) = run(&file, port, None, |_: f64| ());
    if outcome.error.is_some() {
        return f64::INFINITY;
    }
    let metrics = metrics_without_lag(&outcome.trial).expect("a joint was measured");
    metrics.rmse_true_deg.expect("a simulated finger")
}
