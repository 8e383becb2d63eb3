//! `[wearer]` and `[[channel]]`: limits, output stages, trains, muscles.

use firmware::control::{ForceControl, ForceSpec};
use firmware::muscle::{OutOfRange as MuscleOutOfRange, Parameter, Recruitment};
use firmware::pulse::{Shape, TrainError, TrainSpec};
use firmware::safety::{
    Channel as Checked, ChannelSpec, SetupError, Stage, StageSpec, Wearer, WearerSpec,
};
use firmware::units::{Amplitude, OutOfRange};

use super::decimal::in_units;
use super::error::{Problem, SessionError};
use super::joint::read_hold;
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

    /// An amplitude of this channel for people: "28 V".
    #[must_use]
    pub fn display(&self, amplitude: Amplitude) -> String {
        let value = in_units(amplitude.0.into(), 3);
        format!("{value} {}", self.unit().symbol())
    }
}

/// A link field's name in the file, and the power of ten between them.
fn file_field(link: &'static str) -> (&'static str, i32) {
    match link {
        "max_current_ua" => ("max_current_ma", 3),
        "max_charge_nc" => ("max_charge_uc", 3),
        "max_rms_ua" => ("max_rms_ma", 3),
        "full_scale_ua" => ("full_scale_ma", 3),
        "full_scale_mv" => ("full_scale_v", 3),
        "limit" => ("limit", 3),
        same => (same, 0),
    }
}

fn refused(table: &Table<'_>, e: OutOfRange) -> SessionError {
    let (name, places) = file_field(e.field);
    table.not_within(name, e.min.into(), e.max.into(), places)
}

/// Reads `[wearer]`; a field left out keeps [`WearerSpec::default`].
pub(super) fn read_wearer(root: &Table<'_>) -> Result<(WearerSpec, Wearer), SessionError> {
    let default = WearerSpec::default();
    let table = root.table("wearer")?.optional();
    let spec = match &table {
        None => default,
        Some(t) => {
            t.only(&[
                "max_current_ma",
                "max_charge_uc",
                "max_rms_ma",
                "rise_ms",
                "fall_ms",
                "host_timeout_ms",
            ])?;
            WearerSpec {
                max_current_ua: t.whole("max_current_ma", 3)?.or(default.max_current_ua),
                max_charge_nc: t.whole("max_charge_uc", 3)?.or(default.max_charge_nc),
                max_rms_ua: t.whole("max_rms_ma", 3)?.or(default.max_rms_ua),
                rise_ms: t.whole("rise_ms", 0)?.or(default.rise_ms),
                fall_ms: t.whole("fall_ms", 0)?.or(default.fall_ms),
                host_timeout_ms: t.whole("host_timeout_ms", 0)?.or(default.host_timeout_ms),
            }
        }
    };
    let checked = spec.validate();
    Ok((
        spec,
        checked.map_err(|e| refused(table.as_ref().unwrap_or(root), e))?,
    ))
}

/// Reads one `[[channel]]` of a session of `duration_us`. What had to be rounded
/// goes to `notes`.
pub(super) fn read_channel(
    t: &Table<'_>,
    wearer: &Wearer,
    duration_us: u64,
    notes: &mut Vec<String>,
) -> Result<(Channel, Checked), SessionError> {
    t.only(&[
        "number", "name", "stage", "limit", "train", "muscle", "force",
    ])?;
    let number = t.channel("number")?.required()?;
    let name = t.text("name")?.required()?.to_owned();
    let (stage, checked_stage) = read_stage(&t.table("stage")?.required()?)?;
    let train = t.table("train")?.required()?;
    let spec = ChannelSpec {
        train: read_train(&train, number, notes)?,
        stage,
        limit: Amplitude(t.whole("limit", 3)?.required()?),
    };
    let mut channel = Channel {
        number,
        name,
        spec,
        muscle: None,
        force: None,
    };
    let mut checked = spec
        .validate(wearer)
        .map_err(|e| channel_error(t, &train, &checked_stage, &channel, e))?;
    if let Some(muscle) = t.table("muscle")?.optional() {
        let read = read_muscle(&muscle, t, spec.limit, duration_us)?;
        let (count, period_us) = (spec.train.burst_count, spec.train.period_us);
        let follows = read.force.check_train(count, period_us);
        follows.map_err(|e| {
            let [least, most, every] = [e.min, e.max, period_us].map(|us| f64::from(us) / 1e3);
            let allowed = format!("{least} to {most} with bursts of {count} every {every} ms");
            muscle.out_of_range("tau_c_ms", allowed)
        })?;
        channel.muscle = Some(read);
    }
    if let Some(force) = t.table("force")?.optional() {
        let read = read_force(&force, &channel)?;
        channel.force = Some(read);
        checked = spec
            .validate_rates(read.min_period_us, read.max_period_us, wearer)
            .map_err(|e| match e {
                SetupError::Range(e) if e.field.ends_with("period_us") => rates(&force, e),
                SetupError::Range(e) if e.field == "triggered" => {
                    train.out_of_range("triggered", "false with a `force`".into())
                }
                SetupError::Range(e) if e.field == "burst_count" => {
                    train.out_of_range("burst_count", "1 with a `force`".into())
                }
                e => channel_error(t, &train, &checked_stage, &channel, e),
            })?;
        let muscle = channel.muscle.as_ref().ok_or_else(|| {
            let channel = channel.number;
            t.error("force", Problem::NoMuscle { channel })
        })?;
        let recruitment = Recruitment::new(muscle.recruitment);
        let period_us = spec.train.period_us;
        let control = recruitment
            .and_then(|r| ForceControl::new(channel.index(), &read, muscle.force, r, period_us));
        control.map_err(|e| force_error(&force, &train, e))?;
    }
    Ok((channel, checked))
}

