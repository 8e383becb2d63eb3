//! Reads `[setpoints]` and asks the firmware whether it would take them.

use firmware::control::{Joint, JointState, SetpointError};
use firmware::device::channel_of;
use firmware::safety::{self, ListedPulse, PulseList, Stimulus};
use firmware::units::{Amplitude, Angle, Micros};

use super::super::channel::Channel;
use super::super::channels::Channels;
use super::super::fields::DAY_US;
use super::super::setup::SetupSpec;
use super::{Bounds, Course, ForceCourse, Setpoints, StimulusCourse, to_centi};
use crate::fields::decimal::in_units;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Reads `[setpoints]` and checks what it asks for against the setup.
pub(in super::super) fn read_setpoints(
    t: &Table<'_>,
    setup: &SetupSpec,
    has_joint: bool,
    duration_us: u64,
) -> Option<Setpoints> {
    let rate_hz = t.real("rate_hz");
    let timeout_ms = setup.wearer.host_timeout_ms;
    if rate_hz.is_some_and(|hz| hz * f64::from(timeout_ms) <= 1000.0) {
        t.say("rate_hz", Problem::TooSlow { timeout_ms });
    }
    let values = t.has("values").then(|| read_amplitudes(t, setup));
    let course = read_course(t, setup, has_joint);
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
    };
    for bounds in &setpoints.bounds {
        check_own(t, bounds, &setpoints);
    }
    Some(setpoints)
}

/// Tells of bounds that the file's own setpoints of that channel leave. A force comes
/// from rest: below the least it may be.
fn check_own(t: &Table<'_>, bounds: &Bounds, setpoints: &Setpoints) {
    let is_it = |item: &&Table<'_>| item.whole::<u8>("channel") == bounds.channel + 1; // at most 10
    let own = setpoints.extremes(bounds.channel);
    let (Some(item), Some((least, most))) = (t.tables("bounds").iter().find(is_it), own) else {
        return;
    };
    let milli = |value: u32| in_units(value.into(), 3);
    if least < bounds.least && !bounds.is_force {
        let reach = format!("down to {}", milli(least));
        item.say("least", Problem::OutsideBounds { reach });
    }
    if most > bounds.most {
        let reach = format!("up to {}", milli(most));
        item.say("most", Problem::OutsideBounds { reach });
    }
}

