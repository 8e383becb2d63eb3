//! Reads `[setpoints]` and asks the firmware whether it would take them.

use firmware::control::{Joint, JointState, SetpointError};
use firmware::units::{Amplitude, Angle, Micros};

use super::super::channel::Channel;
use super::super::error::{Problem, SessionError};
use super::super::joint::{find, not_under_force, read_amplitude};
use super::super::setup::SetupSpec;
use super::super::table::Table;
use super::{Course, ForceCourse, Setpoints, to_centi};

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
pub(in super::super) fn read_setpoints(
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
        Kind::KeepAlive | Kind::Amplitudes => &["kind", "rate_hz", "forces", "values"],
        Kind::AngleSine => &[
            "kind",
            "rate_hz",
            "offset_deg",
            "amplitude_deg",
            "frequency_hz",
            "forces",
            "values",
        ],
        Kind::AngleSteps => &["kind", "rate_hz", "steps", "forces", "values"],
        Kind::ForceRamp => &["kind", "rate_hz", "channel", "points", "forces", "values"],
        Kind::ForceSine => &[
            "kind",
            "rate_hz",
            "channel",
            "offset_n",
            "amplitude_n",
            "frequency_hz",
            "forces",
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
    let forces = read_further_forces(&t, channels, &course)?;
    Ok(Setpoints {
        rate_hz,
        course,
        forces,
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
    let channel = find_controlled(t, channels)?;
    Ok(Course::Force(channel.index(), read(t, channel)?))
}

/// Reads `forces`, of channels that the course does not drive: each a ramp or a
/// sine.
fn read_further_forces(
    t: &Table<'_>,
    channels: &[Channel],
    course: &Course,
) -> Result<Vec<(u8, ForceCourse)>, SessionError> {
    let mut taken = match course {
        Course::Force(channel, _) => 1u16 << channel, // 0–9
        _ => 0,
    };
    let mut forces = Vec::new();
    for item in t.tables("forces")?.or(Vec::new()) {
        let is_ramp = item.has("points");
        item.only(if is_ramp {
            &["channel", "points"]
        } else {
            &["channel", "offset_n", "amplitude_n", "frequency_hz"]
        })?;
        let channel = find_controlled(&item, channels)?;
        let bit = 1u16 << channel.index();
        if taken & bit != 0 {
            let (field, channel) = (item.path_of("channel"), channel.number);
            return Err(item.error("channel", Problem::ChannelTwice { field, channel }));
        }
        taken |= bit;
        let read = if is_ramp { read_ramp } else { read_force_sine };
        forces.push((channel.index(), read(&item, channel)?));
    }
    Ok(forces)
}

/// The channel that a force names; it must be under force control.
fn find_controlled<'a>(
    t: &Table<'_>,
    channels: &'a [Channel],
) -> Result<&'a Channel, SessionError> {
    let channel = find(t, "channel", channels)?;
    if channel.force.is_none() {
        let (field, channel) = (t.path_of("channel"), channel.number);
        return Err(t.error("channel", Problem::NoForceControl { field, channel }));
    }
    Ok(channel)
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
    let reach_mn = control.map_or((0, 0), |control| control.reach_mn());
    let (min_n, max_n) = (f64::from(reach_mn.0) / 1e3, f64::from(reach_mn.1) / 1e3);
    if (0.0..=max_n).contains(&newton) {
        return Ok(());
    }
    let problem = Problem::OutOfReach {
        field: t.path_of(name),
        given: newton.to_string(),
        channel: channel.number,
        min_n,
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
