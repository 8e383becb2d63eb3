//! `[body] kind = "arm"`: a simulated right arm under nine electrodes.

use hal_sim::body::arm::{ArmSpec, Posture, Support};

use crate::fields::field::Need::{OrTold, OrWord};
use crate::fields::field::{Field, Kind, Number, field, one_of};
use crate::fields::table::Table;

/// Supports of the forearm, and their names in session files.
const HELD: [(&str, Support); 2] = [("cuff", Support::InCuff), ("freely", Support::Freely)];

/// Seed from which the random draws of an arm are generated. A session chooses one of the draws by
/// its index.
const ARMS: u64 = 2023;

/// Returns the fields that only `kind = "arm"` has.
#[rustfmt::skip]
pub(super) fn arm_fields() -> [Field; 6] {
    let d = Posture::STUDY;
    let turn = |name, least, most, default: f64, meaning| {
        field(name, Kind::Real(Number::within("°", 0, least, most)), OrTold(default.to_string()), meaning)
    };
    let fields = [
        field("drawn", Kind::Whole(Number::within("", 0, 0, 1_000_000_000)), OrTold("none: the nominal arm".into()), "index of the random draw of the arm, as described in [endpoint.md](../evidence/endpoint.md)"),
        field("held", one_of(&HELD), OrWord("cuff"), "support of the forearm: it lies in the cuff of a force sensor, or the wearer alone holds it"),
        turn("plane_deg", -180, 180, d.plane_deg, "vertical plane of the upper arm, 0 forward, 90 to the side"),
        turn("elevation_deg", 1, 120, d.elevation_deg, "elevation of the upper arm in this plane: 0 hangs, 90 is level"),
        turn("rotation_deg", -180, 180, d.rotation_deg, "rotation of the forearm about the upper arm, inward positive; 0 where its flexion points most forward"),
        turn("elbow_deg", 0, 100, d.elbow_deg, "elbow flexion"),
    ];
    fields.map(|field| field.when("kind", &["arm"]))
}

/// Reads the arm with its posture, and the support of its forearm. Angles that the file leaves out
/// are those of [`Posture::STUDY`].
pub(super) fn read_arm(t: &Table<'_>) -> (ArmSpec, Support) {
    let real = |name, default| t.real(name).unwrap_or(default);
    let d = Posture::STUDY;
    let spec = match t.has("drawn") {
        true => ArmSpec::random(ARMS, t.integer("drawn")),
        false => ArmSpec::nominal(),
    };
    let posture = Posture {
        plane_deg: real("plane_deg", d.plane_deg),
        elevation_deg: real("elevation_deg", d.elevation_deg),
        rotation_deg: real("rotation_deg", d.rotation_deg),
        elbow_deg: real("elbow_deg", d.elbow_deg),
    };
    let held = t.choice("held", &HELD).unwrap_or(Support::InCuff);
    (ArmSpec { posture, ..spec }, held)
}