fn read_stage(t: &Table<'_>) -> Result<(StageSpec, Stage), SessionError> {
    let kinds = [("voltage", Unit::Volt), ("current", Unit::Milliampere)];
    let spec = match t.choice("kind", &kinds)?.required()? {
        Unit::Volt => {
            t.only(&["kind", "full_scale_v", "load_ohm"])?;
            StageSpec::Voltage {
                full_scale_mv: t.whole("full_scale_v", 3)?.required()?,
                load_ohm: t.whole("load_ohm", 0)?.required()?,
            }
        }
        Unit::Milliampere => {
            t.only(&["kind", "full_scale_ma"])?;
            StageSpec::Current {
                full_scale_ua: t.whole("full_scale_ma", 3)?.required()?,
            }
        }
    };
    let checked = spec.validate().map_err(|e| refused(t, e))?;
    Ok((spec, checked))
}

fn read_train(
    t: &Table<'_>,
    number: u8,
    notes: &mut Vec<String>,
) -> Result<TrainSpec, SessionError> {
    t.only(&[
        "shape",
        "width_us",
        "gap_us",
        "ground_us",
        "frequency_hz",
        "period_us",
        "offset_us",
        "burst_count",
        "burst_interval_us",
        "repeats",
        "triggered",
    ])?;
    let shapes = [
        ("biphasic-cathodic-first", Shape::BiphasicCathodicFirst),
        ("biphasic-anodic-first", Shape::BiphasicAnodicFirst),
        ("monophasic-cathodic", Shape::MonophasicCathodic),
        ("monophasic-anodic", Shape::MonophasicAnodic),
    ];
    Ok(TrainSpec {
        shape: t.choice("shape", &shapes)?.required()?,
        width_us: t.whole("width_us", 0)?.required()?,
        gap_us: t.whole("gap_us", 0)?.or(0),
        ground_us: t.whole("ground_us", 0)?.or(0),
        period_us: read_period(t, number, notes)?,
        offset_us: t.whole("offset_us", 0)?.or(0),
        burst_count: t.whole("burst_count", 0)?.or(1),
        burst_interval_us: t.whole("burst_interval_us", 0)?.or(0),
        repeats: t.whole("repeats", 0)?.or(0),
        triggered: t.flag("triggered")?.or(false),
    })
}

/// The period in µs, from `period_us` or, to the nearest µs, `frequency_hz`.
fn read_period(t: &Table<'_>, number: u8, notes: &mut Vec<String>) -> Result<u32, SessionError> {
    if t.has("period_us") && t.has("frequency_hz") {
        let (field, other) = (t.path_of("period_us"), t.path_of("frequency_hz"));
        return Err(t.error("period_us", Problem::SaidTwice { field, other }));
    }
    if t.has("period_us") {
        return t.whole("period_us", 0)?.required();
    }
    let hz = t.real("frequency_hz")?.required()?;
    let exact_us = 1e6 / hz;
    if hz <= 0.0 {
        return Ok(u32::MAX); // refused by the firmware's validator, with its range
    }
    let period_us = exact_us.round() as u32; // saturates
    // A frequency given to seven digits or more counts as exact.
    if (exact_us - f64::from(period_us)).abs() > 1e-7 * exact_us && period_us > 0 {
        notes.push(format!(
            "channel {number}: {hz} Hz is played with a period of {period_us} µs, {:.4} Hz",
            1e6 / f64::from(period_us)
        ));
    }
    Ok(period_us)
}

