//! `[setpoints]`: what the host streams while the session runs.

use std::f64::consts::TAU;

use firmware::control::setpoint::ESTIMATED_RATE_MAX;
use firmware::control::{Joint, JointState, SetpointError};
use firmware::link::Request;
use firmware::units::{Amplitude, Angle, Micros};

use super::channel::Channel;
use super::error::{Problem, SessionError};
use super::joint::{find, not_under_force, read_amplitude};
use super::setup::SetupSpec;
use super::table::Table;

/// What the host streams, and how often.
#[derive(Clone, PartialEq, Debug)]
pub struct Setpoints {
    /// Setpoints per second; their distance is always shorter than the
    /// wearer's host silence.
    pub rate_hz: f64,
    /// Their values over time.
    pub course: Course,
    /// Constant amplitudes sent with every angle, for channels that no joint
    /// drives, by rising channel on the link (0–9).
    pub beside: Vec<(u8, Amplitude)>,
}

/// The course of setpoints over a session.
#[derive(Clone, PartialEq, Debug)]
pub enum Course {
    /// Nothing is wanted, the host only says that it is there: for a wall.
    KeepAlive,
    /// Constant amplitudes, by rising channel on the link (0–9).
    Amplitudes(Vec<(u8, Amplitude)>),
    /// offset + amplitude · sin(2π·frequency·t).
    AngleSine {
        /// °.
        offset_deg: f64,
        /// °.
        amplitude_deg: f64,
        /// Hz.
        frequency_hz: f64,
    },
    /// Angles in 0.01°, each from its µs on; the first begins at 0.
    AngleSteps(Vec<(u64, i16)>),
    /// Forces of one channel on the link (0–9).
    Force(u8, ForceCourse),
}

/// The course of a wanted force.
#[derive(Clone, PartialEq, Debug)]
pub enum ForceCourse {
    /// Forces in mN at µs, the first at 0, straight between them; the last one
    /// stays. More than 1000 N/s is a step, which nobody extrapolates.
    Ramp(Vec<(u64, u32)>),
    /// offset + amplitude · sin(2π·frequency·t).
    Sine {
        /// N.
        offset_n: f64,
        /// N.
        amplitude_n: f64,
        /// Hz.
        frequency_hz: f64,
    },
}

/// One setpoint.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Setpoint {
    /// For nobody.
    KeepAlive,
    /// For the joint.
    Angle {
        /// 0.01°.
        centideg: i16,
        /// 0.01 °/s; 0 between steps.
        centideg_per_s: i32,
    },
    /// For channels on the link (0–9), rising.
    Amplitudes(Vec<(u8, Amplitude)>),
    /// For a channel under force control.
    Force {
        /// On the link, 0–9.
        channel: u8,
        /// mN.
        millinewton: u32,
        /// mN/s.
        millinewton_per_s: i32,
    },
}

impl Setpoint {
    /// The request that carries it; an angle or a force is valid from `at`, or
    /// from its arrival.
    #[must_use]
    pub fn request(&self, at: Option<Micros>) -> Request {
        match self {
            Self::KeepAlive => Request::KeepAlive,
            &Self::Angle {
                centideg,
                centideg_per_s,
            } => Request::Angle {
                at,
                centideg,
                centideg_per_s: Some(centideg_per_s),
            },
            &Self::Force {
                channel,
                millinewton,
                millinewton_per_s,
            } => Request::Force {
                channel,
                at,
                millinewton,
                millinewton_per_s: Some(millinewton_per_s),
            },
            Self::Amplitudes(values) => Request::Amplitudes {
                mask: values
                    .iter()
                    .fold(0, |mask, (channel, _)| mask | 1 << channel),
                // At most ten channels.
                values: values.iter().map(|&(_, amplitude)| amplitude).collect(),
            },
        }
    }
}

impl Setpoints {
    /// What is wanted `t_us` after the start.
    #[must_use]
    pub fn at(&self, t_us: u64) -> Setpoint {
        match &self.course {
            Course::KeepAlive => Setpoint::KeepAlive,
            Course::Amplitudes(values) => Setpoint::Amplitudes(values.clone()),
            &Course::AngleSine {
                offset_deg,
                amplitude_deg,
                frequency_hz,
            } => {
                let turns = frequency_hz * (t_us as f64 / 1e6);
                let (sin, cos) = (TAU * turns.fract()).sin_cos();
                let rate = TAU * frequency_hz * amplitude_deg * cos;
                Setpoint::Angle {
                    centideg: to_centi(offset_deg + amplitude_deg * sin) as i16, // ±180°: checked
                    centideg_per_s: to_centi(rate) as i32,
                }
            }
            Course::AngleSteps(steps) => {
                let index = steps.partition_point(|&(at_us, _)| at_us <= t_us);
                let step = steps.get(index.saturating_sub(1));
                Setpoint::Angle {
                    centideg: step.map_or(0, |&(_, centideg)| centideg),
                    centideg_per_s: 0,
                }
            }
            Course::Force(channel, course) => {
                let (newton, newton_per_s) = course.at(t_us);
                Setpoint::Force {
                    channel: *channel,
                    millinewton: (newton * 1e3).round() as u32, // saturates
                    millinewton_per_s: (newton_per_s * 1e3).round() as i32,
                }
            }
        }
    }

