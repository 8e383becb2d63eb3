//! `[wearer]` and `[[channel]]`: limits, output stages, trains, muscles.

use firmware::control::{ForceControl, ForceSpec};
use firmware::muscle::Recruitment;
use firmware::pulse::{CHANNELS, Shape, TrainError, TrainSpec};
use firmware::range::OutOfRange;
use firmware::safety::{
    Channel as Checked, ChannelSpec, SetupError, Stage, StageSpec, Wearer, WearerSpec,
};
use firmware::units::Amplitude;

use super::decimal::{between, in_units};
use super::error::Problem;
use super::fields::SHAPES;
use super::hold::read_hold;
use super::muscle::{Muscle, read_muscle};
use super::table::Table;

/// What a channel's amplitudes are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unit {
    /// Milliamperes, on a current-controlled stage.
    Milliampere,
    /// Volts, on a voltage-controlled stage.
    Volt,
}

impl Unit {
    /// "mA" or "V".
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Milliampere => "mA",
            Self::Volt => "V",
        }
    }
}

/// One channel of a session.
#[derive(Clone, PartialEq, Debug)]
pub struct Channel {
    /// Its number in files and on the board, 1–10; the link counts from 0.
    pub number: u8,
    /// What the wearer calls it.
    pub name: String,
    /// Its train, stage and limit, as the device gets them.
    pub spec: ChannelSpec,
    /// The muscle under it, if its force is to be predicted.
    pub muscle: Option<Muscle>,
    /// How the device controls that muscle's force, if the host asks for forces.
    pub force: Option<ForceSpec>,
}

impl Channel {
    /// Its number on the link, 0–9.
    #[must_use]
    pub const fn index(&self) -> u8 {
        self.number - 1 // 1–10
    }

    /// Its force control as the device will run it.
    pub(super) fn force_control(&self) -> Option<ForceControl> {
        let muscle = self.muscle.as_ref()?;
        let recruitment = Recruitment::new(muscle.recruitment).ok()?;
        let period_us = self.spec.train.period_us;
        ForceControl::new(
            self.index(),
            &self.force?,
            muscle.force,
            recruitment,
            period_us,
        )
        .ok()
    }

    /// What its amplitudes are.
    #[must_use]
    pub const fn unit(&self) -> Unit {
        match self.spec.stage {
            StageSpec::Current { .. } => Unit::Milliampere,
            StageSpec::Voltage { .. } => Unit::Volt,
        }
    }

    /// Reads an amplitude that its limit allows.
    pub(super) fn read_amplitude(&self, t: &Table<'_>, name: &str) -> Option<Amplitude> {
        let limit = self.spec.limit;
        let value = t.whole::<i64>(name);
        if value > i64::from(limit.0) {
            let problem = Problem::AboveChannelLimit {
                field: t.path_of(name),
                given: format!("{} {}", t.given(name), self.unit().symbol()),
                channel: self.number,
                limit: self.display(limit),
            };
            t.say(name, problem);
            return None;
        }
        if value < 0 {
            t.out_of_range(name, between(0, limit.0.into(), 3));
        }
        u32::try_from(value).map(Amplitude).ok()
    }

    /// An amplitude of this channel for people: "28 V".
    #[must_use]
    pub fn display(&self, amplitude: Amplitude) -> String {
        let value = in_units(amplitude.0.into(), 3);
        format!("{value} {}", self.unit().symbol())
    }
}

/// The channels of a file: those that can be read, and which others it has.
#[derive(Default)]
pub(super) struct Channels {
    /// By rising number.
    pub(super) list: Vec<Channel>,
    /// What the firmware made of them.
    pub(super) checked: [Option<Checked>; CHANNELS],
    /// Bit i: channel i on the link is in the file, right or wrong.
    named: u16,
    /// Whether any is wrong.
    wrong: bool,
    /// Whether one is, and nobody knows which.
    unknown: bool,
}

impl Channels {
    /// Reads every `[[channel]]` of a session of `duration_us`. What had to be
    /// rounded goes to `notes`.
    pub(super) fn read(
        root: &Table<'_>,
        wearer: &Wearer,
        duration_us: u64,
        notes: &mut Vec<String>,
    ) -> Self {
        let mut all = Self::default();
        let tables = root.tables("channel");
        all.unknown = tables.is_empty();
        for t in tables {
            let number = t.whole::<u8>("number");
            let Some(index) = number.checked_sub(1).filter(|i| usize::from(*i) < CHANNELS) else {
                all.unknown = true;
                continue;
            };
            if all.named & 1 << index != 0 {
                let field = t.path_of("number");
                let channel = number;
                t.say("number", Problem::ChannelTwice { field, channel });
                all.unknown = true;
            }
            all.named |= 1 << index;
            match read_channel(t, wearer, duration_us, notes) {
                Some((channel, checked)) => {
                    all.list.push(channel);
                    all.checked[usize::from(index)] = Some(checked); // 0–9
                }
                None => all.wrong = true,
            }
        }
        all.list.sort_unstable_by_key(|c| c.number);
        all
    }

