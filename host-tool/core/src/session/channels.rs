//! `[[channel]]`: the output stages, trains and muscles of a session.

use firmware::control::ForceSpec;
use firmware::device::Draft;
use firmware::pulse::{CHANNELS, Shape, TrainSpec, Trigger};
use firmware::safety::{ChannelSpec, StageSpec};
use firmware::units::Amplitude;

use super::channel::Channel;
use super::fields::{SHAPES, TRIGGERS};
use super::hold::read_hold;
use super::muscle::read_muscle;
use super::verdict::{report_channel_mistake, report_muscle_mistake};
use super::worn::{WearerContext, check_force_rate};
use crate::fields::error::Problem;
use crate::fields::table::Table;
use crate::wearer::Electrode;

/// The channels of a session file: those that could be read, and the numbers of the others.
#[derive(Default)]
pub(super) struct Channels {
    /// Channels without errors, sorted by number.
    pub(super) list: Vec<Channel>,
    /// Channels that could be read, but that exceed one of their own limits.
    pub(super) beyond: Vec<Channel>,
    /// Electrodes of the wearer file for the channels in `list`. Each is converted to the largest
    /// pulse width of its channel.
    pub(super) fitted: Vec<Electrode>,
    /// Channels that the file has, with or without errors: bit i is channel i on the link.
    named: u16,
    /// Whether any channel has an error.
    wrong: bool,
    /// Whether a channel cannot be identified, because its number is missing, invalid or used
    /// twice.
    unknown: bool,
}

impl Channels {
    /// Reads every `[[channel]]` of a session of `duration_us` into `draft`. Adds a note to `notes`
    /// for each value that had to be rounded or converted.
    pub(super) fn read(
        root: &Table<'_>,
        person: &WearerContext,
        draft: &mut Draft,
        duration_us: u64,
        notes: &mut Vec<String>,
    ) -> Self {
        let mut channels = Self::default();
        let tables = root.tables("channel");
        channels.unknown = tables.is_empty();
        for t in tables {
            let number = t.integer::<u8>("number");
            let Some(index) = number.checked_sub(1).filter(|i| usize::from(*i) < CHANNELS) else {
                channels.unknown = true;
                continue;
            };
            let is_second = channels.named & 1 << index != 0;
            if is_second {
                t.report("number", Problem::ChannelTwice { channel: number });
                channels.unknown = true;
            }
            channels.named |= 1 << index;
            let mut aside = Draft::default();
            let draft = if is_second { &mut aside } else { &mut *draft };
            match read_channel(t, person, draft, duration_us, notes) {
                Ok((channel, fitted)) if !is_second => {
                    channels.list.push(channel);
                    channels.fitted.extend(fitted);
                }
                found => {
                    let beyond = found.err().flatten().filter(|_| !is_second);
                    channels.beyond.extend(beyond.map(|channel| *channel));
                    channels.wrong = true;
                }
            }
        }
        channels.list.sort_unstable_by_key(|c| c.number);
        channels
    }

    /// Returns whether every channel of the file could be read without an error.
    pub(super) const fn all_valid(&self) -> bool {
        !self.wrong && !self.unknown
    }

    /// Returns the electrode of the wearer file under the channel of this number (from 1),
    /// converted to the channel's largest pulse width; `None` without a wearer file.
    pub(super) fn electrode(&self, channel: u8) -> Option<&Electrode> {
        self.fitted
            .iter()
            .find(|electrode| electrode.channel == channel)
    }

    /// Returns the smallest and the largest amplitude that the wearer file allows on a channel: the
    /// operator's minimum and maximum, or else motor threshold and limit. The largest does not
    /// exceed the channel's own limit.
    pub(super) fn usable_range(&self, channel: &Channel) -> Option<[Amplitude; 2]> {
        let electrode = self.electrode(channel.number)?;
        let least = electrode.minimum.unwrap_or(electrode.motor_threshold);
        let most = electrode.maximum.unwrap_or(electrode.limit);
        Some([least, most.min(channel.spec.limit)])
    }

