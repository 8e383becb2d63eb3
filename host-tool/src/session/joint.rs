//! `[joint]`: a closed loop on the device.

use firmware::control::{
    HoldPolicy, Joint, JointSpec, LawSpec, PointSpec, ResponseSpec, SensorSource, SpecError,
    SpecField, WearerModel,
};
use firmware::units::Amplitude;

use super::channel::Channel;
use super::error::{Problem, SessionError};
use super::table::Table;

/// Longest extrapolation of a lost setpoint unless the file says otherwise, ms:
/// nine setpoints of a 90 Hz stream.
const MAX_EXTRAPOLATION_MS: u16 = 100;
/// Calibration of the board's angle sensor unless the file says otherwise: 25
/// codes a degree, and a broken or shorted wire reads −32° or +132°, outside
/// what the device believes of a joint of 0–100°.
const ADC_CODES: (u16, u16) = (800, 3300);
/// Age of a stale measurement unless the file says otherwise, ms: ten readings
/// of the board's converter, or four and a half of a 90 Hz glove.
pub(super) const STALE_AFTER_MS: (u16, u16) = (10, 50);

/// Curvature of recruitment unless the file says otherwise, thousandths: mean of
/// ln(Fmax/Fmin) over Lee 2020, table 2.
const LEE_CURVATURE_MILLI: u16 = 1_200;

const FIELDS: [&str; 16] = [
    "law",
    "gains",
    "law_period_ms",
    "cutoff_hz",
    "flexors",
    "extensor",
    "hold",
    "max_extrapolation_ms",
    "angle_min_deg",
    "angle_max_deg",
    "sensor",
    "code_at_0_deg",
    "code_at_100_deg",
    "stale_after_ms",
    "wearer",
    "response",
];

const WEARER_FIELDS: [&str; 8] = [
    "rest_deg",
    "stiffness_nm_per_rad",
    "damping_nm_s_per_rad",
    "flexion_nm",
    "extension_nm",
    "torque_loss",
    "curvature",
    "lead_ms",
];

const RESPONSE_FIELDS: [&str; 6] = [
    "gain_rad",
    "muscle_ms",
    "joint_ms",
    "delay_ms",
    "scale_learning",
    "damping_learning",
];

const LAWS: [(&str, LawName); 3] = [
    ("recommended", LawName::Recommended),
    ("paper", LawName::Paper),
    ("pid", LawName::Pid),
];

/// The control laws by name.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub enum LawName {
    /// Super-twisting with the wearer's model, or alone where the file has none.
    Recommended,
    /// Super-twisting as Hamana 2022 prints it, its sign corrected.
    Paper,
    /// Proportional, integral, derivative.
    Pid,
}

impl LawName {
    /// Its name in session files.
    #[must_use]
    pub fn name(self) -> &'static str {
        let found = LAWS.iter().find(|(_, law)| *law == self);
        found.map_or("", |(name, _)| name)
    }

    /// The law of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let found = LAWS.iter().find(|(known, _)| *known == name);
        found.map(|(_, law)| *law)
    }

    /// The law with its default gains.
    #[must_use]
    pub const fn spec(self, has_wearer: bool) -> LawSpec {
        match self {
            Self::Recommended if has_wearer => LawSpec::RECOMMENDED,
            Self::Recommended => LawSpec::ALONE,
            Self::Paper => LawSpec::PAPER,
            Self::Pid => LawSpec::PID,
        }
    }
}

/// `spec` under another law, with that law's default gains, period and cutoff.
pub(super) fn with_law(spec: JointSpec, law: LawName) -> JointSpec {
    let law = law.spec(spec.wearer.is_some());
    let law = spec.wearer.map_or(law, |wearer| law.for_wearer(&wearer));
    JointSpec {
        law_period_ms: law.default_period_ms(),
        cutoff_mhz: law.default_cutoff_mhz(),
        law,
        ..spec
    }
}