/// Reads what is streamed by its kind; amplitudes are the caller's.
fn read_course(t: &Table<'_>, setup: &SetupSpec, has_joint: bool) -> Option<Course> {
    let kind = t.word("kind");
    let joint = setup.joint.as_ref().and_then(|spec| Joint::new(spec).ok());
    match kind {
        "keep-alive" => Some(Course::KeepAlive),
        "amplitudes" => Some(Course::Amplitudes(Vec::new())),
        "amplitude-ramp" | "amplitude-steps" => read_stimuli(t, setup, kind == "amplitude-steps"),
        "angle-sine" | "angle-steps" if !has_joint => {
            let wanted = "an angle";
            t.say("kind", Problem::NoJoint { wanted });
            None
        }
        "angle-sine" => read_sine(t, &joint?),
        "angle-steps" => read_steps(t, &joint?),
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

/// Reads `values`: of channels that nothing else drives, by rising channel.
fn read_amplitudes(t: &Table<'_>, setup: &SetupSpec) -> Option<Vec<(u8, Stimulus)>> {
    let mut values: Vec<(u8, Stimulus)> = Vec::new();
    let driven = match t.word("kind") {
        "amplitude-ramp" | "amplitude-steps" => Some(t.whole::<u8>("channel")),
        _ => None,
    };
    for item in t.tables("values").iter().filter(|item| item.is_sound()) {
        let Some(found) = find_free(item, setup) else {
            continue;
        };
        let channel = found.number;
        if driven == Some(channel) || values.iter().any(|&(index, _)| index == found.index()) {
            item.say("channel", Problem::ChannelTwice { channel });
        } else if let Some(stimulus) = read_stimulus(item, found) {
            check_stimulus(item, found, setup, stimulus);
            values.push((found.index(), stimulus));
        }
    }
    values.sort_unstable_by_key(|&(index, _)| index);
    // The device wants every width or none.
    let is_live = |(index, _): &(u8, Stimulus)| {
        let mut channels = setup.channels.list.iter();
        channels.any(|it| it.index() == *index && it.has_live_width())
    };
    if !values.iter().any(is_live) {
        for (_, value) in &mut values {
            *value = Stimulus::own(value.amplitude);
        }
    }
    Some(values)
}

/// The channel that a setpoint of the host's may drive.
fn find_free<'s>(item: &Table<'_>, setup: &'s SetupSpec) -> Option<&'s Channel> {
    let found = setup.channels.find(item, "channel")?;
    let channel = found.number;
    if found.force.is_some() {
        item.say("channel", Problem::ForceControlled { channel });
    } else if setup.controlled & 1 << found.index() != 0 {
        item.say("channel", Problem::Controlled { channel });
    } else {
        return Some(found);
    }
    None
}

/// Reads `value` and `width_us`, the train's own if it says none.
fn read_stimulus(item: &Table<'_>, found: &Channel) -> Option<Stimulus> {
    let train = &found.spec.train;
    let amplitude = Amplitude::new(item.whole("value"));
    let width_us = match item.has("width_us") {
        true => item.whole("width_us"),
        false => train.width_us,
    };
    if amplitude > found.spec.limit {
        found.tell_above_limit(item, "value");
    } else if !found.has_live_width() && width_us != train.width_us {
        let (channel, own_us) = (found.number, train.width_us);
        item.say("width_us", Problem::FixedWidth { channel, own_us });
    } else if width_us > train.max_width_us.max(train.width_us) {
        let allowed = format!("up to the train's `max_width_us` of {}", train.max_width_us);
        item.out_of_range("width_us", allowed);
    } else {
        return Some(Stimulus {
            amplitude,
            width_us,
        });
    }
    None
}

/// Asks the firmware's channel whether it would take this amplitude at this width.
fn check_stimulus(item: &Table<'_>, found: &Channel, setup: &SetupSpec, stimulus: Stimulus) {
    let Some((channel, wearer)) = armed(found, setup) else {
        return; // told
    };
    let highest = channel.highest_at(stimulus.width_us, &wearer);
    if stimulus.width_us != 0 && stimulus.amplitude > highest {
        let problem = Problem::ChargeAtWidth {
            value: found.display(stimulus.amplitude),
            width_us: stimulus.width_us,
            most: found.display(highest),
            max_uc: in_units(wearer.spec().max_charge_nc.into(), 3),
        };
        item.say("value", problem);
    }
}

/// A channel as the device arms it.
fn armed(found: &Channel, setup: &SetupSpec) -> Option<(safety::Channel, safety::Wearer)> {
    let wearer = setup.wearer.validate().ok()?;
    let channel = channel_of(&found.spec, found.force.as_ref(), &wearer).ok()?;
    Some((channel, wearer))
}

/// Reads `channel` and `points`: amplitudes and widths over time.
fn read_stimuli(t: &Table<'_>, setup: &SetupSpec, is_held: bool) -> Option<Course> {
    let found = find_free(t, setup)?;
    let mut points: Vec<(u64, Stimulus)> = Vec::new();
    let items: Vec<_> = t
        .tables("points")
        .iter()
        .filter(|it| it.is_sound())
        .collect();
    for item in &items {
        let at_us = read_time(item, points.last().map(|&(at_us, _)| at_us), "point")?;
        points.push((at_us, read_stimulus(item, found)?));
    }
    let course = StimulusCourse {
        points,
        is_held,
        is_live: found.has_live_width(),
    };
    for (place, stimulus) in course.peaks() {
        check_stimulus(items.get(place)?, found, setup, stimulus);
    }
    Some(Course::Stimulus(found.index(), course))
}

/// Reads `forces`, of channels that the course does not drive: each a ramp or a
/// sine.
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
    for item in t.tables("forces").iter().filter(|item| item.is_sound()) {
        let Some(channel) = find_controlled(item, channels) else {
            continue;
        };
        let bit = 1u16 << channel.index();
        if taken & bit != 0 {
            let channel = channel.number;
            item.say("channel", Problem::ChannelTwice { channel });
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

/// The channel that a force names; it must be under force control.
fn find_controlled<'c>(t: &Table<'_>, channels: &'c Channels) -> Option<&'c Channel> {
    let channel = channels.find(t, "channel")?;
    if channel.force.is_none() {
        let channel = channel.number;
        t.say("channel", Problem::NoForceControl { channel });
        return None;
    }
    Some(channel)
}

fn read_ramp(t: &Table<'_>, channel: &Channel) -> Option<ForceCourse> {
    let mut points: Vec<(u64, u32)> = Vec::new();
    for item in t.tables("points").iter().filter(|item| item.is_sound()) {
        let at_us = read_time(item, points.last().map(|&(at_us, _)| at_us), "point")?;
        let mn = item.whole::<i64>("n");
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

/// Reads `bounds`, of channels that the host may drive; tells of those that
/// contradict themselves, the channel or the session.
fn read_bounds(t: &Table<'_>, setup: &SetupSpec, duration_us: u64) -> Option<Vec<Bounds>> {
    let mut all: Vec<Bounds> = Vec::new();
    for item in t.tables("bounds").iter().filter(|item| item.is_sound()) {
        let Some(found) = setup.channels.find(item, "channel") else {
            continue;
        };
        let (channel, is_force) = (found.number, found.force.is_some());
        let bounds = Bounds {
            channel: found.index(),
            is_force,
            least: item.whole("least"),
            most: item.whole("most"),
            per_s: item.has("per_s").then(|| item.whole("per_s")),
            shortest_us: item.whole("shortest_s"),
        };
        let limit = found.spec.limit;
        if setup.controlled & 1 << bounds.channel != 0 && !is_force {
            item.say("channel", Problem::Controlled { channel });
        } else if all.iter().any(|it| it.channel == bounds.channel) {
            item.say("channel", Problem::ChannelTwice { channel });
        } else if bounds.most <= bounds.least {
            item.not_after("most", "`least`".into());
        } else if !is_force && i64::from(bounds.most) > i64::from(limit.get()) {
            found.tell_above_limit(item, "most");
        } else if bounds.shortest_us > duration_us {
            item.out_of_range("shortest_s", "up to `duration_s`".into());
        } else if let Some(slowest) = bounds.slowest(duration_us).filter(|_| item.has("per_s")) {
            item.out_of_range("per_s", slowest);
        } else if !is_force
            || check_force(item, "most", found, f64::from(bounds.most) / 1e3).is_some()
        {
            all.push(bounds);
        }
    }
    Some(all)
}

impl Bounds {
    /// What the steepest change has to be if it is too slow to go from the lowest to
    /// the highest in this time.
    fn slowest(&self, duration_us: u64) -> Option<String> {
        let least = f64::from(self.most - self.least) * 1e3 / duration_us as f64;
        let given = f64::from(self.per_s?) * 1e-3;
        (given < least)
            .then(|| format!("{least:.3} at least, to go from `least` to `most` in the session"))
    }
}

/// Reads `list`: lists of pulses, by rising time.
fn read_lists(t: &Table<'_>, setup: &SetupSpec, duration_us: u64) -> Option<Vec<(u64, PulseList)>> {
    let mut all: Vec<(u64, PulseList)> = Vec::new();
    for item in t.tables("list").iter().filter(|item| item.is_sound()) {
        let at_us = item.time("at_s", 1, duration_us)?;
        if let Some(&(before, _)) = all.last().filter(|(before, _)| at_us <= *before) {
            item.not_after("at_s", format!("the list at {} s", before as f64 / 1e6));
            return None;
        }
        let Some(found) = find_free(item, setup) else {
            continue;
        };
        if !found.spec.train.lists {
            let channel = found.number;
            item.say("channel", Problem::NoLists { channel });
            continue;
        }
        let mut list = PulseList {
            channel: found.index(),
            pulses: Default::default(),
        };
        for pulse in item.tables("pulses").iter().filter(|it| it.is_sound()) {
            let stimulus = read_stimulus(pulse, found)?;
            check_stimulus(pulse, found, setup, stimulus);
            let after_us: u32 = pulse.whole("after_us");
            let least_us = found.spec.train.period_us;
            if !list.pulses.is_empty() && after_us < least_us {
                let allowed = format!("at least the train's period of {least_us} after the first");
                pulse.out_of_range("after_us", allowed);
            }
            // As many as a list may have: checked.
            let _ = list.pulses.push(ListedPulse {
                after_us,
                amplitude: stimulus.amplitude,
                width_us: stimulus.width_us,
            });
        }
        all.push((at_us, list));
    }
    Some(all)
}

/// Asks the firmware's inverse whether it would take this force.
fn check_force(t: &Table<'_>, name: &str, channel: &Channel, newton: f64) -> Option<()> {
    // Of one that the device would not take, everything has been told.
    let Some(control) = channel.force_control() else {
        return Some(());
    };
    let reach_mn = control.reach_mn();
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
    t.say(name, problem);
    None
}

/// Reads the `at_s` of the next of a list, in µs.
fn read_time(item: &Table<'_>, before: Option<u64>, what: &str) -> Option<u64> {
    let at_us = item.whole::<u64>("at_s");
    match before {
        // Told: what comes next is held against what came before.
        Some(before) if at_us > DAY_US as u64 => return Some(before),
        None if at_us != 0 => item.out_of_range("at_s", "0 at first".into()),
        Some(before) if at_us <= before => {
            item.not_after("at_s", format!("the {what} at {} s", before as f64 / 1e6));
        }
        _ => return Some(at_us),
    }
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
    for item in t.tables("steps").iter().filter(|item| item.is_sound()) {
        let at_us = read_time(item, steps.last().map(|&(at_us, _)| at_us), "step")?;
        let centideg: i16 = item.whole("deg");
        check_angle(item, "deg", joint, f64::from(centideg) / 100.0)?;
        steps.push((at_us, centideg));
    }
    Some(Course::AngleSteps(steps))
}

/// Asks the firmware's joint whether it would take this angle.
fn check_angle(t: &Table<'_>, name: &str, joint: &Joint, deg: f64) -> Option<()> {
    let centideg = to_centi(deg) as i16; // saturates
    let (state, now) = (&mut JointState::default(), Micros::new(0));
    match joint.setpoint(state, now, now, Angle::from_centideg(centideg), None) {
        Err(SetpointError::OutOfRange { min_mdeg, max_mdeg }) => {
            let (min, max) = (f64::from(min_mdeg) / 1e3, f64::from(max_mdeg) / 1e3);
            let allowed = format!("what keeps the angle in the joint's {min}° to {max}°");
            t.out_of_range(name, allowed);
            None
        }
        // A fresh state refuses nothing else.
        _ => Some(()),
    }
}
