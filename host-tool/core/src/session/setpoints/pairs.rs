//! Reads amplitudes and widths, and lists of pulses, and checks with the firmware whether the
//! device would accept them.

use firmware::device::validate_channel;
use firmware::safety::{self, ListedPulse, PulseList, Stimulus};
use firmware::units::Amplitude;

use super::super::channel::Channel;
use super::super::setup::SetupSpec;
use super::times::read_time;
use super::{Course, StimulusCourse};
use crate::fields::decimal::format_scaled;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Reads `values`, the constant amplitudes and widths of channels that nothing else drives. They
/// are sorted by channel (0–9 on the link).
pub(super) fn read_amplitudes(t: &Table<'_>, setup: &SetupSpec) -> Option<Vec<(u8, Stimulus)>> {
    let mut values: Vec<(u8, Stimulus)> = Vec::new();
    let driven = match t.word("kind") {
        "amplitude-ramp" | "amplitude-steps" => Some(t.integer::<u8>("channel")),
        _ => None,
    };
    for item in t.tables("values").iter().filter(|item| item.is_valid()) {
        let Some(found) = find_free(item, setup) else {
            continue;
        };
        let channel = found.number;
        if driven == Some(channel) || values.iter().any(|&(index, _)| index == found.index()) {
            item.report("channel", Problem::ChannelTwice { channel });
        } else if let Some(stimulus) = read_stimulus(item, found) {
            check_stimulus(item, found, setup, stimulus);
            values.push((found.index(), stimulus));
        }
    }
    values.sort_unstable_by_key(|&(index, _)| index);
    // The device needs all widths or none.
    let is_live = |(index, _): &(u8, Stimulus)| {
        let mut channels = setup.channels.list.iter();
        channels.any(|channel| channel.index() == *index && channel.has_live_width())
    };
    if !values.iter().any(is_live) {
        for (_, value) in &mut values {
            *value = Stimulus::with_own_width(value.amplitude);
        }
    }
    Some(values)
}

/// Returns the channel that `item` names, if the host may drive it. Otherwise reports why it may
/// not.
fn find_free<'s>(item: &Table<'_>, setup: &'s SetupSpec) -> Option<&'s Channel> {
    let found = setup.channels.find(item, "channel")?;
    is_free(item, "channel", found, setup).then_some(found)
}

/// Returns whether the host may set the amplitudes of the channel `found`, which `field` names.
/// Reports a channel whose amplitudes a controller on the device sets.
pub(in crate::session) fn is_free(
    t: &Table<'_>,
    field: &str,
    found: &Channel,
    setup: &SetupSpec,
) -> bool {
    let channel = found.number;
    if found.force.is_some() {
        t.report(field, Problem::ForceControlled { channel });
    } else if setup.controlled & 1 << found.index() != 0 {
        t.report(field, Problem::Controlled { channel });
    } else {
        return true;
    }
    false
}

/// Reads an amplitude from `value` and a pulse width from `width_us`, which defaults to the train's
/// own width. Reports values that the channel does not allow.
pub(in crate::session) fn read_stimulus(item: &Table<'_>, found: &Channel) -> Option<Stimulus> {
    let train = &found.spec.train;
    let amplitude = Amplitude::new(item.integer("value"));
    let width_us = match item.has("width_us") {
        true => item.integer("width_us"),
        false => train.width_us,
    };
    if amplitude > found.spec.limit {
        found.report_above_limit(item, "value");
    } else if !found.has_live_width() && width_us != train.width_us {
        let (channel, own_us) = (found.number, train.width_us);
        item.report("width_us", Problem::FixedWidth { channel, own_us });
    } else if width_us > train.max_width_us.max(train.width_us) {
        let allowed = format!("at most {}, the train's `max_width_us`", train.max_width_us);
        item.report_out_of_range("width_us", allowed);
    } else {
        return Some(Stimulus {
            amplitude,
            width_us,
        });
    }
    None
}