    /// Whether every channel of the file could be read.
    pub(super) const fn are_whole(&self) -> bool {
        !self.wrong && !self.unknown
    }

    /// The channel that a field names. Tells if the file has none of this number; of
    /// one that is wrong itself, everything is told.
    pub(super) fn find(&self, t: &Table<'_>, name: &str) -> Option<&Channel> {
        let number = t.whole(name);
        self.numbered(t, name, number)
    }

    /// The channel of this number, which a field names.
    pub(super) fn numbered(&self, t: &Table<'_>, name: &str, number: u8) -> Option<&Channel> {
        let found = self.list.iter().find(|c| c.number == number);
        let index = number.checked_sub(1)?;
        let is_named = self.named.checked_shr(index.into()).unwrap_or(0) & 1 != 0;
        let is_number = usize::from(index) < CHANNELS;
        if found.is_none() && !is_named && !self.unknown && is_number {
            let field = t.path_of(name);
            let channel = number;
            t.say(name, Problem::NoSuchChannel { field, channel });
        }
        found
    }

    /// The channel that a field names, which must not be under force control.
    pub(super) fn find_free(&self, t: &Table<'_>, name: &str) -> Option<&Channel> {
        let channel = self.find(t, name)?;
        if channel.force.is_some() {
            let (field, channel) = (t.path_of(name), channel.number);
            t.say(name, Problem::ForceControlled { field, channel });
            return None;
        }
        Some(channel)
    }
}

/// Reads `[wearer]`. What is wrong by itself judges nothing else: then the loosest
/// limits are checked.
pub(super) fn read_wearer(root: &Table<'_>) -> (WearerSpec, Option<Wearer>) {
    let default = WearerSpec::default();
    let spec = match root.table("wearer").filter(|t| t.is_sound()) {
        None if root.has("wearer") => WearerSpec {
            fall_ms: WearerSpec::FALL_MS.max as u16, // 100 ms
            host_timeout_ms: WearerSpec::HOST_TIMEOUT_MS.max as u16, // 1 s
            ..default
        },
        None => default,
        Some(t) => WearerSpec {
            max_current_ua: t.whole("max_current_ma"),
            max_charge_nc: t.whole("max_charge_uc"),
            max_rms_ua: t.whole("max_rms_ma"),
            rise_ms: t.whole("rise_ms"),
            fall_ms: t.whole("fall_ms"),
            host_timeout_ms: t.whole("host_timeout_ms"),
        },
    };
    let refused = |e| root.table("wearer").unwrap_or(root).refuse(e);
    (spec, spec.validate().map_err(refused).ok())
}

/// Reads one `[[channel]]`.
fn read_channel(
    t: &Table<'_>,
    wearer: &Wearer,
    duration_us: u64,
    notes: &mut Vec<String>,
) -> Option<(Channel, Checked)> {
    let number = t.whole("number");
    let stage = t.part("stage", |s| read_stage(s))?;
    let train = t.part("train", |it| Some(read_train(it, number, notes)))?;
    let (stage, checked_stage) = stage?;
    let (train, train_table) = (train?, t.table("train")?);
    if !t.is_sound() {
        return None;
    }
    let spec = ChannelSpec {
        train,
        stage,
        limit: Amplitude(t.whole("limit")),
    };
    let mut channel = Channel {
        number,
        name: t.text("name")?.to_owned(),
        spec,
        muscle: None,
        force: None,
    };
    let refuse = |channel: &Channel, e| refuse(t, train_table, &checked_stage, channel, e);
    let checked = spec
        .validate(wearer)
        .map_err(|e| refuse(&channel, e))
        .ok()?;
    channel.muscle = t.part("muscle", |m| {
        let read = read_muscle(m, t, spec.limit, duration_us)?;
        follows(m, &read, &spec.train).then_some(read)
    })?;
    channel.force = t.part("force", |f| read_force(f, &channel))?;
    let (Some(force), Some(force_table)) = (channel.force, t.table("force")) else {
        return Some((channel, checked));
    };
    let rates = spec.validate_rates(force.min_period_us, force.max_period_us, wearer);
    let refused = |e| match e {
        SetupError::Range(e) if e.field.ends_with("period_us") => force_table.refuse(e),
        SetupError::Range(e) if e.field == "triggered" => {
            train_table.out_of_range("triggered", "false with a `force`".into());
        }
        SetupError::Range(e) if e.field == TrainSpec::BURST_COUNT.field => {
            train_table.out_of_range("burst_count", "1 with a `force`".into());
        }
        e => refuse(&channel, e),
    };
    let checked = rates.map_err(refused).ok()?;
    let Some(muscle) = &channel.muscle else {
        let channel = channel.number;
        t.say("force", Problem::NoMuscle { channel });
        return None;
    };
    let control = Recruitment::new(muscle.recruitment).and_then(|recruitment| {
        let period_us = spec.train.period_us;
        ForceControl::new(
            channel.index(),
            &force,
            muscle.force,
            recruitment,
            period_us,
        )
    });
    let refused = |e: OutOfRange| match e.field == TrainSpec::PERIOD_US.field {
        true => train_table.refuse(e),
        false => force_table.refuse(e),
    };
    control.map_err(refused).ok()?;
    Some((channel, checked))
}