    /// Returns the amplitudes at zero and at full effort of a joint's point on a channel, as the
    /// wearer file has them. The amplitude at zero effort may be below [`Self::usable_range`].
    pub(super) fn joint_range(&self, channel: &Channel) -> Option<[Amplitude; 2]> {
        let [least, most] = self.usable_range(channel)?;
        let zero = self.electrode(channel.number)?.joint_threshold;
        Some([zero.unwrap_or(least), most])
    }

    /// Returns the channel whose number is in the field `name`, if the channel has no errors.
    /// Reports an error at the field if the file has no channel of this number. A channel with
    /// errors of its own is not reported a second time here.
    pub(super) fn find(&self, t: &Table<'_>, name: &str) -> Option<&Channel> {
        let number = t.integer(name);
        self.find_number(t, name, number)
    }

    /// Returns the channel of this `number`, as [`Self::find`] does. Errors are reported at the
    /// field `name`.
    pub(super) fn find_number(&self, t: &Table<'_>, name: &str, number: u8) -> Option<&Channel> {
        let found = self.list.iter().find(|c| c.number == number);
        let index = number.checked_sub(1)?;
        let is_named = self.named.checked_shr(index.into()).unwrap_or(0) & 1 != 0;
        let is_number = usize::from(index) < CHANNELS;
        if found.is_none() && !is_named && !self.unknown && is_number {
            t.report(name, Problem::NoSuchChannel { channel: number });
        }
        found
    }
}

/// Returns the amplitude in the field `name`. If the field is missing, returns `known`, which comes
/// from the wearer file. If both are missing, reports the missing field.
pub(super) fn amplitude_or(
    t: &Table<'_>,
    name: &str,
    known: Option<Amplitude>,
) -> Option<Amplitude> {
    if t.has(name) {
        return Some(Amplitude::new(t.integer(name)));
    }
    if known.is_none() {
        t.report(name, Problem::MissingField {});
    }
    known
}

/// Reads one `[[channel]]` into `draft` and reports its errors. Returns the channel and its
/// converted electrode of the wearer file. If the draft refuses the channel, the `Err` holds the
/// channel without muscle and force; after any other error it is `Err(None)`.
fn read_channel(
    t: &Table<'_>,
    person: &WearerContext,
    draft: &mut Draft,
    duration_us: u64,
    notes: &mut Vec<String>,
) -> Result<(Channel, Option<Electrode>), Option<Box<Channel>>> {
    let number = t.integer("number");
    let stage = t.optional_table("stage", |s| Some(read_stage(s))).flatten();
    let train = t.optional_table("train", |table| Some(read_train(table, number, notes)));
    let (Some(stage), Some(train), true) = (stage, train.flatten(), t.is_valid()) else {
        return Err(None);
    };
    let fitted = person
        .channel_electrode(t, (&stage, &train), notes)
        .ok_or(None)?;
    let fitted = fitted.as_ref();
    let limit = person.channel_limit(t, fitted).ok_or(None)?;
    let spec = ChannelSpec {
        train,
        stage,
        limit,
        start: person.start_amplitude(t, fitted, limit).ok_or(None)?,
        area_mm2: person.area_mm2(t, fitted),
    };
    let mut channel = Channel {
        number,
        name: t.text("name").ok_or(None)?.to_owned(),
        spec,
        muscle: None,
        force: None,
    };
    let (index, plain) = (channel.index(), channel.clone());
    let channel_report = |mistake| report_channel_mistake(t, &plain, mistake);
    if let Err(mistake) = draft.set_channel(index, spec) {
        channel_report(mistake);
        return Err(Some(Box::new(channel)));
    }
    let muscle = t.optional_table("muscle", |m| {
        let muscle = read_muscle(m, fitted, spec.limit, duration_us)?;
        for (place, spec) in muscle.specs_by_level(m) {
            let muscle_report = |mistake| report_muscle_mistake(place, t, mistake);
            draft.set_muscle(index, spec).map_err(muscle_report).ok()?;
        }
        Some(muscle)
    });
    channel.muscle = muscle.ok_or(None)?;
    let force = t.optional_table("force", |f| {
        let force = read_force(f, &spec.train);
        if let Some(electrode) = fitted {
            check_force_rate(f, electrode, &force);
        }
        draft.set_force(index, force).map_err(channel_report).ok()?;
        Some(force)
    });
    channel.force = force.ok_or(None)?;
    Ok((channel, fitted.cloned()))
}