fn channel_error(
    t: &Table<'_>,
    train: &Table<'_>,
    stage: &Stage,
    channel: &Channel,
    e: SetupError,
) -> SessionError {
    let field = t.path_of("limit");
    let given = channel.display(channel.spec.limit);
    let current_ma = f64::from(stage.current_ua(channel.spec.limit)) / 1e3;
    let milli = |value: u32| in_units(value.into(), 3);
    match e {
        SetupError::Train(e) => train_error(train, e),
        SetupError::Range(e) => refused(t, e),
        SetupError::Current { max_ua } => {
            let max_ma = milli(max_ua);
            let problem = Problem::CurrentLimit {
                field,
                given,
                current_ma,
                max_ma,
            };
            t.error("limit", problem)
        }
        SetupError::Charge { max_nc } => {
            let max_uc = milli(max_nc);
            let problem = Problem::ChargeLimit {
                field,
                given,
                current_ma,
                max_uc,
            };
            t.error("limit", problem)
        }
        SetupError::Rms { max_ua } => {
            let max_ma = milli(max_ua);
            let problem = Problem::RmsLimit {
                field,
                given,
                current_ma,
                max_ma,
            };
            t.error("limit", problem)
        }
        // A single channel has no groups.
        SetupError::Group(_) => t.out_of_range("train", "a train without a group".into()),
    }
}

fn train_error(t: &Table<'_>, e: TrainError) -> SessionError {
    let period = if t.has("period_us") {
        "period_us"
    } else {
        "frequency_hz"
    };
    match e {
        TrainError::Range(e) if e.field == "period_us" && period == "frequency_hz" => {
            let hz = |us: i32| 1e6 / f64::from(us);
            t.out_of_range(period, format!("{} to {}", hz(e.max), hz(e.min)))
        }
        TrainError::Range(e) => refused(t, e),
        TrainError::BurstOverlaps { min_interval_us } => {
            let field = t.path_of("burst_interval_us");
            let min_us = min_interval_us;
            t.error(
                "burst_interval_us",
                Problem::BurstOverlaps { field, min_us },
            )
        }
        TrainError::BurstTooLong { min_period_us } => {
            let field = t.path_of(period);
            let min_us = min_period_us;
            t.error(period, Problem::BurstTooLong { field, min_us })
        }
    }
}

/// Reads a `force` table. The highest and the lowest rate are the train's own if
/// it says none.
fn read_force(t: &Table<'_>, channel: &Channel) -> Result<ForceSpec, SessionError> {
    t.only(&[
        "max_frequency_hz",
        "min_frequency_hz",
        "hold",
        "max_extrapolation_ms",
    ])?;
    let min_period_us = match t.real("max_frequency_hz")?.optional() {
        // Never faster than asked for; saturates, and 0 Hz is refused as the rest.
        Some(hz) => (1e6 / hz).ceil() as u32,
        None => channel.spec.train.period_us,
    };
    // Never slower than asked for; saturates, and 0 Hz is refused as the rest.
    let slowest_hz = t.real("min_frequency_hz")?.optional();
    let spec = ForceSpec {
        min_period_us,
        hold: read_hold(t)?,
        max_period_us: slowest_hz.map(|hz| (1e6 / hz).floor() as u32),
    };
    // Its periods are judged with the train, to name the range that it leaves.
    let checked = spec.check_hold();
    checked.map_err(|e| t.not_within("max_extrapolation_ms", e.min.into(), e.max.into(), 0))?;
    Ok(spec)
}

/// The highest or the lowest rate is out of range.
fn rates(t: &Table<'_>, e: OutOfRange) -> SessionError {
    let hz = |us: i32| 1e6 / f64::from(us);
    let name = match e.field {
        "max_period_us" => "min_frequency_hz",
        _ => "max_frequency_hz",
    };
    t.out_of_range(name, format!("{} to {}", hz(e.max), hz(e.min)))
}

/// Force control's verdict on a channel whose muscle was checked before.
fn force_error(t: &Table<'_>, train: &Table<'_>, e: MuscleOutOfRange) -> SessionError {
    let range = |field| OutOfRange {
        field,
        min: e.min.cast_signed(), // at most 2 000 000
        max: e.max.cast_signed(),
    };
    match e.parameter {
        Parameter::Period => train_error(train, TrainError::Range(range("period_us"))),
        Parameter::LongestPeriod => rates(t, range("max_period_us")),
        _ => rates(t, range("min_period_us")),
    }
}