    /// When setpoint `index` is due, µs after the start.
    #[must_use]
    pub fn due_us(&self, index: u64) -> u64 {
        (index as f64 * 1e6 / self.rate_hz).round() as u64
    }
}

impl ForceCourse {
    /// Force in N and its change in N/s, `t_us` after the start.
    fn at(&self, t_us: u64) -> (f64, f64) {
        match self {
            Self::Ramp(points) => {
                let next = points.partition_point(|&(at_us, _)| at_us <= t_us);
                let newton = |mn: u32| f64::from(mn) * 1e-3;
                let before = points.get(next.saturating_sub(1));
                let (Some(&(from_us, from)), to) = (before, points.get(next)) else {
                    return (0.0, 0.0); // there is a first point: checked
                };
                let slope = to.map_or(0.0, |&(to_us, to)| {
                    (newton(to) - newton(from)) * 1e6 / (to_us - from_us) as f64
                });
                let is_step = slope.abs() > f64::from(ESTIMATED_RATE_MAX);
                let force = newton(from) + slope * (t_us - from_us) as f64 * 1e-6;
                (force, if is_step { 0.0 } else { slope })
            }
            &Self::Sine {
                offset_n,
                amplitude_n,
                frequency_hz,
            } => {
                let turns = frequency_hz * (t_us as f64 / 1e6);
                let (sin, cos) = (TAU * turns.fract()).sin_cos();
                let rate = TAU * frequency_hz * amplitude_n * cos;
                (offset_n + amplitude_n * sin, rate)
            }
        }
    }
}

fn to_centi(value: f64) -> f64 {
    (value * 100.0).round()
}

#[derive(Clone, Copy)]
enum Kind {
    KeepAlive,
    Amplitudes,
    AngleSine,
    AngleSteps,
    ForceRamp,
    ForceSine,
}

/// Reads `[setpoints]` and checks what it asks for against the setup.
pub(super) fn read_setpoints(
    root: &Table<'_>,
    setup: &SetupSpec,
) -> Result<Setpoints, SessionError> {
    let t = root.table("setpoints")?.required()?;
    let kinds = [
        ("keep-alive", Kind::KeepAlive),
        ("amplitudes", Kind::Amplitudes),
        ("angle-sine", Kind::AngleSine),
        ("angle-steps", Kind::AngleSteps),
        ("force-ramp", Kind::ForceRamp),
        ("force-sine", Kind::ForceSine),
    ];
    let kind = t.choice("kind", &kinds)?.required()?;
    t.only(match kind {
        Kind::KeepAlive | Kind::Amplitudes => &["kind", "rate_hz", "values"],
        Kind::AngleSine => &[
            "kind",
            "rate_hz",
            "offset_deg",
            "amplitude_deg",
            "frequency_hz",
            "values",
        ],
        Kind::AngleSteps => &["kind", "rate_hz", "steps", "values"],
        Kind::ForceRamp => &["kind", "rate_hz", "channel", "points", "values"],
        Kind::ForceSine => &[
            "kind",
            "rate_hz",
            "channel",
            "offset_n",
            "amplitude_n",
            "frequency_hz",
            "values",
        ],
    })?;
    let host_timeout_ms = setup.wearer.host_timeout_ms;
    let channels = &setup.channels;
    let course = match (kind, &setup.joint) {
        (Kind::KeepAlive, _) => Course::KeepAlive,
        (Kind::Amplitudes, _) => Course::Amplitudes(read_amplitudes(&t, setup)?),
        (Kind::ForceRamp, _) => read_force(&t, channels, read_ramp)?,
        (Kind::ForceSine, _) => read_force(&t, channels, read_force_sine)?,
        (Kind::AngleSine, Some((_, joint))) => read_sine(&t, joint)?,
        (Kind::AngleSteps, Some((_, joint))) => read_steps(&t, joint)?,
        (_, None) => {
            let wanted = "an angle";
            return Err(t.error("kind", Problem::NoJoint { wanted }));
        }
    };
    let rate_hz = t.real("rate_hz")?.required()?;
    if !(1.0..=1000.0).contains(&rate_hz) {
        return Err(t.not_within("rate_hz", 1, 1000, 0));
    }
    if rate_hz * f64::from(host_timeout_ms) <= 1000.0 {
        let problem = Problem::TooSlow {
            field: t.path_of("rate_hz"),
            given: t.given("rate_hz"),
            timeout_ms: host_timeout_ms,
        };
        return Err(t.error("rate_hz", problem));
    }
    let beside = match course {
        Course::Amplitudes(_) => Vec::new(),
        _ if t.has("values") => read_amplitudes(&t, setup)?,
        _ => Vec::new(),
    };
    Ok(Setpoints {
        rate_hz,
        course,
        beside,
    })
}