fn read_stage(t: &Table<'_>) -> StageSpec {
    match t.word("kind") {
        "voltage" => StageSpec::Voltage {
            full_scale_mv: t.integer("full_scale_v"),
            load_ohm: t.integer("load_ohm"),
        },
        _ => StageSpec::Current {
            full_scale_ua: t.integer("full_scale_ma"),
        },
    }
}

fn read_train(t: &Table<'_>, number: u8, notes: &mut Vec<String>) -> TrainSpec {
    TrainSpec {
        shape: t
            .choice("shape", &SHAPES)
            .unwrap_or(Shape::BiphasicCathodicFirst),
        width_us: t.integer("width_us"),
        max_width_us: match t.has("max_width_us") {
            true => t.integer("max_width_us"),
            false => 0,
        },
        gap_us: t.integer("gap_us"),
        ground_us: t.integer("ground_us"),
        period_us: read_period(t, number, notes),
        offset_us: t.integer("offset_us"),
        burst_count: t.integer("burst_count"),
        burst_interval_us: t.integer("burst_interval_us"),
        repeats: t.integer("repeats"),
        trigger: read_trigger_mode(t),
        lists: t.flag("lists"),
    }
}

/// Reads the effect of the trigger input on the train, from `trigger` or from its short form
/// `triggered = true`, which means that an edge starts the train. Returns `None` if the train does
/// not wait for the input.
fn read_trigger_mode(t: &Table<'_>) -> Option<Trigger> {
    match t.has("trigger") {
        true => t.choice("trigger", &TRIGGERS),
        false => t.flag("triggered").then_some(Trigger::Start),
    }
}

/// Reads the period in µs, from `period_us` or from `frequency_hz`, rounded to the nearest µs. A
/// rounded frequency adds a note.
fn read_period(t: &Table<'_>, number: u8, notes: &mut Vec<String>) -> u32 {
    let Some(hz) = t.real("frequency_hz") else {
        return t.integer("period_us");
    };
    let exact_us = 1e6 / hz;
    let period_us = exact_us.round() as u32; // saturates
    // A frequency given to seven digits or more counts as exact.
    if (exact_us - f64::from(period_us)).abs() > 1e-7 * exact_us && period_us > 0 {
        notes.push(format!(
            "channel {number}: {hz} Hz is rounded to a period of {period_us} µs, {:.4} Hz",
            1e6 / f64::from(period_us)
        ));
    }
    period_us
}

/// Reads a `force` table. The highest and the lowest pulse rate that force control may use default
/// to the train's rate.
fn read_force(t: &Table<'_>, train: &TrainSpec) -> ForceSpec {
    let min_period_us = match t.real("max_frequency_hz") {
        // Rounded up, so that the rate is never above `max_frequency_hz`; the conversion saturates,
        // and 0 Hz is refused with the other values out of range.
        Some(hz) => (1e6 / hz).ceil() as u32,
        None => train.period_us,
    };
    // Rounded down, so that the rate is never below `min_frequency_hz`; the conversion saturates,
    // and 0 Hz is refused with the other values out of range.
    let slowest_hz = t.real("min_frequency_hz");
    ForceSpec {
        min_period_us,
        hold: read_hold(t),
        max_period_us: slowest_hz.map(|hz| (1e6 / hz).floor() as u32),
    }
}
