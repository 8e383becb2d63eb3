//! Reads `[setpoints]` and checks with the firmware whether the device would accept them.

use firmware::control::{Joint, JointState, SetpointError};
use firmware::units::{Angle, Micros};

use super::super::channel::Channel;
use super::super::channels::Channels;
use super::super::program::Programs;
use super::super::setup::SetupSpec;
use super::pairs::{read_amplitudes, read_lists, read_stimuli};
use super::times::read_time;
use super::wrench::read_wrenches;
use super::{Bounds, Course, ForceCourse, Setpoints, to_centi};
use crate::fields::decimal::format_scaled;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Reads `[setpoints]` and checks the values against the setup. `has_joint` is whether the file has
/// a `[joint]`, with or without errors.
pub(in super::super) fn read_setpoints(
    t: &Table<'_>,
    setup: &SetupSpec,
    has_joint: bool,
    duration_us: u64,
) -> Option<Setpoints> {
    let rate_hz = t.real("rate_hz");
    let timeout_ms = setup.wearer.host_timeout_ms;
    if rate_hz.is_some_and(|hz| hz * f64::from(timeout_ms) <= 1000.0) {
        t.report("rate_hz", Problem::TooSlow { timeout_ms });
    }
    let values = t.has("values").then(|| read_amplitudes(t, setup));
    let course = read_course(t, setup, has_joint, duration_us);
    let forces = read_further_forces(t, &setup.channels, course.as_ref());
    let bounds = read_bounds(t, setup, duration_us);
    let lists = read_lists(t, setup, duration_us);
    let (course, values) = (course?, values.map_or(Some(Vec::new()), |values| values)?);
    let (course, beside) = match course {
        Course::Amplitudes(_) => (Course::Amplitudes(values), Vec::new()),
        course => (course, values),
    };
    let setpoints = Setpoints {
        rate_hz: rate_hz?,
        course,
        forces: forces?,
        beside,
        swings: Vec::new(),
        bounds: bounds?,
        lists: lists?,
        programs: Programs::default(),
    };
    for bounds in &setpoints.bounds {
        check_own(t, bounds, &setpoints);
    }
    check_lists(t, &setpoints);
    Some(setpoints)
}

/// Reports lists of pulses on a channel whose amplitude the file never raises above 0. The device
/// would output none of their pulses.
fn check_lists(t: &Table<'_>, setpoints: &Setpoints) {
    for item in t.tables("list").iter().filter(|item| item.is_valid()) {
        let channel: u8 = item.integer("channel");
        let mut values = t.tables("values").iter().filter(|item| item.is_valid());
        let has_values = values.any(|item| item.integer::<u8>("channel") == channel);
        let own = setpoints.extremes(channel.saturating_sub(1)); // at least 1
        // Values that were refused were already reported.
        if own.map_or(!has_values, |(_, most)| most == 0) {
            item.report("channel", Problem::NeverRises { channel });
        }
    }
}

/// Reports bounds if the file's own setpoints of the same channel go beyond them. A force may be
/// below the lower bound, because the file's forces start at rest.
fn check_own(t: &Table<'_>, bounds: &Bounds, setpoints: &Setpoints) {
    let is_it = |item: &&Table<'_>| item.integer::<u8>("channel") == bounds.channel + 1; // at most 10
    let own = setpoints.extremes(bounds.channel);
    let (Some(item), Some((least, most))) = (t.tables("bounds").iter().find(is_it), own) else {
        return;
    };
    let milli = |value: u32| format_scaled(value.into(), 3);
    if least < bounds.least && !bounds.is_force {
        let reach = format!("down to {}", milli(least));
        item.report("least", Problem::OutsideBounds { reach });
    }
    if most > bounds.most {
        let reach = format!("up to {}", milli(most));
        item.report("most", Problem::OutsideBounds { reach });
    }
}

/// Reads the course of the main setpoint, according to `kind`. For constant amplitudes it returns
/// an empty list, which the caller fills.
fn read_course(
    t: &Table<'_>,
    setup: &SetupSpec,
    has_joint: bool,
    duration_us: u64,
) -> Option<Course> {
    let kind = t.word("kind");
    let joint = setup.joint.as_ref().and_then(|spec| Joint::new(spec).ok());
    match kind {
        "keep-alive" => Some(Course::KeepAlive),
        "amplitudes" => Some(Course::Amplitudes(Vec::new())),
        "amplitude-ramp" | "amplitude-steps" => read_stimuli(t, setup, kind == "amplitude-steps"),
        "angle-sine" | "angle-steps" if !has_joint => {
            let wanted = "an angle";
            t.report("kind", Problem::NoJoint { wanted });
            None
        }
        "angle-sine" => read_sine(t, &joint?),
        "angle-steps" => read_steps(t, &joint?),
        "held" => read_held(t, setup, duration_us),
        "endpoint-force" => read_wrenches(t, setup.limb.as_ref(), t.real("rate_hz")),
        "force-ramp" | "force-sine" => {
            let channel = find_controlled(t, &setup.channels)?;
            let course = match kind {
                "force-ramp" => read_ramp(t, channel)?,
                _ => read_force_sine(t, channel)?,
            };
            Some(Course::Force(channel.index(), course))
        }
        _ => None,
    }
}