/// Whether the muscle's model can follow the train; tells if not.
fn follows(t: &Table<'_>, muscle: &Muscle, train: &TrainSpec) -> bool {
    let (count, period_us) = (train.burst_count, train.period_us);
    let checked = muscle.force.check_train(count, period_us);
    let refused = checked.map_err(|e| {
        let every = f64::from(period_us) / 1e3;
        let range = between(e.min.into(), e.max.into(), 3);
        t.out_of_range(
            "tau_c_ms",
            format!("{range} with bursts of {count} every {every} ms"),
        );
    });
    refused.is_ok()
}

fn read_stage(t: &Table<'_>) -> Option<(StageSpec, Stage)> {
    let spec = match t.word("kind") {
        "voltage" => StageSpec::Voltage {
            full_scale_mv: t.whole("full_scale_v"),
            load_ohm: t.whole("load_ohm"),
        },
        _ => StageSpec::Current {
            full_scale_ua: t.whole("full_scale_ma"),
        },
    };
    let checked = spec.validate().map_err(|e| t.refuse(e)).ok()?;
    Some((spec, checked))
}

fn read_train(t: &Table<'_>, number: u8, notes: &mut Vec<String>) -> TrainSpec {
    TrainSpec {
        shape: t
            .named("shape", &SHAPES)
            .unwrap_or(Shape::BiphasicCathodicFirst),
        width_us: t.whole("width_us"),
        gap_us: t.whole("gap_us"),
        ground_us: t.whole("ground_us"),
        period_us: read_period(t, number, notes),
        offset_us: t.whole("offset_us"),
        burst_count: t.whole("burst_count"),
        burst_interval_us: t.whole("burst_interval_us"),
        repeats: t.whole("repeats"),
        triggered: t.flag("triggered"),
    }
}

/// The period in µs, from `period_us` or, to the nearest µs, `frequency_hz`.
fn read_period(t: &Table<'_>, number: u8, notes: &mut Vec<String>) -> u32 {
    let Some(hz) = t.real("frequency_hz") else {
        return t.whole("period_us");
    };
    let exact_us = 1e6 / hz;
    let period_us = exact_us.round() as u32; // saturates
    // A frequency given to seven digits or more counts as exact.
    if (exact_us - f64::from(period_us)).abs() > 1e-7 * exact_us && period_us > 0 {
        notes.push(format!(
            "channel {number}: {hz} Hz is played with a period of {period_us} µs, {:.4} Hz",
            1e6 / f64::from(period_us)
        ));
    }
    period_us
}

/// Puts the firmware's verdict on the field concerned.
fn refuse(t: &Table<'_>, train: &Table<'_>, stage: &Stage, channel: &Channel, e: SetupError) {
    let field = t.path_of("limit");
    let given = channel.display(channel.spec.limit);
    let current_ma = f64::from(stage.current_ua(channel.spec.limit)) / 1e3;
    let milli = |value: u32| in_units(value.into(), 3);
    let problem = match e {
        SetupError::Train(e) => return refuse_train(train, e),
        SetupError::Current { max_ua } => Problem::CurrentLimit {
            field,
            given,
            current_ma,
            max_ma: milli(max_ua),
        },
        SetupError::Charge { max_nc } => Problem::ChargeLimit {
            field,
            given,
            current_ma,
            max_uc: milli(max_nc),
        },
        SetupError::Rms { max_ua } => Problem::RmsLimit {
            field,
            given,
            current_ma,
            max_ma: milli(max_ua),
        },
        // A single channel has no groups.
        e => return t.refuse(e),
    };
    t.say("limit", problem);
}

fn refuse_train(t: &Table<'_>, e: TrainError) {
    match e {
        TrainError::Range(e) => t.refuse(e),
        TrainError::BurstOverlaps { min_interval_us } => {
            let field = t.path_of("burst_interval_us");
            let min_us = min_interval_us;
            t.say(
                "burst_interval_us",
                Problem::BurstOverlaps { field, min_us },
            );
        }
        TrainError::BurstTooLong { min_period_us } => {
            let period = ["period_us", "frequency_hz"][usize::from(!t.has("period_us"))];
            let field = t.path_of(period);
            let min_us = min_period_us;
            t.say(period, Problem::BurstTooLong { field, min_us });
        }
    }
}

/// Reads a `force` table. The highest and the lowest rate are the train's own if
/// it says none.
fn read_force(t: &Table<'_>, channel: &Channel) -> Option<ForceSpec> {
    let min_period_us = match t.real("max_frequency_hz") {
        // Never faster than asked for; saturates, and 0 Hz is refused as the rest.
        Some(hz) => (1e6 / hz).ceil() as u32,
        None => channel.spec.train.period_us,
    };
    // Never slower than asked for; saturates, and 0 Hz is refused as the rest.
    let slowest_hz = t.real("min_frequency_hz");
    Some(ForceSpec {
        min_period_us,
        hold: read_hold(t),
        max_period_us: slowest_hz.map(|hz| (1e6 / hz).floor() as u32),
    })
}
