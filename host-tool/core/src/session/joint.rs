//! `[joint]`: the closed loop on the device that controls the angle of a finger joint.

use firmware::control::{JointSpec, LawSpec, PointSpec, ResponseSpec, WearerModel};

use super::channels::{Channels, amplitude_or};
use super::hold::{read_hold, read_sensor, read_stale};
use super::law::{LAWS, LawName};
use crate::fields::table::Table;

/// Reads `[joint]`. Its flexor and extensor points must name channels of the file.
pub(super) fn read_joint(t: &Table<'_>, channels: &Channels) -> Option<JointSpec> {
    let name = t.choice("law", &LAWS).unwrap_or(LawName::Recommended);
    let law = name.spec(t.has("wearer"));
    let wearer = t.optional_table("wearer", |w| read_wearer_model(w, law))?;
    let law = wearer.map_or(law, |wearer| law.for_wearer(&wearer));
    let law = t
        .optional_table("gains", |g| Some(read_gains(g, law)))?
        .unwrap_or(law);
    let response = t.optional_table("response", |r| Some(read_response(r, wearer)))?;
    // All points are read before the first failure returns, so that every error is reported.
    let points = t.tables("flexors").iter().chain(t.table("extensor"));
    let points: Vec<_> = points.map(|p| read_point(p, channels)).collect();
    let points: Vec<PointSpec> = points.into_iter().collect::<Option<_>>()?;
    let (extensor, flexors) = points.split_last()?;
    if !t.is_valid() {
        return None;
    }
    let sensor = read_sensor(t);
    Some(JointSpec {
        law,
        law_period_ms: t.integer_or("law_period_ms", law.default_period_ms()),
        cutoff_mhz: t.integer_or("cutoff_hz", law.default_cutoff_mhz()),
        flexors: flexors.iter().copied().collect(),
        extensor: *extensor,
        hold: read_hold(t),
        angle_min_mdeg: t.integer("angle_min_deg"),
        angle_max_mdeg: t.integer("angle_max_deg"),
        sensor,
        stale_after_ms: read_stale(t, sensor),
        wearer,
        response,
    })
}

/// Returns `law` with those of its gains replaced that the file gives.
fn read_gains(g: &Table<'_>, law: LawSpec) -> LawSpec {
    match law {
        LawSpec::Paper {
            lambda_milli,
            w_milli,
        } => LawSpec::Paper {
            lambda_milli: g.integer_or("lambda", lambda_milli),
            w_milli: g.integer_or("w", w_milli),
        },
        LawSpec::Recommended {
            lambda_milli,
            k1_milli,
            k2_milli,
            b_milli,
            k3_milli,
            ki_milli,
        } => LawSpec::Recommended {
            lambda_milli: g.integer_or("lambda", lambda_milli),
            k1_milli: g.integer_or("k1", k1_milli),
            k2_milli: g.integer_or("k2", k2_milli),
            b_milli: g.integer_or("b", b_milli),
            k3_milli: g.integer_or("k3", k3_milli),
            ki_milli: g.integer_or("ki", ki_milli),
        },
        LawSpec::Pid {
            kp_milli,
            ki_milli,
            kd_milli,
        } => LawSpec::Pid {
            kp_milli: g.integer_or("kp", kp_milli),
            ki_milli: g.integer_or("ki", ki_milli),
            kd_milli: g.integer_or("kd", kd_milli),
        },
    }
}

/// Reads `[joint.wearer]`: the model of a nominal wearer that the feed-forward uses.
fn read_wearer_model(w: &Table<'_>, law: LawSpec) -> Option<WearerModel> {
    Some(WearerModel {
        rest_mdeg: w.integer("rest_deg"),
        stiffness_unm_per_rad: w.integer("stiffness_nm_per_rad"),
        damping_unm_s_per_rad: w.integer("damping_nm_s_per_rad"),
        flexion_unm: w.integer("flexion_nm"),
        extension_unm: w.integer("extension_nm"),
        torque_loss_milli: w.integer("torque_loss"),
        curvature_milli: w.integer("curvature"),
        lead_ms: w.integer_or("lead_ms", law.default_lead_ms()),
    })
}

/// Reads `[joint.response]`: how fast and how much the joint of the nominal wearer moves in
/// response to effort. A field that is left out has its value of [`ResponseSpec::RECOMMENDED`],
/// adapted to the strength of `wearer`.
fn read_response(r: &Table<'_>, wearer: Option<WearerModel>) -> ResponseSpec {
    let default = ResponseSpec::RECOMMENDED;
    let default = wearer.map_or(default, |wearer| default.for_wearer(&wearer));
    ResponseSpec {
        gain_mrad: r.integer_or("gain_rad", default.gain_mrad),
        muscle_ms: r.integer_or("muscle_ms", default.muscle_ms),
        joint_ms: r.integer_or("joint_ms", default.joint_ms),
        delay_ms: r.integer_or("delay_ms", default.delay_ms),
        scale_milli: r.integer_or("scale_learning", default.scale_milli),
        damping_milli: r.integer_or("damping_learning", default.damping_milli),
    }
}

/// Reads a point: a channel, with its amplitudes at zero and at full effort. If the file leaves the
/// amplitudes out, they are the `joint_threshold` of the wearer file, or else the operator's minimum
/// or the motor threshold; and the operator's maximum, or else the limit.
fn read_point(t: &Table<'_>, channels: &Channels) -> Option<PointSpec> {
    let channel = channels.find(t, "channel")?;
    if !t.is_valid() {
        return None;
    }
    let known = channels.joint_range(channel);
    let threshold = amplitude_or(t, "threshold", known.map(|[least, _]| least));
    let max = amplitude_or(t, "max", known.map(|[_, most]| most));
    Some(PointSpec {
        channel: channel.index(),
        threshold: threshold?,
        max: max?,
    })
}