/// Reports an amplitude that the device would refuse at this width, because of its charge or
/// because a train of a fixed number of bursts would still be rising. The firmware's own channel
/// decides.
pub(in crate::session) fn check_stimulus(
    item: &Table<'_>,
    found: &Channel,
    setup: &SetupSpec,
    stimulus: Stimulus,
) {
    let Some((channel, wearer)) = armed_channel(found, setup) else {
        return; // told
    };
    let highest = channel.max_amplitude_at(stimulus.width_us, &wearer);
    if stimulus.width_us != 0 && stimulus.amplitude > highest {
        let problem = Problem::ChargeAtWidth {
            value: found.format_amplitude(stimulus.amplitude),
            width_us: stimulus.width_us,
            most: found.format_amplitude(highest),
            max_uc: format_scaled(wearer.spec().max_charge_nc.into(), 3),
        };
        item.report("value", problem);
    }
    let stimulus = channel.with_width(stimulus);
    let pulses = channel.pulses_below(stimulus, &wearer);
    if pulses > 0 {
        let problem = Problem::CountedRises {
            channel: found.number,
            value: found.format_amplitude(stimulus.amplitude),
            start: found.format_amplitude(channel.start),
            pulses,
        };
        item.report("value", problem);
    }
}

/// Returns the firmware's channel and wearer as the device has them when it is armed; `None` if the
/// device would refuse them.
fn armed_channel(found: &Channel, setup: &SetupSpec) -> Option<(safety::Channel, safety::Wearer)> {
    let wearer = setup.wearer.validate().ok()?;
    let channel = validate_channel(&found.spec, found.force.as_ref(), &wearer).ok()?;
    Some((channel, wearer))
}

/// Reads `channel` and `points`: amplitudes and widths over time. `is_held` is whether they form
/// steps instead of ramps.
pub(super) fn read_stimuli(t: &Table<'_>, setup: &SetupSpec, is_held: bool) -> Option<Course> {
    let found = find_free(t, setup)?;
    let mut points: Vec<(u64, Stimulus)> = Vec::new();
    let items: Vec<_> = t
        .tables("points")
        .iter()
        .take_while(|table| table.is_valid())
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

/// Reads the lists of pulses in `list`, each with the time at which it is sent in µs. The times
/// must rise.
pub(super) fn read_lists(
    t: &Table<'_>,
    setup: &SetupSpec,
    duration_us: u64,
) -> Option<Vec<(u64, PulseList)>> {
    let mut lists: Vec<(u64, PulseList)> = Vec::new();
    for item in t.tables("list").iter().filter(|item| item.is_valid()) {
        let at_us = item.time("at_s", 1, duration_us)?;
        if let Some(&(before, _)) = lists.last().filter(|(before, _)| at_us <= *before) {
            let after = format!("the {} s of the list before it", before as f64 / 1e6);
            item.report_not_after("at_s", after);
            return None;
        }
        let Some(found) = find_free(item, setup) else {
            continue;
        };
        if !found.spec.train.lists {
            let channel = found.number;
            item.report("channel", Problem::NoLists { channel });
            continue;
        }
        let mut list = PulseList {
            channel: found.index(),
            pulses: Default::default(),
        };
        for pulse in item
            .tables("pulses")
            .iter()
            .filter(|table| table.is_valid())
        {
            let stimulus = read_stimulus(pulse, found)?;
            check_stimulus(pulse, found, setup, stimulus);
            let after_us: u32 = pulse.integer("after_us");
            let least_us = found.spec.train.period_us;
            if !list.pulses.is_empty() && after_us < least_us {
                let allowed = format!("at least {least_us}, the train's period, after the first");
                pulse.report_out_of_range("after_us", allowed);
            }
            // The checks allow no more pulses than a list may have.
            let _ = list.pulses.push(ListedPulse {
                after_us,
                amplitude: stimulus.amplitude,
                width_us: stimulus.width_us,
            });
        }
        lists.push((at_us, list));
    }
    Some(lists)
}