/// Reads `[joint]`, and checks it and its points against the channels.
pub(super) fn read_joint(
    root: &Table<'_>,
    channels: &[Channel],
) -> Result<Option<(JointSpec, Joint)>, SessionError> {
    let Some(t) = root.table("joint")?.optional() else {
        return Ok(None);
    };
    t.only(&FIELDS)?;
    let name = t.choice("law", &LAWS)?.or(LawName::Recommended);
    let law = name.spec(t.has("wearer"));
    let wearer = read_wearer_model(&t, law)?;
    let law = wearer.map_or(law, |wearer| law.for_wearer(&wearer));
    let law = read_gains(&t, law)?;
    let mut points = t.tables("flexors")?.required()?;
    if points.len() > 2 {
        // More than the link's list holds; the firmware refuses none.
        return Err(t.out_of_range("flexors", "1 to 2 points".into()));
    }
    points.push(t.table("extensor")?.required()?);
    let specs: Vec<PointSpec> = points
        .iter()
        .map(|point| read_point(point, channels))
        .collect::<Result<_, _>>()?;
    let (flexors, extensor) = specs.split_at(specs.len() - 1); // the last was just pushed
    let sensor = read_sensor(&t, ADC_CODES)?;
    let stale_after_ms = match sensor {
        SensorSource::Adc { .. } => STALE_AFTER_MS.0,
        SensorSource::Host => STALE_AFTER_MS.1,
    };
    let spec = JointSpec {
        law,
        law_period_ms: t.whole("law_period_ms", 0)?.or(law.default_period_ms()),
        cutoff_mhz: t.whole("cutoff_hz", 3)?.or(law.default_cutoff_mhz()),
        flexors: flexors.iter().copied().collect(),
        extensor: extensor[0],
        hold: read_hold(&t)?,
        angle_min_mdeg: t.whole("angle_min_deg", 3)?.or(0),
        angle_max_mdeg: t.whole("angle_max_deg", 3)?.or(100_000),
        sensor,
        stale_after_ms: t.whole("stale_after_ms", 0)?.or(stale_after_ms),
        wearer,
        response: read_response(&t, wearer)?,
    };
    let joint = Joint::new(&spec).map_err(|e| joint_error(&t, &points, &spec, e))?;
    Ok(Some((spec, joint)))
}

/// `law` with the gains that the file states.
fn read_gains(t: &Table<'_>, law: LawSpec) -> Result<LawSpec, SessionError> {
    let Some(g) = t.table("gains")?.optional() else {
        return Ok(law);
    };
    Ok(match law {
        LawSpec::Paper {
            lambda_milli,
            w_milli,
        } => {
            g.only(&["lambda", "w"])?;
            LawSpec::Paper {
                lambda_milli: g.whole("lambda", 3)?.or(lambda_milli),
                w_milli: g.whole("w", 3)?.or(w_milli),
            }
        }
        LawSpec::Recommended {
            lambda_milli,
            k1_milli,
            k2_milli,
            b_milli,
            k3_milli,
            ki_milli,
        } => {
            g.only(&["lambda", "k1", "k2", "b", "k3", "ki"])?;
            LawSpec::Recommended {
                lambda_milli: g.whole("lambda", 3)?.or(lambda_milli),
                k1_milli: g.whole("k1", 3)?.or(k1_milli),
                k2_milli: g.whole("k2", 3)?.or(k2_milli),
                b_milli: g.whole("b", 3)?.or(b_milli),
                k3_milli: g.whole("k3", 3)?.or(k3_milli),
                ki_milli: g.whole("ki", 3)?.or(ki_milli),
            }
        }
        LawSpec::Pid {
            kp_milli,
            ki_milli,
            kd_milli,
        } => {
            g.only(&["kp", "ki", "kd"])?;
            LawSpec::Pid {
                kp_milli: g.whole("kp", 3)?.or(kp_milli),
                ki_milli: g.whole("ki", 3)?.or(ki_milli),
                kd_milli: g.whole("kd", 3)?.or(kd_milli),
            }
        }
    })
}

/// Reads `[joint.wearer]`, the nominal wearer of the feed-forward.
fn read_wearer_model(t: &Table<'_>, law: LawSpec) -> Result<Option<WearerModel>, SessionError> {
    let Some(w) = t.table("wearer")?.optional() else {
        return Ok(None);
    };
    w.only(&WEARER_FIELDS)?;
    Ok(Some(WearerModel {
        rest_mdeg: w.whole("rest_deg", 3)?.required()?,
        stiffness_unm_per_rad: w.whole("stiffness_nm_per_rad", 6)?.required()?,
        damping_unm_s_per_rad: w.whole("damping_nm_s_per_rad", 6)?.or(0),
        flexion_unm: w.whole("flexion_nm", 6)?.required()?,
        extension_unm: w.whole("extension_nm", 6)?.required()?,
        torque_loss_milli: w.whole("torque_loss", 3)?.or(0),
        curvature_milli: w.whole("curvature", 3)?.or(LEE_CURVATURE_MILLI),
        lead_ms: w.whole("lead_ms", 0)?.or(law.default_lead_ms()),
    }))
}