/// Reads the times from which an object is held or not held. Reports an object that is held for
/// longer than `longest_hold_s` of a joint.
fn read_held(t: &Table<'_>, setup: &SetupSpec, duration_us: u64) -> Option<Course> {
    if !setup.has_modulation {
        t.report("kind", Problem::NothingModulated {});
    }
    let mut points: Vec<(u64, bool)> = Vec::new();
    // The points after one with an error cannot be judged.
    let items = t
        .tables("points")
        .iter()
        .take_while(|table| table.is_valid());
    let items: Vec<&Table<'_>> = items.collect();
    for item in &items {
        let at_us = read_time(item, points.last().map(|&(at_us, _)| at_us), "point")?;
        points.push((at_us, item.flag("held")));
    }
    let joints = setup.modulations.iter();
    let longest_ms = joints.map(|joint| joint.spec.max_hold_ms).min();
    let mut grabbed: Option<(u64, &Table<'_>)> = None;
    let end = (duration_us, false);
    let ends = points
        .iter()
        .chain([&end])
        .zip(items.iter().map(Some).chain([None]));
    for (&(at_us, is_held), item) in ends {
        if let (Some((from_us, at)), Some(ms), false) = (grabbed, longest_ms, is_held)
            && at_us.saturating_sub(from_us) > u64::from(ms) * 1000
        {
            let most_s = f64::from(ms) / 1e3;
            at.report("held", Problem::HeldForTooLong { most_s });
        }
        grabbed = match (is_held, item) {
            (true, Some(item)) => grabbed.or(Some((at_us, *item))),
            _ => None,
        };
    }
    Some(Course::Held(points))
}

/// Reads `forces`, each a ramp or a sine of force on a channel that `course` does not drive.
fn read_further_forces(
    t: &Table<'_>,
    channels: &Channels,
    course: Option<&Course>,
) -> Option<Vec<(u8, ForceCourse)>> {
    let mut taken = match course {
        Some(Course::Force(channel, _)) => 1u16 << channel, // 0–9
        _ => 0,
    };
    let mut forces = Vec::new();
    for item in t.tables("forces").iter().filter(|item| item.is_valid()) {
        let Some(channel) = find_controlled(item, channels) else {
            continue;
        };
        let bit = 1u16 << channel.index();
        if taken & bit != 0 {
            let channel = channel.number;
            item.report("channel", Problem::ChannelTwice { channel });
        }
        taken |= bit;
        let course = match item.has("points") {
            true => read_ramp(item, channel),
            false => read_force_sine(item, channel),
        };
        forces.extend(course.map(|course| (channel.index(), course)));
    }
    Some(forces)
}

/// Returns the channel that the table `t` names. Reports a channel without force control.
fn find_controlled<'c>(t: &Table<'_>, channels: &'c Channels) -> Option<&'c Channel> {
    let channel = channels.find(t, "channel")?;
    if channel.force.is_none() {
        let channel = channel.number;
        t.report("channel", Problem::NoForceControl { channel });
        return None;
    }
    Some(channel)
}

fn read_ramp(t: &Table<'_>, channel: &Channel) -> Option<ForceCourse> {
    let mut points: Vec<(u64, u32)> = Vec::new();
    // The points after one with an error cannot be judged.
    for item in t
        .tables("points")
        .iter()
        .take_while(|table| table.is_valid())
    {
        let at_us = read_time(item, points.last().map(|&(at_us, _)| at_us), "point")?;
        let mn = item.integer::<i64>("n");
        check_force(item, "n", channel, mn as f64 / 1e3)?;
        points.push((at_us, mn as u32)); // not negative, within reach
    }
    Some(ForceCourse::Ramp(points))
}

fn read_force_sine(t: &Table<'_>, channel: &Channel) -> Option<ForceCourse> {
    let (offset_n, amplitude_n) = (t.real("offset_n")?, t.real("amplitude_n")?);
    check_force(t, "offset_n", channel, offset_n)?;
    for extreme in [offset_n - amplitude_n, offset_n + amplitude_n] {
        check_force(t, "amplitude_n", channel, extreme)?;
    }
    Some(ForceCourse::Sine {
        offset_n,
        amplitude_n,
        frequency_hz: t.real("frequency_hz")?,
    })
}

/// Reads `bounds`, for channels that the host may drive. Reports bounds that contradict each other,
/// the channel's limits or the duration of the session.
fn read_bounds(t: &Table<'_>, setup: &SetupSpec, duration_us: u64) -> Option<Vec<Bounds>> {
    let mut channel_bounds: Vec<Bounds> = Vec::new();
    for item in t.tables("bounds").iter().filter(|item| item.is_valid()) {
        let Some(found) = setup.channels.find(item, "channel") else {
            continue;
        };
        let (channel, is_force) = (found.number, found.force.is_some());
        let bounds = Bounds {
            channel: found.index(),
            is_force,
            least: item.integer("least"),
            most: item.integer("most"),
            per_s: item.has("per_s").then(|| item.integer("per_s")),
            shortest_us: item.integer("shortest_s"),
        };
        let limit = found.spec.limit;
        if setup.controlled & 1 << bounds.channel != 0 && !is_force {
            item.report("channel", Problem::Controlled { channel });
        } else if channel_bounds
            .iter()
            .any(|item| item.channel == bounds.channel)
        {
            item.report("channel", Problem::ChannelTwice { channel });
        } else if bounds.most <= bounds.least {
            item.report_not_after("most", "`least`".into());
        } else if !is_force && i64::from(bounds.most) > i64::from(limit.get()) {
            found.report_above_limit(item, "most");
        } else if bounds.shortest_us > duration_us {
            item.report_out_of_range("shortest_s", "at most `duration_s`".into());
        } else if let Some(slowest) = bounds.slowest(duration_us).filter(|_| item.has("per_s")) {
            item.report_out_of_range("per_s", slowest);
        } else if !is_force
            || check_force(item, "most", found, f64::from(bounds.most) / 1e3).is_some()
        {
            channel_bounds.push(bounds);
        }
    }
    Some(channel_bounds)
}

impl Bounds {
    /// Returns the smallest allowed `per_s` as text if the given `per_s` is too small: if the
    /// setpoint could not go from `least` to `most` within `duration_us`. Otherwise returns `None`.
    fn slowest(&self, duration_us: u64) -> Option<String> {
        let least = f64::from(self.most - self.least) * 1e3 / duration_us as f64;
        let given = f64::from(self.per_s?) * 1e-3;
        (given < least)
            .then(|| format!("at least {least:.3}, to go from `least` to `most` in the session"))
    }
}

/// Reports a force that the device would refuse, as its own inverse muscle model decides. Returns
/// `None` if it reports one.
fn check_force(t: &Table<'_>, name: &str, channel: &Channel, newton: f64) -> Option<()> {
    // A channel that the device would refuse was already reported.
    let Some(control) = channel.force_control() else {
        return Some(());
    };
    let reach_mn = control.force_range_mn();
    let (min_n, max_n) = (f64::from(reach_mn.0) / 1e3, f64::from(reach_mn.1) / 1e3);
    if (0.0..=max_n).contains(&newton) {
        return Some(());
    }
    let problem = Problem::OutOfReach {
        newton,
        channel: channel.number,
        min_n,
        max_n,
    };
    t.report(name, problem);
    None
}

fn read_sine(t: &Table<'_>, joint: &Joint) -> Option<Course> {
    let (offset_deg, amplitude_deg) = (t.real("offset_deg")?, t.real("amplitude_deg")?);
    check_angle(t, "offset_deg", joint, offset_deg)?;
    for extreme in [offset_deg - amplitude_deg, offset_deg + amplitude_deg] {
        check_angle(t, "amplitude_deg", joint, extreme)?;
    }
    Some(Course::AngleSine {
        offset_deg,
        amplitude_deg,
        frequency_hz: t.real("frequency_hz")?,
    })
}

fn read_steps(t: &Table<'_>, joint: &Joint) -> Option<Course> {
    let mut steps: Vec<(u64, i16)> = Vec::new();
    for item in t.tables("steps").iter().filter(|item| item.is_valid()) {
        let at_us = read_time(item, steps.last().map(|&(at_us, _)| at_us), "step")?;
        let centideg: i16 = item.integer("deg");
        check_angle(item, "deg", joint, f64::from(centideg) / 100.0)?;
        steps.push((at_us, centideg));
    }
    Some(Course::AngleSteps(steps))
}

/// Reports an angle that the device would refuse, as the firmware's own joint decides. Returns
/// `None` if it reports one.
fn check_angle(t: &Table<'_>, name: &str, joint: &Joint, deg: f64) -> Option<()> {
    let centideg = to_centi(deg) as i16; // saturates
    let (state, now) = (&mut JointState::default(), Micros::new(0));
    match joint.accept_setpoint(state, now, now, Angle::from_centideg(centideg), None) {
        Err(SetpointError::OutOfRange { min_mdeg, max_mdeg }) => {
            let (min, max) = (f64::from(min_mdeg) / 1e3, f64::from(max_mdeg) / 1e3);
            let allowed = format!("values that keep the angle within the joint's {min}° to {max}°");
            t.report_out_of_range(name, allowed);
            None
        }
        // A new state refuses nothing else.
        _ => Some(()),
    }
}
