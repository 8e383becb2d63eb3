//! Reads forces at the hand over time, and checks with the firmware's arm whether it can exert
//! them.

use firmware::control::{Endpoint, EndpointState, ForceImpossible, WrenchError};
use firmware::range::Range;
use firmware::units::Micros;

use super::super::limb::SessionLimb;
use super::Course;
use super::times::read_time;
use crate::fields::error::Problem;
use crate::fields::table::Table;
use crate::wearer::read_triple;

/// Forces at the hand as (time in µs, force in mN). The components are backward, to the right and
/// upward. The first time is 0, the force changes linearly between the entries, and the last force
/// stays.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WrenchCourse(pub Vec<(u64, [i32; 3])>);

impl WrenchCourse {
    /// Returns the wanted force at the hand `t_us` after the start, mN.
    #[must_use]
    pub fn at(&self, t_us: u64) -> [i32; 3] {
        let next = self.0.partition_point(|&(at_us, _)| at_us <= t_us);
        let Some(&(from_us, from)) = self.0.get(next.saturating_sub(1)) else {
            return [0; 3];
        };
        let Some(&(to_us, to)) = self.0.get(next) else {
            return from;
        };
        let part = (t_us - from_us) as f64 / (to_us - from_us) as f64;
        let mut force = from;
        for (value, to) in force.iter_mut().zip(to) {
            *value += (part * f64::from(to - *value)).round() as i32; // both within ±1e6
        }
        force
    }
}

/// Largest number of forces that are checked between two points.
const TRIED: u64 = 2_000;

/// Reads `points`. If the file fixes the arm's posture, reports each point at which, or before
/// which, the arm cannot exert the wanted force, with the largest part of the force that it can
/// exert.
pub(super) fn read_wrenches(
    t: &Table<'_>,
    limb: Option<&SessionLimb>,
    rate_hz: Option<f64>,
) -> Option<Course> {
    let mut points: Vec<(u64, [i32; 3])> = Vec::new();
    // The points after one with an error cannot be judged.
    let items = t
        .tables("points")
        .iter()
        .take_while(|table| table.is_valid());
    let items: Vec<&Table<'_>> = items.collect();
    for item in &items {
        let at_us = read_time(item, points.last().map(|&(at_us, _)| at_us), "point")?;
        let force_mn = read_triple(item, "force_n")?;
        let Range { min, max, .. } = Endpoint::FORCE_MN;
        if !force_mn.iter().all(|mn| (min..=max).contains(mn)) {
            return None; // reported with its range
        }
        points.push((at_us, force_mn));
    }
    let course = WrenchCourse(points);
    let fixed = limb.filter(|limb| !limb.is_measured());
    if let Some(endpoint) = fixed.and_then(|limb| Endpoint::new(&limb.spec, &limb.lines).ok()) {
        check_reachable(&items, &course, &endpoint, rate_hz?);
    }
    Some(Course::Wrench(course))
}

fn check_reachable(items: &[&Table<'_>], course: &WrenchCourse, endpoint: &Endpoint, rate_hz: f64) {
    let mut before_us = 0;
    for (item, &(at_us, _)) in items.iter().zip(&course.0) {
        let setpoints = ((at_us - before_us) as f64 * rate_hz / 1e6).ceil() as u64;
        let count = setpoints.clamp(1, TRIED);
        let way_us = at_us - before_us;
        before_us = at_us;
        let times = (0..count).rev().map(|n| at_us - way_us * n / count);
        // The point itself is reported, or else the first time on the way to it.
        let wrong = |t_us: u64| Some((t_us, impossible_reason(endpoint, course.at(t_us))?));
        let found = wrong(at_us).or_else(|| times.into_iter().find_map(wrong));
        if let Some((t_us, why)) = found {
            let wanted = course.at(t_us);
            let (at_s, force) = (t_us as f64 / 1e6, newtons(wanted));
            item.report("force_n", problem(why, wanted, at_s, force));
        }
    }
}

/// Returns why the arm cannot exert this force in its fixed posture, or `None` if it can.
fn impossible_reason(endpoint: &Endpoint, force_mn: [i32; 3]) -> Option<ForceImpossible> {
    let (mut state, now) = (EndpointState::default(), Micros::new(0));
    match endpoint.accept_force(&mut state, now, now, force_mn) {
        Err(WrenchError::Unmade(why)) => Some(why),
        _ => None,
    }
}

fn problem(why: ForceImpossible, wanted: [i32; 3], at_s: f64, force: String) -> Problem {
    match why {
        ForceImpossible::TooStrong { channel, permille } => Problem::WrenchOutOfReach {
            at_s,
            force,
            channel: channel + 1, // at most 10
            percent: f64::from(permille) / 10.0,
            nearest: newtons(possible_part(wanted, permille)),
        },
        _ => Problem::NoMuscleHelps { at_s, force },
    }
}

/// Returns `permille` thousandths of a force at the hand, mN. With the value from the device's
/// refusal, this is the largest part of the force that the arm can exert.
#[must_use]
pub fn possible_part(force_mn: [i32; 3], permille: u16) -> [i32; 3] {
    force_mn.map(|mn| mn * i32::from(permille.min(1000)) / 1000) // within ±1e9
}

/// Formats a force at the hand in N, for example "[1, -2.5, 0] N".
#[must_use]
pub fn newtons(force_mn: [i32; 3]) -> String {
    let [x, y, z] = force_mn.map(|mn| f64::from(mn) / 1e3);
    format!("[{x}, {y}, {z}] N")
}