/// Reads `[joint.response]`, a nominal wearer in time; a field left out keeps
/// [`ResponseSpec::RECOMMENDED`], for this wearer's strength.
fn read_response(
    t: &Table<'_>,
    wearer: Option<WearerModel>,
) -> Result<Option<ResponseSpec>, SessionError> {
    let Some(r) = t.table("response")?.optional() else {
        return Ok(None);
    };
    r.only(&RESPONSE_FIELDS)?;
    let default = ResponseSpec::RECOMMENDED;
    let default = wearer.map_or(default, |wearer| default.for_wearer(&wearer));
    Ok(Some(ResponseSpec {
        gain_mrad: r.whole("gain_rad", 3)?.or(default.gain_mrad),
        muscle_ms: r.whole("muscle_ms", 0)?.or(default.muscle_ms),
        joint_ms: r.whole("joint_ms", 0)?.or(default.joint_ms),
        delay_ms: r.whole("delay_ms", 0)?.or(default.delay_ms),
        scale_milli: r.whole("scale_learning", 3)?.or(default.scale_milli),
        damping_milli: r.whole("damping_learning", 3)?.or(default.damping_milli),
    }))
}

pub(super) fn read_hold(t: &Table<'_>) -> Result<HoldPolicy, SessionError> {
    let max_ms = t.whole("max_extrapolation_ms", 0)?;
    let extrapolate = HoldPolicy::Extrapolate {
        max_ms: max_ms.or(MAX_EXTRAPOLATION_MS),
    };
    let policies = [("extrapolate", extrapolate), ("hold", HoldPolicy::Hold)];
    let hold = t.choice("hold", &policies)?.or(extrapolate);
    if hold == HoldPolicy::Hold && t.has("max_extrapolation_ms") {
        return Err(t.out_of_range("max_extrapolation_ms", "none with hold = \"hold\"".into()));
    }
    Ok(hold)
}

/// Reads where an angle is measured; `codes` are the converter's at 0° and 100°
/// unless the file says otherwise.
pub(super) fn read_sensor(t: &Table<'_>, codes: (u16, u16)) -> Result<SensorSource, SessionError> {
    let adc = SensorSource::Adc {
        code_at_0: t.whole("code_at_0_deg", 0)?.or(codes.0),
        code_at_100: t.whole("code_at_100_deg", 0)?.or(codes.1),
    };
    let sources = [("adc", adc), ("host", SensorSource::Host)];
    let sensor = t.choice("sensor", &sources)?.required()?;
    for code in ["code_at_0_deg", "code_at_100_deg"] {
        if sensor == SensorSource::Host && t.has(code) {
            return Err(t.out_of_range(code, "none with sensor = \"host\"".into()));
        }
    }
    Ok(sensor)
}

/// Reads a point and holds it to its channel's limit, as arming will.
fn read_point(t: &Table<'_>, channels: &[Channel]) -> Result<PointSpec, SessionError> {
    t.only(&["channel", "threshold", "max"])?;
    let channel = find(t, "channel", channels)?;
    not_under_force(t, channel)?;
    Ok(PointSpec {
        channel: channel.index(),
        threshold: Amplitude(t.whole("threshold", 3)?.required()?),
        max: read_amplitude(t, "max", channel)?,
    })
}

/// Refuses a table's `channel` that is under force control.
pub(super) fn not_under_force(t: &Table<'_>, channel: &Channel) -> Result<(), SessionError> {
    if channel.force.is_none() {
        return Ok(());
    }
    let (field, channel) = (t.path_of("channel"), channel.number);
    Err(t.error("channel", Problem::ForceControlled { field, channel }))
}

/// The channel that a field names.
pub(super) fn find<'c>(
    t: &Table<'_>,
    name: &str,
    channels: &'c [Channel],
) -> Result<&'c Channel, SessionError> {
    let channel = t.channel(name)?.required()?;
    let found = channels.iter().find(|c| c.number == channel);
    found.ok_or_else(|| {
        let field = t.path_of(name);
        t.error(name, Problem::NoSuchChannel { field, channel })
    })
}

/// Reads an amplitude that its channel's limit allows.
pub(super) fn read_amplitude(
    t: &Table<'_>,
    name: &str,
    channel: &Channel,
) -> Result<Amplitude, SessionError> {
    let limit = channel.spec.limit;
    let value = t.whole::<i64>(name, 3)?.required()?;
    if value > i64::from(limit.0) {
        let problem = Problem::AboveChannelLimit {
            field: t.path_of(name),
            given: format!("{} {}", t.given(name), channel.unit().symbol()),
            channel: channel.number,
            limit: channel.display(limit),
        };
        return Err(t.error(name, problem));
    }
    let value = u32::try_from(value);
    value
        .map(Amplitude)
        .map_err(|_| t.not_within(name, 0, limit.0.into(), 3))
}

