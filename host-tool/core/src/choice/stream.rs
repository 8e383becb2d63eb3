//! The worst courses that a live client may stream within its declared bounds.

use crate::session::{Bounds, Course, ForceCourse, Session};

/// Least time between the single bursts of a worst course, µs.
const APART_US: u64 = 2_000_000;

/// Returns the sessions with which a choice is tried: the file's own and, if it declares bounds for
/// a live client, one for each worst course within these bounds. A course applies to all streamed
/// channels at once. The courses are: constantly at the upper bound, which tires most; alternating
/// between the bounds as fast as allowed; single short bursts; a slow rise and fall; and constantly
/// low, where an error is large compared with the peak.
pub(super) fn trial_sessions(session: &Session, length_us: u64) -> Vec<Session> {
    let mut sessions = vec![session.clone()];
    if session.setpoints.bounds.is_empty() {
        return sessions;
    }
    for course in [
        high_course,
        swing_course,
        burst_course,
        slow_course,
        low_course,
    ] {
        sessions.push(with_courses(session, |bounds| course(bounds, length_us)));
    }
    sessions
}

/// Returns a copy of `session` in which the channels that a live client would control follow a
/// fixed course. `points` returns the course of a channel as pairs of time, µs, and value: force in mN,
/// or amplitude in thousandths of the channel's unit.
pub fn with_courses(
    session: &Session,
    mut points: impl FnMut(&Bounds) -> Vec<(u64, u32)>,
) -> Session {
    let mut session = session.clone();
    let setpoints = &mut session.setpoints;
    for bounds in setpoints.bounds.clone() {
        let channel = bounds.channel;
        let course = (channel, ForceCourse::Ramp(points(&bounds)));
        setpoints.beside.retain(|pair| pair.0 != channel);
        setpoints.forces.retain(|force| force.0 != channel);
        match &mut setpoints.course {
            Course::Amplitudes(values) => values.retain(|value| value.0 != channel),
            Course::Force(driven, _) if *driven == channel => setpoints.course = Course::KeepAlive,
            _ => {}
        }
        match bounds.is_force {
            true => setpoints.forces.push(course),
            false => setpoints.swings.push(course),
        }
    }
    if matches!(&setpoints.course, Course::Amplitudes(values) if values.is_empty()) {
        setpoints.course = Course::KeepAlive;
    }
    session
}

impl Bounds {
    /// Returns the shortest time in which a value may change from `from` to `to`, µs; 1 where a
    /// sudden change is allowed.
    #[must_use]
    pub fn shortest_change_us(&self, from: u32, to: u32) -> u64 {
        let way = u64::from(from.abs_diff(to)) * 1_000_000;
        self.per_s
            .map_or(1, |per_s| (way / u64::from(per_s.max(1))).max(1))
    }

    /// Returns a course from the lower bound through these values, until `length_us`. Each value is
    /// kept for the time that is given with it, µs. The result has pairs of time, µs, and value.
    pub fn course_through(
        &self,
        values: impl IntoIterator<Item = (u32, u64)>,
        length_us: u64,
    ) -> Vec<(u64, u32)> {
        let mut points = vec![(0, self.least)];
        let (mut at_us, mut last) = (0, self.least);
        for (value, stay_us) in values {
            if at_us >= length_us {
                break;
            }
            at_us += self.shortest_change_us(last, value);
            points.push((at_us, value));
            at_us += stay_us.max(1);
            points.push((at_us, value));
            last = value;
        }
        points
    }
}

fn high_course(bounds: &Bounds, length_us: u64) -> Vec<(u64, u32)> {
    bounds.course_through([(bounds.most, length_us)], length_us)
}

fn low_course(bounds: &Bounds, length_us: u64) -> Vec<(u64, u32)> {
    let low = bounds.least + (bounds.most - bounds.least).div_ceil(5);
    bounds.course_through([(low, length_us)], length_us)
}

fn swing_course(bounds: &Bounds, length_us: u64) -> Vec<(u64, u32)> {
    let ends = [bounds.most, bounds.least].map(|end| (end, bounds.shortest_us));
    bounds.course_through(ends.into_iter().cycle(), length_us)
}

fn burst_course(bounds: &Bounds, length_us: u64) -> Vec<(u64, u32)> {
    let apart_us = bounds.shortest_us.max(APART_US);
    let burst = [(bounds.most, bounds.shortest_us), (bounds.least, apart_us)];
    bounds.course_through(burst.into_iter().cycle(), length_us)
}

fn slow_course(bounds: &Bounds, length_us: u64) -> Vec<(u64, u32)> {
    let middle = (length_us / 2).max(2);
    vec![
        (0, bounds.least),
        (middle, bounds.most),
        (2 * middle, bounds.least),
    ]
}
