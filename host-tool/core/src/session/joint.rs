//! `[joint]`: a closed loop on the device.

use firmware::control::{
    Joint, JointSpec, LawSpec, PointSpec, ResponseSpec, SpecError, WearerModel,
};
use firmware::units::Amplitude;

use super::channel::Channels;
use super::error::Problem;
use super::hold::{read_hold, read_sensor, read_stale};
use super::law::{LAWS, LawName};
use super::table::Table;

/// Reads `[joint]`, and checks it and its points against the channels.
pub(super) fn read_joint(t: &Table<'_>, channels: &Channels) -> Option<(JointSpec, Joint)> {
    let name = t.named("law", &LAWS).unwrap_or(LawName::Recommended);
    let law = name.spec(t.has("wearer"));
    let wearer = t.part("wearer", |w| read_wearer_model(w, law))?;
    let law = wearer.map_or(law, |wearer| law.for_wearer(&wearer));
    let law = t
        .part("gains", |g| Some(read_gains(g, law)))?
        .unwrap_or(law);
    let response = t.part("response", |r| Some(read_response(r, wearer)))?;
    let points: Vec<&Table<'_>> = t
        .tables("flexors")
        .iter()
        .chain(t.table("extensor"))
        .collect();
    // Every one is read, so that every mistake is told.
    let specs: Vec<Option<PointSpec>> = points.iter().map(|p| read_point(p, channels)).collect();
    let specs: Vec<PointSpec> = specs.into_iter().collect::<Option<_>>()?;
    let (extensor, flexors) = specs.split_last()?;
    if !t.is_sound() {
        return None;
    }
    let sensor = read_sensor(t);
    let spec = JointSpec {
        law,
        law_period_ms: t.whole_or("law_period_ms", law.default_period_ms()),
        cutoff_mhz: t.whole_or("cutoff_hz", law.default_cutoff_mhz()),
        flexors: flexors.iter().copied().collect(),
        extensor: *extensor,
        hold: read_hold(t),
        angle_min_mdeg: t.whole("angle_min_deg"),
        angle_max_mdeg: t.whole("angle_max_deg"),
        sensor,
        stale_after_ms: read_stale(t, sensor),
        wearer,
        response,
    };
    let joint = Joint::new(&spec).map_err(|e| refuse(t, &points, &specs, e));
    Some((spec, joint.ok()?))
}

/// `law` with the gains that the file states.
fn read_gains(g: &Table<'_>, law: LawSpec) -> LawSpec {
    match law {
        LawSpec::Paper {
            lambda_milli,
            w_milli,
        } => LawSpec::Paper {
            lambda_milli: g.whole_or("lambda", lambda_milli),
            w_milli: g.whole_or("w", w_milli),
        },
        LawSpec::Recommended {
            lambda_milli,
            k1_milli,
            k2_milli,
            b_milli,
            k3_milli,
            ki_milli,
        } => LawSpec::Recommended {
            lambda_milli: g.whole_or("lambda", lambda_milli),
            k1_milli: g.whole_or("k1", k1_milli),
            k2_milli: g.whole_or("k2", k2_milli),
            b_milli: g.whole_or("b", b_milli),
            k3_milli: g.whole_or("k3", k3_milli),
            ki_milli: g.whole_or("ki", ki_milli),
        },
        LawSpec::Pid {
            kp_milli,
            ki_milli,
            kd_milli,
        } => LawSpec::Pid {
            kp_milli: g.whole_or("kp", kp_milli),
            ki_milli: g.whole_or("ki", ki_milli),
            kd_milli: g.whole_or("kd", kd_milli),
        },
    }
}

/// Reads `[joint.wearer]`, the nominal wearer of the feed-forward.
fn read_wearer_model(w: &Table<'_>, law: LawSpec) -> Option<WearerModel> {
    Some(WearerModel {
        rest_mdeg: w.whole("rest_deg"),
        stiffness_unm_per_rad: w.whole("stiffness_nm_per_rad"),
        damping_unm_s_per_rad: w.whole("damping_nm_s_per_rad"),
        flexion_unm: w.whole("flexion_nm"),
        extension_unm: w.whole("extension_nm"),
        torque_loss_milli: w.whole("torque_loss"),
        curvature_milli: w.whole("curvature"),
        lead_ms: w.whole_or("lead_ms", law.default_lead_ms()),
    })
}

/// Reads `[joint.response]`, a nominal wearer in time; a field left out keeps
/// [`ResponseSpec::RECOMMENDED`], for this wearer's strength.
fn read_response(r: &Table<'_>, wearer: Option<WearerModel>) -> ResponseSpec {
    let default = ResponseSpec::RECOMMENDED;
    let default = wearer.map_or(default, |wearer| default.for_wearer(&wearer));
    ResponseSpec {
        gain_mrad: r.whole_or("gain_rad", default.gain_mrad),
        muscle_ms: r.whole_or("muscle_ms", default.muscle_ms),
        joint_ms: r.whole_or("joint_ms", default.joint_ms),
        delay_ms: r.whole_or("delay_ms", default.delay_ms),
        scale_milli: r.whole_or("scale_learning", default.scale_milli),
        damping_milli: r.whole_or("damping_learning", default.damping_milli),
    }
}

/// Reads a point and holds it to its channel's limit, as arming will.
fn read_point(t: &Table<'_>, channels: &Channels) -> Option<PointSpec> {
    let channel = channels.find_free(t, "channel");
    let channel = channel.filter(|_| t.is_sound())?;
    Some(PointSpec {
        channel: channel.index(),
        threshold: Amplitude(t.whole("threshold")),
        max: channel.read_amplitude(t, "max")?,
    })
}

/// Puts the firmware's verdict on the field concerned.
fn refuse(t: &Table<'_>, points: &[&Table<'_>], specs: &[PointSpec], e: SpecError) {
    // The point that breaks a rule.
    let point = |breaks: &dyn Fn(&PointSpec) -> bool| {
        let found = specs.iter().zip(points).rfind(|(p, _)| breaks(p));
        found.map_or(t, |(_, table)| *table)
    };
    match e {
        SpecError::ChannelTwice { channel: c } => {
            let (field, channel) = ("joint".into(), c + 1); // at most 10
            let problem = Problem::ChannelTwice { field, channel };
            point(&|p| p.channel == c).say("channel", problem);
        }
        SpecError::Range(range) => match range.field {
            "code_at_100 - code_at_0" => {
                let least = format!("at least {} from `code_at_0_deg`", range.min);
                t.out_of_range("code_at_100_deg", least);
            }
            "threshold" => point(&|p| p.threshold > p.max).refuse(e),
            _ => t.refuse(e),
        },
    }
}