fn read_amplitudes(t: &Table<'_>, setup: &SetupSpec) -> Result<Vec<(u8, Amplitude)>, SessionError> {
    let mut values: Vec<(u8, Amplitude)> = Vec::new();
    for item in t.tables("values")?.required()? {
        item.only(&["channel", "value"])?;
        let channel = find(&item, "channel", &setup.channels)?;
        let field = item.path_of("channel");
        if setup.controlled & 1 << channel.index() != 0 {
            let channel = channel.number;
            return Err(item.error("channel", Problem::Controlled { field, channel }));
        }
        not_under_force(&item, channel)?;
        if values.iter().any(|&(index, _)| index == channel.index()) {
            let channel = channel.number;
            return Err(item.error("channel", Problem::ChannelTwice { field, channel }));
        }
        values.push((channel.index(), read_amplitude(&item, "value", channel)?));
    }
    if values.is_empty() {
        return Err(t.out_of_range("values", "at least one channel's".into()));
    }
    values.sort_unstable_by_key(|&(index, _)| index);
    Ok(values)
}

/// Reads the force of the channel that the file names, by its kind's `read`.
fn read_force(
    t: &Table<'_>,
    channels: &[Channel],
    read: fn(&Table<'_>, &Channel) -> Result<ForceCourse, SessionError>,
) -> Result<Course, SessionError> {
    let channel = find(t, "channel", channels)?;
    if channel.force.is_none() {
        let (field, channel) = (t.path_of("channel"), channel.number);
        return Err(t.error("channel", Problem::NoForceControl { field, channel }));
    }
    Ok(Course::Force(channel.index(), read(t, channel)?))
}

fn read_ramp(t: &Table<'_>, channel: &Channel) -> Result<ForceCourse, SessionError> {
    let mut points: Vec<(u64, u32)> = Vec::new();
    for item in t.tables("points")?.required()? {
        item.only(&["at_s", "n"])?;
        let at_us = read_time(&item, points.last().map(|&(at_us, _)| at_us), "point")?;
        let mn = item.whole::<i64>("n", 3)?.required()?;
        check_force(&item, "n", channel, mn as f64 / 1e3)?;
        points.push((at_us, mn as u32)); // not negative, within reach
    }
    if points.is_empty() {
        return Err(t.out_of_range("points", "at least one".into()));
    }
    Ok(ForceCourse::Ramp(points))
}

fn read_force_sine(t: &Table<'_>, channel: &Channel) -> Result<ForceCourse, SessionError> {
    let offset_n = t.real("offset_n")?.required()?;
    let amplitude_n = t.real("amplitude_n")?.required()?;
    check_force(t, "offset_n", channel, offset_n)?;
    for extreme in [offset_n - amplitude_n, offset_n + amplitude_n] {
        check_force(t, "amplitude_n", channel, extreme)?;
    }
    Ok(ForceCourse::Sine {
        offset_n,
        amplitude_n,
        frequency_hz: read_frequency(t)?,
    })
}

/// Asks the firmware's inverse whether it would take this force.
fn check_force(
    t: &Table<'_>,
    name: &str,
    channel: &Channel,
    newton: f64,
) -> Result<(), SessionError> {
    let control = channel.force_control();
    let most = control.map_or(0, |control| control.reach().1.to_millinewton());
    let max_n = f64::from(most) / 1e3;
    if (0.0..=max_n).contains(&newton) {
        return Ok(());
    }
    let problem = Problem::OutOfReach {
        field: t.path_of(name),
        given: newton.to_string(),
        channel: channel.number,
        max_n,
    };
    Err(t.error(name, problem))
}

/// Reads the `at_s` of the next of a list, in µs.
fn read_time(item: &Table<'_>, before: Option<u64>, what: &str) -> Result<u64, SessionError> {
    let at_us = item.within("at_s", 6, 0, i64::MAX)?.required()? as u64; // not negative
    match before {
        None if at_us != 0 => Err(item.out_of_range("at_s", "0 at first".into())),
        Some(before) if at_us <= before => {
            let problem = Problem::NotInOrder {
                field: item.path_of("at_s"),
                given: item.given("at_s"),
                after: format!("the {what} at {} s", before as f64 / 1e6),
            };
            Err(item.error("at_s", problem))
        }
        _ => Ok(at_us),
    }
}

/// Reads a sine's frequency. 180° at 10 Hz is 11 300 °/s, which the link's rates
/// hold.
fn read_frequency(t: &Table<'_>) -> Result<f64, SessionError> {
    let frequency_hz = t.real("frequency_hz")?.required()?;
    if !(0.0..=10.0).contains(&frequency_hz) {
        return Err(t.not_within("frequency_hz", 0, 10, 0));
    }
    Ok(frequency_hz)
}

fn read_sine(t: &Table<'_>, joint: &Joint) -> Result<Course, SessionError> {
    let offset_deg = t.real("offset_deg")?.required()?;
    let amplitude_deg = t.real("amplitude_deg")?.required()?;
    check_angle(t, "offset_deg", joint, offset_deg)?;
    for extreme in [offset_deg - amplitude_deg, offset_deg + amplitude_deg] {
        check_angle(t, "amplitude_deg", joint, extreme)?;
    }
    Ok(Course::AngleSine {
        offset_deg,
        amplitude_deg,
        frequency_hz: read_frequency(t)?,
    })
}

fn read_steps(t: &Table<'_>, joint: &Joint) -> Result<Course, SessionError> {
    let mut steps: Vec<(u64, i16)> = Vec::new();
    for item in t.tables("steps")?.required()? {
        item.only(&["at_s", "deg"])?;
        let at_us = read_time(&item, steps.last().map(|&(at_us, _)| at_us), "step")?;
        let centideg: i16 = item.whole("deg", 2)?.required()?;
        check_angle(&item, "deg", joint, f64::from(centideg) / 100.0)?;
        steps.push((at_us, centideg));
    }
    if steps.is_empty() {
        return Err(t.out_of_range("steps", "at least one".into()));
    }
    Ok(Course::AngleSteps(steps))
}

/// Asks the firmware's joint whether it would take this angle.
fn check_angle(t: &Table<'_>, name: &str, joint: &Joint, deg: f64) -> Result<(), SessionError> {
    let centideg = to_centi(deg) as i16; // saturates
    let (state, now) = (&mut JointState::default(), Micros(0));
    match joint.setpoint(state, now, now, Angle::from_centideg(centideg), None) {
        Err(SetpointError::OutOfRange { min_mdeg, max_mdeg }) => {
            let (min, max) = (f64::from(min_mdeg) / 1e3, f64::from(max_mdeg) / 1e3);
            let allowed = format!("what keeps the angle in the joint's {min}° to {max}°");
            Err(t.out_of_range(name, allowed))
        }
        // A fresh state refuses nothing else.
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angle(setpoints: &Setpoints, t_us: u64) -> (i16, i32) {
        match setpoints.at(t_us) {
            Setpoint::Angle {
                centideg,
                centideg_per_s,
            } => (centideg, centideg_per_s),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_sine_turns_where_it_should() {
        let sine = Setpoints {
            rate_hz: 90.0,
            course: Course::AngleSine {
                offset_deg: 45.0,
                amplitude_deg: 40.0,
                frequency_hz: 0.2,
            },
            beside: Vec::new(),
        };
        // 2π · 0.2 Hz · 40° = 50.27 °/s.
        assert_eq!(angle(&sine, 0), (4500, 5027));
        assert_eq!(angle(&sine, 1_250_000), (8500, 0));
        assert_eq!(angle(&sine, 2_500_000), (4500, -5027));
        assert_eq!(angle(&sine, 3_750_000), (500, 0));
        assert_eq!(angle(&sine, 3_600_000_000), (4500, 5027));
        assert_eq!(sine.due_us(1), 11_111);
        assert_eq!(sine.due_us(90), 1_000_000);
    }

    #[test]
    fn a_step_holds_from_its_microsecond() {
        let steps = Setpoints {
            rate_hz: 90.0,
            course: Course::AngleSteps(vec![(0, 1000), (500_000, 6000)]),
            beside: Vec::new(),
        };
        assert_eq!(angle(&steps, 0), (1000, 0));
        assert_eq!(angle(&steps, 499_999), (1000, 0));
        assert_eq!(angle(&steps, 500_000), (6000, 0));
        assert_eq!(angle(&steps, u64::MAX), (6000, 0));
    }

    #[test]
    fn amplitudes_name_their_channels() {
        let values = vec![(1, Amplitude(26_000)), (4, Amplitude(0))];
        match Setpoint::Amplitudes(values).request(None) {
            Request::Amplitudes { mask, values } => {
                assert_eq!(mask, 0b10010);
                assert_eq!(values, [Amplitude(26_000), Amplitude(0)]);
            }
            other => panic!("{other:?}"),
        }
    }
}
