//! Description of a session for the page: what its plots need to know.

use firmware::pulse::Shape;
use firmware::safety::StageSpec;
use host_core::session::{BodySpec, Channel, Session};
use serde_json::{Value, json};

/// Describes a session. Amplitudes are in mA or V, times in µs or s.
pub fn describe(session: &Session) -> Value {
    let body = session.body.as_ref().map(|body| match body {
        BodySpec::Finger(_) => "finger",
        BodySpec::Elbow(_) => "elbow",
        BodySpec::Hand(_) => "hand",
        BodySpec::Arm { .. } => "arm",
        BodySpec::Still { .. } => "still",
    });
    let groups = session.groups.iter().map(|group| {
        let members = (0..10_u8).filter(|index| group.members >> index & 1 == 1);
        members.map(|index| index + 1).collect::<Vec<u8>>()
    });
    json!({
        "title": session.title,
        "duration_s": session.duration_us as f64 / 1e6,
        "body": body,
        "channels": session.channels.iter().map(channel).collect::<Vec<_>>(),
        "groups": groups.collect::<Vec<_>>(),
        "has_joint": session.joint.is_some(),
        "has_limb": session.limb.is_some(),
        "has_wall": session.wall.is_some(),
        "telemetry_ms": session.telemetry_ms,
        "measure_s": session.measure.map(|(from, to)| [from as f64 / 1e6, to as f64 / 1e6]),
        "notes": session.notes,
    })
}

fn channel(channel: &Channel) -> Value {
    let train = &channel.spec.train;
    let full_scale = match channel.spec.stage {
        StageSpec::Current { full_scale_ua } => full_scale_ua,
        StageSpec::Voltage { full_scale_mv, .. } => full_scale_mv,
    };
    let shape = match train.shape {
        Shape::BiphasicCathodicFirst => "biphasic-cathodic-first",
        Shape::BiphasicAnodicFirst => "biphasic-anodic-first",
        Shape::MonophasicCathodic => "monophasic-cathodic",
        Shape::MonophasicAnodic => "monophasic-anodic",
    };
    json!({
        "number": channel.number,
        "name": channel.name,
        "unit": channel.unit().symbol(),
        "limit": f64::from(channel.spec.limit.get()) / 1e3,
        "full_scale": f64::from(full_scale) / 1e3,
        "shape": shape,
        "width_us": train.width_us,
        "gap_us": train.gap_us,
        "ground_us": train.ground_us,
        "period_us": train.period_us,
        "offset_us": train.offset_us,
        "muscle": channel.muscle.is_some(),
        "force": channel.force.is_some(),
    })
}