/// Where the file says a joint's field, and the power of ten between them.
pub(super) const fn file_field(field: SpecField) -> (&'static str, i32) {
    use SpecField as F;
    match field {
        F::Lambda => ("lambda", 3),
        F::W => ("w", 3),
        F::K1 => ("k1", 3),
        F::K2 => ("k2", 3),
        F::B => ("b", 3),
        F::Kp => ("kp", 3),
        F::Ki => ("ki", 3),
        F::Kd => ("kd", 3),
        F::LawPeriod => ("law_period_ms", 0),
        F::Cutoff => ("cutoff_hz", 3),
        F::FlexorCount => ("flexors", 0),
        F::Channel => ("channel", 0),
        F::Threshold => ("threshold", 3),
        F::Maximum => ("max", 3),
        F::Extrapolation => ("max_extrapolation_ms", 0),
        F::AngleMin => ("angle_min_deg", 3),
        F::AngleMax => ("angle_max_deg", 3),
        F::CodeAt0 => ("code_at_0_deg", 0),
        F::CodeAt100 | F::CodeSpan => ("code_at_100_deg", 0),
        F::StaleAfter => ("stale_after_ms", 0),
        F::Rest => ("rest_deg", 3),
        F::Stiffness => ("stiffness_nm_per_rad", 6),
        F::Damping => ("damping_nm_s_per_rad", 6),
        F::Flexion => ("flexion_nm", 6),
        F::Extension => ("extension_nm", 6),
        F::TorqueLoss => ("torque_loss", 3),
        F::Curvature => ("curvature", 3),
        F::Lead => ("lead_ms", 0),
        F::K3 => ("k3", 3),
        F::ResponseGain => ("gain_rad", 3),
        F::MuscleLag => ("muscle_ms", 0),
        F::JointLag => ("joint_ms", 0),
        F::Delay => ("delay_ms", 0),
        F::ScaleLearning => ("scale_learning", 3),
        F::DampingLearning => ("damping_learning", 3),
    }
}

/// Puts the firmware's verdict on the field concerned.
fn joint_error(
    t: &Table<'_>,
    points: &[Table<'_>],
    spec: &JointSpec,
    e: SpecError,
) -> SessionError {
    use SpecField as F;
    let specs = || spec.flexors.iter().chain([&spec.extensor]).zip(points);
    // The first point that breaks a rule is the one the firmware met.
    let point = |breaks: &dyn Fn(&PointSpec) -> bool| {
        let found = specs().find(|(p, _)| breaks(p));
        found.map_or(t, |(_, table)| table)
    };
    let (field, min, max) = match e {
        SpecError::ChannelTwice { channel: c } => {
            let second = specs().filter(|(p, _)| p.channel == c).nth(1);
            let (field, channel) = ("joint".into(), c + 1); // at most 10
            let problem = Problem::ChannelTwice { field, channel };
            return second.map_or(t, |(_, p)| p).error("channel", problem);
        }
        SpecError::OutOfRange { field, min, max } => (field, i64::from(min), i64::from(max)),
    };
    let (name, places) = file_field(field);
    let within = |inner: &str| {
        let found = t.table(inner).ok().and_then(|inner| inner.optional());
        found.unwrap_or_else(|| t.clone())
    };
    match field {
        F::FlexorCount => t.out_of_range(name, format!("{min} to {max} points")),
        F::CodeSpan => t.out_of_range(name, format!("at least {min} from `code_at_0_deg`")),
        F::Threshold => point(&|p| p.threshold > p.max).not_within(name, min, max, places),
        F::Maximum => point(&|p| i64::from(p.max.0) > max).not_within(name, min, max, places),
        F::Lambda | F::W | F::K1 | F::K2 | F::B | F::K3 | F::Kp | F::Ki | F::Kd => {
            within("gains").not_within(name, min, max, places)
        }
        F::Rest
        | F::Stiffness
        | F::Damping
        | F::Flexion
        | F::Extension
        | F::TorqueLoss
        | F::Curvature
        | F::Lead => within("wearer").not_within(name, min, max, places),
        F::ResponseGain
        | F::MuscleLag
        | F::JointLag
        | F::Delay
        | F::ScaleLearning
        | F::DampingLearning => within("response").not_within(name, min, max, places),
        _ => t.not_within(name, min, max, places),
    }
}
