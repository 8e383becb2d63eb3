//! `[wearer] haptic_range`: checks which amplitudes of a session leave the range of I_MT to 1.5 ·
//! I_MT (Lee 2020, section 2.4), in which the force model was identified.

use firmware::units::Amplitude;

use super::channels::Channels;
use super::worn::WearerContext;
use crate::fields::table::Table;
use crate::wearer::Electrode;

/// Reports every amplitude of the file `root` that is neither 0 nor within the haptic range of its
/// channel. The amplitude of a wall rises from 0 with the penetration, so only the amplitudes that
/// the file gives for the wall are checked.
pub(super) fn check_haptic_range(root: &Table<'_>, person: &WearerContext, channels: &Channels) {
    let tell = |t: &Table<'_>, named: &Table<'_>, field: &str| {
        let electrode = channels.electrode(named.integer("channel"));
        if let Some(electrode) = electrode.filter(|_| t.has(field) && t.is_valid()) {
            person.check_haptic_range(t, field, electrode, Amplitude::new(t.integer(field)));
        }
    };
    if let Some(setpoints) = root.table("setpoints") {
        for value in setpoints.tables("values") {
            tell(value, value, "value");
        }
        let drives_force = |bounds: &Table<'_>| {
            let number: u8 = bounds.integer("channel");
            let mut list = channels.list.iter();
            list.any(|channel| channel.number == number && channel.force.is_some())
        };
        let amplitudes = setpoints.tables("bounds").iter();
        for bounds in amplitudes.filter(|table| !drives_force(table)) {
            tell(bounds, bounds, "least");
            tell(bounds, bounds, "most");
        }
    }
    if let Some(setpoints) = root.table("setpoints") {
        for (nth, point) in setpoints.tables("points").iter().enumerate() {
            tell(point, setpoints, "value");
            check_ramp_after(setpoints, nth, person, channels);
        }
        for list in setpoints.tables("list") {
            for pulse in list.tables("pulses") {
                tell(pulse, list, "value");
            }
        }
    }
    if let Some(joint) = root.table("joint") {
        for point in joint
            .tables("flexors")
            .iter()
            .chain(joint.table("extensor"))
        {
            tell(point, point, "threshold");
            tell(point, point, "max");
        }
    }
    for program in root.tables("program") {
        check_program(program, person, channels);
    }
    for joint in root.tables("modulation") {
        for muscle in ["flexor", "extensor"]
            .map(|text| joint.table(text))
            .into_iter()
            .flatten()
        {
            tell(muscle, muscle, "base");
            tell(muscle, muscle, "threshold");
            check_scaled(muscle, person, channels);
        }
    }
    if let Some(wall) = root.table("wall") {
        tell(wall, wall, "max");
        if let Some(pre_wall) = wall.table("pre_wall") {
            tell(pre_wall, wall, "begin");
            tell(pre_wall, wall, "end");
        }
        if let Some(other) = wall.table("co_contraction") {
            tell(other, other, "amplitude");
        }
    }
    for channel in root.tables("channel") {
        if let Some(muscle) = channel.table("muscle") {
            let number: u8 = channel.integer("number");
            if let Some(electrode) = channels.electrode(number)
                && muscle.has("motor_threshold")
                && muscle.is_valid()
            {
                let threshold = Amplitude::new(muscle.integer("motor_threshold"));
                person.check_haptic_range(muscle, "motor_threshold", electrode, threshold);
            }
        }
    }
}

/// Reports the amplitudes of a program that are outside the haptic range of their channel. Reports
/// also ramps that the file asks for, because their amplitude passes through the values between 0
/// and the range. The wearer's own rise may do this.
fn check_program(program: &Table<'_>, person: &WearerContext, channels: &Channels) {
    let numbers = program.integers("channels").iter().map(|pair| pair.0);
    let listed: Vec<_> = numbers
        .filter_map(|number| channels.electrode(number as u8))
        .collect(); // 1–10
    let tell = |t: &Table<'_>, field: &str, electrode: &Electrode, value: Amplitude| {
        if t.has(field) && t.is_valid() {
            person.check_haptic_range(t, field, electrode, value);
        }
    };
    let amplitude = |t: &Table<'_>| Amplitude::new(t.integer("value"));
    for electrode in &listed {
        tell(program, "value", electrode, amplitude(program));
        for point in program.tables("points") {
            tell(point, "value", electrode, amplitude(point));
        }
        if program.word("kind") == "ramp" {
            // The smallest amplitude above 0 stands for the values between 0 and the range.
            tell(program, "points", electrode, Amplitude::new(1));
        }
    }
    let phases = program.tables("phases").iter();
    let of_phases =
        phases.filter_map(|table| Some((table, channels.electrode(table.integer("channel"))?)));
    let of_phases: Vec<_> = of_phases.collect();
    for (phase, electrode) in &of_phases {
        tell(phase, "value", electrode, amplitude(phase));
    }
    let any = listed
        .first()
        .or(of_phases.first().map(|(_, electrode)| electrode));
    for field in ["ramp_up_s", "ramp_down_s"] {
        if let Some(electrode) = any.filter(|_| program.integer::<u64>(field) > 0) {
            tell(program, field, electrode, Amplitude::new(1));
        }
    }
}

/// Reports a modulated muscle of the form "scaled". Its intensity takes every value from 0 on and
/// therefore leaves the haptic range.
fn check_scaled(muscle: &Table<'_>, person: &WearerContext, channels: &Channels) {
    let electrode = channels.electrode(muscle.integer("channel"));
    if let Some(electrode) = electrode.filter(|_| muscle.word("form") == "scaled") {
        // The smallest amplitude above 0 stands for the values between 0 and the range.
        person.check_haptic_range(muscle, "form", electrode, Amplitude::new(1));
    }
}

/// Reports the ramp between point `nth` and the next point if it begins or ends at 0, because its
/// amplitude then passes through values outside the haptic range.
fn check_ramp_after(
    setpoints: &Table<'_>,
    nth: usize,
    person: &WearerContext,
    channels: &Channels,
) {
    let points = setpoints.tables("points");
    let value = |t: &Table<'_>| t.has("value").then(|| t.integer::<u32>("value"));
    let pair = points.get(nth).zip(points.get(nth + 1));
    let Some((from, to)) = pair.filter(|_| setpoints.word("kind") == "amplitude-ramp") else {
        return;
    };
    let is_way = value(from)
        .zip(value(to))
        .is_some_and(|(a, b)| (a == 0) != (b == 0));
    if let Some(electrode) = channels.electrode(setpoints.integer("channel"))
        && is_way
    {
        // The smallest amplitude above 0 stands for the values between 0 and the range.
        person.check_haptic_range(to, "value", electrode, Amplitude::new(1));
    }
}
